#include "tests/unit/phantoms/measured_femur.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/phantoms/femur.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kRayStep_mm = 0.1;

template <class Keep>
std::vector<Vec3> those(const std::vector<Vec3>& points, Keep keep) {
  std::vector<Vec3> kept;
  std::ranges::copy_if(points, std::back_inserter(kept), keep);
  return kept;
}

template <class Value>
double largest(const std::vector<Vec3>& points, Value value) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Vec3& point : points) most = std::max(most, value(point));
  return most;
}

// The shaft: a line in the coronal plane, and a parabola in front of it.
struct ShaftLine {
  Vec3 up = Vec3::UnitZ(), lateral = Vec3::UnitX();
  double lateral_mm = 0.0;                                     // of the axis from the origin, across it
  double forward_mm = 0.0, apex_mm = 0.0, radius_mm = 1000.0;  // y = forward - (along - apex)² / 2 radius

  [[nodiscard]] Vec3 centre(double along) const {
    const double from = along - apex_mm;
    return along * up + lateral_mm * lateral + (forward_mm - from * from / (2.0 * radius_mm)) * Vec3::UnitY();
  }
};

// The middle of the section across the shaft, from rays in all directions.
Vec3 section_middle(const BoneView& bone, const Vec3& inside, const Vec3& lateral, const Vec3& front) {
  constexpr int kRays = 72;
  double area = 0.0;
  Vec3 moment = Vec3::Zero();
  std::vector<Vec3> outline;
  for (int i = 0; i < kRays; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kRays;
    const Vec3 way = std::cos(angle) * lateral + std::sin(angle) * front;
    outline.push_back(bone.reach_mm(inside, way) * way);
  }
  for (int i = 0; i < kRays; ++i) {
    const Vec3 &a = outline[static_cast<std::size_t>(i)], &b = outline[static_cast<std::size_t>((i + 1) % kRays)];
    const double part = a.dot(lateral) * b.dot(front) - a.dot(front) * b.dot(lateral);
    area += part;
    moment += part * (a + b) / 3.0;
  }
  return inside + moment / area;
}

ShaftLine measure_shaft(const BoneView& bone, const std::vector<Vec3>& points, double bottom, double length) {
  ShaftLine line;
  // A first guess from the points of the shaft themselves.
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  for (const auto& [part, mean] : {std::pair{0.35, &low}, std::pair{0.65, &high}}) {
    const double z = bottom + part * length;
    const auto ring = those(points, [&](const Vec3& p) { return std::abs(p.z() - z) < 1.0; });
    for (const Vec3& p : ring) *mean += p / static_cast<double>(ring.size());
  }
  const auto guess = [&](double z) { return Vec3(low + (z - low.z()) / (high.z() - low.z()) * (high - low)); };
  for (int round = 0; round < 4; ++round) {
    constexpr int kSections = 25;
    Eigen::MatrixXd coronal(kSections, 2), sagittal(kSections, 3);
    Eigen::VectorXd x(kSections), y(kSections);
    for (int i = 0; i < kSections; ++i) {
      const double z = bottom + length * (0.30 + 0.42 * i / (kSections - 1));
      const Vec3 inside = round == 0 ? guess(z) : line.centre(z / line.up.z());
      const Vec3 middle = section_middle(bone, inside, line.lateral, Vec3::UnitY());
      coronal.row(i) << middle.z(), 1.0;
      x[i] = middle.x();
      const double along = middle.dot(line.up);
      sagittal.row(i) << along * along, along, 1.0;
      y[i] = middle.y();
    }
    const Eigen::VectorXd c = least_squares(coronal, x);
    line.up = Vec3(c[0], 0.0, 1.0).normalized();
    line.lateral = {line.up.z(), 0.0, -line.up.x()};
    line.lateral_mm = c[1] * line.lateral.x();
    const Eigen::VectorXd s = least_squares(sagittal, y);
    line.radius_mm = -0.5 / s[0];
    line.apex_mm = -0.5 * s[1] / s[0];
    line.forward_mm = s[2] - 0.25 * s[1] * s[1] / s[0];
  }
  return line;
}

