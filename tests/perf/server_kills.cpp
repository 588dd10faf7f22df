// osteon-server-kills [COUNT] [SEED]: kills a server of a room with a journal COUNT times during work, and reports what
// was lost. Prints JSON.
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/integration/killed_servers.hpp"

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 2000;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const osteon::test::KilledServers report = osteon::test::kill_servers(count, seed);
  const nlohmann::json out{{"kills", report.kills},
                           {"killed_idle", report.killed_idle},
                           {"sent", report.sent},
                           {"acknowledged", report.acknowledged},
                           {"kept", report.kept},
                           {"lost", report.lost},
                           {"twice", report.twice},
                           {"missing", report.missing},
                           {"hashes_that_differ", report.hashes_that_differ},
                           {"up_p50_ms", report.up.percentile_us(50) / 1000},
                           {"up_p99_ms", report.up.percentile_us(99) / 1000},
                           {"back_p50_ms", report.back.percentile_us(50) / 1000},
                           {"back_p99_ms", report.back.percentile_us(99) / 1000},
                           {"fault", report.fault}};
  std::printf("%s\n", out.dump(2).c_str());
  return report.fault.empty() ? 0 : 1;
}
