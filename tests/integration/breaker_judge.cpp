#include "tests/integration/breaker_judge.hpp"

#include <algorithm>
#include <optional>
#include <regex>
#include <sstream>
#include <utility>

#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

}  // namespace

std::string BreakerJudge::unsaid(const std::string& what, const std::string& text, std::uint64_t events,
                                 std::uint64_t lost, const Trial& trial, bool* without_number) {
  const std::uint64_t acknowledged = trial.oracle->acknowledged();
  if (events >= acknowledged) return {};
  // Counts only what it calls a fault, and of the faults the largest number of missing entries.
  std::string faults;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("fault:")) faults += line + "\n";
  const std::regex missing("([0-9]+) (entry is|entries are) missing");
  for (std::sregex_iterator one(faults.begin(), faults.end(), missing), end; one != end; ++one)
    lost = std::max<std::uint64_t>(lost, std::stoull((*one)[1]));
  const std::string numbers = what + " goes to " + std::to_string(events) + " and misses " + std::to_string(lost) +
                              ", acknowledged were " + std::to_string(acknowledged) + ": " + text;
  if (trial.loses_nothing) return "entries are lost: " + numbers;
  if (events + lost >= acknowledged && events + lost <= trial.most_entries) return {};
  *without_number = true;
  for (const char* named : {"cannot be told", "is damaged", "malformed", "does not fit the chain",
                            "belongs to another journal", "another history"})
    if (has(faults, named)) return {};
  return "the wrong number: " + numbers;
}

std::string BreakerJudge::refusal(const std::string& what, const RunResult& result, const std::string& file) {
  if (!result.timed_out && result.exit_code < 128 && has(result.err, file)) return {};
  return what + " fails with " + std::to_string(result.exit_code) + " and does not say why: " + said(result);
}

std::string BreakerJudge::try_export(const Trial& trial) const {
  const fs::path to = stage_->new_name();
  const RunResult result = stage_->command({"export", trial.file(), to.string()});
  const bool made = fs::exists(to);
  const std::string lines = read_bytes(to);
  fs::remove(to);
  if (result.exit_code != 0) return made ? "export fails and leaves a file" : refusal("export", result, trial.file());
  const std::string lacks = trial.oracle->lacks(lines, trial.most_entries);
  return lacks.empty() ? "" : "export says nothing: " + lacks;
}

std::string BreakerJudge::try_replay(const Trial& trial) const {
  const RunResult result = stage_->command({"replay", trial.file(), "--case", stage_->bone()});
  if (result.exit_code != 0) return refusal("replay", result, trial.file());
  const std::uint64_t events = number_after(result.out, "events").value_or(0);
  if (events >= trial.oracle->acknowledged()) return {};
  return "replay says nothing and goes to " + std::to_string(events) + " of " +
         std::to_string(trial.oracle->acknowledged());
}

std::string BreakerJudge::try_copy(const Trial& trial, const std::string& how) const {
  const fs::path folder = stage_->new_folder();
  const std::string to = (folder / "copy.journal").string();
  const RunResult result = stage_->command({how, trial.file(), to});
  std::string fault;
  if (result.exit_code != 0)
    fault = image_of(folder).empty() ? refusal(how, result, trial.file()) : how + " fails and leaves something";
  else if (fault = stage_->check_export(to, *trial.oracle, trial.most_entries); !fault.empty())
    fault = how + " says nothing: " + fault;
  fs::remove_all(folder);
  return fault;
}

std::string BreakerJudge::try_recover(const Trial& trial, const Verified& found, bool serve,
                                      bool* without_number) const {
  const fs::path folder = stage_->new_folder();
  const std::string to = (folder / (trial.name + ".journal")).string();
  const RunResult result = stage_->command({"salvage", trial.file(), to});
  std::string fault;
  if (result.exit_code != 0) {
    fault = found.read ? "verify reads it, and salvage does not: " + said(result)
                       : refusal("salvage", result, trial.file());
  } else {
    const std::uint64_t events = number_after(result.out, "recovered").value_or(0);
    const std::uint64_t lost = number_after(result.out, "lost").value_or(0);
    if (events < found.events) fault = "salvage leaves out what verify confirms: " + said(result);
    if (fault.empty()) fault = unsaid("salvage", said(result), events, lost, trial, without_number);
    const bool own = !has(result.out, "belongs to another journal") && !has(result.out, "another history");
    if (fault.empty() && own)
      if (const std::string lacks = stage_->check_export(to, *trial.oracle, events); !lacks.empty())
        fault = "recovered: " + lacks;
    // A database of another room is salvaged as that room.
    if (fault.empty() && serve && own && events > 0) {
      Server server = stage_->start(folder, trial.name);
      Oracle later;
      if (server.address.empty()) {
        fault = "what was recovered is not served: " + server.process->err();
      } else if (auto hand = LightHand::come(server.address, "", later, events); !hand) {
        fault = "what was recovered lets nobody in: " + hand.error().message;
      } else if (!wait_until([&] { return (*hand)->decided() > 2; }, BreakerStage::kPatience)) {
        fault = "what was recovered takes no cuts: " + (*hand)->ended().value_or("") + server.process->err();
      }
      BreakerStage::kill(server);
    }
  }
  fs::remove_all(folder);
  return fault;
}