Ball measure_head(const std::vector<Vec3>& points, double top) {
  Ball head = fitted_ball(those(points, [&](const Vec3& p) { return p.z() > top - 12.0; }));
  for (int round = 0; round < 3; ++round)
    head = fitted_ball(those(points, [&](const Vec3& p) {
      const Vec3 from = p - head.centre;
      return from.z() > -0.1 * head.radius && from.x() < 0.1 * head.radius && std::abs(from.norm() - head.radius) < 1.0;
    }));
  return head;
}

// The axis of the neck: from the head's centre to the middles of sections across it.
Vec3 measure_neck(const BoneView& bone, const Ball& head, const Vec3& shaft_up, MeasuredFemur& found) {
  Vec3 neck = Vec3(-0.8, 0.15, 0.55).normalized();
  double height = 0.0, depth = 0.0;
  for (int round = 0; round < 6; ++round) {
    const Vec3 up = (shaft_up - shaft_up.dot(neck) * neck).normalized(), front = up.cross(neck);
    Vec3 sum = Vec3::Zero();
    height = depth = std::numeric_limits<double>::infinity();
    for (double away = 0.95; away < 1.16; away += 0.025) {
      const Vec3 inside = head.centre - away * head.radius * neck;
      sum += section_middle(bone, inside, up, front) - head.centre;
      height = std::min(height, bone.reach_mm(inside, up) + bone.reach_mm(inside, -up));
      depth = std::min(depth, bone.reach_mm(inside, front) + bone.reach_mm(inside, -front));
    }
    neck = -sum.normalized();
  }
  found.values["neck_height_mm"] = height;
  found.values["neck_depth_mm"] = depth;
  return neck;
}

void measure_hip(const BoneView& bone, const std::vector<Vec3>& points, const ShaftLine& shaft, double bottom,
                 double length, MeasuredFemur& found) {
  auto& v = found.values;
  const Ball head = measure_head(points, bottom + length);
  found.landmarks["head centre"] = head.centre;
  v["head_diameter_mm"] = 2.0 * head.radius;
  const Vec3 neck = measure_neck(bone, head, shaft.up, found);
  const double angle = std::acos(-neck.dot(shaft.up));
  v["neck_shaft_degrees"] = angle * kDegrees;
  v["anteversion_degrees"] = std::atan2(neck.y(), -neck.dot(shaft.lateral)) * kDegrees;
  const double neck_length = (head.centre.dot(shaft.lateral) - shaft.lateral_mm) / neck.dot(shaft.lateral);
  v["offset_mm"] = neck_length * std::sin(angle);
  const Vec3 base = head.centre - neck_length * neck;
  found.landmarks["neck base"] = base;

  const auto upper = those(points, [&](const Vec3& p) { return p.z() > bottom + 0.8 * length; });
  const double lateral = largest(upper, [](const Vec3& p) { return p.x(); });
  const double medial = head.centre.x() - head.radius;
  v["proximal_width_mm"] = lateral - medial;
  const auto beside = those(upper, [&](const Vec3& p) { return p.x() > head.centre.x() + 1.3 * head.radius; });
  const double tip = largest(beside, [](const Vec3& p) { return p.z(); });
  v["trochanter_height_mm"] = tip - head.centre.z();

  // The lesser trochanter: where the bone is farthest behind and medial, across the shaft.
  const Vec3 out = (-shaft.lateral - Vec3::UnitY()).normalized();
  const auto beyond = [&](const Vec3& p) { return p.dot(out); };
  const auto near = those(points, [&](const Vec3& p) {
    return p.z() < base.z() - 0.5 * head.radius && p.z() > bottom + 0.68 * length &&
           std::abs((p - shaft.centre(p.dot(shaft.up))).dot((shaft.lateral - Vec3::UnitY()).normalized())) < 4.0;
  });
  const double most = largest(near, beyond);
  Vec3 sum = Vec3::Zero();
  const auto peak = those(near, [&](const Vec3& p) { return beyond(p) > most - 0.3; });
  for (const Vec3& p : peak) sum += p / static_cast<double>(peak.size());
  found.landmarks["lesser trochanter"] = sum;
  v["trochanters_mm"] = tip - sum.z();
}

