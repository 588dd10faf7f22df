// A femur whose parameters are fitted to points of a surface, and what a comparison of both needs. Nothing of it is
// done by hand.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "common/phantoms/femur.hpp"

namespace osteon::test {

struct FittedFemur {
  phantoms::FemurParameters parameters;
  phantoms::Femur bone;
  Pose pose_mesh_bone;
};

// Fits all parameters of a left femur's outer shape, and its place, to points of its surface. They stand in LPS, mm,
// and are about as many on every part of the area. The start is a man's femur of their length.
[[nodiscard]] FittedFemur fit_femur(const std::vector<Vec3>& points);

// Signed distances of the femur's surface at points of the mesh's frame, mm.
[[nodiscard]] Eigen::VectorXd distances_mm(const FittedFemur& femur, const std::vector<Vec3>& points);

// Middles of triangles, about as many on every part of the area.
[[nodiscard]] std::vector<Vec3> spread_points(const TriangleMesh& mesh, int count);
// Points of the femur's surface, by steps along its gradient.
[[nodiscard]] std::vector<Vec3> points_on(const phantoms::Femur& bone, std::size_t count);
[[nodiscard]] double distance_to_mesh_mm(const TriangleMesh& mesh, const Vec3& at);

// A plane across the shaft, bone frame: unit vectors, and the distance along `up` from the origin, mm.
struct ShaftPlane {
  Vec3 up, across;
  double along_mm = 0.0;
};
[[nodiscard]] ShaftPlane shaft_plane(const phantoms::FemurParameters& parameters, double part_of_length);

// Area and second moments of a plane section, mm² and mm⁴, in the directions x and y through its centroid.
struct SectionMoments {
  double area = 0.0, xx = 0.0, yy = 0.0;
};
[[nodiscard]] SectionMoments section_of(const TriangleMesh& mesh, const Pose& to_bone, const ShaftPlane& plane);
[[nodiscard]] SectionMoments section_of(const phantoms::Femur& bone, const ShaftPlane& plane);

}  // namespace osteon::test
