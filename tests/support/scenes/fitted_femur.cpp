#include "tests/support/scenes/fitted_femur.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/geometry/triangle_distance.hpp"

namespace osteon::test {
namespace {

using phantoms::Femur, phantoms::FemurParameters, phantoms::ParameterField, phantoms::femur_fields;

// Parameters that change the surface.
std::vector<ParameterField<FemurParameters>> shape_fields() {
  std::vector<ParameterField<FemurParameters>> fields;
  for (const auto& field : femur_fields()) {
    const bool inner = field.name.starts_with("cortex") || field.name.starts_with("marrow") ||
                       field.name == "shell_mm" || field.name == "cartilage_mm" || field.name == "texture" ||
                       field.name.ends_with("_cm3");
    if (!inner) fields.push_back(field);
  }
  return fields;
}

// The values: shape parameters, then a turn (a rotation vector, radians) and a position, mm.
FittedFemur placed(const Eigen::VectorXd& values, const FemurParameters& start) {
  const auto fields = shape_fields();
  FemurParameters p = start;
  for (std::size_t i = 0; i < fields.size(); ++i) p.*fields[i].value = values[static_cast<Eigen::Index>(i)];
  const auto n = static_cast<Eigen::Index>(fields.size());
  const Vec3 turn = values.segment<3>(n);
  Pose pose;
  pose.position_mm = values.segment<3>(n + 3);
  if (turn.norm() > 0.0) pose.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized());
  return {p, Femur(p, phantoms::Side::left), pose};
}

}  // namespace

Eigen::VectorXd distances_mm(const FittedFemur& femur, const std::vector<Vec3>& points) {
  const Pose back = femur.pose_mesh_bone.inverse();
  Eigen::VectorXd found(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    found[static_cast<Eigen::Index>(i)] = femur.bone.depths(back.point(points[i])).surface_mm;
  return found;
}

namespace {

// Least squares by Levenberg's and Marquardt's method, with differences for derivatives. A weak pull towards the start
// keeps parameters in place that the surface does not show.
Eigen::VectorXd fitted(Eigen::VectorXd values, const FemurParameters& start, const std::vector<Vec3>& points) {
  const auto fields = shape_fields();
  const Eigen::VectorXd first = values;
  const Eigen::Index count = values.size(), rows = static_cast<Eigen::Index>(points.size());
  Eigen::VectorXd steps = Eigen::VectorXd::Constant(count, 1e-3), pull = Eigen::VectorXd::Zero(count);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    steps[at] = 1e-4 * (fields[i].most - fields[i].least);
    pull[at] = 0.02 * std::sqrt(static_cast<double>(rows)) / (fields[i].most - fields[i].least);
  }
  const auto cost = [&](const Eigen::VectorXd& x) {
    return distances_mm(placed(x, start), points).squaredNorm() + pull.cwiseProduct(x - first).squaredNorm();
  };
  double damping = 1e-2, best = cost(values);
  for (int round = 0; round < 40 && damping < 1e6; ++round) {
    const Eigen::VectorXd at = distances_mm(placed(values, start), points);
    Eigen::MatrixXd slopes(rows, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      Eigen::VectorXd moved = values;
      moved[i] += steps[i];
      slopes.col(i) = (distances_mm(placed(moved, start), points) - at) / steps[i];
    }
    Eigen::MatrixXd normal = slopes.transpose() * slopes;
    normal.diagonal() += pull.cwiseAbs2();
    const Eigen::VectorXd down = slopes.transpose() * at + pull.cwiseAbs2().cwiseProduct(values - first);
    for (int attempt = 0; attempt < 8; ++attempt) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal();
      Eigen::VectorXd next = values - damped.ldlt().solve(down);
      double thickest_neck = 0.0;
      for (std::size_t i = 0; i < fields.size(); ++i) {
        double& value = next[static_cast<Eigen::Index>(i)];
        value = std::clamp(value, fields[i].least, fields[i].most);
        // The neck is thinner than the head, which comes before it.
        if (fields[i].name == "head_diameter_mm") thickest_neck = 0.9 * value;
        if (fields[i].name == "neck_height_mm") value = std::min(value, thickest_neck);
      }
      const double found = cost(next);
      if (found < best) {
        best = found;
        values = next;
        damping = std::max(1e-6, 0.3 * damping);
        break;
      }
      damping *= 4.0;
    }
  }
  return values;
}

}  // namespace

FittedFemur fit_femur(const std::vector<Vec3>& points) {
  Box box;
  for (const Vec3& p : points) box.include(p);
  const double length = box.size_mm().z();
  FemurParameters start;
  phantoms::scale_lengths<FemurParameters>(start, femur_fields(), length / start.length_mm);
  const auto fields = shape_fields();
  Eigen::VectorXd values = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(fields.size()) + 6);
  for (std::size_t i = 0; i < fields.size(); ++i) values[static_cast<Eigen::Index>(i)] = start.*fields[i].value;
  Vec3 knee = Vec3::Zero();
  int low = 0;
  double back = -1e9;
  for (const Vec3& p : points) {
    if (p.z() > box.min_mm.z() + 0.1 * length) continue;
    knee += p;
    ++low;
    back = std::max(back, p.y());
  }
  const double radius = start.medial_condyle_radius_mm;
  values.tail<3>() = Vec3(knee.x() / low, back - radius, box.min_mm.z() + radius);
  return placed(fitted(values, start, points), start);
}

