// Recordings as PCM WAV files (Figure 8.4).
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::sound {

// Which part of a stereo recording is meant.
enum class Channel { left, right, mean };
[[nodiscard]] std::optional<Channel> channel_of(std::string_view name);  // "left", "right", "mean"

struct WavSound {
  int rate_hz = 0;             // SampleRate
  int channels = 1;            // NumChannels of the file
  int bits = 16;               // BitsPerSample
  std::vector<float> samples;  // of one channel, or of the mean of both; 1 is full scale

  [[nodiscard]] double seconds() const { return static_cast<double>(samples.size()) / rate_hz; }
};

inline constexpr int kLowestRate_hz = 22050, kHighestRate_hz = 48000;
inline constexpr double kShortest_s = 0.25, kLongest_s = 300.0;

// Reads integer PCM of 16, 24 or 32 bits, with one channel, or two of which `channel` says which one is meant. Refuses
// 8 bits, whose rounding is louder than a quiet room, rates and lengths beyond the limits above, and files that end
// before their header says so. Errors: not_found, invalid_input, unsupported; one sentence with file, field and remedy.
[[nodiscard]] Result<WavSound> read_wav(const std::filesystem::path& file, std::optional<Channel> channel = {});

// Writes mono PCM of 16 bits. Samples beyond full scale are clipped. Error: internal (disk), naming the file.
[[nodiscard]] Result<void> write_wav(const std::filesystem::path& file, std::span<const float> samples, int rate_hz);

}  // namespace osteon::sound
