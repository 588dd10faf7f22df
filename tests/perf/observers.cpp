// A room with many observers. One hand burs steadily while observers get the surface and the tools' states. Some of
// them are stalled. Measures how long a committed cut takes to reach everyone, how many frames a second they get, and
// the cost for the server.
// Measured with a few observers, with all, and with some of these stalled, each on a server of its own. Prints JSON.
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "common/core/check.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "haptic_client/net/room_session.hpp"
#include "tests/perf/observer_streams.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using std::chrono::nanoseconds;

constexpr nanoseconds kBetweenCuts{1'000'000'000 / 120}, kFrame{1'000'000'000 / 30};
constexpr double kFeed_mm_per_s = 20.0, kRow_mm = 30.0, kBetweenRows_mm = 1.0, kDepth_mm = 0.2;
constexpr nanoseconds kWarmUp = 1s;  // cuts committed before are not measured

double ms(nanoseconds time) { return 1e-6 * static_cast<double>(time.count()); }
double rounded(double value) { return std::round(1e3 * value) / 1e3; }

double quantile(const std::vector<double>& sorted, double part) {
  return sorted.empty() ? 0.0 : sorted[static_cast<std::size_t>(part * static_cast<double>(sorted.size() - 1) + 0.5)];
}
json spread(std::vector<double> values) {
  std::ranges::sort(values);
  return {{"count", values.size()},
          {"p50", rounded(quantile(values, 0.5))},
          {"p99", rounded(quantile(values, 0.99))},
          {"max", rounded(values.empty() ? 0.0 : values.back())}};
}

// Resource use of a process, from the system.
struct Usage {
  double cpu_s = 0, resident_mb = 0;
};
Usage usage_of(pid_t process) {
  Usage usage;
  const std::string folder = "/proc/" + std::to_string(process);
  std::string text;
  std::getline(std::ifstream(folder + "/stat"), text);
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::vector<std::string> words{std::istream_iterator<std::string>(fields), {}};
  usage.cpu_s = (std::stod(words.at(11)) + std::stod(words.at(12))) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  usage.resident_mb = std::stod(words.at(21)) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
  return usage;
}

// A hand that burs row by row over the block's upper face, at an even pace.
class Author {
 public:
  Author(const std::string& address, const std::filesystem::path& cache) {
    auto joined = RoomSession::join({.address = address, .name = "author", .patience = 20s, .cache = cache}, {});
    OSTEON_CHECK(joined.has_value());
    session_.emplace(std::move(*joined));
    RoomCallbacks callbacks;
    callbacks.message = [this](const RoomMessage& message) {
      OSTEON_CHECK(!std::holds_alternative<CutRejected>(message));
      if (std::holds_alternative<RoomAtJoin>(message)) complete_ = true;
      const auto* committed = std::get_if<CutCommitted>(&message);
      if (committed == nullptr) return;
      const auto now = machine_time();
      const std::lock_guard lock(mutex_);
      committed_[committed->seq] = {sent_[committed->cut.author_seq - 1], now};
      newest_ = committed->seq.value;
    };
    callbacks.lost = [](const Error& why) {
      std::cerr << "osteon-observers: the author lost the room: " << why.message << "\n";
    };
    session_->open(std::move(callbacks));
    OSTEON_CHECK(wait_until([&] { return complete_.load(); }, 20s));
  }
  ~Author() { close(); }
  void close() { session_->close(); }

  void cut_for(std::chrono::seconds duration) {
    const auto burr = find_tool("burr-round-5");
    OSTEON_CHECK(burr.has_value());
    const double step_mm = kFeed_mm_per_s * 1e-9 * static_cast<double>(kBetweenCuts.count());
    auto next = std::chrono::steady_clock::now();
    const auto until = next + duration;
    Vec3 tip = tip_at(way_mm_);
    while (next < until) {
      const Vec3 to = tip_at(way_mm_ += step_mm);
      Cut cut = straight_cut(*burr, std::exchange(tip, to), to, {0, 0, -1}, ++author_seq_);
      cut.author = session_->room().author;
      cut.lease_epoch = session_->room().lease_epoch;
      CuttingState state;
      state.author = cut.author;
      state.state_seq = author_seq_;
      state.tool_name = burr->name;
      state.phase = CuttingPhase::cutting;
      state.spindle_rpm = cut.spindle_rpm;
      state.pose_bone_tool.position_mm = to;
      {
        const std::lock_guard lock(mutex_);
        sent_.push_back(machine_time());
      }
      OSTEON_CHECK(wait_until([&] { return session_->send(cut); }, 10s));
      session_->send(state);
      std::this_thread::sleep_until(next += kBetweenCuts);
    }
  }
  // Waits until the room has decided every cut.
  [[nodiscard]] RoomSeq wait_for_all() {
    OSTEON_CHECK(wait_until([&] { return commits().size() == author_seq_; }, 20s));
    return RoomSeq{newest_};
  }
  struct Times {
    nanoseconds sent{}, committed{};
  };
  [[nodiscard]] std::map<RoomSeq, Times> commits() const {
    const std::lock_guard lock(mutex_);
    return committed_;
  }

