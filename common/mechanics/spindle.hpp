// The tool's motor: follows the commanded speed with a run-up, gives way under load, stalls when the bone asks for more
// torque than it has, and turns again when the load is taken off.
#pragma once

namespace osteon {

struct SpindleParams {
  double full_rpm = 1000;  // the speed that the run-up is measured to
  double run_up_s = 0.3;   // from standstill to full speed, and back
  // Speed lost under torque [A]: 1.9 % of 1000 rpm under the 27 N mm of cortical bone. The motor's
  // 5500 Hz fall to 5400 Hz in Niu 2008, §8.5.4: 1.8 %.
  double droop_rpm_per_nmm = 0.7;
  double most_nmm = 400;     // the motor gives no more: what asks for more stops it [A]
  double response_s = 0.02;  // of the speed to a change of load that the motor can carry: the rotor's inertia [A]
};

// unloaded_rpm follows the command; under load the rotor falls behind it. The motor's torque is what it has fallen
// behind over the droop, at most most_nmm, and the load's excess over that slows it further.
struct Spindle {
  double unloaded_rpm = 0;
  double rpm = 0;        // what the bone sees, never negative
  bool stalled = false;  // it stands although it is driven

  // `torque_nmm`: of the bone. While it stands: what it would take to turn it in the bone under the present thrust.
  void step(const SpindleParams& params, double command_rpm, double torque_nmm, double dt_s) noexcept;
};

}  // namespace osteon
