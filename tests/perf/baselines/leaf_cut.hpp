// Baseline of a cut: an OpenVDB grid. Only leaves near the tool are walked. A ValueAccessor that is kept between cuts
// finds them through its cached nodes, and the samples of a leaf are one buffer.
#pragma once
#include <openvdb/openvdb.h>

#include <vector>

#include "tests/perf/baselines/swept_shape.hpp"

namespace osteon::baselines {

class LeafCut {
 public:
  // Leaves that meet the samples from `min` to `max`, both included; others have no bone. The background is the band.
  LeafCut(std::array<int, 3> min, std::array<int, 3> max, float pitch_mm, float band_mm);

  // Leaves are spread over the threads that oneTBB allows, if there are several.
  void apply(const SweptShape& shape, int threads = 1);
  [[nodiscard]] float at(int x, int y, int z) const { return accessor_.getValue({x, y, z}); }

 private:
  struct Near {
    openvdb::FloatTree::LeafNodeType* leaf;
    bool removed;  // every sample is deeper than the band
  };
  void lower(const SweptShape& shape, const Near& near) const;

  std::array<int, 3> first_, last_;  // corners of the first and of the last leaf
  float pitch_mm_;
  openvdb::FloatGrid::Ptr grid_;
  openvdb::FloatGrid::Accessor accessor_;
  std::vector<Near> near_;  // kept between cuts for its memory
};

}  // namespace osteon::baselines
