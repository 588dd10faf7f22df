#include "common/mechanics/spindle.hpp"

#include <algorithm>

namespace osteon {

void Spindle::step(const SpindleParams& params, double command_rpm, double torque_nmm, double dt_s) noexcept {
  const double most = params.full_rpm / params.run_up_s * dt_s;
  unloaded_rpm += std::clamp(command_rpm - unloaded_rpm, -most, most);
  rpm = std::max(0.0, unloaded_rpm - params.droop_rpm_per_nmm * torque_nmm);
}

}  // namespace osteon
