// Implicit solids (Niu 2008, §6.1): signed distances, combined from primitives by union, intersection and difference.
// Negative inside and 1-Lipschitz everywhere, because every primitive is, and minimum and maximum preserve it.
#pragma once
#include <functional>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {

struct Implicit {
  std::function<double(const Vec3&)> distance_mm;
  Box bounds;  // contains the solid
  [[nodiscard]] double operator()(const Vec3& p) const { return distance_mm(p); }
};

// A corner of a solid of revolution: distance from the z axis and position along it, mm.
struct Corner {
  double r = 0, z = 0;
};

// The half-space normal · p ≤ offset_mm; the normal has unit length.
struct HalfSpace {
  Vec3 normal;
  double offset_mm = 0;
};

// Primitives. Each is the exact distance.
[[nodiscard]] Implicit ball(const Vec3& centre_mm, double radius_mm);
[[nodiscard]] Implicit cylinder(double radius_mm, double bottom_mm, double top_mm);  // about the z axis
[[nodiscard]] Implicit cuboid(const Box& box);
// A convex outline turned about the z axis. Counter-clockwise with r to the right and z up, with at most one edge on
// the axis.
[[nodiscard]] Implicit turned(std::vector<Corner> outline);
// The points behind all half-spaces. These must enclose a bounded solid with an inner point.
[[nodiscard]] Implicit convex(std::vector<HalfSpace> faces);

// Boolean operations. A distance stays exact where only one part is nearest.
[[nodiscard]] Implicit unite(Implicit a, Implicit b);
[[nodiscard]] Implicit intersect(Implicit a, Implicit b);
[[nodiscard]] Implicit subtract(Implicit a, Implicit b);
[[nodiscard]] Implicit placed(Implicit solid, const Pose& pose);

// Unit gradient by central differences (eq. 6.2). It points out of the solid.
[[nodiscard]] Vec3 gradient(const Implicit& solid, const Vec3& p);

// The faces of a bounded convex solid, in the order of `faces`. Each is a list of corners, counter-clockwise seen from
// outside. It is empty if the half-space only touches the solid or lies beyond it.
[[nodiscard]] std::vector<std::vector<Vec3>> face_polygons(const std::vector<HalfSpace>& faces);
// The bounding box of all corners of these polygons.
[[nodiscard]] Box box_of(const std::vector<std::vector<Vec3>>& polygons);

}  // namespace osteon
