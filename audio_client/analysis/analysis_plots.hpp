// The pictures of an analysis, as the figures of 8.5 show them.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "audio_client/analysis/analysis.hpp"
#include "audio_client/analysis/displacement_file.hpp"
#include "audio_client/analysis/plot.hpp"
#include "common/picture/picture.hpp"

namespace osteon::audio {

// Of the curve of the whole recording, and of those of the states: as a curve, a name, and paler behind a signal.
inline constexpr picture::Colour kWholeColour = kInk;
[[nodiscard]] picture::Colour colour_of(sound::DrillingState state);

struct NamedPicture {
  std::string file;  // NAME.png
  picture::Picture picture;
};

// waveform.png (Figure 8.6), psd.png (8.10), spectrogram.png (8.13), packets.png (8.12), bands.png (8.14 to 8.16: the
// signal of each band over time, with the displacement and its axis if there is one), and difference.png (8.18, 8.19)
// if there is a difference. `displacement`: may be empty.
[[nodiscard]] std::vector<NamedPicture> pictures_of(const SoundAnalysis& analysis,
                                                    std::span<const DisplacementRow> displacement);

}  // namespace osteon::audio
