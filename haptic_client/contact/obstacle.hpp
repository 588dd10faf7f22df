// Items on the bone as obstacles to the tool in hand: guides, pins, screws and implants. Each is a lattice of its
// solid's distance. So sampling a point takes some nanoseconds, whatever the form of the solid.
#pragma once
#include <memory>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon::haptic {

class SolidLattice {
 public:
  // About half a million samples at most, no finer than 0.2 mm. Edges are rounded by less than half of that.
  explicit SolidLattice(const Tool& item);
  // [haptic] Distance to the solid, mm, at a point of the item's frame, and its gradient; negative inside. Returns
  // false where the point is outside the lattice, which reaches `margin_mm` beyond the solid.
  [[nodiscard]] bool sample(const Vec3& point_mm, double& distance_mm, Vec3& gradient) const noexcept;
  // Whether a ball around a point reaches the lattice.
  [[nodiscard]] bool near(const Vec3& point_mm, double radius_mm) const noexcept;
  static constexpr double margin_mm = 1.0;

 private:
  double pitch_mm_ = 0;
  Box box_;
  Coord dims_;
  std::vector<float> values_;  // z fastest
};

}  // namespace osteon::haptic
