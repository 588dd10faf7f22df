// A device that shows force to a hand: what the loop needs of any of them. Device frame: x right, y up, z to the user.
#pragma once
#include <cstdint>
#include <string_view>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

// Read from the device itself, never assumed.
struct DeviceLimits {
  double peak_n = 0;
  double continuous_n = 0;
  double stiffness_n_per_mm = 0;
  double workspace_radius_mm = 0;
};

enum class DeviceStatus : std::uint8_t {
  ok,
  warm,      // motors are warm: only the continuous force may be asked for
  fault,     // lost or broken: no force, and what was read is old
};

enum DeviceButton : std::uint32_t { kClutchButton = 1, kSpindlePedal = 2 };

struct DeviceReading {
  Pose pose_device_tool;  // the handle
  std::uint32_t buttons = 0;
  DeviceStatus status = DeviceStatus::ok;
};

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;
  [[nodiscard]] virtual std::string_view name() const = 0;
  [[nodiscard]] virtual DeviceLimits limits() const = 0;
  // [haptic]
  [[nodiscard]] virtual DeviceReading read() noexcept = 0;
  // [haptic] Held until the next write; newtons, device frame.
  virtual void write(const Vec3& force_n) noexcept = 0;
};

}  // namespace osteon::haptic
