#include "tests/integration/breaker.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "tests/integration/oracle.hpp"
#include "tests/support/failing/failing_writes.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr std::chrono::seconds kPatience{30};
constexpr std::size_t kFaultsKept = 20;
constexpr const char* kRoom = "room";

using Image = std::map<std::string, std::string>;  // bytes of the files of a folder by their names

std::string read_bytes(const fs::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(bytes).str();
}

Image image_of(const fs::path& folder) {
  Image image;
  std::error_code error;  // files come and go while a server runs
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    image[entry->path().filename().string()] = read_bytes(entry->path());
  return image;
}

void put(const Image& image, const fs::path& folder) {
  fs::create_directories(folder);
  for (const auto& [name, bytes] : image) std::ofstream(folder / name, std::ios::binary) << bytes;
}

// What differs, as "NAME was changed"; empty: nothing.
std::string difference(const Image& before, const Image& after) {
  for (const auto& [name, bytes] : before) {
    const auto now = after.find(name);
    if (now == after.end()) return name + " was removed";
    if (now->second != bytes) return name + " was changed";
  }
  for (const auto& [name, bytes] : after)
    if (!before.contains(name)) return name + " was made";
  return {};
}

bool has(const std::string& text, std::string_view part) { return text.find(part) != text.npos; }

std::optional<std::uint64_t> number_after(const std::string& text, const std::string& label) {
  std::smatch found;
  if (!std::regex_search(text, found, std::regex("(^|\n)" + label + ": +([0-9]+)"))) return std::nullopt;
  return std::stoull(found[2]);
}

std::string said(const RunResult& result) {
  return (result.timed_out ? "it did not end: " : "") + result.out + result.err;
}

// A server on FOLDER/NAME.journal.
struct Server {
  std::unique_ptr<Process> process;
  std::string address;  // empty: it ended before it listened
};

// What a killed server leaves.
struct Life {
  Image image;
  std::vector<Image> earlier;  // of moments before
  Oracle oracle;
  wire::JoinedRoom member;     // of a client that may come back
  std::uint64_t rows = 0;      // that the journal has, as the killed server left it
  std::string fault;           // in what needed no damage
};

// What a judgement goes by.
struct Trial {
  fs::path folder;
  const Oracle* oracle;
  std::uint64_t most_rows;             // that there can be
  wire::JoinedRoom member;
  bool loses_nothing = false;          // whatever is said, every acknowledged row must be there
  std::string name = kRoom;
  [[nodiscard]] std::string file() const { return (folder / (name + ".journal")).string(); }
};

enum class Outcome { whole, named, refused };

struct Verdict {
  Outcome outcome = Outcome::whole;
  bool without_number = false;
  std::string fault;  // empty: every promise was kept
};

// What `verify` says.
struct Verified {
  bool sound = false;
  bool read = false;  // it says how far the events go
  std::uint64_t events = 0, witnessed = 0;
  std::string text;
  // A checkpoint may be lost: the one before it, or the rows, then serve instead.
  [[nodiscard]] bool only_checkpoint() const {
    std::istringstream lines(text);
    bool any = false;
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("fault:")) continue;
      if (!has(line, ".checkpoint")) return false;
      any = true;
    }
    return any;
  }
};

// A shell in a mount namespace of its own, and programs beside it.
class Mounter {
 public:
  explicit Mounter(const fs::path& place) : place_(place), shell_("unshare", {"-rm", "sh"}) {
    fs::create_directories(place);
  }
  // False: it failed.
  [[nodiscard]] bool run(const std::string& line) {
    shell_.write(line + " >/dev/null 2>&1 && echo done || echo failed\n");
    return shell_.read_line(10s) == "done";
  }
  [[nodiscard]] bool mount(const std::string& size) {
    return run("mount -t tmpfs -o size=" + size + " none " + place_.string());
  }
  [[nodiscard]] bool make_read_only() { return run("mount -o remount,ro " + place_.string()); }
  [[nodiscard]] const fs::path& place() const { return place_; }
  // What a program begins with to see the mounts.
  [[nodiscard]] std::vector<std::string> prefix() const {
    return {"nsenter", "--target", std::to_string(shell_.pid()), "--user", "--mount", "--preserve-credentials"};
  }
  // By which those outside see them.
  [[nodiscard]] fs::path root() const { return "/proc/" + std::to_string(shell_.pid()) + "/root"; }

 private:
  const fs::path place_;
  Process shell_;
};

}  // namespace

