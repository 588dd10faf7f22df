// Impacts in a sound. They are neither sinusoids nor steady noise, so a model keeps them as short samples (Verma 2000).
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace osteon::sound {

// What a model stores of impacts has limits: otherwise it would be a copy of the sound.
inline constexpr double kLongestTransient_s = 0.020;
inline constexpr double kMostTransientPart = 0.1;

struct TransientParams {
  double block_s = 0.003;   // over which levels are compared
  double before_s = 0.030;  // the loudest block within this time before an impact ...
  double rise_db = 9.0;     // ... is so much quieter
  double range_db = 30.0;   // impacts this far below the loudest block do not count
  double length_s = 0.020;  // kept of each, at most kLongestTransient_s
  double most_part = 0.1;   // of the recording, at most kMostTransientPart: the impacts with the largest rises
};

// A transient begins so long before its impact, and is faded in over that time.
inline constexpr double kTransientLead_s = 0.001;
// Over so long it is faded out.
inline constexpr double kTransientFade_s = 0.004;

// A stored piece of the signal, with flanks as of a Hann window.
struct Transient {
  std::size_t begin = 0;  // sample of the signal at which it begins
  std::vector<float> samples;
};

// Samples at which impacts begin, in order, at least length_s apart: the first sample of a block of block_s that
// exceeds all blocks of before_s before it by rise_db, moved to the steepest rise within it. The recording's own
// beginning counts as silence: a sound that begins with its recording is no impact.
[[nodiscard]] std::vector<std::size_t> impacts(std::span<const float> samples, double rate_hz,
                                               const TransientParams& params = {});

// The pieces round these impacts, times their weight.
[[nodiscard]] std::vector<Transient> transients_at(std::span<const float> samples, double rate_hz,
                                                   std::span<const std::size_t> impacts,
                                                   const TransientParams& params = {});

// Flanks of a transient of `count` samples: 1 between them, and near 0 at its ends.
[[nodiscard]] std::vector<float> transient_weight(std::size_t count, double rate_hz);

// `sound` gives way to the transients: it is multiplied by one less the weight, and their samples are added.
void put_transients(std::span<float> sound, std::span<const Transient> transients, double rate_hz);

}  // namespace osteon::sound
