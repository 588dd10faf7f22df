// Combines several devices into one. One device gives the hand's position, perhaps another its rotation, and a pedal
// drives the spindle. Each part is opened and tended by its own connection. This class only combines their readings.
#pragma once
#include <memory>
#include <vector>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

class CombinedDevice final : public HapticDevice {
 public:
  // The first part is the hand's. A later part that turns provides the rotation. A later part that pedals drives the
  // spindle; the spindle buttons of the others then work as clutch. Error invalid_input: the parts do not fit together.
  [[nodiscard]] static Result<std::unique_ptr<CombinedDevice>> make(std::vector<std::unique_ptr<HapticDevice>> parts);

  [[nodiscard]] std::string_view name() const override { return name_; }
  [[nodiscard]] DeviceLimits limits() const override;
  [[nodiscard]] DeviceInfo info() const override;
  // Neither the hand nor its rotation may be missing. Without its pedal only the spindle stands still.
  [[nodiscard]] DeviceReading read() noexcept override;
  [[nodiscard]] bool over() const noexcept override { return parts_[0]->over(); }
  // A torque belongs to the handle that turns. It is shown only where one device gives both position and rotation.
  void write(const DeviceOutput& output) noexcept override;

  [[nodiscard]] const std::vector<std::unique_ptr<HapticDevice>>& parts() const noexcept { return parts_; }

 private:
  CombinedDevice() = default;
  std::vector<std::unique_ptr<HapticDevice>> parts_;
  HapticDevice* turning_ = nullptr;  // the part that gives the rotation, if it is not the first
  HapticDevice* pedal_ = nullptr;
  std::string name_;
};

}  // namespace osteon::haptic
