// osteon-uplink [SECONDS]: measures the load of one tool on its connection and on its room's disk. It runs a real
// server with a journal, and a haptic client that burs without pause and then rests, with the real loop's cuts and
// poses.
// It runs on a clean connection, and at 40 +- 10 ms with 30 % of the datagrams lost, 10 % reordered and 5 % twice. The
// hand and the bad connection are simulated. Prints JSON.
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "common/core/check.hpp"
#include "common/runtime/log.hpp"
#include "tests/integration/bad_network.hpp"
#include "tests/integration/stage.hpp"
#include "tests/perf/percentiles.hpp"
#include "tests/perf/working_hand.hpp"
#include "tests/support/relay/impair_process.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

constexpr auto kBin = 100ms;
constexpr std::size_t kBinsInWindow = 10;                           // of the busiest second
constexpr std::uint64_t kCutsInBin = 10;                            // of 14: the tool cuts all the time
constexpr std::uint64_t kDatagramHeader = 28, kSegmentHeader = 52;  // IPv4 with UDP, and with TCP and its time stamps
constexpr double kIdle_s = 8.0;

// Bytes that this process has sent so far, headers included: in datagrams, and over the stream, where acknowledgements
// of received data count too.
struct Sent {
  std::uint64_t datagrams = 0, stream = 0;
  [[nodiscard]] std::uint64_t all() const { return datagrams + stream; }
};

std::uint64_t sent_over_tcp() {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    const int file = std::atoi(entry.path().filename().c_str());
    int type = 0, domain = 0;
    socklen_t size = sizeof type;
    if (::getsockopt(file, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_STREAM) continue;
    size = sizeof domain;
    if (::getsockopt(file, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0 || (domain != AF_INET && domain != AF_INET6))
      continue;
    tcp_info info{};
    size = sizeof info;
    if (::getsockopt(file, IPPROTO_TCP, TCP_INFO, &info, &size) == 0)
      bytes += info.tcpi_bytes_sent + info.tcpi_segs_out * kSegmentHeader;
  }
  return bytes;
}

struct Sample {
  Clock::time_point at;
  Sent sent;
};

double kbit_per_s(std::uint64_t bytes, double seconds) { return 8e-3 * static_cast<double>(bytes) / seconds; }

json rates(const std::vector<Sent>& bins) {
  Sent sum;
  for (const Sent& bin : bins) sum.datagrams += bin.datagrams, sum.stream += bin.stream;
  const double seconds = std::chrono::duration<double>(kBin).count() * static_cast<double>(bins.size());
  double worst = 0.0;
  for (std::size_t i = 0; i + kBinsInWindow <= bins.size(); ++i) {
    std::uint64_t bytes = 0;
    for (std::size_t k = 0; k < kBinsInWindow; ++k) bytes += bins[i + k].all();
    worst = std::max(worst, kbit_per_s(bytes, 1.0));
  }
  return {{"seconds", rounded(seconds)},
          {"kbit_per_s", rounded(kbit_per_s(sum.all(), seconds))},
          {"of_them_datagrams", rounded(kbit_per_s(sum.datagrams, seconds))},
          {"of_them_stream", rounded(kbit_per_s(sum.stream, seconds))},
          {"busiest_second", rounded(worst)}};
}

// The journal's bytes by kind of file.
std::map<std::string, std::uint64_t> journal_bytes(const fs::path& folder) {
  std::map<std::string, std::uint64_t> bytes{{"database", 0}, {"log", 0}, {"checkpoints", 0}};
  std::error_code gone;  // files come and go during this
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file(gone)) continue;
    const std::string name = entry.path().filename();
    const std::uint64_t size = entry.file_size(gone);
    if (gone) continue;
    const bool of_log = name.ends_with("-wal") || name.ends_with("-log") || name.ends_with("-mirror");
    bytes[of_log ? "log" : name.ends_with(".journal") ? "database" : "checkpoints"] += size;
  }
  return bytes;
}

