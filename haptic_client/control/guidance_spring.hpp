// A hand that another's leads: its handle is drawn to where the other's is by a spring whose far end follows the
// other's.
//
//   F = k (a - h) - b v,   k from none to the whole in ramp_s, and back in fade_s
//
// The far end a begins at the handle h, goes along with the other's place, low-passed, and makes up the way between
// them at a bounded speed; it is never farther off than the force's bound over k. So nothing jumps wherever the pull
// begins or ends. What the handle is given is what the far end's own motion has put into the spring: raising k shortens
// a - h as much as keeps the energy the same, the rest is the energy ledger's, an account of this pull's own. Where
// contact lessens at once that held the pull back, the pull is what makes the sum of both grow slowly (slew.hpp), in
// whatever direction, for as long as that takes.
#pragma once
#include <cstdint>
#include <limits>

#include "common/geometry/pose.hpp"
#include "haptic_client/control/energy_ledger.hpp"

namespace osteon::haptic {

struct GuidanceSpringParams {
  double dt_s = 1e-3;
  double stiffness_n_per_mm = 6.0;  // at the handle, of a whole share
  double most_n = 30.0;             // likewise
  double smooth_s = 0.02;           // each of two low passes: states come 30 to 120 times a second [A]
  double ramp_s = 0.4, fade_s = 0.25;
  double closing_mm_per_s = 60.0;  // of the handle, on top of the other's own motion [A]
  double most_mm_per_s = 400.0;    // of the other's motion that is followed at once [A]
  double damping_s = 0.015;        // b / k [A]
  double silence_s = 0.25;         // without a new state of the other the pull fades
};
// As firm as a device may be led: 5 mm off is what it can hold for long, and no wall is felt beside it.
[[nodiscard]] GuidanceSpringParams guide_pull_params(double device_n_per_mm, double continuous_n, double dt_s);

// Where the guiding hand was seen last.
struct GuideSeen {
  bool there = false;
  std::uint64_t state_seq = 0;   // rises with each state of it
  Vec3 place_mm = Vec3::Zero();  // of its handle, bone frame
};

struct GuideMoment {
  Vec3 handle_mm = Vec3::Zero();   // device frame, as all here
  Vec3 guide_mm = Vec3::Zero();    // the other's place, as smoothed_mm() of the tick before this maps to the device
  double share = 0;                // 0 … 1
  double room_n = 0;               // that the device's limit leaves
  double slew_n = 0;               // growth of force in this tick
  Vec3 rest_n = Vec3::Zero();      // shown besides it
  Vec3 together_n = Vec3::Zero();  // shown in the last tick, the pull too
  double together_slew_n = std::numeric_limits<double>::infinity();  // growth of both together
  bool safe = true;                                                  // false: no force, and the pull begins anew
};

class GuidanceSpring {
 public:
  explicit GuidanceSpring(const GuidanceSpringParams& params = {})
      : params_(params), ledger_(EnergyParams{.dt_s = params.dt_s}) {}

  // [haptic] The handle was put elsewhere: the pull begins anew.
  void reset() noexcept;
  // [haptic] Once a tick, before step(): follows what was seen. Bone frame.
  void see(const GuideSeen& seen) noexcept;
  [[nodiscard]] const Vec3& smoothed_mm() const noexcept { return second_mm_; }
  // [haptic] Force on the handle, held for this tick.
  [[nodiscard]] Vec3 step(const GuideMoment& moment) noexcept;
  [[nodiscard]] const Vec3& force_n() const noexcept { return force_n_; }  // of the last step
  [[nodiscard]] bool pulls() const noexcept { return k_n_per_mm_ > 0.0; }
  [[nodiscard]] const EnergyReport& energy() const noexcept { return ledger_.report(); }

 private:
  [[nodiscard]] bool fresh() const noexcept { return known_ && silent_s_ < params_.silence_s; }
  void move_far_end(const GuideMoment& moment) noexcept;

  GuidanceSpringParams params_;
  EnergyLedger ledger_;
  std::uint64_t state_seq_ = 0;
  double silent_s_ = 0;
  bool known_ = false;  // a state has come since there was none
  Vec3 raw_mm_ = Vec3::Zero(), first_mm_ = Vec3::Zero(), second_mm_ = Vec3::Zero();  // bone frame
  double k_n_per_mm_ = 0;
  Vec3 far_mm_ = Vec3::Zero(), guide_mm_ = Vec3::Zero(), handle_mm_ = Vec3::Zero();  // device frame, of the last tick
  bool placed_ = false;                                                              // these are known
  Vec3 force_n_ = Vec3::Zero();
};

}  // namespace osteon::haptic