struct Breaker::Parts {
  bool thorough;
  TempDir temp;
  std::string bone = (temp / "case").string();
  mutable std::uint64_t folders = 0;
  BreakerTally tally;
  Life other;
  std::vector<std::string> prefix = {};  // of every osteon-server
  fs::path root = "/";                   // where they see what this program sees under /

  explicit Parts(bool all) : thorough(all) {
    const RunResult made = run(program("osteon-import"), {"phantom", "block", "--layers", "5:1.9,20:0.3,5:1.9", "--width",
                                                          "12", "--pitch", "0.5", "--out", bone}, 120s);
    if (made.exit_code != 0) throw std::runtime_error("osteon-import failed: " + made.err);
    live(0, "other", other);
    if (!other.fault.empty()) throw std::runtime_error("the other room: " + other.fault);
  }

  [[nodiscard]] fs::path new_folder() const {
    const fs::path folder = temp / std::to_string(++folders);
    fs::create_directories(folder);
    return folder;
  }

  // As seen from here, of a folder as servers and commands see it.
  [[nodiscard]] fs::path seen(const fs::path& folder) const { return root / folder.relative_path(); }

  [[nodiscard]] std::vector<std::string> with_prefix(std::vector<std::string> arguments) const {
    arguments = with_plain(program("osteon-server"), std::move(arguments));
    if (prefix.empty()) return arguments;
    arguments.insert(arguments.begin(), program("osteon-server"));
    arguments.insert(arguments.begin(), prefix.begin() + 1, prefix.end());
    return arguments;
  }
  [[nodiscard]] fs::path first() const { return prefix.empty() ? program("osteon-server") : fs::path(prefix.front()); }

  [[nodiscard]] RunResult command(const std::vector<std::string>& arguments,
                                  std::chrono::milliseconds patience = kPatience) const {
    return run(first(), with_prefix(arguments), patience);
  }

  [[nodiscard]] Server start(const fs::path& folder, const std::string& name = kRoom, ProcessOptions options = {}) const {
    const fs::path address = temp / ("address-" + std::to_string(++folders));
    Server server;
    server.process = std::make_unique<Process>(
        first(),
        with_prefix({"--case", bone, "--journal", (folder / (name + ".journal")).string(), "--address-file",
                     address.string(), "--drain-seconds", "0"}),
        std::move(options));
    std::optional<std::string> line;
    (void)wait_until([&] { return (line = wait_for_address(address, 1ms)) || !server.process->running(); }, kPatience);
    server.address = line.value_or("");
    fs::remove(address);
    return server;
  }

  static void kill(Server& server) {
    server.process->signal(SIGKILL);
    (void)server.process->wait(kPatience);
  }

