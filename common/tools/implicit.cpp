#include "common/tools/implicit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/check.hpp"
#include "common/geometry/segment.hpp"

namespace osteon {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSameCorner_mm = 1e-6;

// std::hypot takes twice as long, and its last bit depends on the C library. No tool is large enough to overflow this.
double length_mm(double x, double y) { return std::sqrt(x * x + y * y); }

// An edge of a flat convex polygon, counter-clockwise.
struct PolygonEdge {
  Vec3 from, along, out;  // `out` points out of the polygon, in its plane
  double squared_length;
};

// Distance to a flat convex polygon from a point on the outer side of its plane.
double polygon_distance(const std::vector<PolygonEdge>& edges, double height_mm, const Vec3& p) {
  bool above = true;
  double squared = kInfinity;
  for (const PolygonEdge& edge : edges) {
    const Vec3 from = p - edge.from;
    if (edge.out.dot(from) <= 0.0) continue;  // on the inner side of this edge
    above = false;
    const double t = std::clamp(from.dot(edge.along) / edge.squared_length, 0.0, 1.0);
    squared = std::min(squared, (from - t * edge.along).squaredNorm());
  }
  return above ? height_mm : std::sqrt(squared);
}

std::vector<PolygonEdge> edges_of(const std::vector<Vec3>& corners, const Vec3& normal) {
  std::vector<PolygonEdge> edges;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 along = corners[(i + 1) % corners.size()] - corners[i];
    edges.push_back({corners[i], along, along.cross(normal), along.squaredNorm()});
  }
  return edges;
}

}  // namespace

Implicit ball(const Vec3& centre_mm, double radius_mm) {
  const Vec3 half = Vec3::Constant(radius_mm);
  return {[=](const Vec3& p) { return (p - centre_mm).norm() - radius_mm; }, {centre_mm - half, centre_mm + half}};
}

Implicit cylinder(double radius_mm, double bottom_mm, double top_mm) {
  return {[=](const Vec3& p) {
            const double dr = length_mm(p.x(), p.y()) - radius_mm;
            const double dz = std::max(p.z() - top_mm, bottom_mm - p.z());
            return dr <= 0.0 || dz <= 0.0 ? std::max(dr, dz) : length_mm(dr, dz);
          },
          {Vec3(-radius_mm, -radius_mm, bottom_mm), Vec3(radius_mm, radius_mm, top_mm)}};
}

Implicit cuboid(const Box& box) {
  return {[centre = box.centre_mm(), half = Vec3(0.5 * box.size_mm())](const Vec3& p) {
            const Vec3 beyond = (p - centre).cwiseAbs() - half;
            const double inside = beyond.maxCoeff();
            return inside <= 0.0 ? inside : beyond.cwiseMax(0.0).norm();
          },
          box};
}

Implicit turned(std::vector<Corner> outline) {
  struct Edge {
    Corner from, along;
    double length;
  };
  std::vector<Edge> edges;
  Box bounds;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Corner a = outline[i], b = outline[(i + 1) % outline.size()];
    bounds.include({a.r, a.r, a.z});
    bounds.include({-a.r, -a.r, a.z});
    // An edge on the axis is inside the solid.
    if (a.r == 0.0 && b.r == 0.0) continue;
    const double length = length_mm(b.r - a.r, b.z - a.z);
    edges.push_back({a, {(b.r - a.r) / length, (b.z - a.z) / length}, length});
  }
  return {[edges = std::move(edges)](const Vec3& p) {
            const double r = length_mm(p.x(), p.y());
            double inside = -kInfinity, squared = kInfinity;
            for (const Edge& edge : edges) {
              const double dr = r - edge.from.r, dz = p.z() - edge.from.z;
              inside = std::max(inside, dr * edge.along.z - dz * edge.along.r);
              const double t = std::clamp(dr * edge.along.r + dz * edge.along.z, 0.0, edge.length);
              const double er = dr - t * edge.along.r, ez = dz - t * edge.along.z;
              squared = std::min(squared, er * er + ez * ez);
            }
            return inside <= 0.0 ? inside : std::sqrt(squared);
          },
          bounds};
}

