// Measures a femur in its finished case, as a person measures a bone: from the surface and the density alone.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "common/phantoms/phantom_bone.hpp"
#include "common/volume/case.hpp"

namespace osteon::phantoms {

// A case in the bone's own directions: x lateral, y anterior, z proximal.
class BoneView {
 public:
  BoneView(const Case& bone, Side side) : bone_(bone), side_(side == Side::left ? 1.0 : -1.0) {}

  [[nodiscard]] Vec3 world(const Vec3& own) const { return {side_ * own.x(), -own.y(), own.z()}; }
  [[nodiscard]] double surface_mm(const Vec3& own) const { return bone_.surface_mm(world(own)); }
  [[nodiscard]] double density_g_cm3(const Vec3& own) const { return bone_.density_g_cm3(world(own)); }
  [[nodiscard]] double pitch_mm() const { return bone_.pitch_mm(); }
  // Where the lattice's edges cross the surface.
  [[nodiscard]] std::vector<Vec3> surface_points() const;
  // How far it is from a point in the bone to the surface.
  [[nodiscard]] double reach_mm(const Vec3& from, const Vec3& direction) const;
  // Thickness of the cortex, along a line from a point deep in the bone outwards. At its inner face, the density is
  // half way between that of cortex and what is 3 mm deeper.
  [[nodiscard]] double cortex_mm(const Vec3& from, const Vec3& direction, double thickest_mm) const;

 private:
  const Case& bone_;
  double side_;
};

// The number of the bone that has a point of the surface: that of the deepest sample around it. Samples outside of bone
// may have any number.
[[nodiscard]] int bone_beside(const Case& bone, const Vec3& at_mm);

// The x for which |rows x - values| is least. Compiled once, because each type of matrix that a file solves for takes
// seconds.
[[nodiscard]] Eigen::VectorXd least_squares(const Eigen::MatrixXd& rows, const Eigen::VectorXd& values);

struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;
};
// Least squares. Of points in a plane x = constant, it is a circle: their x counts as that of the centre.
[[nodiscard]] Ball fitted_ball(const std::vector<Vec3>& points);
[[nodiscard]] Ball fitted_circle(const std::vector<Vec3>& points);  // in the plane of y and z

// By the names of the parameters; angles in degrees. `landmarks` get a few points, in the bone's own directions.
struct MeasuredFemur {
  std::map<std::string, double> values;
  std::map<std::string, Vec3> landmarks;
};
[[nodiscard]] MeasuredFemur measure_femur(const Case& bone, Side side);

}  // namespace osteon::phantoms