  // At most so long, with moments that are marked and people who come, for whom the log begins anew.
  static void load(Random& random, const Server& server, LightHand& hand, Oracle& oracle, std::size_t most_ms) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(20 + random.index(most_ms));
    while (std::chrono::steady_clock::now() < until && !hand.ended()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(random.index(25)));
      const std::size_t what = random.index(6);
      if (what == 0) (void)hand.mark("mark " + std::to_string(random.index(1000)));
      if (what != 1) continue;
      oracle.asked();
      const auto joined = wire::join_room(server.address, wire::ClientKind::viewer,
                                          "person " + std::to_string(random.index(1000)), 5s, {});
      if (joined) oracle.heard_join(joined->author);
    }
  }

  // A server that works for a while, in one to three lives, and is killed at a random moment.
  void live(std::uint64_t seed, const std::string& name, Life& life) const {
    Random random(seed * 7 + 1);
    const fs::path folder = new_folder();
    const std::size_t times = 1 + random.index(3);
    for (std::size_t time = 1; time <= times; ++time) {
      Server server = start(folder, name);
      if (server.address.empty()) {
        life.fault = "the server does not start again: " + server.process->err();
        return;
      }
      auto hand = LightHand::come(server.address, "", life.oracle, seed * 10 + time);
      if (!hand) {
        life.fault = "no hand is let in: " + hand.error().message;
        return;
      }
      life.member = (*hand)->room();
      load(random, server, **hand, life.oracle, 150);
      life.earlier.push_back(image_of(folder));
      load(random, server, **hand, life.oracle, 150);
      std::this_thread::sleep_for(std::chrono::microseconds(random.index(5000)));
      if (!(*hand)->rejected().empty()) life.fault = "an honest cut was rejected: " + (*hand)->rejected();
      const bool cleanly = time < times && random.index(2) == 0;
      if (!cleanly) {
        kill(server);
        continue;
      }
      hand->reset();
      if (server.process->terminate(kPatience) != 0) life.fault = "it does not end: " + server.process->err();
    }
    life.image = image_of(folder);
    const std::string file = (folder / (name + ".journal")).string();
    const Verified found = verify(file);
    life.rows = found.events;
    if (!found.sound) life.fault = "a kill alone is called damage: " + found.text;
    if (const std::string lacks = check_export(file, life.oracle, found.events); life.fault.empty()) life.fault = lacks;
    fs::remove_all(folder);
  }

  [[nodiscard]] Verified verify(const std::string& file) const {
    const RunResult result = command({"verify", file});
    Verified found{.text = said(result)};
    const auto events = number_after(result.out, "events"), witnessed = number_after(result.out, "witnessed");
    found.read = events && witnessed;
    found.events = events.value_or(0);
    found.witnessed = witnessed.value_or(0);
    found.sound = result.exit_code == 0;
    return found;
  }

  // What `said` leaves unsaid of what is lost; empty: nothing.
  [[nodiscard]] static std::string unsaid(const std::string& what, const std::string& text, std::uint64_t events,
                                          std::uint64_t witnessed, const Trial& trial, bool* without_number) {
    const std::uint64_t acknowledged = trial.oracle->acknowledged();
    if (events >= acknowledged) return {};
    const std::string numbers = what + " goes to " + std::to_string(events) + " and knows of " + std::to_string(witnessed) +
                                ", acknowledged were " + std::to_string(acknowledged) + ": " + text;
    if (trial.loses_nothing) return "rows are lost: " + numbers;
    if (std::max(events, witnessed) >= acknowledged && witnessed <= trial.most_rows) return {};
    if (without_number != nullptr) *without_number = true;
    for (const char* named : {"cannot be told", "is damaged", "malformed", "does not fit the chain", "belongs to another journal",
                              "another history", "does not say what it says"})
      if (has(text, named)) return {};
    return "the wrong number: " + numbers;
  }

  // What an export of the journal lacks up to a place; empty: nothing.
  [[nodiscard]] std::string check_export(const std::string& file, const Oracle& oracle, std::uint64_t up_to,
                                         bool all = true) const {
    const fs::path to = temp / ("export-" + std::to_string(++folders));
    std::vector<std::string> arguments{"export", file, to.string()};
    if (!all && up_to == 0) return {};
    if (!all) arguments.insert(arguments.end(), {"--to", std::to_string(up_to)});
    const RunResult result = command(arguments);
    const std::string lines = read_bytes(to);
    fs::remove(to);
    if (result.exit_code != 0) return "export fails: " + said(result);
    const std::string lacks = oracle.lacks(lines, up_to);
    return lacks.empty() ? "" : "export: " + lacks;
  }

  // A command that failed must have said why, and about which file.
  [[nodiscard]] static std::string refusal(const std::string& what, const RunResult& result, const std::string& file) {
    if (!result.timed_out && result.exit_code < 128 && has(result.err, file)) return {};
    return what + " fails with " + std::to_string(result.exit_code) + " and does not say why: " + said(result);
  }

  [[nodiscard]] std::string try_export(const Trial& trial) const {
    const fs::path to = temp / ("export-" + std::to_string(++folders));
    const RunResult result = command({"export", trial.file(), to.string()});
    const bool made = fs::exists(to);
    const std::string lines = read_bytes(to);
    fs::remove(to);
    if (result.exit_code != 0) return made ? "export fails and leaves a file" : refusal("export", result, trial.file());
    const std::string lacks = trial.oracle->lacks(lines, trial.most_rows);
    return lacks.empty() ? "" : "export says nothing: " + lacks;
  }

  [[nodiscard]] std::string try_replay(const Trial& trial) const {
    const RunResult result = command({"replay", trial.file(), "--case", bone});
    if (result.exit_code != 0) return refusal("replay", result, trial.file());
    const std::uint64_t events = number_after(result.out, "events").value_or(0);
    if (events >= trial.oracle->acknowledged()) return {};
    return "replay says nothing and goes to " + std::to_string(events) + " of " +
           std::to_string(trial.oracle->acknowledged());
  }

  // Backup and branch.
  [[nodiscard]] std::string try_copy(const Trial& trial, const std::string& how) const {
    const fs::path folder = new_folder();
    const std::string to = (folder / "copy.journal").string();
    const RunResult result = command({how, trial.file(), to});
    std::string fault;
    if (result.exit_code != 0)
      fault = image_of(folder).empty() ? refusal(how, result, trial.file()) : how + " fails and leaves something";
    else if (fault = check_export(to, *trial.oracle, trial.most_rows); !fault.empty())
      fault = how + " says nothing: " + fault;
    fs::remove_all(folder);
    return fault;
  }

  // `serve`: what was recovered takes cuts again.
  [[nodiscard]] std::string try_recover(const Trial& trial, const Verified& found, bool serve, bool* without_number) const {
    const fs::path folder = new_folder();
    const std::string to = (folder / (trial.name + ".journal")).string();
    const RunResult result = command({"recover", trial.file(), to});
    std::string fault;
    if (result.exit_code != 0) {
      fault = found.read ? "verify reads it, and recover does not: " + said(result) : refusal("recover", result, trial.file());
    } else {
      const std::uint64_t events = number_after(result.out, "recovered").value_or(0);
      const std::uint64_t lost = number_after(result.out, "lost").value_or(0);
      if (events < found.events) fault = "recover leaves out what verify confirms: " + said(result);
      if (fault.empty()) fault = unsaid("recover", said(result), events, events + lost, trial, without_number);
      const bool own = !has(result.out, "belongs to another journal") && !has(result.out, "another history");
      if (fault.empty() && own)
        if (const std::string lacks = check_export(to, *trial.oracle, events); !lacks.empty()) fault = "recovered: " + lacks;
      // A database that is another room's is recovered as that.
      if (fault.empty() && serve && own && events > 0) {
        Server server = start(folder, trial.name);
        Oracle later;
        if (server.address.empty()) {
          fault = "what was recovered is not served: " + server.process->err();
        } else if (auto hand = LightHand::come(server.address, "", later, events); !hand) {
          fault = "what was recovered lets nobody in: " + hand.error().message;
        } else if (!wait_until([&] { return (*hand)->decided() > 2; }, kPatience)) {
          fault = "what was recovered takes no cuts: " + (*hand)->ended().value_or("") + server.process->err();
        }
        kill(server);
      }
    }
    fs::remove_all(folder);
    return fault;
  }

  // A server on it: a client comes back with what it was told, cuts, and the server is killed once more.
  [[nodiscard]] std::string try_serve(const Trial& trial, const Verified& found, Outcome* outcome) const {
    Server server = start(trial.folder, trial.name);
    const std::string end = " (verify: " + found.text + ")";
    if (server.address.empty()) {
      *outcome = Outcome::refused;
      if (found.sound) return "verify finds it sound, and no server starts on it: " + server.process->err();
      const bool told = has(server.process->err(), trial.name + ".journal");
      return told ? "" : "a server ends without saying why: " + server.process->err();
    }
    Oracle later(*trial.oracle);
    auto hand = LightHand::come_again(server.address, trial.member, later, trial.most_rows);
    std::string fault;
    if (!hand) {
      *outcome = Outcome::named;
      if (found.sound) fault = "verify finds it sound, and it lets nobody come back: " + hand.error().message;
      else if (hand.error().message.empty()) fault = "a client is refused without a word";
      // Whoever comes anew must not go on either.
      Oracle anew;
      if (auto stranger = LightHand::come(server.address, "", anew, 1); fault.empty() && stranger)
        if (wait_until([&] { return (*stranger)->decided() > 0 || (*stranger)->ended(); }, kPatience) &&
            (*stranger)->decided() > 0)
          fault = "a client is refused, and another cuts on: " + hand.error().message + end;
      kill(server);
      return fault;
    }
    const std::uint64_t before = (*hand)->decided();
    (void)wait_until([&] { return (*hand)->decided() > before + 5 || (*hand)->ended(); }, kPatience);
    const bool cuts = (*hand)->decided() > before;
    const std::string ended = (*hand)->ended().value_or("");
    if (!cuts) *outcome = Outcome::named;
    if (cuts && !found.sound && !found.only_checkpoint()) fault = "verify finds damage, and it takes cuts" + end;
    if (!cuts && found.sound) fault = "verify finds it sound, and it takes no cuts: " + ended + end;
    if (!cuts && !found.sound && ended.empty()) fault = "a room takes no cuts and does not say so" + end;
    kill(server);
    if (!fault.empty() || !cuts) return fault;
    const Verified after = verify(trial.file());
    if (!after.sound && !after.only_checkpoint()) return "after it was served again: " + after.text;
    fault = check_export(trial.file(), later, after.events, after.sound);
    return fault.empty() ? "" : "after it was served again, " + fault;
  }

  [[nodiscard]] Verdict judge(Random& random, const Trial& trial) const {
    Verdict verdict;
    const auto note = [&](const std::string& fault) {
      if (verdict.fault.empty()) verdict.fault = fault;
    };
    const Image before = image_of(seen(trial.folder));
    const Verified found = verify(trial.file());
    const std::uint64_t acknowledged = trial.oracle->acknowledged();
    if (found.sound) {
      if (found.events < acknowledged)
        note("verify says sound, and it goes to " + std::to_string(found.events) + " of " + std::to_string(acknowledged));
    } else if (found.read) {
      verdict.outcome = Outcome::named;
      note(unsaid("verify", found.text, found.events, found.witnessed, trial, &verdict.without_number));
    } else {
      verdict.outcome = Outcome::refused;
      if (trial.loses_nothing) note("verify reads nothing: " + found.text);
      if (!has(found.text, trial.file())) note("verify does not say why: " + found.text);
    }
    const std::size_t first = random.index(4);
    for (std::size_t i = 0; i < 4; ++i) {
      if (!thorough && i != first) continue;
      if (i == 0) note(try_export(trial));
      if (i == 1) note(try_replay(trial));
      if (i == 2) note(try_copy(trial, "backup"));
      if (i == 3) note(try_copy(trial, "branch"));
    }
    if (thorough || trial.loses_nothing || random.index(2) == 0)
      note(try_recover(trial, found, trial.loses_nothing || (thorough && !found.sound), &verdict.without_number));
    if (const std::string changed = difference(before, image_of(seen(trial.folder))); !changed.empty())
      note("commands that only read leave it otherwise: " + changed);
    Outcome served = verdict.outcome;
    note(try_serve(trial, found, &served));
    if (verdict.outcome == Outcome::named && served == Outcome::refused) verdict.outcome = Outcome::refused;
    return verdict;
  }

  void count(std::uint64_t seed, const std::string& what, std::uint64_t acknowledged, const Verdict& verdict) {
    ++tally.trials;
    ++tally.done[what];
    tally.acknowledged += acknowledged;
    if (!verdict.fault.empty()) {
      ++tally.silent;
      if (tally.faults.size() < kFaultsKept) tally.faults.push_back("seed " + std::to_string(seed) + ", " + what + ": " + verdict.fault);
      return;
    }
    if (verdict.outcome == Outcome::whole) ++tally.whole;
    if (verdict.outcome == Outcome::named) ++tally.named;
    if (verdict.outcome == Outcome::refused) ++tally.refused;
    if (verdict.outcome == Outcome::named && verdict.without_number) ++tally.without_number;
  }

  // Changes one file. Gives what was done.
  [[nodiscard]] std::string break_one(Random& random, const Life& life, Image& image) const {
    const std::string room = std::string(kRoom) + ".journal";
    std::vector<std::string> names;
    for (const auto& [name, bytes] : image) names.push_back(name);
    const std::string name = names[random.index(names.size())];
    const std::string kind = name.ends_with(".checkpoint") ? ".checkpoint" : name.substr(room.size());
    const std::string end = kind.empty() ? " database" : " " + kind;
    std::string& bytes = image.at(name);
    // Most of a log is zeros that were never written to.
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
      case 1: bytes.resize(at); return "truncate" + end;
      case 2: bytes.replace(at, length, std::string(length, '\0')); return "zero" + end;
      case 3: image.erase(name); return "delete" + end;
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

  // Commands that take a journal, on one that a server has. So many of them, in a random order. What one of them does
  // that it must not; empty: nothing.
  [[nodiscard]] std::string try_second(Random& random, const fs::path& folder, Server& server, std::size_t most,
                                       bool removed) const {
    const std::string file = (folder / (std::string(kRoom) + ".journal")).string();
    const std::string to = (new_folder() / "second").string();
    std::vector<std::vector<std::string>> commands{{"verify", file},
                                                   {"verify", file, "--case", bone},
                                                   {"recover", file, to},
                                                   {"backup", file, to},
                                                   {"migrate", file, to},
                                                   {"branch", file, to},
                                                   {"replay", file, "--case", bone},
                                                   {"export", file, to},
                                                   {"people", file},
                                                   {"forget", file, "--older-than", "1"},
                                                   {"rename-room", file, "other"},
                                                   {"delete", file, "--alone"},
                                                   {"delete", file, "--branches"},
                                                   {"--case", bone, "--journal", file}};
    for (std::size_t i = commands.size() - 1; i > 0; --i) std::swap(commands[i], commands[random.index(i + 1)]);
    commands.resize(std::min(most, commands.size()));
    std::string fault;
    // The server itself must write nothing meanwhile.
    server.process->signal(SIGSTOP);
    std::this_thread::sleep_for(20ms);
    const Image before = image_of(folder);
    for (const std::vector<std::string>& one : commands) {
      const RunResult result = command(one);
      const std::string what = one.front() + " as the second: ";
      if (result.exit_code == 0 || result.timed_out) fault = what + said(result);
      if (fault.empty() && !removed && !has(result.err, "room.journal is in use by another process"))
        fault = what + "it does not say that it is in use: " + said(result);
      if (fault.empty()) fault = refusal(what, result, kRoom);
      if (fault.empty()) fault = difference(before, image_of(folder));
      if (fault.empty() && fs::exists(to)) fault = what + "it makes " + to;
      if (!fault.empty()) break;
    }
    server.process->signal(SIGCONT);
    return fault;
  }

  // The room has failed: it says so to who is in it and to who comes, with file and remedy. What it does otherwise.
  [[nodiscard]] static std::string unsaid_failure(Server& server, LightHand& hand, const std::string& file) {
    if (!wait_until([&] { return hand.ended().has_value(); }, kPatience)) return "the room goes on";
    const std::string why = *hand.ended();
    Oracle later;
    const auto stranger = LightHand::come(server.address, "", later, 1);
    if (!has(why, "the room takes no more cuts") || !has(why, file) || !has(why, "recover"))
      return "a client is told no reason, file or remedy: " + why;
    if (!stranger) return has(stranger.error().message, "takes no more") ? "" : "who comes is told: " + stranger.error().message;
    (void)wait_until([&] { return (*stranger)->ended() || (*stranger)->decided() > 0; }, kPatience);
    if ((*stranger)->decided() > 0) return "the room has failed and takes cuts";
    const std::string told = (*stranger)->ended().value_or("");
    return has(told, "takes no more") ? "" : "who comes is told: " + told;
  }
};

