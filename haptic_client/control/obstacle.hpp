// What stands on the bone as the tool in the hand meets it: guides, pins, screws and implants, each as the distance of
// its solid on a lattice, so that a point is asked for in some nanoseconds whatever the solid is made of.
#pragma once
#include <memory>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon::haptic {

class SolidLattice {
 public:
  // About half a million samples at most, no finer than 0.2 mm: edges are rounded by less than half of that.
  explicit SolidLattice(const Tool& item);
  // [haptic] Distance to the solid, mm, at a point of the item's frame, and its gradient; negative inside. False where
  // the point is beyond the lattice, which reaches `margin_mm` beyond the solid.
  [[nodiscard]] bool sample(const Vec3& point_mm, double& distance_mm, Vec3& gradient) const noexcept;
  // Whether a ball about a point reaches the lattice.
  [[nodiscard]] bool near(const Vec3& point_mm, double radius_mm) const noexcept;
  static constexpr double margin_mm = 1.0;

 private:
  double pitch_mm_ = 0;
  Box box_;
  Coord dims_;
  std::vector<float> values_;  // z fastest
};

}  // namespace osteon::haptic
