#include "common/sound/resample.hpp"

#include <samplerate.h>

#include <cmath>

#include "common/core/check.hpp"

namespace osteon::sound {

std::vector<float> resampled(std::span<const float> samples, double from_hz, double to_hz) {
  OSTEON_CHECK(from_hz > 0 && to_hz > 0);
  const double ratio = to_hz / from_hz;
  OSTEON_CHECK(ratio >= 1.0 / 256 && ratio <= 256);
  if (from_hz == to_hz || samples.empty()) return {samples.begin(), samples.end()};
  std::vector<float> result(static_cast<std::size_t>(std::llround(static_cast<double>(samples.size()) * ratio)), 0.0F);
  SRC_DATA data{};
  data.data_in = samples.data();
  data.input_frames = static_cast<long>(samples.size());
  data.data_out = result.data();
  data.output_frames = static_cast<long>(result.size());
  data.src_ratio = ratio;
  // It fails only for arguments that are excluded above.
  OSTEON_CHECK(src_simple(&data, SRC_SINC_MEDIUM_QUALITY, 1) == 0);
  return result;
}

}  // namespace osteon::sound
