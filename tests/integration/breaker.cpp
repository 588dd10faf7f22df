#include "tests/integration/breaker.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "tests/integration/breaker_judge.hpp"
#include "tests/integration/breaker_stage.hpp"
#include "tests/support/failing/failing_writes.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr std::size_t kFaultsKept = 20;

}  // namespace

struct Breaker::Parts {
  const bool thorough;
  BreakerStage stage{thorough};
  const BreakerJudge judge{stage, thorough};
  BreakerTally tally = {};
  Life other = {};

  explicit Parts(bool all) : thorough(all) {
    stage.live(0, "other", other);
    if (!other.fault.empty()) throw std::runtime_error("the other room: " + other.fault);
  }

  void count(std::uint64_t seed, const std::string& what, std::uint64_t acknowledged, const Verdict& verdict) {
    ++tally.trials;
    ++tally.done[what];
    tally.acknowledged += acknowledged;
    if (!verdict.fault.empty()) {
      ++tally.silent;
      if (tally.faults.size() < kFaultsKept)
        tally.faults.push_back("seed " + std::to_string(seed) + ", " + what + ": " + verdict.fault);
      return;
    }
    if (verdict.outcome == Outcome::whole) ++tally.whole;
    if (verdict.outcome == Outcome::named) ++tally.named;
    if (verdict.outcome == Outcome::refused) ++tally.refused;
    if (verdict.outcome == Outcome::named && verdict.without_number) ++tally.without_number;
  }

