// The account of the energy that the coupling takes from the hand and gives back, by translation and by rotation. There
// is one account for each contact. It is the last monitor before the device. Time-domain passivity after Hannaford and
// Ryu (2002), made predictive: force is held for a tick, so the energy that it may give away is bounded before it is
// written, not corrected afterwards.
#pragma once
#include <cstdint>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

struct EnergyParams {
  double dt_s = 1e-3;
  double allowance_mj = 0.008;          // energy that one contact may give beyond what it got
  double tank_mj = 2.0;                 // largest part of the damping's work that is saved for later
  double surprise_mm_per_s2 = 10000.0;  // assumed largest acceleration of a hand and its device [A]
  // Smallest assumed acceleration. Where `wary` times the recent acceleration is larger, that is assumed, up to
  // surprise_mm_per_s2. [A]
  double calm_mm_per_s2 = 2000.0;
  double wary = 2.0, lately_s = 0.2;  // [A]
  double turn_arm_mm = 20.0;          // at this arm, a rotation's acceleration is assumed to equal a translation's [A]
};

// Force at the handle's tip, and torque about it.
struct Wrench {
  Vec3 force_n = Vec3::Zero(), torque_nmm = Vec3::Zero();
};

// Energies at the handle, mJ: force shown to the hand times the handle's path, and torque times its rotation:
// N·mm·rad.
struct EnergyReport {
  // Given to the hand and to cutting in this contact, minus what the hand put in. Negative: dissipated.
  double episode_mj = 0;
  double stored_mj = 0;        // in the coupling's springs
  double tank_mj = 0;          // damping's work that is available for material that comes back
  double ended_mj = 0;         // of the contact that ended in this tick; zero in other ticks
  double generated_mj = 0;     // sum over all contacts that ended above zero, from the start
  double worst_mj = 0;         // the most that one contact has generated
  std::uint64_t episodes = 0;  // number of contacts that have ended
  bool ended = false;
  bool held_back = false;  // the monitor cut the force
};

// One tick calls observe(), paid_n_per_mm(), settle(), draw(), limited(), in this order; all [haptic]. All vectors are
// in one frame of any orientation. Lengths are those of the handle's own motion.
class EnergyLedger {
 public:
  explicit EnergyLedger(const EnergyParams& params = {})
      : params_(params),
        moves_{.surprise_mm_per_s2 = params.surprise_mm_per_s2},
        turns_{.surprise_mm_per_s2 = params.surprise_mm_per_s2} {}

  // Another tool or the clutch: the stored energy is discarded.
  void reset() noexcept;
  // The handle's tip moved and the handle turned by this (axis times angle) under the force of the last limited().
  // Where no torque is shown, rotation does no work.
  void observe(const Vec3& handle_moved_mm, const Vec3& handle_turned_rad = Vec3::Zero()) noexcept;
  // Cutting must be paid for too. Returns the stiffness of a spring of this extension that holds the energy the hand
  // has put in, at most `stiffness_n_per_mm`. It is less than the real stiffness in the first millisecond of a contact,
  // before the hand has felt any of it.
  [[nodiscard]] double paid_n_per_mm(double stiffness_n_per_mm, double extension_mm) const noexcept;
  // Extension of a spring of that stiffness that the hand would have paid for, after this much more energy went into
  // cutting.
  [[nodiscard]] double paid_mm(double stiffness_n_per_mm, double cutting_mj) const noexcept;
  // Energy that the hand has put in, beside what is in the spring of the rotation, after this much more went into
  // cutting.
  [[nodiscard]] double paid_mj(double cutting_mj = 0.0) const noexcept;
  // What the proxy then did: the law's force times the path cut, and the springs' energy now. `turned_mj`: the part of
  // it in the spring of the rotation, which cuts nothing.
  void settle(double cutting_mj, double stored_mj, double turned_mj = 0.0) noexcept;
  // Raises the stored energy by at most this much, out of the tank. Returns the permitted increase.
  [[nodiscard]] double draw(double wanted_mj) noexcept;
  // The wrench to show in the next tick. Force and torque are reduced by one share of `wanted`. `damping`: the part of
  // `wanted` that is damping. The contact lasts as long as `touching`, even where safety asks for no force.
  [[nodiscard]] Wrench limited(const Wrench& wanted, const Wrench& damping, bool touching) noexcept;

  [[nodiscard]] const EnergyReport& report() const noexcept { return report_; }

 private:
  // The handle's motion, as far as it can be predicted.
  struct Going {
    Vec3 moved_mm = Vec3::Zero();  // in the last tick; of a rotation, at the arm
    double surprise_mm_per_s2;     // acceleration that is assumed now
    void see(const Vec3& now_mm, const EnergyParams& params) noexcept;
    // Largest energy that this force gives the hand when it is held for a tick.
    [[nodiscard]] double most_mj(const Vec3& force_n, double dt_s) const noexcept;
  };

  EnergyParams params_;
  EnergyReport report_;
  Wrench shown_, damping_;  // held since the last tick
  Going moves_, turns_;
  double account_mj_ = 0;  // put in by the hand and not spent: in the spring or in the tank
  double filled_mj_ = 0;   // by damping, in this tick
  double turned_mj_ = 0;   // the part of the stored energy in the spring of the rotation
  bool open_ = false;      // a contact is under way
};

}  // namespace osteon::haptic