 private:
  static Vec3 tip_at(double way_mm) {
    const double row = std::floor(way_mm / kRow_mm), along = way_mm - row * kRow_mm;
    const bool back = static_cast<long>(row) % 2 != 0;
    return {(back ? kRow_mm - along : along) - 0.5 * kRow_mm, row * kBetweenRows_mm - 0.5 * kRow_mm, -kDepth_mm};
  }

  std::optional<RoomSession> session_;
  std::atomic<bool> complete_{false};
  std::atomic<std::uint64_t> newest_{0};
  std::uint64_t author_seq_ = 0;
  double way_mm_ = 0;
  mutable std::mutex mutex_;
  std::vector<nanoseconds> sent_;  // by author_seq − 1
  std::map<RoomSeq, Times> committed_;
};

// [a process of its own] Runs observers. They report when they have joined, wait for a sequence number, and write what
// they received.
int watch(const std::string& address, int count, int stalled, int states_hz, const std::string& file) {
  Observers observers(address, count, stalled, states_hz);
  if (!observers.wait_for(RoomSeq{0}, 60s)) return 1;
  std::cout << "ready" << std::endl;
  std::uint64_t last = 0;
  std::cin >> last;
  const bool there = observers.wait_for(RoomSeq{last}, 20s);
  std::ofstream out(file);
  const std::vector<Received> received = observers.finish();
  for (std::size_t i = 0; i < received.size(); ++i)
    for (const auto* stream : {&received[i].mesh, &received[i].states})
      for (const Arrival& arrival : *stream)
        out << i << ' ' << (stream == &received[i].mesh ? 'm' : 's') << ' ' << arrival.at.count() << ' '
            << arrival.contains.value << ' ' << arrival.bytes << '\n';
  out.close();
  std::cout << (there && out ? "done" : "late") << std::endl;
  return 0;
}

std::vector<Received> read_received(const std::filesystem::path& file, std::size_t count) {
  std::vector<Received> received(count);
  std::ifstream in(file);
  std::size_t who = 0, bytes = 0;
  char stream = 0;
  std::int64_t at = 0;
  std::uint64_t contains = 0;
  while (in >> who >> stream >> at >> contains >> bytes)
    (stream == 'm' ? received.at(who).mesh : received.at(who).states)
        .push_back({nanoseconds{at}, RoomSeq{contains}, bytes});
  return received;
}

// From each cut's sending or commit until each observer's first message that contains it.
template <class Stream>
std::vector<double> delays_ms(const std::map<RoomSeq, Author::Times>& commits, const std::vector<Received>& received,
                              Stream stream, nanoseconds from, nanoseconds Author::Times::*since) {
  std::vector<double> delays;
  for (const Received& observer : received) {
    auto arrival = (observer.*stream).begin();
    for (const auto& [place, times] : commits) {
      while (arrival != (observer.*stream).end() && arrival->contains < place) ++arrival;
      if (arrival == (observer.*stream).end()) break;  // the last cuts may come without a change of any state
      if (times.committed >= from) delays.push_back(ms(arrival->at - times.*since));
    }
  }
  return delays;
}

// Messages a second of each observer, and the longest pause between two messages, while there were cuts.
template <class Stream>
json rates(const std::vector<Received>& received, Stream stream, nanoseconds from, nanoseconds until) {
  std::vector<double> rates, pauses;
  std::size_t bytes = 0;
  for (const Received& observer : received) {
    std::size_t count = 0;
    nanoseconds last = from, longest{};
    for (const Arrival& arrival : observer.*stream) {
      if (arrival.at < from || arrival.at > until) continue;
      ++count;
      bytes += arrival.bytes;
      longest = std::max(longest, arrival.at - std::exchange(last, arrival.at));
    }
    rates.push_back(static_cast<double>(count) / (1e-9 * static_cast<double>((until - from).count())));
    pauses.push_back(ms(longest));
  }
  std::ranges::sort(rates);
  const double all_s = 1e-9 * static_cast<double>((until - from).count()) * static_cast<double>(received.size());
  return {{"per_s_min", rounded(rates.empty() ? 0 : rates.front())},
          {"per_s_p50", rounded(quantile(rates, 0.5))},
          {"pause_ms", spread(pauses)},
          {"kbytes_per_s", rounded(1e-3 * static_cast<double>(bytes) / all_s)}};
}

struct Setting {
  std::filesystem::path server_program, case_folder;
  std::chrono::seconds duration{10};
  int states_hz = 30;
};

