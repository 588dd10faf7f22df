// osteon-bad-network [RUNS]: real processes and sockets, good and bad networks between them: how soon all hold one bone once it
// is quiet, and how soon one hand feels what another cuts. JSON.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/integration/bad_network.hpp"

namespace {

using namespace osteon::test;

// All runs on one kind of network.
nlohmann::json runs_on(const BadNetwork& network, int runs, std::uint64_t first_seed) {
  std::vector<double> converged_s;
  std::vector<double> felt_p50_ms, felt_p99_ms;
  std::uint64_t sent = 0, kept = 0;
  int faults = 0, alive = 0;
  nlohmann::json said = nlohmann::json::array();
  for (int i = 0; i < runs; ++i) {
    const BadNetworkRun run = run_on(network, first_seed + static_cast<std::uint64_t>(i));
    if (!run.fault.empty()) {
      ++faults;
      said.push_back({{"seed", first_seed + static_cast<std::uint64_t>(i)}, {"fault", run.fault}});
    }
    converged_s.push_back(run.converged_s);
    felt_p50_ms.push_back(run.felt.percentile_us(50) / 1000);
    felt_p99_ms.push_back(run.felt.percentile_us(99) / 1000);
    sent += run.sent;
    kept += run.kept;
    alive += run.fast_path_alive;
  }
  std::ranges::sort(converged_s);
  std::ranges::sort(felt_p50_ms);
  std::ranges::sort(felt_p99_ms);
  return {{"runs", runs},
          {"faults", faults},
          {"said", said},
          {"sent", sent},
          {"kept", kept},
          {"fast_path_alive", alive},
          {"converged_s", {{"p50", converged_s[converged_s.size() / 2]}, {"max", converged_s.back()}}},
          {"felt_ms", {{"p50", felt_p50_ms[felt_p50_ms.size() / 2]}, {"p99_median_run", felt_p99_ms[felt_p99_ms.size() / 2]},
                       {"p99_worst_run", felt_p99_ms.back()}}}};
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 50;
  const BadNetwork bad{.impairment = {"delay 40 10", "loss 0.3", "reorder 0.1", "duplicate 0.05"}, .work = std::chrono::milliseconds(2000)};
  const nlohmann::json out{{"loopback", runs_on({.work = std::chrono::milliseconds(4000)}, 3, 1)}, {"bad", runs_on(bad, runs, 1)}};
  std::printf("%s\n", out.dump(2).c_str());
  return 0;
}
