// Baseline of a cut: OpenVDB's own way. Bone and tool are level sets, and openvdb::tools::csgDifference takes the tool
// away from the bone.
#pragma once
#include <openvdb/openvdb.h>

#include <functional>

#include "tests/perf/baselines/swept_shape.hpp"

namespace osteon::baselines {

class CsgCut {
 public:
  // `bone_mm`: signed distance of the bone at a point in mm, negative inside. Its samples are from `min` to `max`.
  CsgCut(std::array<int, 3> min, std::array<int, 3> max, float pitch_mm, float band_mm,
         const std::function<float(float, float, float)>& bone_mm);

  void apply(const SweptShape& shape);
  // The bone that is left: negative inside, clipped to the band.
  [[nodiscard]] float at(int x, int y, int z) const { return bone_->tree().getValue({x, y, z}); }

 private:
  float pitch_mm_;
  openvdb::FloatGrid::Ptr bone_;
};

}  // namespace osteon::baselines
