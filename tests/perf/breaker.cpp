// osteon-breaker [MINUTES [SEED]]: damages the journals of real servers with one seed after the other, until it is
// stopped or the time is over. Exit code 1 if a promise was broken.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "tests/integration/breaker.hpp"

namespace {

volatile std::sig_atomic_t stopped = 0;

void show(const osteon::test::BreakerTally& tally, std::uint64_t seed, char end) {
  std::printf(
      "seed %llu: %llu trials, %llu entries acknowledged: %llu whole, %llu named (%llu without a number), %llu "
      "refused, %llu SILENT%c",
      static_cast<unsigned long long>(seed), static_cast<unsigned long long>(tally.trials),
      static_cast<unsigned long long>(tally.acknowledged), static_cast<unsigned long long>(tally.whole),
      static_cast<unsigned long long>(tally.named), static_cast<unsigned long long>(tally.without_number),
      static_cast<unsigned long long>(tally.refused), static_cast<unsigned long long>(tally.silent), end);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  using Clock = std::chrono::steady_clock;
  const double minutes = argc > 1 ? std::atof(argv[1]) : 0;
  std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : std::random_device{}();
  const auto until =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(minutes * 60));
  struct sigaction stop {};
  stop.sa_handler = [](int) { stopped = 1; };
  sigaction(SIGINT, &stop, nullptr);
  sigaction(SIGTERM, &stop, nullptr);

  osteon::test::Breaker breaker(true);
  osteon::test::BreakerTally tally;
  std::size_t told = 0;
  bool mounts = true;
  do {
    breaker.damage(seed, 5, 40);
    if (stopped == 0) breaker.older_copy(seed);
    if (stopped == 0) breaker.second_openers(seed);
    if (stopped == 0) breaker.write_errors(seed, 3);
    if (stopped == 0) mounts = breaker.full_disk(seed);
    if (stopped == 0) mounts = breaker.read_only(seed) && mounts;
    if (stopped != 0) break;  // a server that the same signal has ended proves nothing
    tally = breaker.tally();
    for (; told < tally.faults.size(); ++told) std::printf("\nSILENT: %s\n", tally.faults[told].c_str());
    show(tally, seed++, isatty(STDOUT_FILENO) != 0 ? '\r' : '\n');
  } while (stopped == 0 && (minutes <= 0 || Clock::now() < until));
  std::printf("\n");
  for (const auto& [what, times] : tally.done)
    std::printf("%6llu  %s\n", static_cast<unsigned long long>(times), what.c_str());
  if (!mounts)
    std::printf("LEFT OUT: full disks and read-only media, since this machine lets nobody mount one (unshare -rm)\n");
  return tally.silent == 0 ? 0 : 1;
}
