#include "haptic_client/app/check_command.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <thread>

#include "common/runtime/command_line.hpp"
#include "common/runtime/number_option.hpp"
#include "common/runtime/periodic.hpp"
#include "common/runtime/realtime.hpp"

namespace osteon::haptic {
namespace {

constexpr int kPriority = 80;
// Memory that a client with a large bone locks: the case, the cut field, bricks, queues.
constexpr long kMemory_kib = 1024 * 1024;

// Returns the number of ticks that an empty loop missed.
std::uint64_t measure(double seconds) {
  // Not on the stack: it is a histogram of each microsecond.
  static TickStats stats;
  bool fifo = false;
  std::thread([&] {
    fifo = make_realtime(kPriority).fifo;
    PeriodicTimer timer(std::chrono::milliseconds(1), std::chrono::microseconds(150));
    for (auto ticks = static_cast<long>(1000.0 * seconds); ticks > 0; --ticks) {
      timer.wait(stats);
      timer.done(stats);
    }
  }).join();
  std::printf(
      "%.0f ticks of an empty loop%s woke late by %.1f us (median), %.1f us (99 of 100), %.1f us at most; %llu "
      "missed.\n",
      1000.0 * seconds, fifo ? "" : ", without real-time priority,", stats.lateness.percentile_us(50),
      stats.lateness.percentile_us(99), stats.lateness.max_us(), static_cast<unsigned long long>(stats.missed));
  return stats.missed;
}

}  // namespace

int run_check(int argc, char** argv) {
  CLI::App app(
      "Says what this machine lacks for a haptic loop of 1 kHz, and how to set it. Exits with 0 when it lacks nothing "
      "and an empty loop missed no tick, 1 else.",
      "osteon-haptic check");
  double seconds = 1.0;
  app.add_option("--seconds", seconds, "How long to run an empty loop; 0: not at all")
      ->check(number_in(0.0, 3600.0))
      ->capture_default_str();
  if (const auto code = parse_arguments(app, argc, argv)) return *code == 0 ? 0 : 2;

  int lacking = 0;
  for (const MachineFinding& finding : judge(look_at_machine(kPriority), kPriority, kMemory_kib)) {
    const char* const mark = finding.kind == Finding::lacking ? "LACKING"
                             : finding.kind == Finding::note  ? "note"
                                                              : "ok";
    std::printf("%-8s %s\n", mark, finding.sentence.c_str());
    if (!finding.remedy.empty()) std::printf("%-8s   To change it: %s.\n", "", finding.remedy.c_str());
    lacking += finding.kind == Finding::lacking;
  }
  const std::uint64_t missed = seconds > 0.0 ? measure(seconds) : 0;
  if (lacking == 0 && missed > 0)
    std::printf(
        "This machine is set up for the haptic loop, but an empty loop missed ticks: end other programs, or look for "
        "what "
        "delays its cores (power saving, a virtual machine's host), and measure longer with --seconds.\n");
  else if (lacking == 0)
    std::printf("This machine lacks nothing for the haptic loop.\n");
  else
    std::printf("This machine lacks %d of what the haptic loop needs: force may be late or stop for moments.\n",
                lacking);
  return lacking == 0 && missed == 0 ? 0 : 1;
}

}  // namespace osteon::haptic
