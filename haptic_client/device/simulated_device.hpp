// A simulated device with a simulated hand on it. Time passes when step() is called, and the force moves the hand.
#pragma once
#include <string>

#include "common/core/result.hpp"
#include "common/mechanics/simulated_hand.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

// Unless named otherwise, strong enough for the drilling of bone, so that physical force is shown unscaled.
struct SimulatedDeviceParams {
  std::string name = "simulated";
  DeviceLimits limits{.peak_n = 60.0, .continuous_n = 30.0, .stiffness_n_per_mm = 60.0, .workspace_radius_mm = 120.0};
};
// Finds a simulated device by name. Error not_found: lists the names.
[[nodiscard]] Result<SimulatedDeviceParams> find_simulated_device(std::string_view name);

class SimulatedDevice final : public HapticDevice {
 public:
  explicit SimulatedDevice(const SimulatedDeviceParams& params = {});

  [[nodiscard]] std::string_view name() const override { return params_.name; }
  [[nodiscard]] DeviceLimits limits() const override { return params_.limits; }
  [[nodiscard]] DeviceReading read() noexcept override;
  void write(const DeviceOutput& output) noexcept override;

  // [haptic] What the hand is to do from now on; device frame.
  void command(const HandCommand& command, const Eigen::Quaterniond& rotation_device_tool,
               std::uint32_t buttons) noexcept;
  // [haptic] Another hand takes the handle at a position.
  void take(const HandParams& hand, const Vec3& at_mm) noexcept;
  // [haptic] The push of the hand, newtons on the device.
  void push_with(double push_n) noexcept;
  // [haptic] Stiffness of the hand across its axis, on the device.
  void hold_across(double n_per_mm) noexcept;
  // [haptic] Advances the time.
  void step(double dt_s) noexcept;
  [[nodiscard]] const Hand& hand() const noexcept { return hand_; }

 private:
  SimulatedDeviceParams params_;
  Hand hand_;
  HandCommand command_;
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  std::uint32_t buttons_ = 0;
  Vec3 force_n_ = Vec3::Zero();
};

}  // namespace osteon::haptic