// For as long as it lives, servers and commands run behind a prefix.
struct Breaker::InsideOf {
  InsideOf(Parts& all, std::vector<std::string> prefix, fs::path root) : parts(all) {
    parts.prefix = std::move(prefix);
    parts.root = std::move(root);
  }
  ~InsideOf() {
    parts.prefix.clear();
    parts.root = "/";
  }
  InsideOf(const InsideOf&) = delete;
  InsideOf& operator=(const InsideOf&) = delete;
  Parts& parts;
};

Breaker::Breaker(bool thorough) : parts_(std::make_unique<Parts>(thorough)) {}
Breaker::~Breaker() = default;
const BreakerTally& Breaker::tally() const { return parts_->tally; }

void Breaker::damage(std::uint64_t seed, int damages) {
  Random random(seed);
  Life life;
  parts_->live(seed, kRoom, life);
  const std::uint64_t acknowledged = life.oracle.acknowledged();
  parts_->count(seed, "kill alone", acknowledged, {.fault = life.fault});
  for (int i = 0; i < damages && life.fault.empty(); ++i) {
    Image image = life.image;
    const std::string what = parts_->break_one(random, life, image);
    const Trial trial{.folder = parts_->new_folder(), .oracle = &life.oracle, .most_rows = life.rows, .member = life.member};
    put(image, trial.folder);
    parts_->count(seed, what, acknowledged, parts_->judge(random, trial));
    fs::remove_all(trial.folder);
  }
}

