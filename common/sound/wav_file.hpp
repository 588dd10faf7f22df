// Recordings as WAV files (Figure 8.4).
#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"

namespace osteon::sound {

// Which channel of a recording is meant: its number from 1 on, or the mean of all.
enum class Channel : int { mean = 0, left = 1, right = 2 };
inline constexpr int kMostChannels = 64;
// "left", "right", "mean", or a number from 1 to kMostChannels.
[[nodiscard]] std::optional<Channel> channel_of(std::string_view name);

// The part of a file that is read.
struct WavPart {
  std::optional<Channel> channel = {};  // needed only if there are several that differ
  double from_s = 0;
  std::optional<double> to_s = {};  // the end, if not given
};

struct WavSound {
  int rate_hz = 0;                         // SampleRate
  int channels = 1;                        // NumChannels of the file
  int bits = 16;                           // BitsPerSample
  bool floating = false;                   // AudioFormat: IEEE float, or else integers
  double from_s = 0;                       // of the file, at which the samples begin
  double file_s = 0;                       // of sound in the file
  std::optional<double> announced_s = {};  // what its header says, if that is more; 0 if it says nothing
  // Frames of the part in which a channel that counts stays at full scale, from one sample to the next. One sample
  // alone may be the peak of a recording that was made as loud as possible.
  std::size_t clipped = 0;
  std::vector<float> samples;  // of one channel, or of the mean of all; 1 is full scale

  [[nodiscard]] double seconds() const { return static_cast<double>(samples.size()) / rate_hz; }
};

inline constexpr int kLowestRate_hz = 22050, kHighestRate_hz = 384000;
inline constexpr double kShortest_s = 0.25, kLongest_s = 300.0;

// Reads WAV and RF64: integer PCM of 8 to 32 bits, or float of 32 or 64. Several channels need `channel`, unless all
// are equal. A header that announces more than there is, as a recorder leaves it that streams or loses power, is no
// error: see `announced_s`. Refuses rates and lengths beyond the limits above, and samples that are no numbers. Errors:
// not_found, invalid_input, unsupported; one sentence with file, field and remedy.
[[nodiscard]] Result<WavSound> read_wav(const std::filesystem::path& file, const WavPart& part = {});

// Writes mono PCM of 16 bits. Samples beyond full scale are clipped. Error: internal (disk), naming the file.
[[nodiscard]] Result<void> write_wav(const std::filesystem::path& file, std::span<const float> samples, int rate_hz);

}  // namespace osteon::sound
