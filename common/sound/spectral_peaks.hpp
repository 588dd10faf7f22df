// Sinusoids in one frame of a sound: peaks of its spectrum, interpolated, and refined by subtracting each other.
#pragma once
#include <complex>
#include <span>
#include <vector>

#include "common/sound/fourier.hpp"

namespace osteon::sound {

// amplitude cos(2 pi hz t + phase), t = 0 in the middle of the frame.
struct Sinusoid {
  double hz = 0;
  double amplitude = 0;  // 1 = full scale
  double phase = 0;      // rad
};

struct PeakParams {
  int size = 2048;              // samples of the transform; the frame is padded with zeros
  double threshold_db = -80.0;  // quieter peaks are left out, dB re amplitude 1
  int most = 100;               // peaks of a frame: the loudest ones
  int refinements = 0;          // rounds of refinement
};

// Finds the peaks of frames of `window` samples (even, at least 32, at most size). Owns its scratch memory: one thread
// at a time.
//
// A local maximum of the spectrum's magnitude in dB, alpha < beta > gamma, has its top at the offset p = (alpha -
// gamma) / (2 (alpha - 2 beta + gamma)) bins (Serra 1990). The amplitude and phase there follow from the transform W of
// the Hann window, X(k) = a / 2 exp(j phase) W(k - f). With W a frame of two lines is their sum. So in each round each
// peak, the loudest first, is estimated again from the frame's spectrum less that of all others. That fails if lines
// are closer than one main lobe, 4 rate / window: they are one peak. Maxima that may be side lobes of a louder peak are
// none.
class PeakFinder {
 public:
  PeakFinder(int window, double rate_hz, const PeakParams& params);

  // `frame`: window samples. Returns the peaks in the order of their frequencies.
  [[nodiscard]] std::vector<Sinusoid> find(std::span<const float> frame);

 private:
  struct Line {
    double bin = 0;             // frequency in bins of the transform
    std::complex<double> half;  // a / 2 exp(j phase)
  };

  void transform(std::span<const float> frame);
  [[nodiscard]] std::vector<Line> pick();
  void add(const Line& line, double sign);
  [[nodiscard]] Line estimated(int bin) const;
  [[nodiscard]] double window_at(double bins) const;  // W
  void refine(std::vector<Line>& lines);

  int window_;
  double rate_hz_;
  PeakParams params_;
  RealFft fft_;
  std::vector<float> hann_, time_;
  std::vector<std::complex<float>> bins_;
  std::vector<float> power_;
  std::vector<float> lobe_;  // W at steps of 1 / kLobeSteps bins
  int reach_ = 0;            // bins of the transform, on each side of a line, that its spectrum is taken for
  std::vector<float> side_;  // |W / W(0)|^2 of the side lobes, by whole bins
  std::vector<float> mask_;  // power below which a peak is a side lobe of a louder one
};

}  // namespace osteon::sound
