#include "common/phantoms/structures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/geometry/triangle_distance.hpp"
#include "common/phantoms/implicit_shapes.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kLineStep_mm = 4.0;
constexpr double kFar_mm = 90.0;     // a bone is narrower than this around its middle
constexpr double kSlowest = 0.6;     // part of a distance that is safe to step
constexpr double kFlattest = 0.3;    // slope of a distance in grooves
constexpr double kOffBone_mm = 0.1;  // between a tube and bone that it would touch

Box box_around(const std::vector<Vec3>& points, double radius_mm) {
  Box box;
  for (const Vec3& point : points) box.include(point);
  return box.grown(radius_mm);
}

// How far from a point along its direction the line is clear of bone, from there on to far away.
double clear_from(const Beside& beside, const Distance& bone_mm) {
  double t = kFar_mm;
  for (int step = 0; step < 400; ++step) {
    const double free_mm = bone_mm(beside.point_mm + t * beside.direction) - beside.clear_mm;
    if (free_mm < 0.05) return t;
    t -= std::max(0.05, kSlowest * free_mm);
    if (t <= 0.0) return 0.0;
  }
  return t;
}

// Some successive segments of a line, in a box.
struct LinePart {
  std::size_t first = 0, end = 0;
  Box box;
};

std::vector<LinePart> parts_of(const std::vector<Vec3>& line) {
  constexpr std::size_t kSegments = 6;
  std::vector<LinePart> parts;
  for (std::size_t first = 0; first + 1 < line.size(); first += kSegments) {
    LinePart part{first, std::min(first + kSegments, line.size() - 1), {}};
    for (std::size_t i = part.first; i <= part.end; ++i) part.box.include(line[i]);
    parts.push_back(part);
  }
  return parts;
}

double squared_distance_to_line(const Vec3& at, const std::vector<Vec3>& line, const std::vector<LinePart>& parts) {
  const auto to_box = [&](const LinePart& part) {
    return (at - at.cwiseMax(part.box.min_mm).cwiseMin(part.box.max_mm)).squaredNorm();
  };
  // What is beyond this part of a squared distance is not nearer, also after rounding.
  constexpr double kSurely = 1.0 - 1e-9;
  double squared = std::numeric_limits<double>::infinity();
  const auto look = [&](const LinePart& part) {
    for (std::size_t i = part.first; i < part.end; ++i)
      squared = std::min(squared, squared_distance_to_segment<double>(at, line[i], line[i + 1]));
  };
  // The part whose box is nearest comes first, so that most others are too far.
  const LinePart& nearest = *std::ranges::min_element(parts, {}, to_box);
  look(nearest);
  for (const LinePart& part : parts)
    if (&part != &nearest && kSurely * to_box(part) < squared) look(part);
  return squared;
}

// How fast a distance grows. In grooves it is slower than the Euclidean one.
double slope_at(const Vec3& at, const Distance& distance_mm) {
  constexpr double kStep_mm = 0.01;
  Vec3 rise;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep_mm * Vec3::Unit(axis);
    rise[axis] = distance_mm(at + step) - distance_mm(at - step);
  }
  return rise.norm() / (2.0 * kStep_mm);
}

template <class Combine>
std::vector<double> windowed(const std::vector<double>& values, std::size_t reach, Combine combine) {
  std::vector<double> found;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(i < reach ? 0 : i - reach);
    const auto to = values.begin() + static_cast<std::ptrdiff_t>(std::min(values.size(), i + reach + 1));
    found.push_back(combine(from, to));
  }
  return found;
}

}  // namespace

Structure tube(const std::string& name, LabelKind kind, std::vector<Vec3> line, double radius_mm,
               const Distance& bone_mm) {
  Structure made{name, kind, kind == LabelKind::nerve ? kNerve_hu : kVessel_hu, box_around(line, radius_mm), {}, line};
  made.distance_mm = [line = std::move(line), parts = parts_of(made.line_mm), radius_mm, bone_mm](const Vec3& at) {
    const double tube_mm = std::sqrt(squared_distance_to_line(at, line, parts)) - radius_mm;
    return tube_mm < 0.0 ? std::max(tube_mm, kOffBone_mm - bone_mm(at)) : tube_mm;
  };
  return made;
}

