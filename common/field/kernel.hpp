// The cut kernel: signed distance to a swept tool on the samples of one leaf. One translation unit, + − × ÷ √ in a
// fixed order, contraction off, so that equal cuts give equal bytes on every compiler and processor.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/field/cut.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon {

// Changes whenever any value that the kernel can produce changes; programs that differ do not join.
inline constexpr std::uint32_t kKernelVersion = 1;

// A cut field's values are clipped to this many of its voxels.
inline constexpr int kBandVoxels = 4;
[[nodiscard]] constexpr float band_mm(double level_pitch) { return static_cast<float>(kBandVoxels * level_pitch); }

// A cut made ready for one pitch: its path as translations of the cutting body, exact for each.
class SweptTool {
 public:
  SweptTool(const Cut& cut, double pitch_mm);  // pitch_mm: h of the case; the level comes from the cut

  [[nodiscard]] double level_pitch_mm() const { return level_pitch_mm_; }
  // Leaves (by origin, in samples of the level) that the cut can change; sorted, without repetition.
  [[nodiscard]] std::vector<Coord> leaves() const;
  // values = min(values, distance), z fastest as in OpenVDB; returns how many samples changed.
  int cut_leaf(Coord origin, std::span<float, kLeafVoxels> values) const;
  // Unclipped, unquantised distance at one point, mm; for tests and for reference.
  [[nodiscard]] double distance_mm(const Vec3& point_bone_mm) const;

  // The cutting body at one rotation, translated along `motion`. For a sphere `start` is its centre.
  struct Sweep {
    double start_mm[3];
    float motion_mm[3];
    float axis[3];   // tool's +z in the bone frame; drills only
    int search_steps;
  };

 private:
  CutShape shape_;
  double level_pitch_mm_;
  std::vector<Sweep> sweeps_;
};

}  // namespace osteon
