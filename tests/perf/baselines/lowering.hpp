// The inner loops of the cut baselines: values = min(values, distance to the swept tool), rounded to 1/1024 mm and
// clipped to the band, as Osteon's cut field stores them. Plain loops that the compiler vectorises for the machine's
// own processor. Positions in mm, bone frame.
#pragma once
#include "tests/perf/baselines/swept_shape.hpp"

namespace osteon::baselines {

// A dense array of samples from `min` to `max`, both included; z fastest. A row has `row` samples, a multiple of
// kRowStep: it is filled up, so that no loop has a remainder.
inline constexpr int kRowStep = 16;
struct DenseSamples {
  std::array<int, 3> min, max;
  int row;
  float* values;
};

// The samples of the plane x, for y from first_y to last_y. Skips what is outside a ball or a cylinder round the tool.
void lower_plane(const SweptShape& shape, const DenseSamples& samples, int x, int first_y, int last_y);

// The 8³ samples of a leaf, z fastest, from (x, y, z) on.
void lower_leaf(const SweptShape& shape, float x_mm, float y_mm, float z_mm, float* values);

[[nodiscard]] float distance_mm(const SweptShape& shape, float x_mm, float y_mm, float z_mm);

}  // namespace osteon::baselines
