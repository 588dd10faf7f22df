#include "common/mechanics/spindle.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

void Spindle::step(const SpindleParams& params, double command_rpm, double torque_nmm, double dt_s) noexcept {
  const double before_rpm = unloaded_rpm, most = params.full_rpm / params.run_up_s * dt_s;
  unloaded_rpm += std::clamp(command_rpm - unloaded_rpm, -most, most);

  double behind_rpm = std::max(0.0, before_rpm - rpm);
  const double load_nmm = std::max(0.0, torque_nmm);
  if (std::max(load_nmm, behind_rpm / params.droop_rpm_per_nmm) <= params.most_nmm) {
    // Linear, and solved exactly for a constant load, so it is stable for any dt.
    behind_rpm += (params.droop_rpm_per_nmm * load_nmm - behind_rpm) * (1.0 - std::exp(-dt_s / params.response_s));
  } else {
    const double inertia = params.response_s / params.droop_rpm_per_nmm;  // N mm s per rpm
    behind_rpm += (load_nmm - std::min(behind_rpm / params.droop_rpm_per_nmm, params.most_nmm)) / inertia * dt_s;
  }
  rpm = unloaded_rpm - std::clamp(behind_rpm, 0.0, unloaded_rpm);
  stalled = unloaded_rpm > 1.0 && rpm < 1.0 && load_nmm > 0.0;
}

}  // namespace osteon
