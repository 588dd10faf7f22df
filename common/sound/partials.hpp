// Sinusoidal model of a sound (McAulay 1986): peaks of successive frames become partials, and partials become sound.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/sound/spectral_peaks.hpp"

namespace osteon::sound {

struct PartialParams {
  int window = 1000;  // samples of a frame, even
  int hop = 128;      // samples from one frame to the next
  PeakParams peaks;
  double step_hz = 20.0;  // a partial moves by at most step_hz + step_part f in a hop
  double step_part = 0.005;
  double shortest_s = 0.02;  // shorter partials are left to the residual
};

// A sinusoid over successive frames. Point i belongs to sample (first + i) * hop.
struct Partial {
  std::size_t first = 0;
  std::vector<Sinusoid> points;
};

// The peaks of the frames 0 ... samples / hop, whose middles are at the samples m * hop. `cuts` are samples at which
// something new begins, such as ringing after an impact: a frame with its middle before a cut sees nothing beyond it. A
// frame that would reach beyond a cut or the signal is moved to the side, and its phases are carried to its middle by
// their frequencies. Where too little is left for that, the frame is shorter, and below 32 samples it has no peaks. If
// `keep_going` stops the work, the frames that were not reached have no peaks.
[[nodiscard]] std::vector<std::vector<Sinusoid>> frame_peaks(
    std::span<const float> samples, double rate_hz, const PartialParams& params, std::span<const std::size_t> cuts = {},
    const KeepGoing& keep_going = [](double) { return true; });

// Peak continuation: from frame to frame, the closest pair of a partial and a peak is joined first, then the next
// closest, within the step. A partial without a peak dies, and a peak without a partial is born. Short partials are
// left out. Partials are in the order of their births, then of their frequencies. None goes on across a cut.
[[nodiscard]] std::vector<Partial> continued(std::span<const std::vector<Sinusoid>> frames, double rate_hz,
                                             const PartialParams& params, std::span<const std::size_t> cuts = {});

// The sound of partials, with their phases: between two points the amplitude is a line, and the phase the cubic that
// meets both phases and frequencies, with the number of turns that makes it smoothest (McAulay 1986, eq. 33 to 37). A
// partial begins and ends within a hop of its first and last point, or at once at a cut in the hop before its first
// one.
[[nodiscard]] std::vector<float> sound_with_phases(std::span<const Partial> partials, double rate_hz, int hop,
                                                   std::size_t samples, std::span<const std::size_t> cuts = {});

}  // namespace osteon::sound
