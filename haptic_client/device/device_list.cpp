#include "haptic_client/device/device_list.hpp"

#include <array>
#include <charconv>

#include "haptic_client/device/falcon.hpp"
#include "haptic_client/device/foot_pedal.hpp"
#include "haptic_client/device/force_dimension.hpp"
#include "haptic_client/device/openhaptics.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "haptic_client/device/simulated_device.hpp"
#include "haptic_client/device/space_mouse.hpp"

namespace osteon::haptic {
namespace {

using Made = Result<std::unique_ptr<HapticDevice>>;

struct Kind {
  std::string_view name, what;
  std::string_view argument;  // what may follow a colon; empty: nothing
  Made (*make)(const std::string& argument, const DeviceOptions& options);
  DeviceFinding (*look)(const DeviceOptions& options);
};

Made make_numbered_force_dimension(const std::string& argument, const DeviceOptions& options) {
  int number = 0;
  const auto [end, wrong] = std::from_chars(argument.data(), argument.data() + argument.size(), number);
  if (!argument.empty() &&
      (wrong != std::errc{} || end != argument.data() + argument.size() || number < 0 || number > 15))
    return failure(ErrorCode::invalid_input,
                   "--device force-dimension:" + argument + ": the number of the device must be from 0 to 15");
  return make_force_dimension({.library = options.libdhd, .number = number});
}

Made make_recorded(const std::string& argument, const DeviceOptions&) {
  if (argument.empty())
    return failure(ErrorCode::invalid_input, "--device recorded: it needs a file; name it, recorded:FILE");
  Result<std::unique_ptr<RecordedDevice>> device = make_recorded_device(argument);
  if (!device) return tl::unexpected(device.error());
  return Made(std::move(*device));
}

Made make_pedal(const Result<FootPedalOptions>& options) {
  if (!options) return tl::unexpected(options.error());
  return make_foot_pedal(*options);
}

constexpr std::array<Kind, 7> kKinds{{
    {"phantom", "PHANToM Omni, Touch, Desktop, Premium (OpenHaptics)", "NAME of the vendor's setup",
     [](const std::string& argument, const DeviceOptions& options) -> Made {
       return make_openhaptics({options.libhd, argument});
     },
     [](const DeviceOptions& options) {
       return look_for_openhaptics({options.libhd, {}});
     }},
    {"force-dimension", "omega, sigma, delta (libdhd)", "NUMBER", make_numbered_force_dimension,
     [](const DeviceOptions& options) { return look_for_force_dimension({.library = options.libdhd}); }},
    {"falcon", "Novint Falcon (USB)", "",
     [](const std::string&, const DeviceOptions& options) -> Made {
       return make_falcon({.firmware = options.falcon_firmware});
     },
     [](const DeviceOptions& options) { return look_for_falcon({.firmware = options.falcon_firmware}); }},
    {"spacemouse", "SpaceMouse: six degrees of freedom without force, or the rotation for another", "",
     [](const std::string&, const DeviceOptions&) -> Made { return make_space_mouse(); },
     [](const DeviceOptions&) { return look_for_space_mouse(); }},
    {"pedal",
     "foot pedal, a switch for the spindle; pedal:left, :middle or :right for one of three, "
     "pedal:left:irrigation-right:suction-middle for the other hand too",
     "left, middle or right",
     [](const std::string& argument, const DeviceOptions&) { return make_pedal(read_pedal_switch(argument)); },
     [](const DeviceOptions&) { return look_for_foot_pedals(false); }},
    {"pedal-axis",
     "a joystick's axis as a proportional pedal for the spindle; pedal-axis:inverted where it rests at its upper end, "
     "pedal-axis:z for another axis",
     "AXIS, inverted or both",
     [](const std::string& argument, const DeviceOptions&) { return make_pedal(read_pedal_axis(argument)); },
     [](const DeviceOptions&) { return look_for_foot_pedals(true); }},
    {"recorded", "a recording that --record wrote, played again: recorded:FILE", "FILE", make_recorded,
     [](const DeviceOptions&) {
       return DeviceFinding{{"always there"}, ""};
     }},
}};

std::string all_names() {
  std::string names = "simulated, simulated-3.3N, pointer:SOCKET";
  for (const Kind& kind : kKinds)
    names += ", " + std::string(kind.name) + (kind.argument.empty() ? "" : "[:" + std::string(kind.argument) + ']');
  return names;
}

// `text`: one of the names that are joined in `whole`.
Made make_one(std::string_view text, std::string_view whole, const DeviceOptions& options) {
  const std::size_t colon = text.find(':');
  const std::string_view name = text.substr(0, colon);
  const std::string argument(colon == std::string_view::npos ? std::string_view{} : text.substr(colon + 1));
  const std::string prefix = "--device " + std::string(whole) + ": ";
  if (name == "recorded" && text != whole)
    return failure(ErrorCode::invalid_input, prefix + "a recording is played alone; name no other device");
  for (const Kind& kind : kKinds) {
    if (kind.name != name) continue;
    if (kind.argument.empty() && colon != std::string_view::npos)
      return failure(ErrorCode::invalid_input, "--device " + std::string(text) + ": nothing may follow " +
                                                   std::string(name) + "; leave out the colon");
    return kind.make(argument, options);
  }
  if (name == "pointer")
    return failure(ErrorCode::invalid_input, prefix + "a pointer is named alone, as pointer:SOCKET");
  if (find_simulated_device(name))
    return failure(ErrorCode::invalid_input,
                   prefix + std::string(name) + " has a simulated hand; name it alone, with a --plan");
  const std::string what = name.empty() ? "a name is missing" : "there is no device \"" + std::string(name) + '"';
  return failure(ErrorCode::not_found, prefix + what + "; choose among " + all_names() + ", joined by \"+\"");
}

}  // namespace

Result<std::unique_ptr<CombinedDevice>> make_devices(std::string_view names, const DeviceOptions& options) {
  std::vector<std::unique_ptr<HapticDevice>> parts;
  // A recording's path may contain any character, so it stands alone.
  const std::string_view whole = names;
  const bool alone = names.starts_with("recorded:");
  while (true) {
    const std::size_t plus = alone ? std::string_view::npos : names.find('+');
    Made part = make_one(names.substr(0, plus), whole, options);
    if (!part) return tl::unexpected(part.error());
    parts.push_back(std::move(*part));
    if (plus == std::string_view::npos) break;
    names.remove_prefix(plus + 1);
  }
  return CombinedDevice::make(std::move(parts));
}

std::vector<DeviceLine> look_for_devices(const DeviceOptions& options) {
  std::vector<DeviceLine> lines;
  lines.push_back(
      {"simulated", "a simulated hand, strong enough for the drilling of bone; needs a plan", {{"always there"}, ""}});
  lines.push_back({"simulated-3.3N", "the same at a desktop device's force", {{"always there"}, ""}});
  lines.push_back(
      {"pointer", "the mouse of the window osteon, which starts this program: pointer:SOCKET", {{"always there"}, ""}});
  for (const Kind& kind : kKinds) lines.push_back({kind.name, kind.what, kind.look(options)});
  return lines;
}

}  // namespace osteon::haptic