ShaftPlane shaft_plane(const FemurParameters& parameters, double part_of_length) {
  const double valgus = parameters.shaft_valgus_degrees * std::numbers::pi / 180.0;
  const Vec3 up(std::sin(valgus), 0.0, std::cos(valgus)), across(std::cos(valgus), 0.0, -std::sin(valgus));
  return {up, across, (part_of_length * parameters.length_mm - parameters.medial_condyle_radius_mm) / up.z()};
}

// Green's theorem over the outline, whose parts run counter-clockwise: from the triangles' normals.
SectionMoments section_of(const TriangleMesh& mesh, const Pose& to_bone, const ShaftPlane& plane) {
  const auto& [up, across, along] = plane;
  const Vec3 front = up.cross(across);
  double area = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, syy = 0.0;
  for (const auto& triangle : mesh.triangles) {
    Vec3 corner[3];
    for (std::size_t i = 0; i < 3; ++i) corner[i] = to_bone.point(position(mesh, triangle[i]));
    std::vector<Vec3> ends;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 &a = corner[i], &b = corner[(i + 1) % 3];
      const double from = a.dot(up) - along, to = b.dot(up) - along;
      if ((from < 0.0) != (to < 0.0)) ends.push_back(a + from / (from - to) * (b - a));
    }
    if (ends.size() != 2) continue;
    const Vec3 out = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    if (up.cross(out).dot(ends[1] - ends[0]) < 0.0) std::swap(ends[0], ends[1]);
    const double x0 = ends[0].dot(across), y0 = ends[0].dot(front), x1 = ends[1].dot(across), y1 = ends[1].dot(front);
    const double part = x0 * y1 - x1 * y0;
    area += part / 2.0;
    sx += part * (x0 + x1) / 6.0;
    sy += part * (y0 + y1) / 6.0;
    sxx += part * (x0 * x0 + x0 * x1 + x1 * x1) / 12.0;
    syy += part * (y0 * y0 + y0 * y1 + y1 * y1) / 12.0;
  }
  return {area, sxx - sx * sx / area, syy - sy * sy / area};
}

SectionMoments section_of(const Femur& bone, const ShaftPlane& plane) {
  const auto& [up, across, along] = plane;
  const Vec3 front = up.cross(across);
  constexpr double kGrid_mm = 0.25;
  double area = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, syy = 0.0;
  for (double x = -60.0; x <= 60.0; x += kGrid_mm)
    for (double y = -60.0; y <= 60.0; y += kGrid_mm) {
      const double s = bone.depths(along * up + x * across + y * front).surface_mm;
      const double part = kGrid_mm * kGrid_mm * std::clamp(0.5 - s / kGrid_mm, 0.0, 1.0);
      area += part;
      sx += part * x;
      sy += part * y;
      sxx += part * x * x;
      syy += part * y * y;
    }
  return {area, sxx - sx * sx / area, syy - sy * sy / area};
}

std::vector<Vec3> spread_points(const TriangleMesh& mesh, int count) {
  std::vector<Vec3> points;
  const double step = area_mm2(mesh) / count;
  double passed = 0.5 * step;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = position(mesh, t[0]), b = position(mesh, t[1]), c = position(mesh, t[2]);
    passed += 0.5 * (b - a).cross(c - a).norm();
    for (; passed >= step; passed -= step) points.emplace_back((a + b + c) / 3.0);
  }
  return points;
}

double distance_to_mesh_mm(const TriangleMesh& mesh, const Vec3& at) {
  double nearest = 1e18;
  for (const auto& t : mesh.triangles)
    nearest = std::min(
        nearest,
        distance_to_triangle<double>(at, position(mesh, t[0]), position(mesh, t[1]), position(mesh, t[2])).squared);
  return std::sqrt(nearest);
}

std::vector<Vec3> points_on(const Femur& bone, std::size_t count) {
  std::vector<Vec3> points;
  const Box box = bone.bounds();
  const auto value = [&](const Vec3& p) { return bone.depths(p).surface_mm; };
  // A sequence that fills the box evenly: multiples of the golden ratio's relatives, modulo 1.
  for (int i = 1; points.size() < count; ++i) {
    const Vec3 part(std::fmod(i * 0.8191725134, 1.0), std::fmod(i * 0.6710436067, 1.0),
                    std::fmod(i * 0.5497004779, 1.0));
    Vec3 p = box.min_mm + part.cwiseProduct(box.size_mm());
    if (std::abs(value(p)) > 2.0) continue;
    for (int step = 0; step < 5; ++step) {
      Vec3 slope;
      for (int axis = 0; axis < 3; ++axis) {
        Vec3 off = Vec3::Zero();
        off[axis] = 1e-3;
        slope[axis] = (value(p + off) - value(p - off)) / 2e-3;
      }
      p -= value(p) * slope / std::max(0.1, slope.squaredNorm());
    }
    if (std::abs(value(p)) < 0.01) points.push_back(p);
  }
  return points;
}

}  // namespace osteon::test
