// A million ticks of a hand at the haptic loop on virtual time: stroking, pressing into a cavity and a thin wall, burring
// and drilling, while others cut and bone is taken back, with 0 to 200 ms on the way to the room; and as many again on devices
// that show torque to a hand that turns. Takes the number of ticks of each and prints JSON.
#include <cstdio>
#include <cstdlib>

#include "tests/support/stability/stability.hpp"

using namespace osteon::test;

namespace {

constexpr int kDelays_ms[] = {0, 50, 100, 200};
constexpr int kRuns = kStabilityScenes * 4;

StabilityResult all_scenes(long ticks, bool six_axes) {
  StabilityResult all;
  for (int scene = 0; scene < kStabilityScenes; ++scene)
    for (int i = 0; i < 4; ++i) {
      StabilityRun run;
      run.scene = static_cast<StabilityScene>(scene);
      run.delay_ms = kDelays_ms[i];
      run.ticks = ticks / kRuns;
      run.seed = static_cast<std::uint64_t>(10 * scene + i + 1);
      run.six_axes = six_axes;
      const StabilityResult r = run_stability(run);
      all.add(r);
      const int axes = six_axes ? 6 : 3;
      std::fprintf(stderr, "# %d axes, %s, %d ms: %llu contacts, %.5f mJ generated\n", axes, name(run.scene), run.delay_ms,
                   static_cast<unsigned long long>(r.episodes), r.generated_mj);
      std::printf(
          "%s{\"axes\": %d, \"scene\": \"%s\", \"delay_ms\": %d, \"ticks\": %lld, \"touching\": %lld, \"episodes\": %llu, "
          "\"generated_mj\": %.6f, \"worst_mj\": %.6f, \"net_mj\": %.3f, \"cutting_mj\": %.3f, \"turned_mj\": %.3f, "
          "\"held_back\": %lld, \"returned\": %lld, \"undone\": %llu}",
          six_axes || scene + i > 0 ? ", " : "", axes, name(run.scene), run.delay_ms, static_cast<long long>(r.ticks),
          static_cast<long long>(r.touching), static_cast<unsigned long long>(r.episodes), r.generated_mj, r.worst_mj, r.net_mj,
          r.cutting_mj, r.turned_mj, static_cast<long long>(r.held_back), static_cast<long long>(r.returned),
          static_cast<unsigned long long>(r.undone));
    }
  return all;
}

void print(const char* key, const StabilityResult& all) {
  std::printf(
      ", \"%s\": {\"ticks\": %lld, \"touching\": %lld, \"cutting\": %lld, \"uncovered\": %lld, \"episodes\": %llu, \"undone\": "
      "%llu, \"others_cuts\": %llu, \"generated_mj\": %.6f, \"worst_mj\": %.6f, \"net_mj\": %.3f, \"cutting_mj\": %.3f, "
      "\"least_cutting_n_mm\": %.9f, \"step_over_n\": %.6f, \"still_step_n\": %.6f, \"fall_n\": %.6f, \"late\": %lld, \"motor_over_n\": %.9f, \"motor_late_n\": "
      "%.9f, \"motor_most_n\": %.4f, \"force_most_n\": %.3f, \"thin_wall_deepest_mm\": %.4f, \"allocations\": %lld, "
      "\"turned_mj\": %.3f, \"torque_most_nmm\": %.3f, \"torque_over_nmm\": %.9f, \"turn_step_over_n\": %.6f, "
      "\"cut_step_over_n\": %.6f, \"cut_over_nmm\": %.9f, \"cut_late_nmm\": %.9f, \"cut_most_nmm\": %.3f}",
      key, static_cast<long long>(all.ticks), static_cast<long long>(all.touching), static_cast<long long>(all.cutting),
      static_cast<long long>(all.uncovered), static_cast<unsigned long long>(all.episodes),
      static_cast<unsigned long long>(all.undone), static_cast<unsigned long long>(all.others_cuts), all.generated_mj,
      all.worst_mj, all.net_mj, all.cutting_mj, all.least_cutting_n_mm, all.step_over_n, all.still_step_n, all.fall_n, static_cast<long long>(all.late), all.motor_over_n,
      all.motor_late_n, all.motor_most_n, all.force_most_n, all.deepest_mm, static_cast<long long>(all.allocations),
      all.turned_mj, all.torque_most_nmm, all.torque_over_nmm, all.turn_step_over_n, all.cut_step_over_n, all.cut_over_nmm,
      all.cut_late_nmm, all.cut_most_nmm);
}

}  // namespace

int main(int argc, char** argv) {
  const long ticks = argc > 1 ? std::atol(argv[1]) : 0;
  if (ticks < 20L * kRuns || ticks > 1'000'000'000L) {
    std::fprintf(stderr, "osteon-stability: needs the number of ticks, %d to 1000000000\n", 20 * kRuns);
    return 1;
  }
  std::printf("{\"runs\": [");
  const StabilityResult three = all_scenes(ticks, false), six = all_scenes(ticks, true);
  std::printf("]");
  print("three_axes", three);
  print("six_axes", six);
  std::printf("}\n");
  return 0;
}
