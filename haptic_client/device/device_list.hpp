// The devices that --device can name, which of them are on this machine, and how several are combined.
#pragma once
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "haptic_client/device/combined_device.hpp"

namespace osteon::haptic {

// Options besides a device's name.
struct DeviceOptions {
  std::filesystem::path libhd, libdhd;    // vendors' libraries; empty: searched by the dynamic linker
  std::filesystem::path falcon_firmware;  // the vendor's image; Osteon ships none
};

// `names`: one device for the hand and what is added to it, joined by "+". Examples: "phantom",
// "falcon+spacemouse+pedal", "phantom:NAME" (as in the vendor's setup), "force-dimension:1", "pedal-axis:z:inverted",
// "recorded:FILE". Opens nothing. Errors: not_found, invalid_input; each lists the possible names.
[[nodiscard]] Result<std::unique_ptr<CombinedDevice>> make_devices(std::string_view names,
                                                                   const DeviceOptions& options);

struct DeviceLine {
  std::string_view name, what;
  DeviceFinding finding;
};
// Every kind of device, with what was found of it on this machine. May take seconds.
[[nodiscard]] std::vector<DeviceLine> look_for_devices(const DeviceOptions& options);

}  // namespace osteon::haptic
