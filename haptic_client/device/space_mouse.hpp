// SpaceMouse by hidapi: six degrees of freedom without force. As a device for the hand its cap is the velocity of a tool; as
// a reader it gives the cap itself, for a camera.
#pragma once
#include <memory>

#include "haptic_client/device/haptic_device.hpp"
#include "haptic_client/device/space_mouse_report.hpp"

namespace osteon::haptic {

struct SpaceMouseOptions {
  RateControlParams rate = {};
  bool light = true;  // its LED, while it is open
};

// Shows no force: its limits are zero. Of its buttons the first is the spindle's, any other the clutch.
[[nodiscard]] std::unique_ptr<HapticDevice> make_space_mouse(const SpaceMouseOptions& options = {});
[[nodiscard]] DeviceFinding look_for_space_mouse();

// The cap for whoever moves a camera with it; opens, closes and opens again like any device, from one thread.
class SpaceMouseCap {
 public:
  virtual ~SpaceMouseCap() = default;
  [[nodiscard]] virtual Result<void> open() = 0;
  virtual void close() noexcept = 0;
  // While open, now and then; an error says that it was unplugged.
  [[nodiscard]] virtual Result<void> tend() = 0;
  // [one reader] At rest while it is not there.
  [[nodiscard]] virtual SpaceMouseState cap() noexcept = 0;
};
[[nodiscard]] std::unique_ptr<SpaceMouseCap> make_space_mouse_cap(bool light = true);

}  // namespace osteon::haptic
