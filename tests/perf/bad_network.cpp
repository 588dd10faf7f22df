// osteon-bad-network [RUNS]: real processes and sockets, with good and bad networks between them. Measures how soon all
// hold one bone after the network is quiet, and how soon one hand's cut is in the patch that another feels.
// Makes a fifth as many runs without a bad network. The hands are simulated. Prints JSON.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "tests/integration/bad_network.hpp"
#include "tests/perf/percentiles.hpp"
#include "tests/support/temp_dir.hpp"

namespace {

using namespace osteon::test;
using Clock = std::chrono::steady_clock;

// Measures the machine itself: the delay of a thread that waits for its time and for the disk. It syncs a few bytes
// from time to time.
class Machine {
 public:
  Machine() : thread_([this] { run(); }) {}
  ~Machine() { (void)stop(); }
  // Returns the delay of each.
  std::vector<double> stop() {
    over_ = true;
    if (thread_.joinable()) thread_.join();
    return std::move(late_ms_);
  }

 private:
  void run() {
    constexpr std::chrono::milliseconds kTick{50};  // so rare that the server still gets the disk
    const TempDir folder;
    const int file = ::open((folder / "probe").c_str(), O_RDWR | O_CREAT, 0600);
    const std::vector<char> bytes(4096, 'x');
    for (auto due = Clock::now() + kTick; !over_; due = std::max(due + kTick, Clock::now())) {
      std::this_thread::sleep_until(due);
      if (::pwrite(file, bytes.data(), bytes.size(), 0) < 0 || ::fdatasync(file) != 0) break;
      late_ms_.push_back(std::chrono::duration<double, std::milli>(Clock::now() - due).count());
    }
    ::close(file);
  }

  std::atomic<bool> over_{false};
  std::vector<double> late_ms_;
  std::thread thread_;
};

// All runs on one kind of network.
nlohmann::json runs_on(const BadNetwork& network, int runs, std::uint64_t first_seed) {
  std::vector<double> converged_s, felt_ms, machine_ms, p50_ms, p99_ms;  // felt_ms: of all cuts of all runs
  std::uint64_t sent = 0, kept = 0;
  int faults = 0, alive = 0;
  nlohmann::json said = nlohmann::json::array();
  for (int i = 0; i < runs; ++i) {
    Machine machine;
    BadNetworkRun run = run_on(network, first_seed + static_cast<std::uint64_t>(i));
    std::ranges::move(machine.stop(), std::back_inserter(machine_ms));
    if (!run.fault.empty()) {
      ++faults;
      said.push_back({{"seed", first_seed + static_cast<std::uint64_t>(i)}, {"fault", run.fault}});
    }
    converged_s.push_back(run.converged_s);
    std::ranges::sort(run.felt_ms);
    p50_ms.push_back(percentile(run.felt_ms, 50));
    p99_ms.push_back(percentile(run.felt_ms, 99));
    felt_ms.insert(felt_ms.end(), run.felt_ms.begin(), run.felt_ms.end());
    sent += run.sent;
    kept += run.kept;
    alive += run.fast_path_alive;
  }
  for (auto* values : {&converged_s, &felt_ms, &p50_ms, &p99_ms}) std::ranges::sort(*values);
  return {{"runs", runs},
          {"faults", faults},
          {"said", said},
          {"sent", sent},
          {"kept", kept},
          {"fast_path_alive", alive},
          {"converged_s", {{"p50", percentile(converged_s, 50)}, {"max", converged_s.back()}}},
          {"machine_ms", spread(machine_ms)},
          {"felt_ms",
           {{"cuts", felt_ms.size()},
            {"p50", percentile(felt_ms, 50)},
            {"p99_pooled", percentile(felt_ms, 99)},
            {"p99_median_run", percentile(p99_ms, 50)},
            {"p99_worst_run", p99_ms.back()},
            {"max", felt_ms.empty() ? 0.0 : felt_ms.back()}}}};
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 50;
  const int loopback_runs = std::max(1, runs / 5);
  const BadNetwork good{.work = std::chrono::milliseconds(4000)};
  const BadNetwork bad{.impairment = {"delay 40 10", "loss 0.3", "reorder 0.1", "duplicate 0.05"},
                       .work = std::chrono::milliseconds(2000)};
  const nlohmann::json out{{"loopback", runs_on(good, loopback_runs, 1)}, {"bad", runs_on(bad, runs, 1)}};
  std::printf("%s\n", out.dump(2).c_str());
  return 0;
}