  // Changes one file. Returns what it did.
  [[nodiscard]] std::string break_one(Random& random, const Life& life, Image& image) const {
    const std::string room = std::string(BreakerStage::kRoom) + ".journal";
    std::vector<std::string> names;
    for (const auto& [file, bytes] : image) {
      names.push_back(file);
      if (file.ends_with("-log") || file.ends_with("-mirror"))
        names.insert(names.end(), 2, file);  // the newest entries
    }
    const std::string name = names[random.index(names.size())];
    const std::string kind = name.ends_with(".checkpoint") ? ".checkpoint" : name.substr(room.size());
    const std::string end = kind.empty() ? " database" : " " + kind;
    // Each file of the log replaces what the other lacks. Without both nobody knows how far the journal went.
    if ((kind == "-log" || kind == "-mirror") && random.index(4) == 0) {
      const bool deleted = random.index(2) == 0;
      for (const char* log : {"-log", "-mirror"}) {
        if (deleted)
          image.erase(room + log);
        else if (image.contains(room + log))
          image.at(room + log).resize(random.index(random.index(2) == 0 ? 100 : image.at(room + log).size()));
      }
      return deleted ? "delete -log and -mirror" : "truncate -log and -mirror";
    }
    std::string& bytes = image.at(name);
    // Most of a log is zeros that were never overwritten.
    std::size_t used = bytes.size();
    while (random.index(4) != 0 && used > 0 && bytes[used - 1] == '\0') {
      const std::size_t last = bytes.find_last_not_of('\0');
      used = last == bytes.npos ? 0 : last + 1;
    }
    const std::size_t at = used == 0 ? 0 : random.index(used);
    const std::size_t length = std::min<std::size_t>(1 + random.index(5000), bytes.size() - at);
    switch (random.index(7)) {
      case 0:
        if (bytes.empty()) break;
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.index(8)));
        return "flip" + end;
      case 1:
        bytes.resize(at);
        return "truncate" + end;
      case 2:
        bytes.replace(at, length, std::string(length, '\0'));
        return "zero" + end;
      case 3:
        image.erase(name);
        return "delete" + end;
      case 4:
        for (const auto& [theirs, foreign] : other.image)
          if (theirs == "other.journal" + kind || (kind == ".checkpoint" && theirs.ends_with(kind))) {
            bytes = foreign;
            return "another room's" + end;
          }
        break;
      case 5: {
        const std::string& from = names[random.index(names.size())];
        if (from == name) break;
        bytes = std::string(image.at(from));
        return "duplicate" + end;
      }
      default: {
        const Image& then = life.earlier[random.index(life.earlier.size())];
        const auto stale = then.find(name);
        if (stale == then.end()) break;
        bytes = stale->second;
        return "older copy" + end;
      }
    }
    image.erase(name);
    return "delete" + end;
  }

  // Each command that takes a journal. `to`: a path that does not exist.
  [[nodiscard]] std::vector<std::vector<std::string>> commands(const std::string& file, const std::string& to) const {
    return {
        {"verify", file},
        {"verify", file, "--case", stage.bone()},
        {"salvage", file, to},
        {"backup", file, to},
        {"migrate", file, to},
        {"branch", file, to},
        {"replay", file, "--case", stage.bone()},
        {"export", file, to},
        {"people", file},
        {"erase-person", file, "--older-than", "1"},
        {"rename-room", file, "other"},
        {"delete", file, "--alone"},
        {"delete", file, "--branches"},
        {"--case", stage.bone(), "--plain", "--journal", file, "--signing-key", stage.key(), "--audit", stage.audit()}};
  }

  // A command of osteon-server that this test does not know. Empty: there is none.
  [[nodiscard]] std::string find_untried() const {
    std::istringstream help(stage.command({"--help"}).out);
    std::vector<std::string> known{"rooms", "cases", "ticket", "key", "audit"};  // commands without a journal
    for (const std::vector<std::string>& one : commands("", "")) known.push_back(one.front());
    bool listed = false;
    std::size_t found = 0;
    for (std::string line; std::getline(help, line);) {
      if (line.starts_with("Subcommands:")) listed = true;
      if (!listed || !line.starts_with("  ") || line.starts_with("   ")) continue;
      const std::string name = line.substr(2, line.find(' ', 2) - 2);
      ++found;
      if (std::ranges::find(known, name) == known.end()) return name;
    }
    return found < 10 ? "(--help lists no commands)" : "";
  }

  // Runs at most `most` of the commands that take a journal, in random order, on the journal of a running server.
  // Returns a command's fault. Empty: none.
  // `removed`: ending of the journal's file that was removed.
  [[nodiscard]] std::string try_second(Random& random, const fs::path& folder, Server& server, std::size_t most,
                                       const std::optional<std::string>& removed) const {
    const std::string file = (folder / (std::string(BreakerStage::kRoom) + ".journal")).string();
    const std::string to = (stage.new_folder() / "second").string();
    std::vector<std::vector<std::string>> all = commands(file, to);
    // Without its database, a room looks like an interrupted deletion, so `delete` may finish it.
    if (removed == "") std::erase_if(all, [](const auto& one) { return one.front() == "delete"; });
    for (std::size_t i = all.size() - 1; i > 0; --i) std::swap(all[i], all[random.index(i + 1)]);
    all.resize(std::min(most, all.size()));
    for (const std::vector<std::string>& one : all) {
      // While the server is frozen, only the command can have changed anything.
      const bool still = removed || random.index(4) != 0;
      if (still) BreakerStage::freeze(server);
      const Image before = still ? image_of(folder) : Image{};
      const RunResult result = stage.command(one);
      const std::string changed = still ? difference(before, image_of(folder)) : std::string();
      if (still && !removed) server.process->signal(SIGCONT);
      const std::string what = one.front() + " as the second: ";
      if (result.exit_code == 0 || result.timed_out) return what + said(result);
      if (removed != "" && !has(result.err, "room.journal is in use by another process"))
        return what + "it does not say that it is in use: " + said(result);
      if (std::string silent = BreakerJudge::refusal(what, result, BreakerStage::kRoom); !silent.empty()) return silent;
      if (!changed.empty()) return what + changed;
      if (fs::exists(to)) return what + "it makes " + to;
    }
    return {};
  }
};

Breaker::Breaker(bool thorough) : parts_(std::make_unique<Parts>(thorough)) {}
Breaker::~Breaker() = default;
const BreakerTally& Breaker::tally() const { return parts_->tally; }

void Breaker::damage(std::uint64_t seed, int damages, int more) {
  Random random(seed);
  Life life;
  parts_->stage.live(seed, BreakerStage::kRoom, life);
  const std::uint64_t acknowledged = life.oracle.acknowledged();
  parts_->count(seed, "kill alone", acknowledged, {.fault = life.fault});
  for (int i = 0; i < damages + more && life.fault.empty(); ++i) {
    Image image = life.image;
    const std::string what = parts_->break_one(random, life, image);
    const Trial trial{.folder = parts_->stage.new_folder(),
                      .oracle = &life.oracle,
                      .most_entries = life.entries,
                      .member = life.member,
                      .only_verify = i >= damages};
    put(image, trial.folder);
    parts_->count(seed, what, acknowledged, parts_->judge.judge(random, trial));
    fs::remove_all(trial.folder);
  }
}

