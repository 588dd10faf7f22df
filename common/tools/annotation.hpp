// What a person draws on the bone for others to see. It does not affect cutting.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"

namespace osteon {

// Stored in journals and sent, so the numbers never change.
enum class AnnotationKind : std::uint8_t {
  pointer = 1,  // an arrow to one point; each author has at most one
  line = 2,     // a line through all points
  label = 3,    // text at one point
};

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

// Error invalid_input, naming the field: too few or too many points for the kind, text too long or missing, a colour of
// more than 24 bits.
[[nodiscard]] Result<void> check(const Annotation& drawn);

}  // namespace osteon
