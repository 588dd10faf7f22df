#include "audio_client/app/devices_command.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "common/core/bounded_text.hpp"

namespace osteon::audio {
namespace {

// One line for each sink; the default one has a star.
Result<std::string> run_devices() {
  const Result<std::vector<OutputDevice>> devices = output_devices();
  if (!devices) return tl::unexpected(devices.error());
  if (devices->empty())
    return failure(ErrorCode::unavailable, "the sound server has no sink; connect a device, or use --output none");
  std::string text;
  for (std::size_t i = 0; i < devices->size(); ++i) {
    const OutputDevice& device = (*devices)[i];
    char numbers[80];
    std::snprintf(numbers, sizeof numbers, "%c %2zu  %2u channels  %6u Hz  ", device.is_default ? '*' : ' ', i,
                  device.channels, device.rate_hz);
    text += numbers + bounded_text(device.name, 200) + "\n";
  }
  return text;
}

}  // namespace

void add_devices_command(CLI::App& app, std::function<Result<std::string>()>& chosen) {
  CLI::App* command =
      app.add_subcommand("devices",
                         "List the sinks of the sound server: number, channels, rate and name, with a star at the "
                         "default one. RtAudio tells no latency, nor whether anything is plugged in");
  command->callback([&chosen] { chosen = run_devices; });
}

}  // namespace osteon::audio