// Both condyles in the plane through the middle of each, and what lies between and beside them.
void measure_knee(const BoneView& bone, const std::vector<Vec3>& points, double bottom, MeasuredFemur& found) {
  auto& v = found.values;
  const auto low = those(points, [&](const Vec3& p) { return p.z() < bottom + 45.0; });
  v["bicondylar_width_mm"] =
      largest(low, [](const Vec3& p) { return p.x(); }) + largest(low, [](const Vec3& p) { return -p.x(); });
  double apart = 24.0;
  Ball circles[2];
  for (int round = 0; round < 3; ++round) {
    double inner[2] = {}, width[2] = {};
    for (const int side : {0, 1}) {
      const double sign = side == 0 ? -1.0 : 1.0;
      const auto slice = those(low, [&](const Vec3& p) { return std::abs(p.x() - sign * apart) < 1.0; });
      const double back = -largest(slice, [](const Vec3& p) { return -p.y(); });
      circles[side] =
          fitted_circle(those(slice, [&](const Vec3& p) { return p.y() < back + 12.0 && p.z() < bottom + 24.0; }));
      circles[side].centre.x() = sign * apart;
      const Vec3 middle = circles[side].centre - 0.12 * circles[side].radius * Vec3(0.0, 1.0, 1.0);
      inner[side] = bone.reach_mm(middle, -sign * Vec3::UnitX());
      width[side] = inner[side] + bone.reach_mm(middle, sign * Vec3::UnitX());
    }
    v["notch_width_mm"] = 2.0 * apart - inner[0] - inner[1];
    v["condyle_width_mm"] = 0.5 * (width[0] + width[1]);
    apart = 0.5 * (v["notch_width_mm"] + v["condyle_width_mm"]);
  }
  v["medial_condyle_radius_mm"] = circles[0].radius;
  v["lateral_condyle_radius_mm"] = circles[1].radius;
  const Vec3 centre = circles[0].centre;
  found.landmarks["medial condyle"] = centre;
  const double level = centre.z() + 0.15 * circles[0].radius;
  const auto front = those(
      low, [&](const Vec3& p) { return std::abs(std::abs(p.x()) - apart) < 1.5 && std::abs(p.z() - level) < 2.0; });
  v["condyle_depth_mm"] = largest(front, [](const Vec3& p) { return p.y(); }) - centre.y() + circles[0].radius;
}

// Mean and relative deviation of the density within a ball.
std::pair<double, double> density_around(const BoneView& bone, const Vec3& at, double radius_mm) {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  const double pitch = bone.pitch_mm();
  const CoordBox box = covering_samples({at.array() - radius_mm, at.array() + radius_mm}, pitch);
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 p = position_mm({x, y, z}, pitch);
        if ((p - at).norm() > radius_mm) continue;
        const double density = bone.density_g_cm3(p);
        sum += density;
        squares += density * density;
        ++count;
      }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean)) / mean};
}

// Where the mean density of points across the shaft passes a level on its way along it.
double passes(const BoneView& bone, const ShaftLine& shaft, double from, double to, double level) {
  const auto density = [&](double along) {
    double sum = 0.0;
    for (const double x : {-2.1, -0.7, 0.7, 2.1})
      for (const double y : {-2.1, -0.7, 0.7, 2.1})
        sum += bone.density_g_cm3(shaft.centre(along) + x * shaft.lateral + y * Vec3::UnitY());
    return sum / 16.0;
  };
  const double step = from < to ? 0.25 : -0.25;
  double along = from;
  while ((along - to) * step < 0.0 && density(along) > level) along += step;
  return along;
}

