#include "haptic_client/device/simulated_device.hpp"

namespace osteon::haptic {

Result<SimulatedDeviceParams> find_simulated_device(std::string_view name) {
  // Force, stiffness and workspace of a PHANToM Omni, as its vendor gives them. Its motors are assumed never to be
  // warm.
  static const SimulatedDeviceParams kDevices[] = {
      {},
      {"simulated-3.3N",
       {.peak_n = 3.3, .continuous_n = 3.3, .stiffness_n_per_mm = 0.7, .workspace_radius_mm = 100.0}}};
  std::string names;
  for (const SimulatedDeviceParams& device : kDevices) {
    if (device.name == name) return device;
    names += (names.empty() ? "" : " or ") + device.name;
  }
  return failure(ErrorCode::not_found, "there is no device \"" + std::string(name) + "\"; choose " + names);
}

SimulatedDevice::SimulatedDevice(const SimulatedDeviceParams& params)
    : params_(params), hand_(HandParams{}, Vec3::Zero()) {}

DeviceReading SimulatedDevice::read() noexcept {
  return {.pose_device_tool = {hand_.position_mm(), rotation_}, .buttons = buttons_};
}

void SimulatedDevice::write(const DeviceOutput& output) noexcept {
  force_n_ = clamped(output.force_n, params_.limits.peak_n);  // a real amplifier saturates too
}

void SimulatedDevice::command(const HandCommand& command, const Eigen::Quaterniond& rotation_device_tool,
                              std::uint32_t buttons) noexcept {
  command_ = command;
  rotation_ = rotation_device_tool;
  buttons_ = buttons;
}

void SimulatedDevice::take(const HandParams& hand, const Vec3& at_mm) noexcept {
  hand_.set_params(hand);
  hand_.place(at_mm);
  force_n_.setZero();
}

void SimulatedDevice::push_with(double push_n) noexcept {
  HandParams hand = hand_.params();
  hand.push_n = push_n;
  hand_.set_params(hand);
}

void SimulatedDevice::hold_across(double n_per_mm) noexcept {
  HandParams hand = hand_.params();
  hand.lateral_n_per_mm = n_per_mm;
  hand_.set_params(hand);
}

void SimulatedDevice::step(double dt_s) noexcept { hand_.step(command_, force_n_, dt_s); }

}  // namespace osteon::haptic
