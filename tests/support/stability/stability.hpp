// A hand at the haptic loop for any number of ticks, in pure virtual time. It strokes, presses and cuts, while a room
// behind a slow network lets others cut under it and undoes cuts. The energy that the loop gives the hand is computed
// from outside, only from forces and torques written and poses read.
#pragma once
#include <cstdint>

#include "haptic_client/device/simulated_device.hpp"
#include "haptic_client/rendering/force_scaling.hpp"

namespace osteon::test {

enum class StabilityScene : std::uint8_t { stroke, cavity, thin_wall, burr, drill };
inline constexpr int kStabilityScenes = 5;
[[nodiscard]] const char* name(StabilityScene scene);

struct StabilityRun {
  StabilityScene scene = StabilityScene::stroke;
  std::int64_t ticks = 50'000;
  int delay_ms = 0;  // one way
  double dt_s = 1e-3;
  bool others = true;  // cut near the tool, and undo under it
  // The device also shows torque. The hand tilts its handle by up to 15 degrees and yields to that torque.
  bool six_axes = false;
  haptic::ForceChoice choice = haptic::ForceChoice::proportional;
  std::uint64_t seed = 1;
};

struct StabilityResult {
  std::int64_t ticks = 0, late = 0, touching = 0, cutting = 0, uncovered = 0, held_back = 0, returned = 0,
               slew_limited = 0;
  std::uint64_t episodes = 0, others_cuts = 0, undone = 0;
  double generated_mj = 0;   // over all contacts that gave more than they got
  double worst_mj = 0;       // most of one contact
  double hand_worst_mj = 0;  // likewise of the hand alone, without what went into cutting
  double budget_over_n = 0;  // of the whole force over the device's continuous force
  double cue_most_n = 0;
  double still_off_n = 0;  // while the handle stood still: of the coupling's force from the closed form of its scaling
  std::int64_t still = 0;  // number of such ticks with force
  double net_mj = 0;       // over all contacts; negative: what the coupling took
  double cutting_mj = 0;   // work of the cutting forces, at the handle
  double least_cutting_n_mm = 0;  // of all ticks' F_cut · dx
  // Ticks that had to be made rubbing for that, because turning pushed back what was cut, and the largest work that one
  // would have given.
  std::int64_t pushed_back = 0;
  double pushed_back_most_mj = 0;
  double step_over_n =
      0;  // growth of force in a tick that neither the hand's motion nor the slew limit explains; 0: none
  // Fall of force in a tick beyond the slew limit and what the hand's and the tool's motion explain: caused by the
  // monitor. Breakthroughs and safety zeros are left out.
  double fall_n = 0;
  double still_step_n = 0;  // growth of force in a tick while the handle stood still
  // The same of torque, over the arm of a turn. The cut's moment is not included, as it is not the hand's.
  double turn_step_over_n = 0;
  double cut_step_over_n = 0;
  double cut_over_nmm = 0;  // of the cut's moment over the force shown at the arm of a turn
  double cut_late_nmm = 0;  // of the cut's moment later than 10 ms after the pedal
  double cut_most_nmm = 0;
  double torque_most_nmm = 0;
  double turned_mj = 0;        // put in by the hand by turning, in total
  double torque_over_nmm = 0;  // beyond the device's limit
  double motor_over_n = 0;     // of the motor's force over s · mu · normal force
  double motor_late_n = 0;     // of the motor's force later than 10 ms after the pedal
  double motor_most_n = 0;
  double force_most_n = 0;
  double deepest_mm = 0;  // thin wall: of the tool's tip beyond its near face
  std::int64_t allocations = 0;
  void add(const StabilityResult& other);
};
[[nodiscard]] StabilityResult run_stability(const StabilityRun& run);

}  // namespace osteon::test
