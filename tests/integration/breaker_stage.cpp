#include "tests/integration/breaker_stage.hpp"

#include <algorithm>
#include <csignal>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

}  // namespace

bool has(const std::string& text, std::string_view part) { return text.find(part) != text.npos; }

std::optional<std::uint64_t> number_after(const std::string& text, const std::string& label) {
  std::smatch found;
  if (!std::regex_search(text, found, std::regex("(^|\n)" + label + ": +([0-9]+)"))) return std::nullopt;
  return std::stoull(found[2]);
}

std::string read_bytes(const fs::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(bytes).str();
}

Image image_of(const fs::path& folder) {
  Image image;
  std::error_code error;  // files appear and vanish while a server runs
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    image[entry->path().filename().string()] = read_bytes(entry->path());
  return image;
}

void put(const Image& image, const fs::path& folder) {
  fs::create_directories(folder);
  for (const auto& [name, bytes] : image) std::ofstream(folder / name, std::ios::binary) << bytes;
}

// What differs, as "NAME was changed". Empty: nothing.
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

std::string said(const RunResult& result) {
  return (result.timed_out ? "it did not end: " : "") + result.out + result.err;
}

bool Verified::only_checkpoint() const {
  std::istringstream lines(text);
  bool any = false;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("fault:")) continue;
    if (!has(line, ".checkpoint")) return false;
    any = true;
  }
  return any;
}

Mounter::Mounter(fs::path place) : place_(std::move(place)), shell_("unshare", {"-rm", "sh"}) {
  fs::create_directories(place_);
}

bool Mounter::run(const std::string& line) {
  shell_.write(line + " >/dev/null 2>&1 && echo done || echo failed\n");
  return shell_.read_line(10s) == "done";
}

bool Mounter::mount(const std::string& size) {
  return run("mount -t tmpfs -o size=" + size + " none " + place_.string());
}
bool Mounter::make_read_only() { return run("mount -o remount,ro " + place_.string()); }

std::vector<std::string> Mounter::prefix() const {
  return {"nsenter", "--target", std::to_string(shell_.pid()), "--user", "--mount", "--preserve-credentials"};
}

fs::path Mounter::root() const { return "/proc/" + std::to_string(shell_.pid()) + "/root"; }

BreakerStage::BreakerStage(bool longer) : longer_(longer), bone_((temp_ / "case").string()) {
  const RunResult made = run(
      program("osteon-import"),
      {"phantom", "block", "--layers", "5:1.9,20:0.3,5:1.9", "--width", "12", "--pitch", "0.5", "--out", bone_}, 120s);
  if (made.exit_code != 0) throw std::runtime_error("osteon-import failed: " + made.err);
}

fs::path BreakerStage::new_name() const { return temp_ / std::to_string(++names_); }

fs::path BreakerStage::new_folder() const {
  fs::path folder = new_name();
  fs::create_directories(folder);
  return folder;
}

std::vector<std::string> BreakerStage::with_prefix(std::vector<std::string> arguments) const {
  if (prefix_.empty()) return arguments;
  arguments.insert(arguments.begin(), program("osteon-server"));
  arguments.insert(arguments.begin(), prefix_.begin() + 1, prefix_.end());
  return arguments;
}

fs::path BreakerStage::first() const { return prefix_.empty() ? program("osteon-server") : fs::path(prefix_.front()); }

RunResult BreakerStage::command(const std::vector<std::string>& arguments, std::chrono::milliseconds patience) const {
  return run(first(), with_prefix(arguments), patience);
}

Server BreakerStage::start(const fs::path& folder, const std::string& name, ProcessOptions options) const {
  const fs::path address = new_name();
  Server server;
  server.process = std::make_unique<Process>(
      first(),
      with_prefix({"--case", bone_, "--plain", "--journal", (folder / (name + ".journal")).string(), "--signing-key",
                   key(), "--audit", audit(), "--address-file", address.string(), "--drain-seconds", "0"}),
      std::move(options));
  std::optional<std::string> line;
  (void)wait_until([&] { return (line = wait_for_address(address, 1ms)) || !server.process->running(); }, kPatience);
  server.address = line.value_or("");
  fs::remove(address);
  return server;
}

void BreakerStage::kill(Server& server) {
  server.process->signal(SIGKILL);
  (void)server.process->wait(kPatience);
}

void BreakerStage::freeze(Server& server) {
  server.process->signal(SIGSTOP);
  (void)wait_until(
      [&] {
        std::error_code error;
        for (fs::directory_iterator task("/proc/" + std::to_string(server.process->pid()) + "/task", error), end;
             !error && task != end; task.increment(error)) {
          const std::string stat = read_bytes(task->path() / "stat");
          const std::size_t name_ends = stat.rfind(')');
          if (name_ends == stat.npos || stat.size() < name_ends + 3 || stat[name_ends + 2] != 'T') return false;
        }
        return true;
      },
      kPatience);
}

void BreakerStage::load(std::uint64_t seed, const Server& server, LightHand& hand, Oracle& oracle,
                        std::size_t most_ms) const {
  Random random(seed);  // of its own, because the number of calls depends on the machine
  if (longer_) most_ms *= 5;
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

void BreakerStage::live(std::uint64_t seed, const std::string& name, Life& life) const {
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
    load(random.index(1'000'000), server, **hand, life.oracle, 150);
    life.earlier.push_back(image_of(folder));
    load(random.index(1'000'000), server, **hand, life.oracle, 150);
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
  life.entries = found.events;
  if (!found.sound) life.fault = "a kill alone is called damage: " + found.text;
  if (const std::string lacks = check_export(file, life.oracle, found.events); life.fault.empty()) life.fault = lacks;
  fs::remove_all(folder);
}

Verified BreakerStage::verify(const std::string& file) const {
  const RunResult result = command({"verify", file});
  Verified found{.text = said(result)};
  const auto events = number_after(result.out, "events"), witnessed = number_after(result.out, "witnessed");
  found.read = events && witnessed;
  found.events = events.value_or(0);
  found.witnessed = witnessed.value_or(0);
  found.sound = result.exit_code == 0;
  return found;
}

std::string BreakerStage::check_export(const std::string& file, const Oracle& oracle, std::uint64_t up_to,
                                       bool all) const {
  const fs::path to = new_name();
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

Behind::Behind(BreakerStage& stage, std::vector<std::string> prefix, fs::path root) : stage_(&stage) {
  stage.prefix_ = std::move(prefix);
  stage.root_ = std::move(root);
}

Behind::~Behind() {
  stage_->prefix_.clear();
  stage_->root_ = "/";
}

}  // namespace osteon::test
