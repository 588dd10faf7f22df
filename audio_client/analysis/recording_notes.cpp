#include "audio_client/analysis/recording_notes.hpp"

#include <array>
#include <cstdio>

namespace osteon::audio {
namespace {

std::string of_clipping(const sound::WavSound& recording) {
  const double part = static_cast<double>(recording.clipped) / static_cast<double>(recording.samples.size());
  std::array<char, 200> text{};
  std::snprintf(
      text.data(), text.size(),
      "note       %zu samples (%.2g %%) stay at full scale, so the sound may be clipped; record it at a lower "
      "level\n",
      recording.clipped, 100.0 * part);
  return text.data();
}

}  // namespace

std::string recording_notes(const sound::WavSound& recording) {
  std::string text;
  std::array<char, 120> line{};
  if (recording.announced_s) {
    if (*recording.announced_s > 0)
      std::snprintf(line.data(), line.size(), "note       the header announces %.4g s; %.4g s are there\n",
                    *recording.announced_s, recording.file_s);
    else
      std::snprintf(line.data(), line.size(), "note       the header gives no length; %.4g s are there\n",
                    recording.file_s);
    text += line.data();
  }
  if (recording.bits == 8)
    text += "note       8 bits: their quantisation noise, about -53 dB re full scale, hides a quiet room\n";
  if (recording.clipped > 0) text += of_clipping(recording);
  return text;
}

}  // namespace osteon::audio