void Breaker::second_openers(std::uint64_t seed) {
  Random random(seed * 3 + 1);
  for (const bool removes : {false, true}) {
    Oracle oracle;
    const fs::path folder = parts_->new_folder();
    const std::string file = (folder / (std::string(kRoom) + ".journal")).string();
    Server server = parts_->start(folder);
    auto hand = LightHand::come(server.address, "", oracle, seed);
    Verdict verdict;
    std::string what = "second openers";
    if (!hand) {
      parts_->count(seed, what, 0, {.fault = "no hand is let in: " + hand.error().message});
      return;
    }
    parts_->load(random, server, **hand, oracle, 100);
    if (removes) {
      constexpr std::array kEnds{"", "-log", "-mirror", "-wal"};
      const std::string end = kEnds[random.index(kEnds.size())];
      what += ", without " + (end.empty() ? "database" : end);
      server.process->signal(SIGSTOP);
      fs::remove(file + end);
      verdict.fault = parts_->try_second(random, folder, server, parts_->thorough ? 99 : 4, true);
      // SQLite's own log has what the database lacks only while rows are carried into it.
      if (end != "-wal" && verdict.fault.empty()) verdict.fault = Parts::unsaid_failure(server, **hand, file);
    } else {
      verdict.fault = parts_->try_second(random, folder, server, 99, false);
      const std::uint64_t before = oracle.acknowledged();
      if (!wait_until([&] { return oracle.acknowledged() > before || (*hand)->ended(); }, kPatience) || (*hand)->ended())
        verdict.fault += "the server does not go on";
    }
    const wire::JoinedRoom member = (*hand)->room();
    Parts::kill(server);
    hand->reset();
    if (verdict.fault.empty()) {
      const Trial trial{.folder = folder, .oracle = &oracle, .most_rows = oracle.most(), .member = member,
                        .loses_nothing = fs::exists(file)};
      verdict = parts_->judge(random, trial);
    }
    parts_->count(seed, what, oracle.acknowledged(), verdict);
    fs::remove_all(folder);
  }
}

