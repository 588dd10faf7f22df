// What a person draws on the bone for others to see. It does not affect cutting.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon {

// Stored in journals and sent, so the numbers never change.
enum class AnnotationKind : std::uint8_t {
  pointer = 1,  // an arrow to one point; each author has at most one
  line = 2,     // a line through all points
  label = 3,    // text at one point
  axis = 4,     // planned: from an entry to a target, at which the tool stops
  plane = 5,    // planned: the plane through three points; the first two are the ends of its line
};

[[nodiscard]] constexpr bool is_planned(AnnotationKind kind) {
  return kind == AnnotationKind::axis || kind == AnnotationKind::plane;
}

struct Annotation {
  std::uint32_t id = 0;  // given by the room, from 1
  AuthorId author{};
  AnnotationKind kind = AnnotationKind::pointer;
  std::vector<std::array<std::int32_t, 3>> points{};  // bone frame, in steps of 2^-10 mm
  std::string words{};
  std::uint32_t colour = 0xffd040;  // red, green, blue
  friend bool operator==(const Annotation&, const Annotation&) = default;
};

inline constexpr std::size_t kMostAnnotations = 256, kMostAnnotationPoints = 1024, kMostAnnotationWords = 256;

// Error invalid_input, naming the field: too few or too many points for the kind, points of an axis or a plane that are
// nearer than 0.1 mm to each other or to one line, text too long or missing, a colour of more than 24 bits.
[[nodiscard]] Result<void> check(const Annotation& drawn);

// Bone frame, in steps of 2^-10 mm, as in Annotation. Points beyond 2^30 steps are clamped.
[[nodiscard]] std::array<std::int32_t, 3> in_steps(const Vec3& point_mm);
[[nodiscard]] Vec3 from_steps(const std::array<std::int32_t, 3>& point);
[[nodiscard]] std::vector<Vec3> points_mm(const Annotation& drawn);
// Unit vector from the entry of a checked axis to its target, or through a checked plane.
[[nodiscard]] Vec3 planned_direction(const Annotation& planned);

}  // namespace osteon
