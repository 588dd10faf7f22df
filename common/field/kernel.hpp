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

// A cut field's values are multiples of kQuantum_mm, clipped to this many of its voxels.
inline constexpr int kBandVoxels = 4;
// The clip of a level in quanta, rounded down, and in mm; also the value where nothing was cut.
[[nodiscard]] constexpr std::int32_t band_quanta(double level_pitch) {
  return static_cast<std::int32_t>(kBandVoxels * level_pitch * 1024.0);
}
[[nodiscard]] constexpr float band_mm(double level_pitch) {
  return static_cast<float>(band_quanta(level_pitch)) * static_cast<float>(kQuantum_mm);
}

// A cut made ready for one pitch: its path as translations of the cutting body, exact for each.
class SweptTool {
 public:
  // `body`: of the cut's tool. `pitch_mm`: h of the case; the level comes from the cut.
  SweptTool(const Cut& cut, const CutBody& body, double pitch_mm);

  [[nodiscard]] double level_pitch_mm() const { return level_pitch_mm_; }
  // Leaves (by origin, in samples of the level) that the cut can change; sorted, without repetition.
  [[nodiscard]] std::vector<Coord> leaves() const;
  // values = min(values, distance), z fastest as in OpenVDB; returns how many samples changed.
  int cut_leaf(Coord origin, std::span<float, kLeafVoxels> values) const;
  // Unclipped, unquantised distance at one point, mm; for tests and for reference.
  [[nodiscard]] float distance_mm(const Vec3& point_bone_mm) const;

  // The cutting body at one rotation, translated from `start` along `motion`.
  struct Sweep {
    double start_mm[3];    // a sphere's centre, a drill's tip
    float motion_mm[3];
    float axis[3];         // tool's +z in the bone frame; drills only
    float along_mm;        // motion's part along the axis; drills only
    int search_steps;      // of the search for the nearest pose; 0: a motion along the axis, in closed form
    double min_mm[3], max_mm[3];  // box of everything that the sweep removes
  };
  // Lengths of the cutting body, mm.
  struct Body {
    CutKind kind;
    float radius, tip_height, length;
    float slant;           // of the cone
  };

 private:
  void add_drill_sweep(const double from[3], const double to[3], const double axis[3]);
  void add_sphere_sweep(const double from[3], const double to[3]);

  Body body_;
  double level_pitch_mm_;
  std::vector<Sweep> sweeps_;
};

}  // namespace osteon
