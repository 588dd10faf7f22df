#include "haptic_client/rendering/energy_ledger.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::haptic {

// Assumes a small acceleration of a hand that has held still. Otherwise a slow, light feed would be held back
// permanently.
void EnergyLedger::Going::see(const Vec3& now_mm, const EnergyParams& params) noexcept {
  const double seen = params.wary * (now_mm - moved_mm).norm() / (params.dt_s * params.dt_s);
  const double fading = surprise_mm_per_s2 * std::exp(-params.dt_s / params.lately_s);
  surprise_mm_per_s2 = std::min(params.surprise_mm_per_s2, std::max({seen, fading, params.calm_mm_per_s2}));
  moved_mm = now_mm;
}

// The handle continues its motion, changed at most by the assumed acceleration.
double EnergyLedger::Going::most_mj(const Vec3& force_n, double dt_s) const noexcept {
  const double size_n = force_n.norm();
  return size_n > 0.0 ? size_n * (moved_mm.dot(force_n) / size_n + surprise_mm_per_s2 * dt_s * dt_s) : 0.0;
}

void EnergyLedger::reset() noexcept {
  shown_ = damping_ = {};
  moves_ = turns_ = {.surprise_mm_per_s2 = params_.surprise_mm_per_s2};
  account_mj_ = filled_mj_ = turned_mj_ = 0.0;
  report_.episode_mj = report_.stored_mj = report_.tank_mj = report_.ended_mj = 0.0;
  report_.ended = report_.held_back = open_ = false;
}

void EnergyLedger::observe(const Vec3& handle_moved_mm, const Vec3& handle_turned_rad) noexcept {
  report_.ended = report_.held_back = false;
  report_.ended_mj = 0.0;
  const auto work_mj = [&](const Wrench& held) {
    return held.force_n.dot(handle_moved_mm) + held.torque_nmm.dot(handle_turned_rad);
  };
  const double given_mj = work_mj(shown_);
  account_mj_ -= given_mj;
  report_.episode_mj += given_mj;
  filled_mj_ = std::max(0.0, -work_mj(damping_));
  moves_.see(handle_moved_mm, params_);
  turns_.see(params_.turn_arm_mm * handle_turned_rad, params_);
}

void EnergyLedger::settle(double cutting_mj, double stored_mj, double turned_mj) noexcept {
  turned_mj_ = turned_mj;
  account_mj_ -= cutting_mj;
  report_.episode_mj += cutting_mj;
  report_.stored_mj = stored_mj;
  // The tank holds what damping took, minus what sampling has already given back. What the spring lost in other ways,
  // by cutting, sliding or slack, must not be given back later.
  report_.tank_mj = std::min({report_.tank_mj + filled_mj_, std::max(0.0, account_mj_ - stored_mj), params_.tank_mj});
  account_mj_ = std::min(account_mj_, stored_mj + report_.tank_mj);
}

double EnergyLedger::paid_n_per_mm(double stiffness_n_per_mm, double extension_mm) const noexcept {
  const double paid_mj = std::max(0.0, account_mj_ - turned_mj_ + params_.allowance_mj);
  const double square = extension_mm * extension_mm;
  return 2.0 * paid_mj >= stiffness_n_per_mm * square ? stiffness_n_per_mm : 2.0 * paid_mj / square;
}

double EnergyLedger::paid_mm(double stiffness_n_per_mm, double cutting_mj) const noexcept {
  const double paid_mj = account_mj_ - turned_mj_ - cutting_mj + params_.allowance_mj;
  return std::sqrt(2.0 * std::max(0.0, paid_mj) / stiffness_n_per_mm);
}

double EnergyLedger::paid_mj(double cutting_mj) const noexcept {
  return std::max(0.0, account_mj_ - turned_mj_ - cutting_mj + params_.allowance_mj);
}

double EnergyLedger::draw(double wanted_mj) noexcept {
  const double drawn_mj = std::clamp(wanted_mj, 0.0, report_.tank_mj);
  report_.tank_mj -= drawn_mj;
  report_.stored_mj += drawn_mj;
  return drawn_mj;
}

Wrench EnergyLedger::limited(const Wrench& wanted, const Wrench& damping, bool touching) noexcept {
  shown_ = damping_ = {};
  if (!touching) {
    if (!open_) return shown_;
    open_ = false;
    report_.ended = true;
    report_.ended_mj = report_.episode_mj;
    ++report_.episodes;
    report_.generated_mj += std::max(0.0, report_.episode_mj);
    report_.worst_mj = std::max(report_.worst_mj, report_.episode_mj);
    // A contact that gave a little pays for it in the next one, so that a thousand of them do not add up.
    account_mj_ = std::clamp(0.5 * account_mj_, -0.5 * params_.allowance_mj, 0.0);
    report_.episode_mj = report_.tank_mj = report_.stored_mj = turned_mj_ = 0.0;
    return shown_;
  }
  open_ = true;
  const double given_mj = moves_.most_mj(wanted.force_n, params_.dt_s) +
                          turns_.most_mj(wanted.torque_nmm / params_.turn_arm_mm, params_.dt_s);
  const double most_mj = std::max(0.0, account_mj_ + params_.allowance_mj);
  double share = 1.0;
  if (given_mj > most_mj) {
    share = most_mj / given_mj;
    report_.held_back = true;
  }
  shown_ = {share * wanted.force_n, share * wanted.torque_nmm};
  damping_ = {share * damping.force_n, share * damping.torque_nmm};
  return shown_;
}

}  // namespace osteon::haptic