std::vector<std::vector<Vec3>> face_polygons(const std::vector<HalfSpace>& faces) {
  std::vector<std::vector<Vec3>> polygons(faces.size());
  const auto add = [](std::vector<Vec3>& polygon, const Vec3& p) {
    for (const Vec3& corner : polygon)
      if ((corner - p).norm() < kSameCorner_mm) return;
    polygon.push_back(p);
  };
  // Every three faces meet in a point. It is a corner of the solid if it lies behind all other faces.
  for (std::size_t i = 0; i < faces.size(); ++i)
    for (std::size_t j = i + 1; j < faces.size(); ++j)
      for (std::size_t k = j + 1; k < faces.size(); ++k) {
        const Vec3 jk = faces[j].normal.cross(faces[k].normal);
        const double volume = faces[i].normal.dot(jk);
        if (std::abs(volume) < 1e-9) continue;
        const Vec3 p = (faces[i].offset_mm * jk + faces[j].offset_mm * faces[k].normal.cross(faces[i].normal) +
                        faces[k].offset_mm * faces[i].normal.cross(faces[j].normal)) /
                       volume;
        if (std::ranges::any_of(faces,
                                [&](const HalfSpace& f) { return f.normal.dot(p) > f.offset_mm + kSameCorner_mm; }))
          continue;
        for (const std::size_t face : {i, j, k}) add(polygons[face], p);
      }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    auto& polygon = polygons[i];
    if (polygon.size() < 3) {
      polygon.clear();
      continue;
    }
    Vec3 middle = Vec3::Zero();
    for (const Vec3& p : polygon) middle += p / static_cast<double>(polygon.size());
    const Vec3 u = (polygon.front() - middle).normalized(), v = faces[i].normal.cross(u);
    std::ranges::sort(polygon, {}, [&](const Vec3& p) { return std::atan2((p - middle).dot(v), (p - middle).dot(u)); });
  }
  return polygons;
}

Box box_of(const std::vector<std::vector<Vec3>>& polygons) {
  Box box;
  for (const auto& polygon : polygons)
    for (const Vec3& p : polygon) box.include(p);
  return box;
}

Implicit convex(std::vector<HalfSpace> faces) {
  const auto polygons = face_polygons(faces);
  const Box bounds = box_of(polygons);
  OSTEON_CHECK(!bounds.empty());
  std::vector<std::vector<PolygonEdge>> edges;
  for (std::size_t i = 0; i < faces.size(); ++i) edges.push_back(edges_of(polygons[i], faces[i].normal));
  return {[faces = std::move(faces), edges = std::move(edges)](const Vec3& p) {
            const auto height_of = [&](std::size_t i) { return faces[i].normal.dot(p) - faces[i].offset_mm; };
            // Tools have no more faces than this. The heights over further ones are computed twice.
            std::array<double, 32> heights;
            double inside = -kInfinity;
            for (std::size_t i = 0; i < faces.size(); ++i) {
              const double height = height_of(i);
              if (i < heights.size()) heights[i] = height;
              inside = std::max(inside, height);
            }
            if (inside <= 0.0) return inside;
            // The nearest point lies on a face that is visible from p.
            double nearest = kInfinity;
            for (std::size_t i = 0; i < faces.size(); ++i) {
              const double height = i < heights.size() ? heights[i] : height_of(i);
              if (height <= 0.0 || height >= nearest || edges[i].empty()) continue;
              nearest = std::min(nearest, polygon_distance(edges[i], height, p));
            }
            return nearest;
          },
          bounds};
}

Implicit unite(Implicit a, Implicit b) {
  const Box bounds{a.bounds.min_mm.cwiseMin(b.bounds.min_mm), a.bounds.max_mm.cwiseMax(b.bounds.max_mm)};
  return {[a = std::move(a.distance_mm), b = std::move(b.distance_mm)](const Vec3& p) { return std::min(a(p), b(p)); },
          bounds};
}

Implicit intersect(Implicit a, Implicit b) {
  const Box bounds{a.bounds.min_mm.cwiseMax(b.bounds.min_mm), a.bounds.max_mm.cwiseMin(b.bounds.max_mm)};
  return {[a = std::move(a.distance_mm), b = std::move(b.distance_mm)](const Vec3& p) { return std::max(a(p), b(p)); },
          bounds};
}

Implicit subtract(Implicit a, Implicit b) {
  const Box bounds = a.bounds;
  return {[a = std::move(a.distance_mm), b = std::move(b.distance_mm)](const Vec3& p) { return std::max(a(p), -b(p)); },
          bounds};
}

Implicit placed(Implicit solid, const Pose& pose) {
  const Eigen::Matrix3d turn = pose.rotation.toRotationMatrix().cwiseAbs();
  const Vec3 centre = pose.point(solid.bounds.centre_mm()), half = 0.5 * (turn * solid.bounds.size_mm());
  return {[solid = std::move(solid.distance_mm), back = pose.inverse()](const Vec3& p) { return solid(back.point(p)); },
          {centre - half, centre + half}};
}

Vec3 gradient(const Implicit& solid, const Vec3& p) {
  constexpr double kStep_mm = 1e-5;
  Vec3 slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep_mm * Vec3::Unit(axis);
    slope[axis] = solid(p + step) - solid(p - step);
  }
  const double length = slope.norm();
  return length > 0.0 ? Vec3(slope / length) : Vec3::UnitZ();
}

}  // namespace osteon
