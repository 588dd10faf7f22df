// What the coupling between handle and tool takes from the hand and gives back: an account for each contact, and the last
// monitor before the device. Time-domain passivity after Hannaford and Ryu (2002), made predictive: force is held for a
// tick, so what it may give away is bounded before it is written, not mended after.
#pragma once
#include <cstdint>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

struct EnergyParams {
  double dt_s = 1e-3;
  double allowance_mj = 0.008;            // that one contact may give more than it got
  double tank_mj = 2.0;                   // most of the damping's work that is kept for later
  double surprise_mm_per_s2 = 10000.0;    // a hand and its device are taken to accelerate less than this [A]
  double calm_mm_per_s2 = 2000.0;         // and less than this, or `wary` times what they did lately, while that is less [A]
  double wary = 2.0, lately_s = 0.2;      // [A]
};

// Energies at the handle, mJ: force shown to the hand times the way of the handle.
struct EnergyReport {
  double episode_mj = 0;     // given to the hand and to cutting in this contact, less what the hand put in; negative: dissipated
  double stored_mj = 0;      // in the coupling's spring
  double tank_mj = 0;        // of damping's work, at hand for material that comes back
  double ended_mj = 0;       // of the contact that ended in this tick; zero in others
  double generated_mj = 0;   // over all contacts that ended above zero, from the start
  double worst_mj = 0;       // the most that one contact has generated
  std::uint64_t episodes = 0;  // that have ended
  bool ended = false;
  bool held_back = false;    // the monitor cut the force
};

// One tick: observe(), paid_n_per_mm(), settle(), draw(), limited(), in this order; all [haptic]. Vectors in one frame of any
// orientation, lengths of the handle's own motion.
class EnergyLedger {
 public:
  explicit EnergyLedger(const EnergyParams& params = {}) : params_(params), surprise_mm_per_s2_(params.surprise_mm_per_s2) {}

  // Another tool, or the clutch: what was stored is gone.
  void reset() noexcept;
  // The handle moved by this under the force of the last limited().
  void observe(const Vec3& handle_moved_mm) noexcept;
  // Cutting too must be paid for: the spring, at most this stiff and this long, as stiff as what the hand has put into it.
  // It falls short of the real one in the first millisecond of a contact, before the hand has felt any of it.
  [[nodiscard]] double paid_n_per_mm(double stiffness_n_per_mm, double extension_mm) const noexcept;
  // What the proxy did then: the law's force times the way cut, and the spring's energy as it is now.
  void settle(double cutting_mj, double stored_mj) noexcept;
  // Raises the stored energy by at most this, out of the tank; what it may be raised by.
  [[nodiscard]] double draw(double wanted_mj) noexcept;
  // The force to show in the next tick, no more than `wanted_n`; `damping_n`: its part that is damping. The contact lasts
  // as long as `touching`, also where safety asks for no force.
  [[nodiscard]] Vec3 limited(const Vec3& wanted_n, const Vec3& damping_n, bool touching) noexcept;

  [[nodiscard]] const EnergyReport& report() const noexcept { return report_; }

 private:
  EnergyParams params_;
  EnergyReport report_;
  Vec3 force_n_ = Vec3::Zero(), damping_n_ = Vec3::Zero();  // held since the last tick
  Vec3 moved_mm_ = Vec3::Zero();                            // in the last tick
  double surprise_mm_per_s2_;                               // that is reckoned with now
  double account_mj_ = 0;   // put in by the hand and still there: in the spring, or in the tank
  double filled_mj_ = 0;    // by damping, in this tick
  bool open_ = false;       // a contact is under way
};

}  // namespace osteon::haptic
