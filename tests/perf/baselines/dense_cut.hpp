// Baseline of a cut: one dense array of floats over the whole bone. Each row near the tool is one loop that the
// compiler vectorises. It needs the memory of the whole box, cut or not.
#pragma once
#include <array>
#include <cstdlib>
#include <memory>

#include "tests/perf/baselines/swept_shape.hpp"

namespace osteon::baselines {

class DenseCut {
 public:
  // Samples from `min` to `max`, both included, of the pitch; z fastest. All hold the band: nothing is cut. Rows are
  // filled up to whole steps, so that a loop never ends within one.
  DenseCut(std::array<int, 3> min, std::array<int, 3> max, float pitch_mm, float band_mm);

  // Planes of x are spread over the threads that oneTBB allows, if there are several.
  void apply(const SweptShape& shape, int threads = 1);
  [[nodiscard]] float at(int x, int y, int z) const { return values_[index(x, y, z)]; }

 private:
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    const auto width = static_cast<std::size_t>(max_[1] - min_[1] + 1);
    return (static_cast<std::size_t>(x - min_[0]) * width + static_cast<std::size_t>(y - min_[1])) *
               static_cast<std::size_t>(row_) +
           static_cast<std::size_t>(z - min_[2]);
  }

  std::array<int, 3> min_, max_;
  int row_;
  float pitch_mm_;
  struct Free {
    void operator()(float* values) const { std::free(values); }
  };
  std::unique_ptr<float[], Free> values_;  // on a line of the cache, as every row then is
};

}  // namespace osteon::baselines
