#include "audio_client/synth/spindle_motor.hpp"

#include <algorithm>

namespace osteon::audio {
namespace {

constexpr double kTurning_rpm = 1.0;
// A stalled tool needs more torque than the motor has. How much more is not known: this stops it in some 0.1 s.
constexpr double kStallTorque = 2.0;
// A tool that turns has a torque that its motor can carry, whatever a state says; it loses at most half of its speed.
constexpr double kCarried = 0.95;
// A state's speed that falls under load may fall faster than a motor runs down by itself.
constexpr double kLoaded_s = 0.05;

}  // namespace

void SpindleMotor::start(const SpindleParams& params, double run_down_s) noexcept {
  *this = SpindleMotor{};
  params_ = params;
  span_rpm_ = params.full_rpm;
  run_down_s_ = run_down_s;
}

void SpindleMotor::aim(double rpm, double torque_Nmm) noexcept {
  torque_Nmm_ = std::max(0.0, torque_Nmm);
  if (rpm >= kTurning_rpm) {
    torque_Nmm_ = std::min({torque_Nmm_, kCarried * params_.most_nmm, rpm / params_.droop_rpm_per_nmm});
    // A motor that comes from rest has lost nothing yet, but will.
    command_rpm_ = rpm + (spindle_.unloaded_rpm < kTurning_rpm ? params_.droop_rpm_per_nmm * torque_Nmm_
                                                               : spindle_.unloaded_rpm - spindle_.rpm);
    span_rpm_ = std::max(span_rpm_, rpm);
  } else if (torque_Nmm_ > 0 && command_rpm_ > 0) {
    torque_Nmm_ = std::max(torque_Nmm_, kStallTorque * params_.most_nmm);
  } else {
    command_rpm_ = 0;
  }
}

void SpindleMotor::step(double dt_s) noexcept {
  SpindleParams params = params_;
  params.full_rpm = span_rpm_;
  if (torque_Nmm_ > 0)
    params.run_up_s = kLoaded_s;
  else if (command_rpm_ < spindle_.unloaded_rpm)
    params.run_up_s = run_down_s_;
  spindle_.step(params, command_rpm_, torque_Nmm_, dt_s);
}

}  // namespace osteon::audio
