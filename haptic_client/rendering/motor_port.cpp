#include "haptic_client/rendering/motor_port.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteon::haptic {

void MotorPort::reset() noexcept { open_ = usual_n_ = phase_ = 0.0; }

Vec3 MotorPort::step(const MotorMoment& moment, double dt_s) noexcept {
  const bool turns = moment.spindle_rpm > 1.0;
  open_ =
      moment.pedal && turns ? std::min(1.0, open_ + dt_s / params_.on_s) : std::max(0.0, open_ - dt_s / params_.off_s);
  const double normal_n = moment.normal_n.norm();
  usual_n_ += (normal_n - usual_n_) * (1.0 - std::exp(-dt_s / params_.kick_s));
  const bool saws = moment.stroke.squaredNorm() > 0.0;
  const double bite_hz = moment.spindle_rpm / 60.0 * (saws ? 1 : std::max(1, moment.teeth));
  phase_ = std::fmod(phase_ + bite_hz * dt_s, 1.0);
  if (!(open_ > 0.0) || !(normal_n > 0.0) || !turns) return Vec3::Zero();

  const Vec3 out = moment.normal_n / normal_n;
  const double most_n = params_.friction * normal_n;
  // The part that oscillates with the teeth or the stroke, with zero mean.
  const double fade = std::clamp((params_.most_hz - bite_hz) / (0.2 * params_.most_hz), 0.0, 1.0);
  const double wave = fade * std::sin(2.0 * std::numbers::pi * phase_);
  // The bone holds back the flank that slides over it. At the pole, and under a drill's point, nothing slides to one
  // side.
  const Vec3 across = saws ? Vec3(wave * moment.stroke) : moment.axis.cross(out);
  const double kick_n = moment.cutting ? params_.kick * params_.friction * std::max(0.0, normal_n - usual_n_) : 0.0;
  const double drag_n = moment.cutting ? std::min(moment.across_n, params_.drag * most_n) : params_.drag * most_n;
  Vec3 force_n = (drag_n + kick_n) * across + moment.pull_n * moment.axis;
  if (moment.cutting && !saws) force_n += params_.vibration * most_n * wave * out;  // teeth that bite
  const double size_n = force_n.norm();
  if (size_n > most_n) force_n *= most_n / size_n;
  return open_ * force_n;
}

}  // namespace osteon::haptic
