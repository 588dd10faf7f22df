// `osteon-haptic devices`: lists the devices, which of them are on this machine, what is missing, and the remedy.
#pragma once
#include <string>
#include <vector>

#include "haptic_client/device/device_list.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::haptic {

// Adds the options that name vendors' files, for every command that opens devices.
void add_device_options(CLI::App& app, DeviceOptions& options);
// The list as it is printed.
[[nodiscard]] std::string list_devices(const std::vector<DeviceLine>& lines);
// argv[0] is the command's name. Returns the exit code.
[[nodiscard]] int run_devices(int argc, char** argv);

}  // namespace osteon::haptic