void Breaker::write_errors(std::uint64_t seed) {
  Random random(seed * 5 + 1);
  constexpr std::array<std::pair<int, const char*>, 3> kReasons{{{EIO, "EIO"}, {ENOSPC, "ENOSPC"}, {EROFS, "EROFS"}}};
  constexpr std::array kKinds{"wsn", "w", "s"};
  const auto [reason, name] = kReasons[random.index(kReasons.size())];
  const std::string kinds = reason == EIO ? kKinds[random.index(kKinds.size())] : reason == ENOSPC ? "wn" : "wsn";
  const std::string what = std::string(name) + " of " + kinds;
  Oracle oracle;
  const fs::path folder = parts_->new_folder();
  const std::string file = (folder / (std::string(kRoom) + ".journal")).string();
  const FailingWrites failing(folder, parts_->temp / ("control-" + std::to_string(++parts_->folders)));
  Server server = parts_->start(folder, kRoom, failing.options());
  auto hand = LightHand::come(server.address, "", oracle, seed);
  if (!hand) return parts_->count(seed, what, 0, {.fault = "no hand is let in: " + hand.error().message + server.process->err()});
  parts_->load(random, server, **hand, oracle, 150);
  failing.begin(reason, kinds, static_cast<int>(random.index(20)));
  // What happens then may be a commit, or a person who comes, for whom the log begins anew.
  parts_->load(random, server, **hand, oracle, 50);
  Verdict verdict;
  verdict.fault = Parts::unsaid_failure(server, **hand, file);
  const std::string why = (*hand)->ended().value_or("");
  if (verdict.fault.empty() && reason == ENOSPC && !has(why, "make room on the disk")) verdict.fault = "no remedy: " + why;
  // A disk that works again makes no difference to a server that has seen it fail.
  const bool again = random.index(2) == 0;
  if (again) failing.end();
  if (again && verdict.fault.empty()) verdict.fault = Parts::unsaid_failure(server, **hand, file);
  const wire::JoinedRoom member = (*hand)->room();
  if (random.index(2) == 0) {
    Parts::kill(server);
  } else if (!server.process->terminate(kPatience)) {
    verdict.fault = "it does not end";
    Parts::kill(server);
  }
  failing.end();
  hand->reset();
  if (verdict.fault.empty()) {
    const Trial trial{.folder = folder, .oracle = &oracle, .most_rows = oracle.most(), .member = member, .loses_nothing = true};
    verdict = parts_->judge(random, trial);
  }
  parts_->count(seed, what, oracle.acknowledged(), verdict);
  fs::remove_all(folder);
}

