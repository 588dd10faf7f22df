#include "audio_client/output/audio_output.hpp"

#include <algorithm>
#include <charconv>

#include "common/core/bounded_text.hpp"
#include "common/core/check.hpp"

namespace osteon::audio {

Result<OutputKind> output_kind(std::string_view name) {
  if (name == "pulse") return OutputKind::pulse;
  if (name == "none") return OutputKind::none;
  return failure(ErrorCode::invalid_input,
                 "there is no output \"" + std::string(name) + "\"; choose --output pulse or --output none");
}

Result<std::size_t> chosen_device(const std::vector<OutputDevice>& devices, const std::string& wanted) {
  const auto index = [&](auto found) { return static_cast<std::size_t>(found - devices.begin()); };
  const auto refused = [](const std::string& why) {
    return failure(ErrorCode::invalid_input, why + "; osteon-audio devices lists them, for --device");
  };
  if (wanted.empty()) {
    const auto usual = std::ranges::find_if(devices, &OutputDevice::is_default);
    if (devices.empty()) return refused("the sound server has no sink");
    return usual == devices.end() ? 0 : index(usual);
  }
  const auto named = [&](const OutputDevice& device) { return device.name == wanted; };
  if (std::ranges::count_if(devices, named) > 1)
    return refused("several sinks are named \"" + bounded_text(wanted, 80) + "\": give a number");
  if (const auto found = std::ranges::find_if(devices, named); found != devices.end()) return index(found);
  std::size_t number = 0;
  const auto [end, fault] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  if (fault == std::errc() && end == wanted.data() + wanted.size() && number < devices.size()) return number;
  return refused("there is no sink \"" + bounded_text(wanted, 80) + "\"");
}

Result<std::unique_ptr<AudioOutput>> open_output(const OutputParams& params, SoundSource& source) {
  OSTEON_CHECK(params.rate_hz > 0 && params.frames > 0 && params.buffers > 0);
  if (params.kind == OutputKind::none) return make_paced_output(params, source);
  return open_pulse_output(params, source);
}

}  // namespace osteon::audio
