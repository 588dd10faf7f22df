// From where the tools are heard, and over what (Niu 2008, 8.4).
#pragma once
#include <cstdint>
#include <string_view>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon::audio {

enum class Listening : std::uint8_t {
  mono = 0,          // every tool in the middle, at its own level
  loudspeakers = 1,  // from a place near the tool, by level
  headphones = 2,    // from the surgeon's head, by the ears' own filters
};
[[nodiscard]] Result<Listening> listening(std::string_view name);

inline constexpr double kSoundSpeed_mm_per_s = 343'000;  // in dry air of 20 degrees C
// A farther tool is heard as from here. It bounds the delay, and is beyond any operating room's table.
inline constexpr double kFarthest_mm = 5000;

// The distance at which a tool has its own level, and that of the usual listener from the middle of the bone. [A]
[[nodiscard]] double reference_mm(Listening listening) noexcept;

// The usual listener, seen from the middle of the bone along the axes of the bone frame: a surgeon at the right side of
// a patient who lies on the back (x to the patient's left, y to the back, z to the head).
[[nodiscard]] Vec3 usual_listener_mm(Listening listening);

// A head at `from_mm` that looks at `at_mm`, with its vertex as near to `up` as that allows. In the frame of a head, x
// is ahead, y left and z up. Vectors that leave a direction open are completed by some direction.
[[nodiscard]] Pose looking(const Vec3& from_mm, const Vec3& at_mm, const Vec3& up);

}  // namespace osteon::audio
