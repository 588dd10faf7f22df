#include "audio_client/app/devices_command.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "audio_client/capture/sound_input.hpp"
#include "audio_client/output/audio_output.hpp"
#include "common/core/bounded_text.hpp"

namespace osteon::audio {
namespace {

// One line for each; the default one has a star.
std::string list_of(const char* title, const std::vector<SoundDevice>& devices) {
  std::string text = std::string(title) + (devices.empty() ? " none\n" : "\n");
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const SoundDevice& device = devices[i];
    char numbers[80];
    std::snprintf(numbers, sizeof numbers, "%c %2zu  %2u channels  %6u Hz  ", device.is_default ? '*' : ' ', i,
                  device.channels, device.rate_hz);
    text += numbers + bounded_text(device.name, 200) + "\n";
  }
  return text;
}

Result<std::string> run_devices() {
  const Result<std::vector<SoundDevice>> sinks = output_devices();
  if (!sinks) return tl::unexpected(sinks.error());
  const Result<std::vector<SoundDevice>> sources = input_devices();
  if (!sources) return tl::unexpected(sources.error());
  return list_of("sinks, to play to:", *sinks) + list_of("sources, to record from:", *sources);
}

}  // namespace

void add_devices_command(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  CLI::App* command =
      app.add_subcommand("devices",
                         "List the sinks and sources of the sound server: number, channels, rate and name, with a star "
                         "at the default one. RtAudio tells no latency, nor whether anything is plugged in");
  command->callback([&chosen] { chosen = run_devices; });
}

}  // namespace osteon::audio
