#include "haptic_client/app/devices_command.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>

#include "common/runtime/command_line.hpp"

namespace osteon::haptic {

void add_device_options(CLI::App& app, DeviceOptions& options) {
  app.add_option("--libhd", options.libhd,
                 "OpenHaptics' libHD.so, for a PHANToM; by default as the dynamic linker finds it")
      ->envname("OSTEON_LIBHD");
  app.add_option("--libdhd", options.libdhd, "Force Dimension's libdhd.so; by default as the dynamic linker finds it")
      ->envname("OSTEON_LIBDHD");
  app.add_option("--falcon-firmware", options.falcon_firmware, "The vendor's firmware image for a Novint Falcon")
      ->envname("OSTEON_FALCON_FIRMWARE");
}

std::string list_devices(const std::vector<DeviceLine>& lines) {
  std::string text;
  for (const DeviceLine& line : lines) {
    std::string name(line.name);
    name.resize(std::max<std::size_t>(name.size(), 16), ' ');
    text.append(name).append(" ").append(line.what).append("\n");
    const std::string indent(17, ' ');
    for (const std::string& found : line.finding.found) text += indent + "found: " + found + '\n';
    if (line.finding.found.empty() && line.finding.missing.empty()) text += indent + "not here: none is plugged in\n";
    if (!line.finding.missing.empty())
      text += indent + (line.finding.found.empty() ? "not here: " : "but: ") + line.finding.missing + '\n';
  }
  return text;
}

int run_devices(int argc, char** argv) {
  DeviceOptions options;
  CLI::App app(
      "Lists the devices that --device can name, what of them is here, and what is missing. Exits with 1 when a file "
      "that "
      "you name cannot be used.",
      "osteon-haptic devices");
  add_device_options(app, options);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  const std::vector<DeviceLine> lines = look_for_devices(options);
  std::fputs(list_devices(lines).c_str(), stdout);
  std::puts(
      "Joined by \"+\" they work together: one for the hand, then a spacemouse for its rotation, a pedal for the "
      "spindle.");
  return std::ranges::any_of(lines, [](const DeviceLine& line) { return line.finding.wrong_file; }) ? 1 : 0;
}

}  // namespace osteon::haptic
