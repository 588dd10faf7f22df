#include "haptic_client/rendering/coupling.hpp"

#include <algorithm>
#include <cmath>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {
namespace {

constexpr double kBleed = 0.1;  // share of the handle's free motion
// With less force a burr leaves bone a hundred times a second; nobody feels that plunge [A].
constexpr double kLeastToRelease_n = 3.0;
constexpr double kNothing_mm = 1e-9;

}  // namespace

void Coupling::reset(const Vec3& handle_mm, const Vec3& proxy_mm) noexcept {
  slack_mm_.setZero();
  returned_mm_.setZero();
  smooth_.reset(Vec3::Zero());
  extension_mm_ = handle_mm - proxy_mm;
  turn_rad_.setZero();
  handle_mm_ = handle_mm;
  cutting_ = false;
}

void Coupling::release_all(const Vec3& handle_mm, const Vec3& proxy_mm) noexcept {
  reset(handle_mm, proxy_mm);
  slack_mm_ = proxy_mm - handle_mm;
  extension_mm_.setZero();
}

void Coupling::turn(const Eigen::Quaterniond& now_before) noexcept {
  slack_mm_ = now_before * slack_mm_;
  returned_mm_ = now_before * returned_mm_;
}

void Coupling::release(Vec3& offset_mm, Vec3& extension_mm, const Vec3& to_mm) noexcept {
  const Vec3 change_mm = to_mm - extension_mm;
  offset_mm += change_mm;
  extension_mm_ += change_mm;
  extension_mm = to_mm;
}

void Coupling::bleed(const CouplingMoment& moment) noexcept {
  double most_mm = kBleed * (moment.handle_mm - handle_mm_).norm();
  for (Vec3* offset_mm : {&slack_mm_, &returned_mm_}) {
    const double size_mm = offset_mm->norm();
    if (size_mm < kNothing_mm) {
      offset_mm->setZero();
      continue;
    }
    const double less_mm = std::min(most_mm, size_mm);
    *offset_mm *= 1.0 - less_mm / size_mm;
    most_mm -= less_mm;
  }
}

