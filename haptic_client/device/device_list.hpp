// The devices that --device can name, what of them is on this machine, and how to put several together.
#pragma once
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "haptic_client/device/combined_device.hpp"

namespace osteon::haptic {

// What the user gives beside a device's name.
struct DeviceOptions {
  std::filesystem::path libhd, libdhd;    // vendors' libraries; empty: where the dynamic linker finds them
  std::filesystem::path falcon_firmware;  // the vendor's image; none is shipped
};

// `names`: one device for the hand, and what is to be added to it, joined by "+": "phantom", "falcon+spacemouse+pedal",
// "phantom:NAME" (as in the vendor's setup), "force-dimension:1", "pedal-axis:z:inverted", "recorded:FILE". Nothing is
// opened. Errors: not_found, invalid_input; each tells what may be named.
[[nodiscard]] Result<std::unique_ptr<CombinedDevice>> make_devices(std::string_view names,
                                                                   const DeviceOptions& options);

struct DeviceLine {
  std::string_view name, what;
  DeviceFinding finding;
};
// Every kind of device, with what a look at this machine shows of it. May take seconds.
[[nodiscard]] std::vector<DeviceLine> look_for_devices(const DeviceOptions& options);

}  // namespace osteon::haptic
