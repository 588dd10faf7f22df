#include "haptic_client/rendering/guidance_spring.hpp"

#include <algorithm>
#include <cmath>

#include "haptic_client/device/haptic_device.hpp"
#include "haptic_client/rendering/slew.hpp"

namespace osteon::haptic {

GuidanceSpringParams guide_pull_params(double device_n_per_mm, double continuous_n, double dt_s) {
  constexpr double kHeld_mm = 5.0, kOfDevice = 0.25;
  GuidanceSpringParams params;
  params.dt_s = dt_s;
  params.most_n = continuous_n;
  params.stiffness_n_per_mm = std::min(continuous_n / kHeld_mm, kOfDevice * device_n_per_mm);
  return params;
}

void GuidanceSpring::reset() noexcept {
  k_n_per_mm_ = 0.0;
  force_n_.setZero();
  placed_ = false;
  ledger_.reset();
}

void GuidanceSpring::see(const GuideSeen& seen) noexcept {
  silent_s_ += params_.dt_s;
  if (seen.there && (!known_ || seen.state_seq != state_seq_)) {
    raw_mm_ = seen.place_mm;
    // After a silence the other may be anywhere. The distance is closed as at the beginning.
    if (!fresh()) first_mm_ = second_mm_ = raw_mm_, placed_ = false;
    state_seq_ = seen.state_seq;
    silent_s_ = 0.0;
    known_ = true;
  }
  if (!seen.there) silent_s_ = params_.silence_s;
  const double part = 1.0 - std::exp(-params_.dt_s / params_.smooth_s);
  first_mm_ += part * (raw_mm_ - first_mm_);
  second_mm_ += part * (first_mm_ - second_mm_);
}

void GuidanceSpring::move_far_end(const GuideMoment& moment) noexcept {
  far_mm_ += clamped(moment.guide_mm - guide_mm_, params_.most_mm_per_s * params_.dt_s);
  far_mm_ += clamped(moment.guide_mm - far_mm_, params_.closing_mm_per_s * params_.dt_s);
  // A hand that holds back pulls the far end along.
  const double most_mm = params_.most_n / params_.stiffness_n_per_mm;
  far_mm_ = moment.handle_mm + clamped(far_mm_ - moment.handle_mm, most_mm);
}

Vec3 GuidanceSpring::step(const GuideMoment& moment) noexcept {
  if (!moment.safe) {
    reset();
    return force_n_;
  }
  const double whole = std::clamp(moment.share, 0.0, 1.0) * params_.stiffness_n_per_mm;
  const bool pull = fresh() && whole > 0.0;
  if (!placed_) {
    if (!pull && !(k_n_per_mm_ > 0.0)) return force_n_;
    // A pull that was fading continues from its present force.
    if (!(k_n_per_mm_ > 0.0)) far_mm_ = handle_mm_ = moment.handle_mm;
    guide_mm_ = moment.guide_mm;
    placed_ = true;
  }
  const Vec3 moved_mm = moment.handle_mm - handle_mm_;
  ledger_.observe(moved_mm);
  const auto stored_mj = [&] { return 0.5 * k_n_per_mm_ * (far_mm_ - moment.handle_mm).squaredNorm(); };
  const double before_mj = stored_mj();

  // Raising the stiffness does not raise the energy; lowering it loses some.
  const double firmer = std::min(params_.stiffness_n_per_mm * params_.dt_s / params_.ramp_s, whole - k_n_per_mm_);
  if (pull && firmer > 0.0) {
    far_mm_ = moment.handle_mm + std::sqrt(k_n_per_mm_ / (k_n_per_mm_ + firmer)) * (far_mm_ - moment.handle_mm);
    k_n_per_mm_ += firmer;
  } else {
    const double least = pull ? whole : 0.0;
    k_n_per_mm_ = std::max(least, k_n_per_mm_ - params_.stiffness_n_per_mm * params_.dt_s / params_.fade_s);
  }
  if (pull)
    move_far_end(moment);
  else if (!(k_n_per_mm_ > 0.0)) {
    static_cast<void>(ledger_.limited({}, {}, false));
    reset();
    return force_n_;
  }
  const double after_mj = stored_mj();
  ledger_.settle(-std::max(0.0, after_mj - before_mj), after_mj);

  const double share = k_n_per_mm_ / params_.stiffness_n_per_mm;
  const Vec3 damping_n = clamped(-params_.damping_s * k_n_per_mm_ / params_.dt_s * moved_mm, share * params_.most_n);
  const Vec3 spring_n = k_n_per_mm_ * (far_mm_ - moment.handle_mm);
  Vec3 wanted_n = clamped(spring_n + damping_n, std::min(share * params_.most_n, moment.room_n));
  const Vec3 grown_n = growth(wanted_n, force_n_);
  wanted_n += clamped(grown_n, moment.slew_n) - grown_n;
  wanted_n = held_to(moment.together_slew_n, wanted_n, moment.rest_n, moment.together_n);
  const double asked_n = (spring_n + damping_n).norm();
  const Vec3 shown_damping_n =
      asked_n > 0.0 ? Vec3(std::min(1.0, wanted_n.norm() / asked_n) * damping_n) : Vec3(Vec3::Zero());
  force_n_ = ledger_.limited({.force_n = wanted_n}, {.force_n = shown_damping_n}, true).force_n;
  guide_mm_ = moment.guide_mm;
  handle_mm_ = moment.handle_mm;
  return force_n_;
}

}  // namespace osteon::haptic
