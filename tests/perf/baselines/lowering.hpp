// The inner loops of the cut baselines: values = min(values, distance to the swept tool), rounded to 1/1024 mm and
// clipped to the band, as Osteon's cut field stores them. Plain loops that the compiler vectorises for the machine's
// own processor. Positions in mm, bone frame.
#pragma once
#include "tests/perf/baselines/swept_shape.hpp"

namespace osteon::baselines {

// The samples of a row along z that the tool's band may reach, by a ball or a cylinder round the tool.
struct RowSpan {
  float from_mm, to_mm;  // empty if to < from
};
[[nodiscard]] RowSpan row_span(const SweptShape& shape, float x_mm, float y_mm);

// n samples along z, a pitch apart, from (x, y, z) on.
void lower_row(const SweptShape& shape, float x_mm, float y_mm, float z_mm, int n, float* values);

// The 8³ samples of a leaf, z fastest, from (x, y, z) on.
void lower_leaf(const SweptShape& shape, float x_mm, float y_mm, float z_mm, float* values);

[[nodiscard]] float distance_mm(const SweptShape& shape, float x_mm, float y_mm, float z_mm);

}  // namespace osteon::baselines
