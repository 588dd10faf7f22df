#include "audio_client/device/sound_device.hpp"

#include <algorithm>
#include <charconv>

#include "common/core/bounded_text.hpp"

namespace osteon::audio {

Result<std::size_t> chosen_device(const std::vector<SoundDevice>& devices, const std::string& wanted,
                                  std::string_view kind) {
  const auto refused = [](const std::string& why) {
    return failure(ErrorCode::invalid_input, why + "; osteon-audio devices lists them, for --device");
  };
  const std::string one(kind), asked = "\"" + bounded_text(wanted, 80) + "\"";
  if (devices.empty()) return refused("the sound server has no " + one);
  const auto index = [&](auto found) { return static_cast<std::size_t>(found - devices.begin()); };
  if (wanted.empty()) {
    const auto usual = std::ranges::find_if(devices, &SoundDevice::is_default);
    return usual == devices.end() ? 0 : index(usual);
  }
  const auto named = [&](const SoundDevice& device) { return device.name == wanted; };
  if (std::ranges::count_if(devices, named) > 1)
    return refused("several " + one + "s are named " + asked + ": give a number");
  if (const auto found = std::ranges::find_if(devices, named); found != devices.end()) return index(found);
  std::size_t number = 0;
  const auto [end, fault] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  if (fault == std::errc() && end == wanted.data() + wanted.size() && number < devices.size()) return number;
  const auto similar = [&](const SoundDevice& device) { return device.name.find(wanted) != std::string::npos; };
  if (std::ranges::count_if(devices, similar) > 1)
    return refused("several " + one + "s have a name with " + asked + ": give more of it, or a number");
  if (const auto found = std::ranges::find_if(devices, similar); found != devices.end()) return index(found);
  return refused("there is no " + one + " " + asked);
}

}  // namespace osteon::audio
