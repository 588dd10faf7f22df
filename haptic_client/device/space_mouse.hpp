// SpaceMouse as a device for the hand: six degrees of freedom without force. Its cap sets the velocity of a tool.
#pragma once
#include <memory>

#include "haptic_client/device/haptic_device.hpp"
#include "haptic_client/device/rate_control.hpp"

namespace osteon::haptic {

struct SpaceMouseOptions {
  RateControlParams rate = {};
  bool light = true;  // its LED, while it is open
};

// Shows no force: its limits are zero. The first button works the spindle, any other the clutch.
[[nodiscard]] std::unique_ptr<HapticDevice> make_space_mouse(const SpaceMouseOptions& options = {});
[[nodiscard]] DeviceFinding look_for_space_mouse();

}  // namespace osteon::haptic