bool Breaker::full_disk(std::uint64_t seed) {
  Random random(seed * 11 + 1);
  Mounter mounter(parts_->temp / ("mount-" + std::to_string(++parts_->folders)));
  if (!mounter.mount("12m")) return false;
  Oracle oracle;
  const fs::path folder = mounter.place();
  const std::string file = (folder / (std::string(kRoom) + ".journal")).string(), what = "full disk";
  const InsideOf inside(*parts_, mounter.prefix(), mounter.root());
  Server server = parts_->start(folder);
  auto hand = LightHand::come(server.address, "", oracle, seed);
  if (!hand) {
    parts_->count(seed, what, 0, {.fault = "no hand is let in: " + hand.error().message + server.process->err()});
    return true;
  }
  parts_->load(random, server, **hand, oracle, 100);
  {
    std::ofstream filler(parts_->seen(folder) / "filler", std::ios::binary);
    while (filler << std::string(4096, 'x') << std::flush) {
    }
  }
  // Its log has room that it took before. Who comes makes it begin anew, in the database.
  for (int i = 0; i < 50 && !(*hand)->ended(); ++i)
    (void)wire::join_room(server.address, wire::ClientKind::viewer, std::string(200, 'p') + std::to_string(i), 5s, {});
  Verdict verdict;
  verdict.fault = Parts::unsaid_failure(server, **hand, file);
  const std::string why = (*hand)->ended().value_or("");
  if (verdict.fault.empty() && !has(why, "make room on the disk")) verdict.fault = "no remedy: " + why;
  const wire::JoinedRoom member = (*hand)->room();
  Parts::kill(server);
  hand->reset();
  fs::remove(parts_->seen(folder) / "filler");
  if (verdict.fault.empty()) {
    const Trial trial{.folder = folder, .oracle = &oracle, .most_rows = oracle.most() + 50, .member = member, .loses_nothing = true};
    verdict = parts_->judge(random, trial);
  }
  parts_->count(seed, what, oracle.acknowledged(), verdict);
  return true;
}

