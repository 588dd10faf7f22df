// A drill that goes through a cortical shell over cancellous bone, computed from the geometry of layers and point, a
// hand's push and a force law. It knows nothing of sound. It says at each millisecond what the drill does.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/mechanics/cutting_state.hpp"

namespace osteon::test {

enum class SoundClass : std::uint8_t { silent, free, cortical, cancellous, perforation };
inline constexpr std::size_t kSoundClasses = 5;
[[nodiscard]] std::string_view name(SoundClass one);

// A near and a far cortical layer, and cancellous bone between them.
struct Shell {
  double near_mm = 3, between_mm = 12, far_mm = 3;
  double cortical_g_cm3 = 1.9, cancellous_g_cm3 = 0.3;
};

struct Drilling {
  std::string tool = "drill-3.2";
  double rpm = 1000;
  Shell shell;
  double push_n = 27;                 // of the hand in cortical bone
  double most_feed_mm_per_s = 10.7;   // the hand lets the drill go no faster in cancellous bone
  double plunge_mm_per_s = 45;        // and as the far layer gives way, until it has stopped the drill
  double rest_s = 0.6, free_s = 1.2;  // before the drill turns, and before it meets bone; the same again afterwards
};

// Shells, pushes and pauses as they differ between operations. `rpm` is not changed.
[[nodiscard]] Drilling varied(const Drilling& usual, std::uint64_t seed);

struct DrilledLayers {
  std::vector<CuttingState> states;  // one for each 1/120 s; time_ns counts from 0
  std::vector<SoundClass> truth;     // one for each millisecond
};

// Silent: the spindle turns at less than half of its speed. Free: less than a tenth of the point is in bone. Cortical
// and cancellous: what more of the point's area is in. Perforation: the point has passed the far surface and less than
// half of it is left in bone, and until 0.12 s after the last of it was.
[[nodiscard]] DrilledLayers drill(const Drilling& drilling);

}  // namespace osteon::test
