// Implicit solids (Niu 2008, §6.1): signed distances, put together from primitives by union, intersection and
// difference. Negative inside and 1-Lipschitz everywhere, since every primitive is, and minimum and maximum keep it.
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

// A corner of a solid of revolution: distance from the z axis and place along it, mm.
struct Corner {
  double r = 0, z = 0;
};

// The half-space normal · p ≤ offset_mm; the normal has unit length.
struct HalfSpace {
  Vec3 normal;
  double offset_mm = 0;
};

// Primitives, each the exact distance.
[[nodiscard]] Implicit ball(const Vec3& centre_mm, double radius_mm);
[[nodiscard]] Implicit cylinder(double radius_mm, double bottom_mm, double top_mm);  // about the z axis
[[nodiscard]] Implicit cuboid(const Box& box);
// A convex outline turned about the z axis: counter-clockwise with r to the right and z up, at most one edge on the
// axis.
[[nodiscard]] Implicit turned(std::vector<Corner> outline);
// The points behind all half-spaces, which must enclose a bounded solid with a point inside.
[[nodiscard]] Implicit convex(std::vector<HalfSpace> faces);

// Boolean operations. A distance stays exact where one part alone is nearest.
[[nodiscard]] Implicit unite(Implicit a, Implicit b);
[[nodiscard]] Implicit intersect(Implicit a, Implicit b);
[[nodiscard]] Implicit subtract(Implicit a, Implicit b);
[[nodiscard]] Implicit placed(Implicit solid, const Pose& pose);

// Unit gradient by central differences (eq. 6.2): out of the solid.
[[nodiscard]] Vec3 gradient(const Implicit& solid, const Vec3& p);

// One face of a bounded convex solid: its corners, counter-clockwise seen from outside. Empty when the half-space only
// touches the solid or lies beyond it. In the order of `faces`.
[[nodiscard]] std::vector<std::vector<Vec3>> face_polygons(const std::vector<HalfSpace>& faces);
// The box round all corners of these polygons.
[[nodiscard]] Box box_of(const std::vector<std::vector<Vec3>>& polygons);

}  // namespace osteon
