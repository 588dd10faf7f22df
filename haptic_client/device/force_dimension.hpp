// Force Dimension's devices (omega, sigma, delta) through the vendor's libdhd, loaded at run time. The library's calls
// wait for the device, so a separate thread makes them. It shares only a DeviceExchange with the haptic thread.
#pragma once
#include <chrono>
#include <filesystem>
#include <memory>

#include "haptic_client/device/device_exchange.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

struct ForceDimensionOptions {
  std::filesystem::path library;           // empty: libdhd.so, searched by the dynamic linker
  int number = 0;                          // among the connected devices
  std::chrono::microseconds period{1000};  // of its thread; 0: as fast as the device answers
  // How long the force that was written last lasts. Only a test that simulates time needs more.
  std::chrono::milliseconds force_held = DeviceExchange::kForceHeld;
};

[[nodiscard]] std::unique_ptr<HapticDevice> make_force_dimension(const ForceDimensionOptions& options);
// Opens each free device for a moment, without its motors.
[[nodiscard]] DeviceFinding look_for_force_dimension(const ForceDimensionOptions& options);

// The sentence for an error of the library, with the remedy.
[[nodiscard]] Error force_dimension_error(int code, const char* vendors_text);

// Converts the vendor's device coordinates (x to the user, y right, z up) to ours. Also for forces and torques, in any
// unit.
[[nodiscard]] inline Vec3 from_force_dimension(const Vec3& v) { return {v.y(), v.z(), v.x()}; }
[[nodiscard]] inline Vec3 to_force_dimension(const Vec3& v) { return {v.z(), v.x(), v.y()}; }

}  // namespace osteon::haptic
