#include "common/radiology/slice.hpp"

#include "common/core/check.hpp"
#include "common/radiology/sampling.hpp"

namespace osteon::radiology {
namespace {

std::array<float, 3> as_floats(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

PixelGrid plane_about(const Vec3& centre, const Vec3& right, const Vec3& down, const SliceView& view) {
  return grid_about(centre, right, down, view.pixel_mm, view.columns, view.rows);
}

}  // namespace

void sample_slice(const BoneHu& bone, const PixelGrid& plane, std::span<float> hu) {
  OSTEON_CHECK(hu.size() == plane.count());
  const HuLattice lattice = bone.lattice();
  const std::array<float, 3> step = as_floats(plane.column_mm / bone.pitch_mm());
  for (int row = 0; row < plane.rows; ++row)
    sample_line(lattice, as_floats(bone.in_lattice(plane.at(0, row))), step, plane.columns,
                hu.data() + plane.index(0, row));
}

PatientPlanes patient_planes(const Vec3& point_mm, const SliceView& view) {
  const Vec3 left = Vec3::UnitX(), back = Vec3::UnitY(), feet = -Vec3::UnitZ();
  return {plane_about(point_mm, left, back, view), plane_about(point_mm, left, feet, view),
          plane_about(point_mm, back, feet, view)};
}

ToolPlanes tool_planes(const Pose& pose_bone_tool, const SliceView& view) {
  const Vec3 tip = pose_bone_tool.position_mm, x = pose_bone_tool.direction(Vec3::UnitX()),
             y = pose_bone_tool.direction(Vec3::UnitY()), axis = pose_bone_tool.direction(Vec3::UnitZ());
  return {plane_about(tip, x, axis, view), plane_about(tip, y, axis, view), plane_about(tip, x, y, view)};
}

}  // namespace osteon::radiology
