// A million ticks of a hand at the haptic loop on virtual time. It strokes, presses into a cavity and a thin wall, burs
// and drills, while others cut and bone is undone, with 0 to 200 ms to the room. Runs as many again on devices that
// show torque, with a hand that turns. Takes the number of ticks of each and prints JSON.
#include <cstdio>
#include <cstdlib>
#include <utility>

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
      std::fprintf(stderr, "# %d axes, %s, %d ms: %llu contacts, %.5f mJ generated\n", axes, name(run.scene),
                   run.delay_ms, static_cast<unsigned long long>(r.episodes), r.generated_mj);
      std::printf(
          "%s{\"axes\": %d, \"scene\": \"%s\", \"delay_ms\": %d, \"ticks\": %lld, \"touching\": %lld, \"episodes\": "
          "%llu, "
          "\"generated_mj\": %.6f, \"worst_mj\": %.6f, \"net_mj\": %.3f, \"cutting_mj\": %.3f, \"turned_mj\": %.3f, "
          "\"held_back\": %lld, \"returned\": %lld, \"undone\": %llu}",
          six_axes || scene + i > 0 ? ", " : "", axes, name(run.scene), run.delay_ms, static_cast<long long>(r.ticks),
          static_cast<long long>(r.touching), static_cast<unsigned long long>(r.episodes), r.generated_mj, r.worst_mj,
          r.net_mj, r.cutting_mj, r.turned_mj, static_cast<long long>(r.held_back), static_cast<long long>(r.returned),
          static_cast<unsigned long long>(r.undone));
    }
  return all;
}

void print(const char* key, const StabilityResult& all) {
  const std::pair<const char*, double> values[] = {
      {"ticks", static_cast<double>(all.ticks)},
      {"touching", static_cast<double>(all.touching)},
      {"cutting", static_cast<double>(all.cutting)},
      {"uncovered", static_cast<double>(all.uncovered)},
      {"late", static_cast<double>(all.late)},
      {"episodes", static_cast<double>(all.episodes)},
      {"undone", static_cast<double>(all.undone)},
      {"others_cuts", static_cast<double>(all.others_cuts)},
      {"allocations", static_cast<double>(all.allocations)},
      {"generated_mj", all.generated_mj},
      {"worst_mj", all.worst_mj},
      {"net_mj", all.net_mj},
      {"cutting_mj", all.cutting_mj},
      {"turned_mj", all.turned_mj},
      {"least_cutting_n_mm", all.least_cutting_n_mm},
      {"pushed_back", static_cast<double>(all.pushed_back)},
      {"pushed_back_most_mj", all.pushed_back_most_mj},
      {"step_over_n", all.step_over_n},
      {"still_step_n", all.still_step_n},
      {"fall_n", all.fall_n},
      {"force_most_n", all.force_most_n},
      {"motor_over_n", all.motor_over_n},
      {"motor_late_n", all.motor_late_n},
      {"motor_most_n", all.motor_most_n},
      {"thin_wall_deepest_mm", all.deepest_mm},
      {"torque_most_nmm", all.torque_most_nmm},
      {"torque_over_nmm", all.torque_over_nmm},
      {"turn_step_over_n", all.turn_step_over_n},
      {"cut_step_over_n", all.cut_step_over_n},
      {"cut_over_nmm", all.cut_over_nmm},
      {"cut_late_nmm", all.cut_late_nmm},
      {"cut_most_nmm", all.cut_most_nmm},
  };
  std::printf(", \"%s\": {", key);
  for (const auto& [name, value] : values)
    std::printf("%s\"%s\": %.10g", name == values[0].first ? "" : ", ", name, value);
  std::printf("}");
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
