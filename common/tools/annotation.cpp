#include "common/tools/annotation.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/core/check.hpp"
#include "common/tools/cut_body.hpp"

namespace osteon {
namespace {

constexpr double kLeastPlanned_mm = 0.1;

tl::unexpected<Error> bad(const std::string& field, const std::string& why) {
  return failure(ErrorCode::invalid_input, "drawn." + field + " " + why);
}

// The least and the most number of points.
std::pair<std::size_t, std::size_t> numbers_of_points(AnnotationKind kind) {
  switch (kind) {
    case AnnotationKind::line:
      return {2, kMostAnnotationPoints};
    case AnnotationKind::axis:
      return {2, 2};
    case AnnotationKind::plane:
      return {3, 3};
    case AnnotationKind::pointer:
    case AnnotationKind::label:
      break;
  }
  return {1, 1};
}

// Whether they give an axis or a plane its direction.
bool are_apart(const std::vector<Vec3>& points) {
  const Vec3 along = points[1] - points[0];
  if (along.norm() < kLeastPlanned_mm) return false;
  return points.size() < 3 || along.normalized().cross(points[2] - points[0]).norm() >= kLeastPlanned_mm;
}

}  // namespace

Result<void> check(const Annotation& drawn) {
  if (drawn.kind < AnnotationKind::pointer || drawn.kind > AnnotationKind::plane)
    return bad("kind", "must be pointer, line, label, axis or plane");
  const auto [least, most] = numbers_of_points(drawn.kind);
  if (drawn.points.size() < least || drawn.points.size() > most)
    return bad("points", "are " + std::to_string(drawn.points.size()) + "; give " + std::to_string(least) +
                             (most > least ? " to " + std::to_string(most) : ""));
  if (is_planned(drawn.kind) && !are_apart(points_mm(drawn)))
    return bad("points", drawn.kind == AnnotationKind::axis ? "are at one place; an axis needs two places"
                                                            : "are on one line; a plane needs three corners");
  if (drawn.words.size() > kMostAnnotationWords)
    return bad("words", "are longer than " + std::to_string(kMostAnnotationWords) + " bytes");
  if (drawn.kind == AnnotationKind::label && drawn.words.empty()) return bad("words", "are missing; a label has some");
  if (drawn.colour > 0xffffff) return bad("colour", "has more than 24 bits");
  return {};
}

std::array<std::int32_t, 3> in_steps(const Vec3& point_mm) {
  constexpr double kMost = 1 << 30;
  std::array<std::int32_t, 3> steps{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double step = std::round(point_mm[static_cast<Eigen::Index>(axis)] / kQuantum_mm);
    steps[axis] = static_cast<std::int32_t>(std::clamp(step, -kMost, kMost));
  }
  return steps;
}

Vec3 from_steps(const std::array<std::int32_t, 3>& point) { return kQuantum_mm * Vec3(point[0], point[1], point[2]); }

std::vector<Vec3> points_mm(const Annotation& drawn) {
  std::vector<Vec3> points;
  for (const auto& point : drawn.points) points.push_back(from_steps(point));
  return points;
}

Vec3 planned_direction(const Annotation& planned) {
  OSTEON_CHECK(is_planned(planned.kind));
  const std::vector<Vec3> points = points_mm(planned);
  const Vec3 along = points[1] - points[0];
  if (planned.kind == AnnotationKind::axis) return along.normalized();
  return along.cross(points[2] - points[0]).normalized();
}

}  // namespace osteon
