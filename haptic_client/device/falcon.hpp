// Novint Falcon: three axes of place and force over USB, with our own driver. Its firmware is its vendor's: the user
// names the file. Its I/O has a thread of its own, a frame each way a thousand times a second.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

struct FalconOptions {
  std::filesystem::path firmware;  // empty: none, which is enough while the device still runs what it was given before
  int priority = 75;               // of its I/O thread, SCHED_FIFO; 0: an ordinary thread
};

// open() gives the device its firmware if it needs it, then the user moves the grip in and out until every axis has
// found its end (red light; calibration pending); blue: ready; green: force is on. Buttons: the centre one is the
// spindle's, any other the clutch. Limits: 8 N, 3 N/mm, 40 mm; continuous is what the motors' range gives in every
// direction at every place of that workspace [A: how warm they get is not known].
[[nodiscard]] std::unique_ptr<HapticDevice> make_falcon(FalconOptions options);
// Opens nothing, but reads the firmware where a file is named.
[[nodiscard]] DeviceFinding look_for_falcon(const FalconOptions& options = {});

// The image that the boot loader takes. Errors: not_found, invalid_input; each names the file.
[[nodiscard]] Result<std::vector<std::uint8_t>> read_falcon_firmware(const std::filesystem::path& file);

}  // namespace osteon::haptic
