// A million ticks of a hand at the haptic loop on virtual time: stroking, pressing into a cavity and a thin wall, burring
// and drilling, while others cut and bone is taken back, with 0 to 200 ms on the way to the room. Takes the number of ticks
// and prints JSON.
#include <cstdio>
#include <cstdlib>

#include "tests/support/stability/stability.hpp"

using namespace osteon::test;

int main(int argc, char** argv) {
  const long ticks = argc > 1 ? std::atol(argv[1]) : 0;
  constexpr int kDelays_ms[] = {0, 50, 100, 200};
  constexpr int kRuns = kStabilityScenes * 4;
  if (ticks < 20L * kRuns || ticks > 1'000'000'000L) {
    std::fprintf(stderr, "osteon-stability: needs the number of ticks, %d to 1000000000\n", 20 * kRuns);
    return 1;
  }
  StabilityResult all;
  std::printf("{\"runs\": [");
  for (int scene = 0; scene < kStabilityScenes; ++scene)
    for (int i = 0; i < 4; ++i) {
      StabilityRun run;
      run.scene = static_cast<StabilityScene>(scene);
      run.delay_ms = kDelays_ms[i];
      run.ticks = ticks / kRuns;
      run.seed = static_cast<std::uint64_t>(10 * scene + i + 1);
      const StabilityResult r = run_stability(run);
      all.add(r);
      std::fprintf(stderr, "# %s, %d ms: %llu contacts, %.5f mJ generated\n", name(run.scene), run.delay_ms,
                   static_cast<unsigned long long>(r.episodes), r.generated_mj);
      std::printf(
          "%s{\"scene\": \"%s\", \"delay_ms\": %d, \"ticks\": %lld, \"touching\": %lld, \"episodes\": %llu, \"generated_mj\": "
          "%.6f, "
          "\"worst_mj\": %.6f, \"net_mj\": %.3f, \"cutting_mj\": %.3f, \"held_back\": %lld, \"returned\": %lld, \"undone\": "
          "%llu}",
          scene + i > 0 ? ", " : "", name(run.scene), run.delay_ms, static_cast<long long>(r.ticks),
          static_cast<long long>(r.touching), static_cast<unsigned long long>(r.episodes), r.generated_mj, r.worst_mj, r.net_mj,
          r.cutting_mj, static_cast<long long>(r.held_back), static_cast<long long>(r.returned),
          static_cast<unsigned long long>(r.undone));
    }
  std::printf(
      "], \"ticks\": %lld, \"touching\": %lld, \"cutting\": %lld, \"uncovered\": %lld, \"episodes\": %llu, \"undone\": %llu, "
      "\"others_cuts\": %llu, \"generated_mj\": %.6f, \"worst_mj\": %.6f, \"net_mj\": %.3f, \"cutting_mj\": %.3f, "
      "\"least_cutting_n_mm\": %.9f, \"step_over_n\": %.6f, \"still_step_n\": %.6f, \"motor_over_n\": %.9f, \"motor_late_n\": "
      "%.9f, "
      "\"motor_most_n\": %.4f, \"force_most_n\": %.3f, \"thin_wall_deepest_mm\": %.4f, \"allocations\": %lld}\n",
      static_cast<long long>(all.ticks), static_cast<long long>(all.touching), static_cast<long long>(all.cutting),
      static_cast<long long>(all.uncovered), static_cast<unsigned long long>(all.episodes),
      static_cast<unsigned long long>(all.undone), static_cast<unsigned long long>(all.others_cuts), all.generated_mj,
      all.worst_mj, all.net_mj, all.cutting_mj, all.least_cutting_n_mm, all.step_over_n, all.still_step_n, all.motor_over_n,
      all.motor_late_n, all.motor_most_n, all.force_most_n, all.deepest_mm, static_cast<long long>(all.allocations));
  return 0;
}
