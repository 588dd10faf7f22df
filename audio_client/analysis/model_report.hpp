// A recording as a spectral model, and how near its sound comes to the recording.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/sound/spectral_model.hpp"
#include "common/sound/wav_file.hpp"

namespace osteon::audio {

// Smaller is nearer, but for the SNR.
struct Likeness {
  std::string what;
  double snr_db = 0, psd_lsd_db = 0, mel_lsd_db = 0, envelope_error_db = 0;
};

struct ModelReport {
  sound::SpectralAnalysis analysis;
  std::string bytes;           // the file of the model
  std::vector<float> sound;    // of the model as it is in that file, at its rate
  std::vector<Likeness> rows;  // sines with phases; all with phases; all without phases
  double work_s = 0;           // of one processor, for the analysis
};

// `refinements`: rounds of refinement of the peaks. `seed`: of phases and noise. Error: cancelled.
[[nodiscard]] Result<ModelReport> model_report(const sound::WavSound& recording, int refinements, std::uint64_t seed,
                                               const KeepGoing& keep_going);

// The table that osteon-audio model prints.
[[nodiscard]] std::string to_text(const ModelReport& report);

// Reads the file of a model. Errors: not_found, invalid_input, unsupported.
[[nodiscard]] Result<sound::SpectralModel> read_model(const std::string& file);

}  // namespace osteon::audio
