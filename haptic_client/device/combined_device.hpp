// Several devices as one: the hand's place from one, its rotation perhaps from another, the spindle from a pedal. Each
// part is opened and tended by a connection of its own; this only puts together what they read.
#pragma once
#include <memory>
#include <vector>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

class CombinedDevice final : public HapticDevice {
 public:
  // The first is the hand's. One after it that turns takes over the rotation, one that pedals the spindle: the spindle
  // buttons of the others work the clutch then. Errors invalid_input: the parts do not go together.
  [[nodiscard]] static Result<std::unique_ptr<CombinedDevice>> make(std::vector<std::unique_ptr<HapticDevice>> parts);

  [[nodiscard]] std::string_view name() const override { return name_; }
  [[nodiscard]] DeviceLimits limits() const override;
  [[nodiscard]] DeviceInfo info() const override;
  // Neither the hand nor its rotation may be missing; without its pedal the spindle only stands still.
  [[nodiscard]] DeviceReading read() noexcept override;
  [[nodiscard]] bool over() const noexcept override { return parts_[0]->over(); }
  // A torque belongs to the handle that turns: it is shown only where one device does both.
  void write(const DeviceOutput& output) noexcept override;

  [[nodiscard]] const std::vector<std::unique_ptr<HapticDevice>>& parts() const noexcept { return parts_; }

 private:
  CombinedDevice() = default;
  std::vector<std::unique_ptr<HapticDevice>> parts_;
  HapticDevice* turning_ = nullptr;  // where another part gives the rotation
  HapticDevice* pedal_ = nullptr;
  std::string name_;
};

}  // namespace osteon::haptic
