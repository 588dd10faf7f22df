#include "haptic_client/control/energy_ledger.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::haptic {

void EnergyLedger::reset() noexcept {
  force_n_.setZero();
  damping_n_.setZero();
  moved_mm_.setZero();
  account_mj_ = filled_mj_ = 0.0;
  report_.episode_mj = report_.stored_mj = report_.tank_mj = report_.ended_mj = 0.0;
  report_.ended = report_.held_back = open_ = false;
  surprise_mm_per_s2_ = params_.surprise_mm_per_s2;
}

void EnergyLedger::observe(const Vec3& handle_moved_mm) noexcept {
  report_.ended = report_.held_back = false;
  report_.ended_mj = 0.0;
  const double given_mj = force_n_.dot(handle_moved_mm);
  account_mj_ -= given_mj;
  report_.episode_mj += given_mj;
  filled_mj_ = std::max(0.0, -damping_n_.dot(handle_moved_mm));
  // Who has held still surprises little: else a slow, light feed would be held back for good.
  const double seen = params_.wary * (handle_moved_mm - moved_mm_).norm() / (params_.dt_s * params_.dt_s);
  const double fading = surprise_mm_per_s2_ * std::exp(-params_.dt_s / params_.lately_s);
  surprise_mm_per_s2_ = std::min(params_.surprise_mm_per_s2, std::max({seen, fading, params_.calm_mm_per_s2}));
  moved_mm_ = handle_moved_mm;
}

void EnergyLedger::settle(double cutting_mj, double stored_mj) noexcept {
  account_mj_ -= cutting_mj;
  report_.episode_mj += cutting_mj;
  report_.stored_mj = stored_mj;
  // The tank holds what damping took, as far as sampling has not given it back already. What the spring lost otherwise, by
  // cutting, sliding or slack, is gone: it may not be given back later.
  report_.tank_mj = std::min({report_.tank_mj + filled_mj_, std::max(0.0, account_mj_ - stored_mj), params_.tank_mj});
  account_mj_ = std::min(account_mj_, stored_mj + report_.tank_mj);
}

double EnergyLedger::paid_n_per_mm(double stiffness_n_per_mm, double extension_mm) const noexcept {
  const double paid_mj = std::max(0.0, account_mj_ + params_.allowance_mj);
  const double square = extension_mm * extension_mm;
  return 2.0 * paid_mj >= stiffness_n_per_mm * square ? stiffness_n_per_mm : 2.0 * paid_mj / square;
}

double EnergyLedger::draw(double wanted_mj) noexcept {
  const double drawn_mj = std::clamp(wanted_mj, 0.0, report_.tank_mj);
  report_.tank_mj -= drawn_mj;
  report_.stored_mj += drawn_mj;
  return drawn_mj;
}

Vec3 EnergyLedger::limited(const Vec3& wanted_n, const Vec3& damping_n, bool touching) noexcept {
  const double wanted = wanted_n.norm();
  force_n_.setZero();
  damping_n_.setZero();
  if (!touching) {
    if (!open_) return force_n_;
    open_ = false;
    report_.ended = true;
    report_.ended_mj = report_.episode_mj;
    ++report_.episodes;
    report_.generated_mj += std::max(0.0, report_.episode_mj);
    report_.worst_mj = std::max(report_.worst_mj, report_.episode_mj);
    // A contact that gave a little goes on paying in the next one, so that a thousand of them do not add up.
    account_mj_ = std::clamp(0.5 * account_mj_, -0.5 * params_.allowance_mj, 0.0);
    report_.episode_mj = report_.tank_mj = report_.stored_mj = 0.0;
    return force_n_;
  }
  open_ = true;
  if (!(wanted > 0.0)) return force_n_;
  // Held for a tick while the handle goes on as it did, give or take what it can accelerate.
  const double out_mm = moved_mm_.dot(wanted_n) / wanted + surprise_mm_per_s2_ * params_.dt_s * params_.dt_s;
  const double given_mj = wanted * out_mm, most_mj = std::max(0.0, account_mj_ + params_.allowance_mj);
  double share = 1.0;
  if (given_mj > most_mj) {
    share = most_mj / given_mj;
    report_.held_back = true;
  }
  force_n_ = share * wanted_n;
  damping_n_ = share * damping_n;
  return force_n_;
}

}  // namespace osteon::haptic
