// The tool's motor. It follows the commanded speed with a run-up and slows under load. It stalls when the bone needs
// more torque than it has, and turns again when the load is removed.
#pragma once

namespace osteon {

struct SpindleParams {
  double full_rpm = 1000;  // the speed reached after run_up_s
  double run_up_s = 0.3;   // from standstill to full speed, and back
  // Speed lost under torque [A]: 1.9 % of 1000 rpm under the 27 N mm of cortical bone. The motor's 5500 Hz fall to 5400
  // Hz in Niu 2008, §8.5.4: 1.8 %.
  double droop_rpm_per_nmm = 0.7;
  double most_nmm = 400;  // largest torque of the motor; a larger load stops it [A]
  // time constant of the speed after a load change that the motor can carry: the rotor's inertia [A]
  double response_s = 0.02;
};

// unloaded_rpm follows the command. Under load the rotor is slower. The motor's torque is that difference divided by
// the droop, at most most_nmm. The excess of the load slows it further.
struct Spindle {
  double unloaded_rpm = 0;
  double rpm = 0;        // the real speed of the tool, never negative
  bool stalled = false;  // it stands although it is driven

  // `torque_nmm`: of the bone. For a stopped spindle: the torque needed to turn it in the bone under the present
  // thrust.
  void step(const SpindleParams& params, double command_rpm, double torque_nmm, double dt_s) noexcept;
};

}  // namespace osteon
