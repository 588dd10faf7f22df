// A model of the surgeon's hand on the handle: a mass on a spring and a damper. The rest position of the spring follows
// the tool, and the hand pushes along the axis: M a = F g(t) + K (x_e - x) - B v - f, x_e' = (x - x_e) / 0.3 s. At
// breakthrough the rest position freezes, and after the reaction time the push decays. Across the axis the hand is
// stiff. Frame: that of the caller.
#pragma once
#include <cstdint>

#include "common/geometry/pose.hpp"

namespace osteon {

// Reference values, physical (for a device that shows the physical force unscaled).
struct HandParams {
  double mass_kg = 2.5;
  double damping_n_s_per_mm = 0.235;
  double stiffness_n_per_mm = 5.5;
  double push_n = 29.0;
  double follow_s = 0.3;     // the rest position follows the tool with this time constant
  double rise_s = 0.15;      // from contact to the full push
  double reaction_s = 0.15;  // after breakthrough until the push begins to decay
  double release_s = 0.05;   // time constant of that decay
  double lateral_n_per_mm = 20.0;
};
[[nodiscard]] HandParams expert_hand();
[[nodiscard]] HandParams novice_hand();
// For a device that renders physical force times `force` and whose handle moves 1 / `length` as far as the tool. The
// tool's motions stay the same.
[[nodiscard]] HandParams scaled(const HandParams& hand, double force, double length = 1.0);

enum class HandMode : std::uint8_t {
  carry,    // the command sets the rest position; no push
  push,     // pushes along the axis; the rest position follows
  release,  // after breakthrough: the rest position is frozen and the push decays
  rig,      // no hand: a machine holds the handle exactly at the target
};

struct HandCommand {
  HandMode mode = HandMode::carry;
  Vec3 target_mm = Vec3::Zero();  // rest position (carry), held position (rig), any point of the line of push
  Vec3 axis = Vec3::UnitZ();      // unit direction of push
};

class Hand {
 public:
  explicit Hand(const HandParams& params, const Vec3& at_mm) : params_(params), position_mm_(at_mm), rest_mm_(at_mm) {}

  // `force_n`: force of the device on the hand.
  void step(const HandCommand& command, const Vec3& force_n, double dt_s) noexcept;
  // Moves the handle to another position at rest, as when a tool is picked up.
  void place(const Vec3& at_mm) noexcept;
  void set_params(const HandParams& params) noexcept { params_ = params; }

  [[nodiscard]] const HandParams& params() const noexcept { return params_; }
  [[nodiscard]] const Vec3& position_mm() const noexcept { return position_mm_; }
  [[nodiscard]] const Vec3& velocity_mm_per_s() const noexcept { return velocity_mm_per_s_; }
  [[nodiscard]] const Vec3& rest_mm() const noexcept { return rest_mm_; }

 private:
  HandParams params_;
  HandMode mode_ = HandMode::carry;
  double in_mode_s_ = 0;
  double push_n_ = 0;
  Vec3 position_mm_;
  Vec3 velocity_mm_per_s_ = Vec3::Zero();
  Vec3 rest_mm_;
};

}  // namespace osteon
