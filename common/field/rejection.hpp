// Why a room rejects a cut. The author of the cut receives the reason, and journals store it.
#pragma once
#include <cstdint>
#include <string_view>

namespace osteon {

// Stored in journals and sent, so the numbers never change.
enum class Rejection : std::uint8_t {
  none = 0,
  body = 1,             // no such body
  lease = 2,            // made under a lease that has ended
  tool = 3,             // not a registered tool, or one that does not cut
  level = 4,            // finer than the tool or the case allows
  path = 5,             // no poses or too many
  rotation = 6,         // a quaternion far from unit length
  place = 7,            // too far from the bone
  sweep = 8,            // too long a path for one cut
  spindle = 9,          // faster than any spindle
  time = 10,            // more tool time than has passed since the lease was granted
  rate = 11,            // more volume swept than a room can evaluate
  power = 12,           // more bone than any motor can remove in that time
  frozen = 13,          // an instructor has stopped the person
  taken = 14,           // an instructor has taken over the person's tool
  forbidden_tool = 15,  // an instructor allows the person only other tools
  zone = 16,            // outside the zone that an instructor allows
  metal = 17,           // it would remove metal
};
inline constexpr int kRejections = 18;
[[nodiscard]] std::string_view sentence(Rejection reason);

}  // namespace osteon
