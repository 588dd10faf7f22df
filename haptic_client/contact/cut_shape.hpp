// The form that a tool removes. The proxy remembers it until the bone of its patch is up to date. Gives the cutting
// body's distance at a point, and the way out of it.
#pragma once
#include <array>
#include <memory>

#include "common/tools/tool.hpp"
#include "haptic_client/contact/contact.hpp"

namespace osteon::haptic {

class CutShape {
 public:
  CutShape() = default;
  // `open_behind`: for a tool that goes along its axis. Its hole continues behind it, so faces that point back are left
  // out.
  CutShape(const Tool& tool, bool open_behind);
  // Of a point in the tool's frame. Exact inside and in front of faces. Too small in front of edges, where only the
  // sign counts.
  [[nodiscard]] double distance_mm(const Vec3& point_mm) const noexcept {
    Vec3 out;
    return distance_mm(point_mm, out);
  }
  // [haptic] `out`: its gradient, a unit vector out of the body.
  [[nodiscard]] double distance_mm(const Vec3& point_mm, Vec3& out) const noexcept;
  // [haptic] Of a group of points at once, in single precision. `place`: from the points' frame to the tool's. `p`: x,
  // y, z.
  [[nodiscard]] Lanes distance_mm(const HullPlace& place, const Lanes (&p)[3]) const noexcept;
  [[nodiscard]] bool open_behind() const noexcept { return open_behind_; }
  // How far behind its tip the tool cuts.
  [[nodiscard]] double behind_mm() const noexcept { return behind_mm_; }
  // The sweep of a ball is a capsule about its centre.
  [[nodiscard]] bool is_ball() const noexcept { return kind_ == CutKind::ball; }
  [[nodiscard]] double radius_mm() const noexcept { return radius_mm_; }
  [[nodiscard]] Vec3 ball_centre_mm() const noexcept { return {0, 0, -radius_mm_}; }

 private:
  // Turned body: n · (distance from the axis, position along it). Hull: n · point. Both are at most the offset.
  struct Plane {
    Vec3 n = Vec3::Zero();
    double offset_mm = 0;
  };
  CutKind kind_ = CutKind::none;
  bool open_behind_ = false;
  int count_ = 0;
  std::array<Plane, kMostHullPlanes + 4> planes_;
  std::array<HullFace, kMostHullPlanes + 4> faces_;  // the same in single precision
  double behind_mm_ = 0;
  double radius_mm_ = 0;                            // of a ball, and of the dome that rounds a turned body's end
  std::shared_ptr<const SampledDistance> sampled_;  // shared with the tool, immutable
};

}  // namespace osteon::haptic