bool Breaker::read_only(std::uint64_t seed) {
  Life life;
  parts_->live(seed, kRoom, life);
  parts_->count(seed, "kill alone", life.oracle.acknowledged(), {.fault = life.fault});
  const auto judge = [&](const fs::path& folder, const std::string& what) {
    const Trial trial{.folder = folder, .oracle = &life.oracle, .most_rows = life.rows, .member = life.member};
    Verdict verdict;
    const Verified found = parts_->verify(trial.file());
    if (!found.sound || found.events < life.rows) verdict.fault = "verify: " + found.text;
    if (verdict.fault.empty()) verdict.fault = parts_->check_export(trial.file(), life.oracle, life.rows);
    const RunResult replayed = parts_->command({"replay", trial.file(), "--case", parts_->bone});
    if (verdict.fault.empty() && replayed.exit_code != 0) verdict.fault = "replay: " + said(replayed);
    const fs::path to = parts_->new_folder();
    const RunResult copied = parts_->command({"backup", trial.file(), (to / "copy").string()});
    if (verdict.fault.empty() && copied.exit_code != 0) verdict.fault = "backup: " + said(copied);
    if (verdict.fault.empty()) verdict.fault = parts_->check_export((to / "copy").string(), life.oracle, life.rows);
    const RunResult served = parts_->command({"--case", parts_->bone, "--journal", trial.file()}, 10s);
    if (verdict.fault.empty() && (served.exit_code == 0 || served.timed_out)) verdict.fault = "a server: " + said(served);
    if (verdict.fault.empty()) verdict.fault = Parts::refusal("a server", served, trial.file());
    if (verdict.fault.empty()) verdict.fault = difference(life.image, image_of(parts_->seen(folder)));
    parts_->count(seed, what, life.oracle.acknowledged(), verdict);
  };
  {
    const fs::path folder = parts_->new_folder();
    put(life.image, folder);
    for (const auto& entry : fs::directory_iterator(folder)) fs::permissions(entry.path(), fs::perms(0444));
    fs::permissions(folder, fs::perms(0555));
    {
      // Root would write to them as well.
      const std::vector<std::string> anybody{"setpriv", "--bounding-set", "-all", "--inh-caps", "-all"};
      const InsideOf inside(*parts_, ::geteuid() == 0 ? anybody : std::vector<std::string>{}, "/");
      judge(folder, "read-only files");
    }
    fs::permissions(folder, fs::perms(0755));
  }
  Mounter mounter(parts_->temp / ("mount-" + std::to_string(++parts_->folders)));
  if (!mounter.mount("64m")) return false;
  const InsideOf inside(*parts_, mounter.prefix(), mounter.root());
  put(life.image, parts_->seen(mounter.place()));
  if (!mounter.make_read_only()) return false;
  judge(mounter.place(), "read-only medium");
  return true;
}

}  // namespace osteon::test
