// PHANToM devices (Omni, Touch, Desktop, Premium) through the vendor's OpenHaptics, loaded at run time. Its own
// scheduler calls us a thousand times a second. It shares only a DeviceExchange with the haptic thread.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

struct OpenHapticsOptions {
  std::filesystem::path library;  // empty: libHD.so, searched by the dynamic linker
  std::string device;             // as named in the vendor's setup program; empty: its default device
};

// One device of this kind can be open at a time, because the vendor's scheduler serves the whole process.
[[nodiscard]] std::unique_ptr<HapticDevice> make_openhaptics(const OpenHapticsOptions& options);
// Opens the device for a moment, without its motors, unless it is open in this process.
[[nodiscard]] DeviceFinding look_for_openhaptics(const OpenHapticsOptions& options);

// The sentence for an error of the library, with the remedy.
[[nodiscard]] Error openhaptics_error(unsigned code, const char* vendors_text);

}  // namespace osteon::haptic