CouplingForce Coupling::step(const CouplingMoment& moment, const ProxyStep& proxy, EnergyLedger& ledger, double dt_s,
                             double smooth_s) noexcept {
  CouplingForce force;
  const double k = moment.stiffness_n_per_mm;
  const Compression& compression = moment.compression;
  const auto stored_mj = [&](double extension_mm) {
    if (compression.on()) return moment.energy_scale * compression.stored_mj(k, extension_mm);
    return 0.5 * k * moment.energy_scale * extension_mm * extension_mm;
  };
  // Energy of the rotation's spring. What the device cannot show is not stored either.
  const auto turned_mj = [&](const Vec3& turn_rad) {
    const double size_rad = turn_rad.norm(), k_turn = moment.stiffness_nmm_per_rad;
    const double shown_rad = k_turn > 0.0 ? std::min(size_rad, moment.limit_nmm / k_turn) : 0.0;
    return moment.energy_scale * k_turn * shown_rad * (size_rad - 0.5 * shown_rad);
  };
  // What the hand feels of the cutting force is what it pays for.
  const double cutting_mj =
      moment.energy_scale * proxy.cutting_work_mj * compression.share(proxy.cutting_force_n.norm());
  Vec3 e_mm = moment.handle_mm + offset_mm() - moment.proxy_mm;

  if (!moment.touching) {
    ledger.settle(cutting_mj, 0.0);
    extension_mm_ = e_mm;
    turn_rad_ = moment.turn_rad;
    bleed(moment);
    handle_mm_ = moment.handle_mm;
    smooth_.reset(Vec3::Zero());
    cutting_ = false;
    return force;
  }

  // Only bone that came back moves the proxy away from the handle. The exception is the distance that a release of the
  // rotation's spring pays for.
  const double now_turned_mj = turned_mj(moment.turn_rad);
  const double relaxed_mj = turned_mj(moment.turn_before_rad) - now_turned_mj;
  const double before_mm =
      std::sqrt(std::max(0.0, (moment.handle_mm + offset_mm() - moment.proxy_before_mm).squaredNorm() +
                                  2.0 * relaxed_mj / (k * moment.energy_scale)));
  if (e_mm.norm() > before_mm + kNothing_mm) {
    release(returned_mm_, e_mm, e_mm * (before_mm / e_mm.norm()));
    force.returned = true;
  }
  // Slack: the part that the device cannot show, and all of it where the bone has given way.
  const double most_mm = moment.limit_n / k;
  if (e_mm.norm() > most_mm) {
    release(slack_mm_, e_mm, e_mm * (most_mm / e_mm.norm()));
    force.limited = true;
  }
  if (proxy.breakthrough && k * e_mm.norm() >= kLeastToRelease_n) {
    release(slack_mm_, e_mm, Vec3::Zero());
    force.breakthrough = true;
  }
  // Where less force was shown than the spring's (missed ticks, the ramp, the monitor), the hand moves on without
  // paying. That extension would permanently show less force than the spring says, and cut less. So it is released.
  const double size_mm = e_mm.norm();
  const double paid_mm = compression.on()
                             ? compression.paid_mm(k, size_mm, ledger.paid_mj(cutting_mj) / moment.energy_scale)
                             : ledger.paid_mm(k * moment.energy_scale, cutting_mj);
  if (moment.fell_short && size_mm > paid_mm) release(slack_mm_, e_mm, e_mm * (paid_mm / size_mm));
  ledger.settle(cutting_mj, stored_mj(e_mm.norm()) + now_turned_mj, now_turned_mj);

  // Returned bone may press again as far as the damping pays for it.
  const double returned_mm = returned_mm_.norm();
  if (returned_mm > kNothing_mm && ledger.report().tank_mj > 0.0) {
    const double most_step_mm = std::min(returned_mm, kBleed * (moment.handle_mm - handle_mm_).norm());
    const Vec3 back_mm = returned_mm_ * (most_step_mm / returned_mm);
    const double price_mj = stored_mj((e_mm - back_mm).norm()) - stored_mj(e_mm.norm());
    if (price_mj <= 0.0 || ledger.draw(price_mj) >= price_mj) release(returned_mm_, e_mm, e_mm - back_mm);
  }

  force.spring_n = -k * e_mm;
  // A sampled spring needs k·T. The force that a filter holds back by tau arrives too late by as much as k·tau pays
  // for. The damping is never more than the spring's force, so that it cannot pull.
  force.damping_n = clamped(-std::max(1.0, smooth_s / dt_s) * k * (e_mm - extension_mm_), force.spring_n.norm());

  force.turn_spring_nmm = clamped(-moment.stiffness_nmm_per_rad * moment.turn_rad, moment.limit_nmm);
  force.turn_damping_nmm =
      clamped(-std::max(1.0, smooth_s / dt_s) * moment.stiffness_nmm_per_rad * (moment.turn_rad - turn_rad_),
              force.turn_spring_nmm.norm());

  // (7.15), EWMA, on the cutting force alone and only while cutting continues. Where cutting begins or ends, the rest
  // of the coupling takes over at once. A filter between them would pull.
  const Vec3& cutting_n = proxy.cutting_force_n;
  if (proxy.cutting && cutting_)
    smooth_.step(cutting_n, dt_s, smooth_s);
  else
    smooth_.reset(cutting_n);
  force.cutting_lag_n = clamped(cutting_n - smooth_.value(), force.spring_n.norm());
  cutting_ = proxy.cutting;

  extension_mm_ = e_mm;
  turn_rad_ = moment.turn_rad;
  handle_mm_ = moment.handle_mm;
  return force;
}

}  // namespace osteon::haptic
