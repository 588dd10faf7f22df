// A spring that pulls a client's handle to where another's handle is. The spring's far end follows the other handle.
//
//   F = k (a - h) - b v,   k from none to the whole in ramp_s, and back in fade_s
//
// The far end a begins at the handle h. It moves along with the other's position, low-passed, and closes the remaining
// distance at a bounded speed. It is never farther away than the force's bound over k. So nothing jumps when the pull
// begins or ends.
//
// The handle receives only the energy that the far end's own motion has put into the spring. Raising k shortens a - h
// by as much as keeps the energy the same. The energy ledger limits the rest, in an account for this pull alone.
// Contact that held the pull back may decrease at once. Then the pull makes the sum of both grow slowly (slew.hpp), in
// any direction, for as long as that takes.
#pragma once
#include <cstdint>
#include <limits>

#include "common/geometry/pose.hpp"
#include "haptic_client/rendering/energy_ledger.hpp"

namespace osteon::haptic {

struct GuidanceSpringParams {
  double dt_s = 1e-3;
  double stiffness_n_per_mm = 6.0;  // at the handle, for the full share
  double most_n = 30.0;             // likewise
  double smooth_s = 0.02;           // each of two low passes: states come 30 to 120 times a second [A]
  double ramp_s = 0.4, fade_s = 0.25;
  double closing_mm_per_s = 60.0;  // closing speed of the handle, in addition to the other's own motion [A]
  double most_mm_per_s = 400.0;    // speed of the other's motion that is followed at once [A]
  double damping_s = 0.015;        // b / k [A]
  double silence_s = 0.25;         // the pull fades when no new state of the other was received for so long
};
// Parameters as firm as a device permits. It can hold an offset of 5 mm for long, and no wall is felt beside the pull.
[[nodiscard]] GuidanceSpringParams guide_pull_params(double device_n_per_mm, double continuous_n, double dt_s);

// Where the guiding handle was last seen.
struct GuideSeen {
  bool there = false;
  std::uint64_t state_seq = 0;   // rises with each of its states
  Vec3 place_mm = Vec3::Zero();  // of its handle, bone frame
};

struct GuideMoment {
  Vec3 handle_mm = Vec3::Zero();   // device frame, as all vectors here
  Vec3 guide_mm = Vec3::Zero();    // the other's position: smoothed_mm() of the tick before this, mapped to the device
  double share = 0;                // 0 … 1
  double room_n = 0;               // force that the device's limit leaves
  double slew_n = 0;               // permitted growth of force in this tick
  Vec3 rest_n = Vec3::Zero();      // other force that is shown
  Vec3 together_n = Vec3::Zero();  // total force shown in the last tick, including the pull
  double together_slew_n = std::numeric_limits<double>::infinity();  // permitted growth of both together
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
  bool known_ = false;  // a state was received after the last silence
  Vec3 raw_mm_ = Vec3::Zero(), first_mm_ = Vec3::Zero(), second_mm_ = Vec3::Zero();  // bone frame
  double k_n_per_mm_ = 0;
  Vec3 far_mm_ = Vec3::Zero(), guide_mm_ = Vec3::Zero(), handle_mm_ = Vec3::Zero();  // device frame, of the last tick
  bool placed_ = false;                                                              // these are known
  Vec3 force_n_ = Vec3::Zero();
};

}  // namespace osteon::haptic
