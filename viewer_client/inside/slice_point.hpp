// The point through which the slices go: the tip of the tool while it cuts, else the cross that the user has set.
#pragma once
#include "common/geometry/lattice.hpp"
#include "viewer_client/inside/slice_planes.hpp"

namespace osteon {

class SlicePoint {
 public:
  // A new bone: its middle.
  void reset(const Vec3& middle_mm) { *this = SlicePoint(), point_mm_ = middle_mm; }
  // The user has put it there. It stays there until a tool cuts.
  void set(const Vec3& point_mm) {
    point_mm_ = point_mm;
    set_by_user_ = true;
  }
  // Where the tool is now. Planes along a tool also follow one that is only held, so that it can be aimed.
  void follow(const Pose& tool, bool cuts, SliceAxes axes) {
    rotation_ = tool.rotation;
    if (cuts) set_by_user_ = false;
    if (cuts || (axes == SliceAxes::tool && !set_by_user_)) point_mm_ = tool.position_mm;
  }
  [[nodiscard]] const Vec3& point_mm() const { return point_mm_; }
  [[nodiscard]] const Eigen::Quaterniond& rotation() const { return rotation_; }  // of the tool that was followed last

 private:
  Vec3 point_mm_ = Vec3::Zero();
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  bool set_by_user_ = false;
};

}  // namespace osteon