void Breaker::older_copy(std::uint64_t seed) {
  Random random(seed * 13 + 1);
  Oracle oracle;
  const std::string what = "older copy of all files";
  const fs::path folder = parts_->stage.new_folder();
  const std::string file = (folder / (std::string(BreakerStage::kRoom) + ".journal")).string();
  Server server = parts_->stage.start(folder);
  auto hand = LightHand::come(server.address, "", oracle, seed);
  if (!hand) return parts_->count(seed, what, 0, {.fault = "no hand is let in: " + hand.error().message});
  parts_->stage.load(seed, server, **hand, oracle, 100);
  BreakerStage::freeze(server);
  const Image then = image_of(folder);
  server.process->signal(SIGCONT);
  const std::uint64_t most_then = oracle.most();
  Verdict verdict;
  verdict.outcome = Outcome::named;
  const auto knows_more = [&] { return oracle.kept() && oracle.kept()->room_seq.value > most_then; };
  if (!wait_until(knows_more, BreakerStage::kPatience)) verdict.fault = "no client is told what is kept";
  const wire::JoinedRoom member = (*hand)->room();
  BreakerStage::kill(server);
  hand->reset();
  for (const auto& entry : fs::directory_iterator(folder)) fs::remove(entry.path());
  put(then, folder);
  // Nothing in the files shows that they are old. A client that comes back shows it, and from then on nobody can go on.
  const Verified found = parts_->stage.verify(file);
  if (verdict.fault.empty() && !found.sound) verdict.fault = "verify of a whole older copy: " + found.text;
  server = parts_->stage.start(folder);
  const auto back = LightHand::come_again(server.address, member, oracle, seed);
  if (verdict.fault.empty() && (back || !has(back.error().message, "has lost")))
    verdict.fault = "a client that knows more is told: " + (back ? "nothing" : back.error().message);
  Oracle anew;
  if (const auto stranger = LightHand::come(server.address, "", anew, seed); verdict.fault.empty() && stranger)
    if (!wait_until([&] { return (*stranger)->ended() || (*stranger)->decided() > 0; }, BreakerStage::kPatience) ||
        !(*stranger)->ended())
      verdict.fault = "a client knows more, and another cuts on";
  BreakerStage::kill(server);
  const Verified after = parts_->stage.verify(file);
  if (verdict.fault.empty() && (after.sound || !has(after.text, "entries were lost")))
    verdict.fault = "what a client knew is forgotten: " + after.text;
  parts_->count(seed, what, oracle.acknowledged(), verdict);
  fs::remove_all(folder);
}

void Breaker::second_openers(std::uint64_t seed) {
  Random random(seed * 3 + 1);
  for (const bool removes : {false, true}) {
    Oracle oracle;
    const fs::path folder = parts_->stage.new_folder();
    const std::string file = (folder / (std::string(BreakerStage::kRoom) + ".journal")).string();
    Server server = parts_->stage.start(folder);
    auto hand = LightHand::come(server.address, "", oracle, seed);
    Verdict verdict;
    std::string what = "second openers";
    // SQLite's own log has entries that the database lacks only while entries are carried into the database. A kill may
    // hit that moment.
    bool loses_nothing = true;
    if (const std::string untried = parts_->find_untried(); !untried.empty())
      verdict.fault = "nobody tries the command " + untried;
    if (!hand) {
      parts_->count(seed, what, 0, {.fault = "no hand is let in: " + hand.error().message});
      return;
    }
    parts_->stage.load(seed, server, **hand, oracle, 100);
    if (removes) {
      constexpr std::array kEnds{"", "-log", "-mirror", "-wal"};
      const std::string end = kEnds[random.index(kEnds.size())];
      what += ", without " + (end.empty() ? "database" : end);
      BreakerStage::freeze(server);
      fs::remove(file + end);
      verdict.fault = parts_->try_second(random, folder, server, parts_->thorough ? 99 : 4, end);
      server.process->signal(SIGCONT);
      loses_nothing = end == "-log" || end == "-mirror";
      if (end != "-wal" && verdict.fault.empty()) verdict.fault = BreakerJudge::unsaid_failure(server, **hand, file);
    } else {
      if (verdict.fault.empty()) verdict.fault = parts_->try_second(random, folder, server, 99, std::nullopt);
      const std::uint64_t before = oracle.acknowledged();
      if (!wait_until([&] { return oracle.acknowledged() > before || (*hand)->ended(); }, BreakerStage::kPatience) ||
          (*hand)->ended())
        verdict.fault += "the server does not go on";
    }
    const wire::JoinedRoom member = (*hand)->room();
    BreakerStage::kill(server);
    hand->reset();
    if (verdict.fault.empty()) {
      const Trial trial{.folder = folder,
                        .oracle = &oracle,
                        .most_entries = oracle.most(),
                        .member = member,
                        .loses_nothing = loses_nothing};
      verdict = parts_->judge.judge(random, trial);
    }
    parts_->count(seed, what, oracle.acknowledged(), verdict);
    fs::remove_all(folder);
  }
}

