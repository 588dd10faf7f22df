// A 1 kHz loop that does nothing. Shows how this machine runs a periodic thread without any work. Takes the seconds to
// run and prints JSON.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "common/runtime/periodic.hpp"

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 0.0;
  if (!(seconds > 0.0 && seconds <= 3600.0)) {
    std::fprintf(stderr, "osteon-empty-loop: needs the seconds to run, more than 0 and at most 3600\n");
    return 1;
  }
  const bool realtime = osteon::try_realtime(80);
  static osteon::TickStats stats;
  osteon::PeriodicTimer timer(std::chrono::milliseconds{1}, std::chrono::microseconds{150});
  for (auto ticks = static_cast<long>(seconds * 1000.0); ticks > 0; --ticks) {
    timer.wait(stats);
    timer.done(stats);
  }
  std::printf(
      "{\"ticks\": %llu, \"missed\": %llu, \"realtime\": %s, \"late_p50_us\": %.3f, \"late_p99_us\": %.3f, "
      "\"late_p999_us\": %.3f, \"late_max_us\": %.3f, \"work_p50_us\": %.3f, \"work_p99_us\": %.3f}\n",
      static_cast<unsigned long long>(stats.lateness.count()), static_cast<unsigned long long>(stats.missed),
      realtime ? "true" : "false", stats.lateness.percentile_us(50), stats.lateness.percentile_us(99),
      stats.lateness.percentile_us(99.9), stats.lateness.max_us(), stats.work.percentile_us(50),
      stats.work.percentile_us(99));
}