json measure(const Setting& setting, int count, int stalled) {
  const TempDir temp;
  Process server(setting.server_program, {"--case", setting.case_folder, "--plain", "--address-file", temp / "address",
                                          "--summary", temp / "summary.json"});
  const auto address = wait_for_address(temp / "address", 120s);
  OSTEON_CHECK(address.has_value());
  Author author(*address, temp / "cache");
  const Usage alone = usage_of(server.pid());
  Process readers(program("osteon-observers"),
                  {"--watch", *address, "--observers", std::to_string(count), "--stalled", std::to_string(stalled),
                   "--states-hz", std::to_string(setting.states_hz), "--file", temp / "received"});
  OSTEON_CHECK(readers.read_line(90s) == "ready");

  const Usage before = usage_of(server.pid()), readers_before = usage_of(readers.pid()),
              own_before = usage_of(::getpid());
  const auto start = machine_time();
  author.cut_for(setting.duration);
  const auto stop = machine_time();
  const Usage after = usage_of(server.pid()), readers_after = usage_of(readers.pid()), own_after = usage_of(::getpid());
  const RoomSeq last = author.wait_for_all();
  readers.write(std::to_string(last.value) + "\n");
  author.close();
  const bool everyone_there = readers.read_line(60s) == "done";
  const auto received = read_received(temp / "received", static_cast<std::size_t>(count - stalled));
  (void)readers.wait(20s);
  (void)server.terminate(20s);
  json summary;
  std::ifstream(temp / "summary.json") >> summary;

  const auto commits = author.commits();
  const nanoseconds from = start + kWarmUp;
  std::vector<double> to_commit;
  for (const auto& [place, times] : commits)
    if (times.committed >= from) to_commit.push_back(ms(times.committed - times.sent));
  const double seconds = 1e-9 * static_cast<double>((stop - start).count());
  const auto share = [&](const Usage& a, const Usage& b) { return rounded((b.cpu_s - a.cpu_s) / seconds); };
  json out{{"observers", count},
           {"stalled", stalled},
           {"cuts", commits.size()},
           {"everyone_there", everyone_there},
           {"sent_to_commit_ms", spread(to_commit)}};
  if (everyone_there) {
    out["commit_to_mesh_ms"] = spread(delays_ms(commits, received, &Received::mesh, from, &Author::Times::committed));
    out["sent_to_mesh_ms"] = spread(delays_ms(commits, received, &Received::mesh, from, &Author::Times::sent));
    out["commit_to_state_ms"] =
        spread(delays_ms(commits, received, &Received::states, from, &Author::Times::committed));
  }
  out["mesh"] = rates(received, &Received::mesh, from, stop);
  out["states"] = rates(received, &Received::states, from, stop);
  out["server_cores"] = share(before, after);
  out["readers_cores"] = share(readers_before, readers_after);
  out["author_cores"] = share(own_before, own_after);
  out["server_mb"] = {{"alone", rounded(alone.resident_mb)},
                      {"watched", rounded(before.resident_mb)},
                      {"after", rounded(after.resident_mb)}};
  out["surface_mb"] = rounded(1e-6 * summary.value("surface_bytes", 0.0));
  out["surface_blocks"] = summary.value("surface_blocks", 0);
  out["mesh_update_us"] = summary["mesh_update_after_cut"];
  out["tick"] = summary["tick"];
  return out;
}

std::filesystem::path make_block(const TempDir& temp) {
  const RunResult imported = run(
      program("osteon-import"),
      {"phantom", "block", "--layers", "5:1.9,20:0.3,5:1.9", "--width", "40", "--pitch", "0.5", "--out", temp / "case"},
      120s);
  OSTEON_CHECK(imported.exit_code == 0);
  return temp / "case";
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  using namespace osteon::test;
  int observers = 150, stalled = 10, few = 10, seconds = 10;
  std::string address, file, only;
  Setting setting{program("osteon-server"), {}};
  CLI::App app("Measures a room that many watch.", "osteon-observers");
  app.add_option("--observers", observers, "How many watch")->capture_default_str();
  app.add_option("--stalled", stalled, "How many of them never read")->capture_default_str();
  app.add_option("--few", few, "How many watch in the run that the others are compared with")->capture_default_str();
  app.add_option("--seconds", seconds, "How long is cut in each run")->capture_default_str();
  app.add_option("--case", setting.case_folder, "Folder of the case; without it a block of layers, burred at z = 0");
  app.add_option("--server-program", setting.server_program, "The osteon-server to measure")->capture_default_str();
  app.add_option("--only", only, "One of the runs alone: few, all, stalled");
  app.add_option("--states-hz", setting.states_hz, "How often a second they want the tools' states; 0: every change")
      ->capture_default_str();
  app.add_option("--watch", address, "[the measuring process itself] HOST:PORT of the server to watch");
  app.add_option("--file", file, "[the measuring process itself] where it writes what it has received");
  CLI11_PARSE(app, argc, argv);
  if (!address.empty()) return watch(address, observers, stalled, setting.states_hz, file);

  const TempDir temp;
  if (setting.case_folder.empty()) setting.case_folder = make_block(temp);
  setting.duration = std::chrono::seconds{seconds};
  json out;
  if (only.empty() || only == "few") out["few"] = measure(setting, few, 0);
  if (only.empty() || only == "all") out["all"] = measure(setting, observers, 0);
  if (only.empty() || only == "stalled") out["stalled"] = measure(setting, observers, stalled);
  std::cout << out.dump(1) << "\n";
  return 0;
}