std::string BreakerJudge::try_serve(const Trial& trial, const Verified& found, Outcome* outcome) const {
  Server server = stage_->start(trial.folder, trial.name);
  const std::string end = " (verify: " + found.text + ")";
  if (server.address.empty()) {
    *outcome = Outcome::refused;
    if (found.sound) return "verify finds it sound, and no server starts on it: " + server.process->err();
    const bool told = has(server.process->err(), trial.name + ".journal");
    return told ? "" : "a server ends without saying why: " + server.process->err();
  }
  Oracle later(*trial.oracle);
  auto hand = LightHand::come_again(server.address, trial.member, later, trial.most_entries);
  std::string fault;
  if (!hand) {
    *outcome = Outcome::named;
    if (found.sound)
      fault = "verify finds it sound, and it lets nobody come back: " + hand.error().message;
    else if (hand.error().message.empty())
      fault = "a client is refused without a word";
    // A new client must not go on either.
    Oracle anew;
    if (auto stranger = LightHand::come(server.address, "", anew, 1); fault.empty() && stranger)
      if (wait_until([&] { return (*stranger)->decided() > 0 || (*stranger)->ended(); }, BreakerStage::kPatience) &&
          (*stranger)->decided() > 0)
        fault = "a client is refused, and another cuts on: " + hand.error().message + end;
    BreakerStage::kill(server);
    return fault;
  }
  const std::uint64_t before = (*hand)->decided();
  (void)wait_until([&] { return (*hand)->decided() > before + 5 || (*hand)->ended(); }, BreakerStage::kPatience);
  const bool cuts = (*hand)->decided() > before;
  const std::string ended = (*hand)->ended().value_or("");
  if (!cuts) *outcome = Outcome::named;
  if (cuts && !found.sound && !found.only_checkpoint()) fault = "verify finds damage, and it takes cuts" + end;
  if (!cuts && found.sound) fault = "verify finds it sound, and it takes no cuts: " + ended + end;
  if (!cuts && !found.sound && ended.empty()) fault = "a room takes no cuts and does not say so" + end;
  BreakerStage::kill(server);
  if (!fault.empty() || !cuts) return fault;
  const Verified after = stage_->verify(trial.file());
  if (!after.sound && !after.only_checkpoint()) return "after it was served again: " + after.text;
  fault = stage_->check_export(trial.file(), later, after.events, after.sound);
  return fault.empty() ? "" : "after it was served again, " + fault;
}

Verdict BreakerJudge::judge(Random& random, const Trial& trial) const {
  Verdict verdict;
  const auto note = [&](const std::string& fault) {
    if (verdict.fault.empty()) verdict.fault = fault;
  };
  const Image before = image_of(stage_->seen(trial.folder));
  const Verified found = stage_->verify(trial.file());
  const std::uint64_t acknowledged = trial.oracle->acknowledged();
  if (found.sound) {
    if (found.events < acknowledged)
      note("verify says sound, and it goes to " + std::to_string(found.events) + " of " + std::to_string(acknowledged));
  } else if (found.read) {
    verdict.outcome = Outcome::named;
    note(unsaid("verify", found.text, found.events, 0, trial, &verdict.without_number));
  } else {
    verdict.outcome = Outcome::refused;
    if (trial.loses_nothing) note("verify reads nothing: " + found.text);
    if (!has(found.text, trial.file())) note("verify does not say why: " + found.text);
  }
  if (trial.only_verify) {
    if (found.sound) note(try_export(trial));
    return verdict;
  }
  const std::size_t first = random.index(4);
  for (std::size_t i = 0; i < 4; ++i) {
    if (!thorough_ && i != first) continue;
    if (i == 0) note(try_export(trial));
    if (i == 1) note(try_replay(trial));
    if (i == 2) note(try_copy(trial, "backup"));
    if (i == 3) note(try_copy(trial, "branch"));
  }
  if (thorough_ || trial.loses_nothing || random.index(2) == 0)
    note(try_recover(trial, found, trial.loses_nothing || (thorough_ && !found.sound), &verdict.without_number));
  if (const std::string changed = difference(before, image_of(stage_->seen(trial.folder))); !changed.empty())
    note("commands that only read leave it otherwise: " + changed);
  Outcome served = verdict.outcome;
  note(try_serve(trial, found, &served));
  if (verdict.outcome == Outcome::named && served == Outcome::refused) verdict.outcome = Outcome::refused;
  return verdict;
}

std::string BreakerJudge::unsaid_failure(Server& server, LightHand& hand, const std::string& file) {
  if (!wait_until([&] { return hand.ended().has_value(); }, BreakerStage::kPatience)) return "the room goes on";
  const std::string why = *hand.ended();
  Oracle later;
  const auto stranger = LightHand::come(server.address, "", later, 1);
  // The client receives the file's name. Only the server's log has its path.
  if (!has(why, "the room takes no more cuts") || !has(why, fs::path(file).filename().string()) || !has(why, "salvage"))
    return "a client is told no reason, file or remedy: " + why;
  if (!stranger)
    return has(stranger.error().message, "takes no more") ? "" : "who comes is told: " + stranger.error().message;
  (void)wait_until([&] { return (*stranger)->ended() || (*stranger)->decided() > 0; }, BreakerStage::kPatience);
  if ((*stranger)->decided() > 0) return "the room has failed and takes cuts";
  const std::string told = (*stranger)->ended().value_or("");
  return has(told, "takes no more") ? "" : "who comes is told: " + told;
}

}  // namespace osteon::test