json run_tool(const BadNetwork& network, double seconds) {
  TempDir folder;
  fs::create_directories(folder / "kept");
  Stage stage(40.0, {"--plain", "--journal", (folder / "kept" / "room.journal").string()});
  std::optional<ImpairProcess> relay;
  RoomSessionOptions options;
  options.address = stage.address();
  options.patience = 20s;
  options.cache = folder / "cache";
  if (!network.impairment.empty()) {
    relay.emplace(
        std::vector<std::string>{"--tcp", stage.address(), "--udp", "127.0.0.1:" + udp_port_of(stage.server())});
    options.address = relay->tcp();
    options.fast_path = relay->udp();
  }
  const std::map<std::string, std::uint64_t> at_first = journal_bytes(folder / "kept");
  WorkingHand client(options, burr_then_rest(seconds, 0.1, kIdle_s));
  std::vector<Sample> samples;
  bool impaired = network.impairment.empty();
  std::uint64_t log_bytes = 0;
  for (auto next = Clock::now(); !client.over(); std::this_thread::sleep_until(next += kBin)) {
    const FastPathHealth path = client.room().fast_path();
    // The hand joins on a good network, as people join before an operation.
    if (!impaired && path.alive) {
      for (const std::string& command : network.impairment) OSTEON_CHECK(relay->command(command) == "ok");
      impaired = true;
    }
    samples.push_back({Clock::now(), {path.bytes_sent + path.packets_sent * kDatagramHeader, sent_over_tcp()}});
    log_bytes = std::max(log_bytes, journal_bytes(folder / "kept").at("log"));
  }
  const haptic::ClientOutcome& done = client.outcome();
  (void)stage.server().terminate(20s);
  const std::map<std::string, std::uint64_t> at_last = journal_bytes(folder / "kept");

  // By bins of samples: what was sent, and how many cuts were closed.
  std::vector<Sent> cutting, idle;
  Clock::time_point last_cut{};
  for (const haptic::RecordedCut& cut : done.replica.cuts)
    last_cut = std::max(last_cut, Clock::time_point(std::chrono::nanoseconds(cut.closed_mono_ns)));
  const std::chrono::duration<double> resting(kIdle_s - 1.5);
  const auto idle_from = samples.back().at - std::chrono::duration_cast<Clock::duration>(resting);
  auto cut = done.replica.cuts.begin();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    std::uint64_t closed = 0;
    for (; cut != done.replica.cuts.end() && cut->closed_mono_ns < samples[i].at.time_since_epoch().count(); ++cut)
      ++closed;
    // The fast path's connection ends with the session.
    const Sent &before = samples[i - 1].sent, &after = samples[i].sent;
    if (after.datagrams < before.datagrams || after.stream < before.stream) continue;
    const Sent sent{after.datagrams - before.datagrams, after.stream - before.stream};
    if (closed >= kCutsInBin) cutting.push_back(sent);
    if (samples[i - 1].at >= std::max(idle_from, last_cut + 500ms)) idle.push_back(sent);
  }
  const double cutting_s = 1e-3 * 7.0 * static_cast<double>(done.replica.cuts.size());
  json kept;
  for (const auto& [what, bytes] : at_last) kept[what] = {{"at_first", at_first.at(what)}, {"at_last", bytes}};
  kept["log_most"] = log_bytes;
  return {
      {"cuts", done.replica.cuts.size()},
      {"cutting_s", rounded(cutting_s)},
      {"rejected", done.replica.rejected},
      {"interruptions", done.replica.interruptions},
      {"held_for_room_ticks", done.haptic.held_for_room_ticks},
      {"lost", done.lost ? json(done.lost->message) : json()},
      {"fast_path", {{"loss", rounded(done.fast_path.loss)}, {"round_trip_ms", rounded(done.fast_path.round_trip_ms)}}},
      {"cutting", rates(cutting)},
      {"idle", rates(idle)},
      {"journal_bytes", kept}};
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  using namespace osteon::test;
  osteon::log::open("osteon-uplink");
  const double seconds = argc > 1 ? std::max(5.0, std::atof(argv[1])) : 30.0;
  const BadNetwork bad{.impairment = {"delay 40 10", "loss 0.3", "reorder 0.1", "duplicate 0.05"}};
  const nlohmann::json out{{"clean", run_tool({}, seconds)}, {"bad", run_tool(bad, seconds)}};
  std::printf("%s\n", out.dump(1).c_str());
  return 0;
}