void Breaker::write_errors(std::uint64_t seed, int times) {
  for (int i = 0; i < times; ++i) write_error(seed, Random(seed * 100 + static_cast<std::uint64_t>(i)));
}

void Breaker::write_error(std::uint64_t seed, Random random) {
  constexpr std::array<std::pair<int, const char*>, 3> kReasons{{{EIO, "EIO"}, {ENOSPC, "ENOSPC"}, {EROFS, "EROFS"}}};
  constexpr std::array kKinds{"wsn", "w", "s"};
  const auto [reason, name] = kReasons[random.index(kReasons.size())];
  const std::string kinds = reason == EIO ? kKinds[random.index(kKinds.size())] : reason == ENOSPC ? "wn" : "wsn";
  std::string what = std::string(name) + " of " + kinds;
  Life life;
  Oracle& oracle = life.oracle;
  const fs::path folder = parts_->stage.new_folder();
  const std::string file = (folder / (std::string(BreakerStage::kRoom) + ".journal")).string();
  const FailingWrites failing(folder, parts_->stage.new_name());
  Server server = parts_->stage.start(folder, BreakerStage::kRoom, failing.options());
  auto hand = LightHand::come(server.address, "", oracle, seed);
  if (!hand)
    return parts_->count(seed, what, 0,
                         {.fault = "no hand is let in: " + hand.error().message + server.process->err()});
  parts_->stage.load(seed, server, **hand, oracle, 150);
  life.earlier.push_back(image_of(folder));
  failing.begin(reason, kinds, static_cast<int>(random.index(20)));
  // At the failure there may be a commit, or a person who joins, for whom the log begins anew.
  parts_->stage.load(seed, server, **hand, oracle, 50);
  Verdict verdict;
  verdict.fault = BreakerJudge::unsaid_failure(server, **hand, file);
  const std::string why = (*hand)->ended().value_or("");
  if (verdict.fault.empty() && reason == ENOSPC && !has(why, "make room on the disk"))
    verdict.fault = "no remedy: " + why;
  // A server that has seen its disk fail stays failed, even if the disk works again.
  const bool again = random.index(2) == 0;
  if (again) failing.end();
  if (again && verdict.fault.empty()) verdict.fault = BreakerJudge::unsaid_failure(server, **hand, file);
  const wire::JoinedRoom member = (*hand)->room();
  if (random.index(2) == 0) {
    BreakerStage::kill(server);
  } else if (!server.process->terminate(BreakerStage::kPatience)) {
    verdict.fault = "it does not end";
    BreakerStage::kill(server);
  }
  failing.end();
  hand->reset();
  if (verdict.fault.empty()) {
    Trial trial{
        .folder = folder, .oracle = &oracle, .most_entries = oracle.most(), .member = member, .loses_nothing = true};
    // The files that the failure leaves may be damaged too.
    if (random.index(3) == 0) {
      Image image = image_of(folder);
      what += ", then " + parts_->break_one(random, life, image);
      for (const auto& entry : fs::directory_iterator(folder)) fs::remove(entry.path());
      put(image, folder);
      trial.loses_nothing = false;
    }
    verdict = parts_->judge.judge(random, trial);
  }
  parts_->count(seed, what, oracle.acknowledged(), verdict);
  fs::remove_all(folder);
}