// Thickness of the cortex at a place of the shaft, on one side of it. Means over a few directions, from there on
// towards the middle of the shaft, where nothing is beside it; then the value at the beginning of a parabola through
// them.
double cortex_at(const BoneView& bone, const ShaftLine& shaft, double along, double inwards, const Vec3& side) {
  constexpr int kSteps = 17;
  constexpr double kStep_mm = 0.5;
  Eigen::MatrixXd rows(kSteps, 3);
  Eigen::VectorXd thickness = Eigen::VectorXd::Zero(kSteps);
  for (int i = 0; i < kSteps; ++i) {
    rows.row(i) << 1.0, i, i * i;
    const Vec3 centre = shaft.centre(along + inwards * kStep_mm * i);
    const double thickest_mm = 0.9 * bone.reach_mm(centre, side);
    for (double turn = -12.0; turn <= 12.0; turn += 2.0)
      thickness[i] += bone.cortex_mm(centre, Eigen::AngleAxisd(turn / kDegrees, shaft.up) * side, thickest_mm) / 13.0;
  }
  return least_squares(rows, thickness)[0];
}

// Width, depth and cortex at the stations of the shaft.
void measure_stations(const BoneView& bone, const ShaftLine& shaft, double bottom, double length,
                      MeasuredFemur& found) {
  auto& v = found.values;
  const auto along_at = [&](double part) { return (bottom + part * length) / shaft.up.z(); };
  const char* names[] = {"15", "25", "40", "55", "74", "80"};
  for (std::size_t i = 0; i < kFemurStations.size(); ++i) {
    const std::string at = std::string("_") + names[i] + "_mm";
    const double middle = along_at(kFemurStations[i]);
    // Neck, trochanters and condyles only add to the shaft, so the side without them counts.
    const Vec3 centre = shaft.centre(middle), front = Vec3::UnitY();
    const double half_width = std::min(bone.reach_mm(centre, shaft.lateral), bone.reach_mm(centre, -shaft.lateral));
    double half_depth = std::min(bone.reach_mm(centre, front), bone.reach_mm(centre, -front));
    for (const double way : {-1.0, 1.0}) {
      // An ellipse from its half width and its reach along the diagonal: 1 / reach² = (1 / a² + 1 / b²) / 2.
      const double reach = bone.reach_mm(centre, (shaft.lateral + way * front).normalized());
      half_depth = std::min(half_depth, 1.0 / std::sqrt(2.0 / (reach * reach) - 1.0 / (half_width * half_width)));
    }
    v["width" + at] = 2.0 * half_width;
    v["depth" + at] = 2.0 * half_depth;
    // Cortex, where the section is most like that ellipse.
    Vec3 freest = shaft.lateral;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 8; ++i) {
      const double angle = i * std::numbers::pi / 4.0;
      const Vec3 way = std::cos(angle) * shaft.lateral + std::sin(angle) * front;
      const double ellipse = 1.0 / std::hypot(std::cos(angle) / half_width, std::sin(angle) / half_depth);
      const double beyond = bone.reach_mm(centre, way) - ellipse;
      if (beyond < least - 0.05) freest = way;
      least = std::min(least, beyond);
    }
    const double inwards = kFemurStations[i] < 0.5 ? 1.0 : -1.0;
    v["cortex" + at] = cortex_at(bone, shaft, middle, inwards, freest);
  }
}

