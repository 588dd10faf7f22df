// The tool's motor: follows the commanded speed with a run-up, and gives way a little under load.
#pragma once

namespace osteon {

struct SpindleParams {
  double full_rpm = 1000;            // the speed that the run-up is measured to
  double run_up_s = 0.3;             // from standstill to full speed, and back
  // Speed lost under torque [A]: 1.9 % of 1000 rpm under the 27 N mm of cortical bone. §8.5.4 hears the motor's 5500 Hz
  // fall to 5400 Hz there, 1.8 %.
  double droop_rpm_per_nmm = 0.7;
};

struct Spindle {
  double unloaded_rpm = 0;
  double rpm = 0;  // what the bone sees

  void step(const SpindleParams& params, double command_rpm, double torque_nmm, double dt_s) noexcept;
};

}  // namespace osteon
