// What the coupling between handle and tool takes from the hand and gives back, by its moves and by its turns: an
// account for each contact, and the last monitor before the device. Time-domain passivity after Hannaford and Ryu
// (2002), made predictive: force is held for a tick, so what it may give away is bounded before it is written, not
// mended after.
#pragma once
#include <cstdint>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

struct EnergyParams {
  double dt_s = 1e-3;
  double allowance_mj = 0.008;          // that one contact may give more than it got
  double tank_mj = 2.0;                 // most of the damping's work that is kept for later
  double surprise_mm_per_s2 = 10000.0;  // a hand and its device are taken to accelerate less than this [A]
  double calm_mm_per_s2 = 2000.0;  // and less than this, or `wary` times what they did lately, while that is less [A]
  double wary = 2.0, lately_s = 0.2;  // [A]
  double turn_arm_mm = 20.0;          // at this arm a turn is taken to surprise as a move does [A]
};

// Force at the handle's tip, and torque about it.
struct Wrench {
  Vec3 force_n = Vec3::Zero(), torque_nmm = Vec3::Zero();
};

// Energies at the handle, mJ: force shown to the hand times the way of the handle, and torque times its turn: N·mm·rad.
struct EnergyReport {
  double episode_mj =
      0;  // given to the hand and to cutting in this contact, less what the hand put in; negative: dissipated
  double stored_mj = 0;        // in the coupling's springs
  double tank_mj = 0;          // of damping's work, at hand for material that comes back
  double ended_mj = 0;         // of the contact that ended in this tick; zero in others
  double generated_mj = 0;     // over all contacts that ended above zero, from the start
  double worst_mj = 0;         // the most that one contact has generated
  std::uint64_t episodes = 0;  // that have ended
  bool ended = false;
  bool held_back = false;  // the monitor cut the force
};

// One tick: observe(), paid_n_per_mm(), settle(), draw(), limited(), in this order; all [haptic]. Vectors in one frame
// of any orientation, lengths of the handle's own motion.
class EnergyLedger {
 public:
  explicit EnergyLedger(const EnergyParams& params = {})
      : params_(params),
        moves_{.surprise_mm_per_s2 = params.surprise_mm_per_s2},
        turns_{.surprise_mm_per_s2 = params.surprise_mm_per_s2} {}

  // Another tool, or the clutch: what was stored is gone.
  void reset() noexcept;
  // The handle's tip moved and the handle turned by this (axis times angle) under what the last limited() gave. Where
  // no torque is shown turning does no work.
  void observe(const Vec3& handle_moved_mm, const Vec3& handle_turned_rad = Vec3::Zero()) noexcept;
  // Cutting too must be paid for: the spring, at most this stiff and this long, as stiff as what the hand has put into
  // it. It falls short of the real one in the first millisecond of a contact, before the hand has felt any of it.
  [[nodiscard]] double paid_n_per_mm(double stiffness_n_per_mm, double extension_mm) const noexcept;
  // How long a spring of that stiffness would be that the hand had paid for, when this much more has gone into cutting.
  [[nodiscard]] double paid_mm(double stiffness_n_per_mm, double cutting_mj) const noexcept;
  // What the proxy did then: the law's force times the way cut, and the springs' energy as it is now. `turned_mj`: what
  // of it is in the spring of the turn, which cuts nothing.
  void settle(double cutting_mj, double stored_mj, double turned_mj = 0.0) noexcept;
  // Raises the stored energy by at most this, out of the tank; what it may be raised by.
  [[nodiscard]] double draw(double wanted_mj) noexcept;
  // What to show in the next tick, force and torque held back by one share of `wanted`; `damping`: its part that is
  // damping. The contact lasts as long as `touching`, also where safety asks for no force.
  [[nodiscard]] Wrench limited(const Wrench& wanted, const Wrench& damping, bool touching) noexcept;

  [[nodiscard]] const EnergyReport& report() const noexcept { return report_; }

 private:
  // How the handle goes on, as far as that can be foreseen.
  struct Going {
    Vec3 moved_mm = Vec3::Zero();  // in the last tick; of a turn, at the arm
    double surprise_mm_per_s2;     // that is reckoned with now
    void see(const Vec3& now_mm, const EnergyParams& params) noexcept;
    // Most that this force gives the hand, held for a tick.
    [[nodiscard]] double most_mj(const Vec3& force_n, double dt_s) const noexcept;
  };

  EnergyParams params_;
  EnergyReport report_;
  Wrench shown_, damping_;  // held since the last tick
  Going moves_, turns_;
  double account_mj_ = 0;  // put in by the hand and still there: in the spring, or in the tank
  double filled_mj_ = 0;   // by damping, in this tick
  double turned_mj_ = 0;   // of what is stored, in the spring of the turn
  bool open_ = false;      // a contact is under way
};

}  // namespace osteon::haptic
