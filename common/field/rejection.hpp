// Why a room does not take a cut: what it says to the cut's author, and what journals keep.
#pragma once
#include <cstdint>
#include <string_view>

namespace osteon {

// Kept in journals and sent: numbers stay.
enum class Rejection : std::uint8_t {
  none = 0,
  body = 1,             // no such body
  lease = 2,            // made under a lease that is over
  tool = 3,             // not a registered tool, or one that does not cut
  level = 4,            // finer than the tool or the case allows
  path = 5,             // no knots or too many
  rotation = 6,         // a quaternion far from unit
  place = 7,            // too far from the bone
  sweep = 8,            // too long a way for one cut
  spindle = 9,          // faster than any spindle
  time = 10,            // more tool time than has passed since the lease was granted
  rate = 11,            // more volume swept than a room can evaluate
  power = 12,           // more bone than any motor can take in that time
  frozen = 13,          // an instructor has stopped the hand
  taken = 14,           // an instructor holds the hand's tool
  forbidden_tool = 15,  // an instructor allows the hand other tools
  zone = 16,            // outside where an instructor lets the hand cut
  metal = 17,           // it would take metal away
};
inline constexpr int kRejections = 18;
[[nodiscard]] std::string_view sentence(Rejection reason);

}  // namespace osteon
