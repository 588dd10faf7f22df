#include "audio_client/app/recording_option.hpp"

#include <cstdint>

#include "common/core/bounded_text.hpp"
#include "common/core/read_number.hpp"
#include "common/runtime/number_option.hpp"

namespace osteon::audio {

CLI::Validator whole_number() {
  return {[](const std::string& text) {
            return read_number<std::uint64_t>(text) ? std::string() : text + " is no whole number from 0 to 2^64 - 1";
          },
          ""};
}

CLI::Validator given_name() {
  return {[](const std::string& text) {
            return text.empty() ? std::string("the name is empty; give a file") : std::string();
          },
          ""};
}

void add_recording(CLI::App& command, RecordingOption& recording) {
  command.add_option("FILE", recording.file, "WAV or RF64, PCM or float, 22050 to 384000 Hz, 0.25 s to 5 minutes")
      ->required();
  command.add_option("--channel", recording.channel,
                     "Of several that differ: left, right, mean, or its number from 1 on");
  command
      .add_option("--from", recording.from_s,
                  "Seconds of the recording at which its part begins. All other times count from here")
      ->check(number_in(0.0, 1e6))
      ->capture_default_str();
  command
      .add_option("--to", recording.to_s,
                  "Seconds of the recording at which its part ends; by default, the recording's end")
      ->check(number_in(0.0, 1e6));
}

Result<sound::WavSound> read(const RecordingOption& recording) {
  sound::WavPart part{.channel = {}, .from_s = recording.from_s, .to_s = recording.to_s};
  if (!recording.channel.empty() && !(part.channel = sound::channel_of(recording.channel)))
    return failure(ErrorCode::invalid_input, "--channel must be left, right, mean or a number from 1 to " +
                                                 std::to_string(sound::kMostChannels) + ", not " +
                                                 bounded_text(recording.channel, 40));
  return sound::read_wav(recording.file, part);
}

}  // namespace osteon::audio
