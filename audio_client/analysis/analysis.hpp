// The analysis of a recorded drilling (8.5): states, spectra, wavelet packets, and the sound difference (8.20) between
// a cutting drill and a free one.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/sound/drilling_states.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/stft.hpp"
#include "common/sound/wav_file.hpp"
#include "common/sound/wavelet_packets.hpp"

namespace osteon::audio {

// 8.5.4 analyses at this rate. The bands of the wavelet packets follow from it.
inline constexpr int kAnalysisRate_hz = 22050;

struct AnalysisParams {
  int spectrum_window = 4096;  // samples: bins of 5.4 Hz
  int spectrogram_window = 512;
  double spindle_rpm = 1400;
  double line_reach = 0.03;             // of a line's frequency: within it its peak is looked for
  std::optional<double> full_scale_pa;  // pressure of a sample of 1, for sound levels
  std::optional<sound::TimeSpan> free;  // where the drill runs free; otherwise the longest such state
};

// The average power spectrum of one state, over its longest span.
struct StateSpectrum {
  sound::DrillingState state{};
  sound::TimeSpan span;
  sound::Spectrum spectrum;
  std::vector<sound::Peak> peaks;  // the strongest, loudest first
};

struct PacketShare {
  sound::Packet packet;
  double share = 0;     // of the energy of its level
  double level_db = 0;  // re full scale
};

struct BandInTime {
  sound::Packet packet;
  std::vector<float> samples;  // as many as the recording has at the analysis rate
};

// A line of the gears and the strongest peak near it; none if that does not exceed the median of its neighbourhood by
// 8 dB. Of noise that did not last, the median is 1.6 dB below the mean.
struct FoundLine {
  sound::GearLine line;
  std::optional<sound::Peak> peak;
};

struct Difference {
  sound::TimeSpan free;        // of which the spectrum was subtracted
  std::vector<float> samples;  // the sound difference in time (8.20)
  sound::Spectrum spectrum;    // of the same span as `drilled`
  sound::DrillingState drilled{};
};

struct SoundAnalysis {
  AnalysisParams params;
  int file_rate_hz = 0, file_channels = 0, file_bits = 0;
  bool file_floating = false;
  double from_s = 0, file_s = 0;           // times of all results count from from_s of the file
  std::optional<double> announced_s = {};  // as in WavSound
  std::size_t clipped = 0;                 // likewise
  std::string file_notes;                  // recording_notes()
  double rate_hz = kAnalysisRate_hz;
  std::vector<float> samples;  // at rate_hz
  double level_db = 0, peak = 0;
  sound::Spectrum whole;
  std::vector<StateSpectrum> spectra;  // of each state that occurs, in the order of DrillingState
  sound::Spectrogram spectrogram;
  std::vector<sound::StateSpan> states;
  std::vector<PacketShare> packets;  // levels 1 to 5
  std::vector<BandInTime> bands;     // those of Figure 8.14
  std::vector<FoundLine> lines;
  std::optional<Difference> difference;  // if there is a free and a drilled span
};

// A pure function of both. It takes about 1 s for a minute of sound.
[[nodiscard]] SoundAnalysis analyse(const sound::WavSound& recording, const AnalysisParams& params);
// The same. `keep_going` is called after each part. Error: cancelled.
[[nodiscard]] Result<SoundAnalysis> analyse(const sound::WavSound& recording, const AnalysisParams& params,
                                            const KeepGoing& keep_going);

// The spectrum of a state, or null.
[[nodiscard]] const StateSpectrum* spectrum_of(const SoundAnalysis& analysis, sound::DrillingState state);

}  // namespace osteon::audio
