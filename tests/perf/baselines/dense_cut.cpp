#include "tests/perf/baselines/dense_cut.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "tests/perf/baselines/lowering.hpp"

namespace osteon::baselines {

DenseCut::DenseCut(std::array<int, 3> min, std::array<int, 3> max, float pitch_mm, float band_mm)
    : min_(min),
      max_(max),
      dims_{max[0] - min[0] + 1, max[1] - min[1] + 1, max[2] - min[2] + 1},
      pitch_mm_(pitch_mm),
      values_(index(max[0], max[1], max[2]) + 1, band_mm) {}

void DenseCut::lower_plane(const SweptShape& shape, int x, int first_y, int last_y) {
  const float x_mm = static_cast<float>(x) * pitch_mm_;
  for (int y = first_y; y <= last_y; ++y) {
    const float y_mm = static_cast<float>(y) * pitch_mm_;
    const RowSpan span = row_span(shape, x_mm, y_mm);
    const int first = std::max(min_[2], static_cast<int>(std::ceil(span.from_mm / pitch_mm_)));
    const int last = std::min(max_[2], static_cast<int>(std::floor(span.to_mm / pitch_mm_)));
    if (first <= last)
      lower_row(shape, x_mm, y_mm, static_cast<float>(first) * pitch_mm_, last - first + 1,
                &values_[index(x, y, first)]);
  }
}

void DenseCut::apply(const SweptShape& shape, int threads) {
  std::array<int, 2> first{}, last{};
  for (std::size_t k = 0; k < 2; ++k) {
    first[k] = std::max(min_[k], static_cast<int>(std::ceil(shape.low[k] / pitch_mm_)));
    last[k] = std::min(max_[k], static_cast<int>(std::floor(shape.high[k] / pitch_mm_)));
  }
  if (threads > 1) {
    tbb::parallel_for(first[0], last[0] + 1, [&](int x) { lower_plane(shape, x, first[1], last[1]); });
    return;
  }
  for (int x = first[0]; x <= last[0]; ++x) lower_plane(shape, x, first[1], last[1]);
}

}  // namespace osteon::baselines