void measure_inside(const BoneView& bone, const std::vector<Vec3>& points, const ShaftLine& shaft, double bottom,
                    double length, MeasuredFemur& found) {
  auto& v = found.values;
  const auto along_at = [&](double part) { return (bottom + part * length) / shaft.up.z(); };
  const Vec3 head = found.landmarks["head centre"];
  const double radius = 0.5 * v["head_diameter_mm"];
  double sum = 0.0;
  int count = 0;
  for (const Vec3& p : points) {
    const Vec3 way = (p - head) / radius;
    if (std::abs(way.norm() - 1.0) > 0.02 || way.z() < 0.1 || way.x() > 0.1) continue;
    sum += bone.cortex_mm(head, way.normalized(), 5.0);
    ++count;
  }
  v["shell_mm"] = sum / count;

  v["marrow_g_cm3"] = density_around(bone, shaft.centre(along_at(0.5)), 4.0).first;
  const double edge = 0.5 * (v["marrow_g_cm3"] + density_around(bone, shaft.centre(along_at(0.17)), 5.0).first);
  v["marrow_from"] = (passes(bone, shaft, along_at(0.15), along_at(0.45), edge) * shaft.up.z() - bottom) / length;
  v["marrow_to"] = (passes(bone, shaft, along_at(0.83), along_at(0.5), edge) * shaft.up.z() - bottom) / length;

  const Vec3 wall = shaft.centre(along_at(0.55)) + 0.5 * (v["width_55_mm"] - v["cortex_55_mm"]) * shaft.lateral;
  v["cortical_g_cm3"] = density_around(bone, wall, 0.25 * v["cortex_55_mm"]).first;
  const auto cancellous = density_around(bone, found.landmarks["medial condyle"] + Vec3(0.0, 4.0, 0.0), 6.0);
  v["cancellous_g_cm3"] = cancellous.first;
  // Noise between lattice points, interpolated with smooth weights, has this deviation.
  constexpr double kNoise = 0.3698;
  v["texture"] = cancellous.second / kNoise;
  // Along the middle of the compressive group, from the medial cortex below the neck to the top of the head.
  const Vec3 base = found.landmarks["neck base"];
  const double half = 0.5 * v["width_80_mm"];
  const Vec3 from = base - 0.75 * half * shaft.lateral - 8.0 * shaft.up, to = head + 0.8 * radius * Vec3::UnitZ();
  sum = 0.0;
  for (int i = 0; i < 200; ++i) sum += bone.density_g_cm3(from + (0.3 + 0.45 * i / 200.0) * (to - from));
  v["compressive_g_cm3"] = sum / 200.0;
  // The tensile group where the other is far away: along the beginning of its arch.
  const Vec3 neck = (head - base).normalized();
  const Vec3 up = (shaft.up - shaft.up.dot(neck) * neck).normalized();
  const Vec3 a = base + 0.75 * half * shaft.lateral - 10.0 * shaft.up;
  const Vec3 b = base + 0.45 * (head - base).norm() * neck + 1.1 * radius * up;
  const Vec3 c = head - 0.35 * radius * up + 0.5 * radius * neck;
  sum = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.12 + 0.22 * i / 200.0, s = 1.0 - t;
    sum += bone.density_g_cm3(s * s * a + 2.0 * s * t * b + t * t * c);
  }
  v["tensile_g_cm3"] = sum / 200.0;
}

}  // namespace

std::vector<Vec3> BoneView::surface_points() const {
  std::vector<Vec3> points;
  const CoordBox box = bone_.bounds_samples();
  const Coord dims = box.dims();
  const double pitch = bone_.pitch_mm();
  std::vector<float> slab(2 * to_index(dims.y) * to_index(dims.z));
  const auto own = [&](const Vec3& at) { return Vec3(side_ * at.x(), -at.y(), at.z()); };
  for (int x = box.min.x; x < box.max.x; ++x) {
    bone_.gather_surface({{x, box.min.y, box.min.z}, {x + 1, box.max.y, box.max.z}}, slab);
    const auto at = [&](int dx, int y, int z) {
      return static_cast<double>(
          slab[(to_index(dx) * to_index(dims.y) + to_index(y)) * to_index(dims.z) + to_index(z)]);
    };
    for (int y = 0; y + 1 < dims.y; ++y)
      for (int z = 0; z + 1 < dims.z; ++z) {
        const double s = at(0, y, z);
        const double next[3] = {at(1, y, z), at(0, y + 1, z), at(0, y, z + 1)};
        for (int axis = 0; axis < 3; ++axis)
          if ((s < 0.0) != (next[axis] < 0.0)) {
            Vec3 p = position_mm({x, box.min.y + y, box.min.z + z}, pitch);
            p[axis] += pitch * s / (s - next[axis]);
            points.push_back(own(p));
          }
      }
  }
  return points;
}

