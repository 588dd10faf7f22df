// Novint Falcon: three axes of position and force over USB, with our own driver. Its firmware is its vendor's; the user
// names the file. Its I/O has a thread of its own, which sends and receives a frame a thousand times a second.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

struct FalconOptions {
  std::filesystem::path firmware;  // empty: none, which suffices while the device still runs its earlier firmware
  int priority = 75;               // of its I/O thread, SCHED_FIFO; 0: normal scheduling
};

// open() gives the device its firmware if needed. Then the user moves the grip in and out until every axis has found
// its end. Red light: calibration pending. Blue: ready. Green: force is on. The centre button works the spindle, any
// other the clutch. Limits: 8 N, 3 N/mm, 40 mm. The continuous force is what the motors' range gives in every direction
// at every position of that workspace [A: how warm they get is not known].
[[nodiscard]] std::unique_ptr<HapticDevice> make_falcon(FalconOptions options);
// Opens nothing, but reads the firmware if a file is named.
[[nodiscard]] DeviceFinding look_for_falcon(const FalconOptions& options = {});

// The image for the boot loader. Errors: not_found, invalid_input; each names the file.
[[nodiscard]] Result<std::vector<std::uint8_t>> read_falcon_firmware(const std::filesystem::path& file);

}  // namespace osteon::haptic