bool Breaker::full_disk(std::uint64_t seed) {
  Random random(seed * 11 + 1);
  Mounter mounter(parts_->stage.new_name());
  if (!mounter.mount("12m")) return false;
  Oracle oracle;
  const fs::path folder = mounter.place();
  const std::string file = (folder / (std::string(BreakerStage::kRoom) + ".journal")).string(), what = "full disk";
  const Behind behind(parts_->stage, mounter.prefix(), mounter.root());
  Server server = parts_->stage.start(folder);
  auto hand = LightHand::come(server.address, "", oracle, seed);
  if (!hand) {
    parts_->count(seed, what, 0, {.fault = "no hand is let in: " + hand.error().message + server.process->err()});
    return true;
  }
  parts_->stage.load(seed, server, **hand, oracle, 100);
  {
    std::ofstream filler(parts_->stage.seen(folder) / "filler", std::ios::binary);
    while (filler << std::string(4096, 'x') << std::flush) {
    }
  }
  // The room's log uses space that it allocated before. A person who joins makes the log begin anew, in the database.
  for (int i = 0; i < 50 && !(*hand)->ended(); ++i) {
    const std::string name = std::string(200, 'p') + std::to_string(i);
    oracle.asked();
    const auto joined = wire::join_room(server.address, wire::ClientKind::viewer, name, 5s, {});
    if (joined) oracle.heard_join(joined->author);
  }
  Verdict verdict;
  verdict.fault = BreakerJudge::unsaid_failure(server, **hand, file);
  const std::string why = (*hand)->ended().value_or("");
  if (verdict.fault.empty() && !has(why, "make room on the disk")) verdict.fault = "no remedy: " + why;
  const wire::JoinedRoom member = (*hand)->room();
  BreakerStage::kill(server);
  hand->reset();
  fs::remove(parts_->stage.seen(folder) / "filler");
  if (verdict.fault.empty()) {
    const Trial trial{
        .folder = folder, .oracle = &oracle, .most_entries = oracle.most(), .member = member, .loses_nothing = true};
    verdict = parts_->judge.judge(random, trial);
  }
  parts_->count(seed, what, oracle.acknowledged(), verdict);
  return true;
}

bool Breaker::read_only(std::uint64_t seed) {
  Life life;
  parts_->stage.live(seed, BreakerStage::kRoom, life);
  parts_->count(seed, "kill alone", life.oracle.acknowledged(), {.fault = life.fault});
  const auto judge = [&](const fs::path& folder, const std::string& what) {
    const Trial trial{.folder = folder, .oracle = &life.oracle, .most_entries = life.entries, .member = life.member};
    Verdict verdict;
    const Verified found = parts_->stage.verify(trial.file());
    if (!found.sound || found.events < life.entries) verdict.fault = "verify: " + found.text;
    if (verdict.fault.empty()) verdict.fault = parts_->stage.check_export(trial.file(), life.oracle, life.entries);
    const RunResult replayed = parts_->stage.command({"replay", trial.file(), "--case", parts_->stage.bone()});
    if (verdict.fault.empty() && replayed.exit_code != 0) verdict.fault = "replay: " + said(replayed);
    const fs::path to = parts_->stage.new_folder();
    const RunResult copied = parts_->stage.command({"backup", trial.file(), (to / "copy").string()});
    if (verdict.fault.empty() && copied.exit_code != 0) verdict.fault = "backup: " + said(copied);
    if (verdict.fault.empty())
      verdict.fault = parts_->stage.check_export((to / "copy").string(), life.oracle, life.entries);
    const RunResult served =
        parts_->stage.command({"--case", parts_->stage.bone(), "--plain", "--journal", trial.file(), "--signing-key",
                               parts_->stage.key(), "--audit", parts_->stage.audit()},
                              10s);
    if (verdict.fault.empty() && (served.exit_code == 0 || served.timed_out))
      verdict.fault = "a server: " + said(served);
    if (verdict.fault.empty()) verdict.fault = BreakerJudge::refusal("a server", served, trial.file());
    if (verdict.fault.empty()) verdict.fault = difference(life.image, image_of(parts_->stage.seen(folder)));
    parts_->count(seed, what, life.oracle.acknowledged(), verdict);
  };
  {
    const fs::path folder = parts_->stage.new_folder();
    put(life.image, folder);
    for (const auto& entry : fs::directory_iterator(folder)) fs::permissions(entry.path(), fs::perms(0444));
    fs::permissions(folder, fs::perms(0555));
    {
      // Root could write to them as well.
      const std::vector<std::string> anybody{"setpriv", "--bounding-set", "-all", "--inh-caps", "-all"};
      const Behind behind(parts_->stage, ::geteuid() == 0 ? anybody : std::vector<std::string>{}, "/");
      judge(folder, "read-only files");
    }
    fs::permissions(folder, fs::perms(0755));
  }
  Mounter mounter(parts_->stage.new_name());
  if (!mounter.mount("64m")) return false;
  const Behind behind(parts_->stage, mounter.prefix(), mounter.root());
  put(life.image, parts_->stage.seen(mounter.place()));
  if (!mounter.make_read_only()) return false;
  judge(mounter.place(), "read-only medium");
  return true;
}

}  // namespace osteon::test