double BoneView::reach_mm(const Vec3& from, const Vec3& direction) const {
  double away = 0.0, inside = surface_mm(from);
  while (away < 200.0) {
    const double next = surface_mm(from + (away + kRayStep_mm) * direction);
    if (next >= 0.0) return away + kRayStep_mm * inside / (inside - next);
    inside = next;
    away += kRayStep_mm;
  }
  return away;
}

double BoneView::cortex_mm(const Vec3& from, const Vec3& direction, double thickest_mm) const {
  const double reach = reach_mm(from, direction);
  const double dense = density_g_cm3(from + reach * direction);
  const auto density = [&](double depth) { return density_g_cm3(from + (reach - depth) * direction); };
  double depth = 0.0;
  while (depth < thickest_mm && density(depth) > 0.5 * (dense + std::min(density(depth + 3.0), 0.9 * dense)))
    depth += 0.02;
  return depth;
}

int bone_beside(const Case& bone, const Vec3& at_mm) {
  const Eigen::Vector3i near = (at_mm / bone.pitch_mm()).array().round().cast<int>();
  const Coord at{near.x(), near.y(), near.z()};
  Coord deepest = at;
  double least = std::numeric_limits<double>::infinity();
  for (const Coord step : {Coord{0, 0, 0}, Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}})
    for (const Coord sample : {at + step, at - step})
      if (const double depth = bone.surface_mm(position_mm(sample, bone.pitch_mm())); depth < least) {
        least = depth;
        deepest = sample;
      }
  return bone.bone_number(deepest);
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& rows, const Eigen::VectorXd& values) {
  return rows.colPivHouseholderQr().solve(values);
}

Ball fitted_ball(const std::vector<Vec3>& points) {
  // |p|² = 2 c·p + (r² - c²) is linear in c and in the last term.
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(points.size()), 4);
  Eigen::VectorXd squares(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) << 2.0 * points[i].transpose(), 1.0;
    squares[static_cast<Eigen::Index>(i)] = points[i].squaredNorm();
  }
  const Eigen::VectorXd found = least_squares(rows, squares);
  const Vec3 centre = found.head<3>();
  return {centre, std::sqrt(found[3] + centre.squaredNorm())};
}

Ball fitted_circle(const std::vector<Vec3>& points) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(points.size()), 3);
  Eigen::VectorXd squares(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& p = points[i];
    rows.row(static_cast<Eigen::Index>(i)) << 2.0 * p.y(), 2.0 * p.z(), 1.0;
    squares[static_cast<Eigen::Index>(i)] = p.y() * p.y() + p.z() * p.z();
  }
  const Eigen::VectorXd found = least_squares(rows, squares);
  return {{0.0, found[0], found[1]}, std::sqrt(found[2] + found.head<2>().squaredNorm())};
}

MeasuredFemur measure_femur(const Case& bone, Side side) {
  MeasuredFemur found;
  const BoneView view(bone, side);
  const std::vector<Vec3> points = view.surface_points();
  const double bottom = -largest(points, [](const Vec3& p) { return -p.z(); });
  const double length = largest(points, [](const Vec3& p) { return p.z(); }) - bottom;
  found.values["length_mm"] = length;
  const ShaftLine shaft = measure_shaft(view, points, bottom, length);
  auto& v = found.values;
  v["shaft_valgus_degrees"] = std::asin(shaft.up.x()) * kDegrees;
  v["shaft_lateral_mm"] = shaft.lateral_mm;
  v["bow_radius_mm"] = shaft.radius_mm;
  v["bow_apex"] = (shaft.apex_mm * shaft.up.z() - bottom) / length;
  measure_knee(view, points, bottom, found);
  v["shaft_forward_mm"] = shaft.forward_mm - found.landmarks["medial condyle"].y();
  measure_hip(view, points, shaft, bottom, length, found);
  measure_stations(view, shaft, bottom, length, found);
  measure_inside(view, points, shaft, bottom, length, found);
  return found;
}

}  // namespace osteon::phantoms
