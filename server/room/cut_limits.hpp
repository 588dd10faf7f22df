// Limits of a cut that a room checks.
#pragma once
#include <chrono>
#include <cstdint>

namespace osteon {

// Limits of a cut, checked before any of it is evaluated.
struct CutLimits {
  int path_knots = 64;
  double beyond_bone_mm = 60.0;  // largest distance of a tool's tip from the bone's box
  double swept_mm = 25.0;        // largest path of the cutting part in one cut, its rotation included
  std::uint32_t spindle_rpm = 120000;
  // Limits over time, for one author; zero: no limit. set_time() gives the time.
  std::chrono::nanoseconds time_slack{};  // tool time that may be claimed beyond the time since the author joined
  double swept_voxels_per_s = 0;          // of the cut's level: samples that the kernel has to visit
  double power_w = 0;                     // power of a motor; with blow_j it limits the energy of a cut
  double blow_j = 20.0;
};

}  // namespace osteon