Structure cartilage(const std::string& name, double thickness_mm, const Box& bounds, const Distance& bone_mm,
                    const Distance& region_mm) {
  return {name,
          LabelKind::cartilage,
          kCartilage_hu,
          bounds,
          [thickness_mm, bone_mm, region_mm](const Vec3& at) {
            const double region = region_mm(at);
            if (region > 0.0) return region;
            const double thickness = thickness_mm * smooth_step(-region, 0.0, thickness_mm);
            const double bone = bone_mm(at);
            if (bone <= 0.0 || bone > thickness) return std::max({region, -bone, bone - thickness});
            return std::max({region, -bone, bone / std::max(kFlattest, slope_at(at, bone_mm)) - thickness});
          },
          {}};
}

Structure footprint(const std::string& name, const Vec3& centre, double radius_mm, const Distance& bone_mm) {
  return {name,
          LabelKind::soft_tissue,
          kLigament_hu,
          box_around({centre}, radius_mm),
          [centre, radius_mm, bone_mm](const Vec3& at) {
            const double ball = ball_mm(at, centre, radius_mm);
            if (ball > 0.0) return ball;
            const double bone = bone_mm(at);
            return std::max({ball, -bone, bone - kFootprint_mm});
          },
          {}};
}

std::vector<Vec3> line_beside(const std::vector<Beside>& points, double span_mm, const Distance& bone_mm) {
  std::vector<Beside> fine;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Beside &a = points[i], &b = points[i + 1];
    const int parts = std::max(1, static_cast<int>(std::ceil((b.point_mm - a.point_mm).norm() / kLineStep_mm)));
    for (int k = i == 0 ? 0 : 1; k <= parts; ++k) {
      const double t = static_cast<double>(k) / parts;
      fine.push_back({(1.0 - t) * a.point_mm + t * b.point_mm, ((1.0 - t) * a.direction + t * b.direction).normalized(),
                      (1.0 - t) * a.clear_mm + t * b.clear_mm});
    }
  }
  std::vector<double> away;
  for (const Beside& beside : fine) away.push_back(clear_from(beside, bone_mm));
  // Each value becomes the largest one around, and then their mean, which is at least the value at that place.
  const auto reach = static_cast<std::size_t>(std::lround(0.5 * span_mm / kLineStep_mm));
  away = windowed(away, reach, [](auto from, auto to) { return *std::max_element(from, to); });
  away = windowed(away, reach, [](auto from, auto to) {
    double sum = 0.0;
    for (auto value = from; value != to; ++value) sum += *value;
    return sum / static_cast<double>(to - from);
  });
  std::vector<Vec3> line;
  for (std::size_t i = 0; i < fine.size(); ++i) line.emplace_back(fine[i].point_mm + away[i] * fine[i].direction);
  return line;
}

std::vector<Vec3> rounded(const std::vector<Vec3>& line) {
  constexpr int kRounds = 12;
  std::vector<Vec3> fine{line.front()};
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const int parts = std::max(1, static_cast<int>(std::ceil((line[i + 1] - line[i]).norm() / kLineStep_mm)));
    for (int k = 1; k <= parts; ++k)
      fine.emplace_back(line[i] + static_cast<double>(k) / parts * (line[i + 1] - line[i]));
  }
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Vec3> old = fine;
    for (std::size_t i = 1; i + 1 < fine.size(); ++i) fine[i] = 0.25 * old[i - 1] + 0.5 * old[i] + 0.25 * old[i + 1];
  }
  return fine;
}

Vec3 surface_from(const Vec3& inside, const Vec3& direction, const Distance& bone_mm) {
  double t = 0.0;
  for (int step = 0; step < 400 && t < kFar_mm; ++step) {
    const double deep_mm = -bone_mm(inside + t * direction);
    if (deep_mm < 0.01) break;
    t += std::max(0.01, kSlowest * deep_mm);
  }
  return inside + t * direction;
}

}  // namespace osteon::phantoms
