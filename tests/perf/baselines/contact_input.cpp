#include "tests/perf/baselines/contact_input.hpp"

namespace osteon::baselines {
namespace {

DenseGrid empty_grid(const CoordBox& box, double pitch_mm) {
  const Coord d = box.dims();
  const Vec3 origin = position_mm(box.min, pitch_mm);
  DenseGrid grid;
  grid.dims = {d.x, d.y, d.z};
  grid.origin_mm = {static_cast<float>(origin.x()), static_cast<float>(origin.y()), static_cast<float>(origin.z())};
  grid.pitch_mm = static_cast<float>(pitch_mm);
  grid.values.resize(static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z));
  return grid;
}

std::array<float, 3> floats(const Vec3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

}  // namespace

PointArrays point_arrays(const haptic::ContactSet& set) {
  return {set.x, set.y, set.z, set.nx, set.ny, set.nz, set.area_mm2, set.arm_mm, set.edge};
}

ContactTask contact_task(const haptic::ContactQuery& query) {
  const Eigen::Matrix3d turn = query.pose_bone_tool.rotation.toRotationMatrix();
  ContactTask task;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      task.rotation[static_cast<std::size_t>(3 * row + column)] = static_cast<float>(turn(row, column));
  task.position_mm = floats(query.pose_bone_tool.position_mm);
  task.direction = floats(query.direction_bone);
  task.toward = floats(turn.transpose() * query.direction_bone);
  task.lift_mm = static_cast<float>(query.lift_mm);
  task.ahead_mm = static_cast<float>(query.ahead_mm);
  task.most_mm = static_cast<float>(query.most_mm);
  task.least_facing = static_cast<float>(query.least_facing);
  task.strength = query.strength->data();
  task.strength_steps = haptic::kDensitySteps;
  task.most_density_g_cm3 = static_cast<float>(haptic::kMostDensity_g_cm3);
  task.left_out_mm = haptic::kLeftOut_mm;
  return task;
}

PointValues room_for(const PointArrays& points) {
  const std::vector<float> room(points.x.size());
  return {room, room, room, room, room};
}

DenseGrid dense_solid(const CutField& field, int level, const CoordBox& box) {
  DenseGrid grid = empty_grid(box, level_pitch_mm(field.bone().pitch_mm(), level));
  field.gather_solid(level, box, grid.values);
  return grid;
}

DenseGrid dense_density(const Case& bone, const CoordBox& box) {
  DenseGrid grid = empty_grid(box, bone.pitch_mm());
  bone.gather_density(box, grid.values);
  return grid;
}

}  // namespace osteon::baselines
