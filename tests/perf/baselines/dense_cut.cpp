#include "tests/perf/baselines/dense_cut.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "tests/perf/baselines/lowering.hpp"

namespace osteon::baselines {

DenseCut::DenseCut(std::array<int, 3> min, std::array<int, 3> max, float pitch_mm, float band_mm)
    : min_(min), max_(max), row_(((max[2] - min[2]) / kRowStep + 1) * kRowStep), pitch_mm_(pitch_mm) {
  const std::size_t samples = index(max[0], max[1], min[2]) + static_cast<std::size_t>(row_);
  values_.reset(static_cast<float*>(std::aligned_alloc(kRowStep * sizeof(float), samples * sizeof(float))));
  OSTEON_CHECK(values_);
  std::fill_n(values_.get(), samples, band_mm);
}

void DenseCut::apply(const SweptShape& shape, int threads) {
  std::array<int, 2> first{}, last{};
  for (std::size_t k = 0; k < 2; ++k) {
    first[k] = std::max(min_[k], static_cast<int>(std::ceil(shape.low[k] / pitch_mm_)));
    last[k] = std::min(max_[k], static_cast<int>(std::floor(shape.high[k] / pitch_mm_)));
  }
  const DenseSamples samples{min_, max_, row_, values_.get()};
  const auto plane = [&](int x) { lower_plane(shape, samples, x, first[1], last[1]); };
  if (threads > 1) {
    tbb::parallel_for(first[0], last[0] + 1, plane);
    return;
  }
  for (int x = first[0]; x <= last[0]; ++x) plane(x);
}

}  // namespace osteon::baselines
