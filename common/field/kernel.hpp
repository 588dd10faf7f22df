// The cut kernel computes the signed distance to a swept tool on the samples of one leaf. It is one translation unit,
// uses + − × ÷ √ in a fixed order, and has contraction off. So equal cuts give equal bytes on every compiler and
// processor.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/field/cut.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon {

// Changes whenever any value that the kernel can produce changes. Programs with different versions cannot join each
// other.
inline constexpr std::uint32_t kKernelVersion = 2;

// Values of a cut field are multiples of kQuantum_mm, clipped to this many of its voxels.
inline constexpr int kBandVoxels = 4;
// The clip of a level, in quanta (rounded down) and in mm. It is also the value where nothing was cut.
[[nodiscard]] constexpr std::int32_t band_quanta(double level_pitch) {
  return static_cast<std::int32_t>(kBandVoxels * level_pitch * 1024.0);
}
[[nodiscard]] constexpr float band_mm(double level_pitch) {
  return static_cast<float>(band_quanta(level_pitch)) * static_cast<float>(kQuantum_mm);
}

// How one translation of the cutting body is evaluated. The distance to a convex body is convex along a line. If a body
// of revolution has no hole along its axis, the distance to it grows with the distance from the axis. Hence:
enum class SweepKind : std::uint8_t {
  ball,     // a capsule, in closed form
  axial,    // a turned body that moves along its axis is a turned body with a stretched outline
  across,   // a turned body that moves across its axis: the nearest pose is the one with the nearest axis
  oblique,  // both: golden-section search for the nearest pose
  hull,     // a translated hull is again a hull
  sampled,  // one pose; a translation is several of these
};

// The cutting body at one rotation, translated. Positions in mm relative to `start_mm`, directions in the bone frame.
struct ToolSweep {
  SweepKind kind;
  int search_steps;             // oblique
  double start_mm[3];           // centre of a ball, otherwise the tip
  double min_mm[3], max_mm[3];  // box of everything that the sweep removes
  float motion_mm[3];           // ball
  float inverse_square;         // ball: 1 / |motion|², 0 without motion
  float radius;                 // ball; turned with a dome: the largest radius
  float axis[3], u[3], v[3];    // turned: +z of the tool, and two directions perpendicular to it; sampled: +z, +x, +y
  float across_mm, along_mm;    // turned: motion along u and along the axis
  float length_mm;              // oblique: length of the motion
  float dome, up_mm, down_mm;   // turned: radius of the ball that clips it (0: none); the sweep moves its centre so far
  std::uint32_t first, count;   // turned: edges; hull: planes
};

// An edge of a turned body's outline, counter-clockwise: from (r, s), `length` along (er, es), outward normal (es,
// -er).
struct OutlineEdge {
  float r, s, er, es, length;
};

struct SweptPlane {
  float x, y, z, offset;  // unit normal out of the body
};

// The leaves of a cut, and the sweeps that affect each leaf, so that nothing is computed twice.
struct CutPlan {
  struct Leaf {
    Coord origin;
    std::uint32_t first, count;  // in `near`
    bool removed;                // every sample is deeper than the band
  };
  struct Near {
    std::uint32_t sweep;
    float nearest_mm;  // lower bound of the distance to it in the leaf
  };
  std::vector<Leaf> leaves;  // sorted
  std::vector<Near> near;
  std::int64_t visited = 0;  // leaves in the world bounding block (box of the cut), including the planned ones
};

struct LeafChange {
  int modified = 0;       // samples
  bool computed = false;  // whether distances had to be evaluated
  bool removed = false;   // of a changed leaf: every sample is now at the lower end of the band
};

// A cut prepared for one pitch: its path as translations of the cutting body. They are exact, except that rings (turned
// bodies with a hole) and sampled bodies move in steps of a quarter pitch, and that the search for oblique motions errs
// by 0.03 pitches. Rotations are split into steps that move no point by more than a quarter pitch.
class SweptTool {
 public:
  // `body`: cutting body of the cut's tool. `pitch_mm`: h of the case; the level comes from the cut.
  SweptTool(const Cut& cut, const CutBody& body, double pitch_mm);

  [[nodiscard]] double level_pitch_mm() const { return level_pitch_mm_; }
  // Leaves (by origin, in samples of the level) that the cut can change. Sorted, without repetition.
  [[nodiscard]] std::vector<Coord> leaves() const;
  [[nodiscard]] CutPlan plan() const;
  [[nodiscard]] CutPlan plan(std::span<const Coord> leaves) const;  // only of these leaves

  // values = min(values, distance), z fastest as in OpenVDB. Only changed values are written, so several threads may
  // cut different leaves at once.
  LeafChange cut_leaf(const CutPlan& plan, const CutPlan::Leaf& leaf, std::span<float, kLeafVoxels> values) const;
  int cut_leaf(Coord origin, std::span<float, kLeafVoxels> values) const;  // returns the number of changed samples
  // Distance at one point, neither clipped nor quantised, mm. For tests and as a reference.
  [[nodiscard]] float distance_mm(const Vec3& point_bone_mm) const;

  [[nodiscard]] std::span<const ToolSweep> sweeps() const { return sweeps_; }

  // Data that the evaluation reads.
  struct Body {
    std::span<const OutlineEdge> edges;
    std::span<const SweptPlane> planes;
    const SampledDistance* sampled = nullptr;
    float sampled_outside = 0.0f;  // smallest distance on the faces of the lattice, mm
  };

 private:
  void add_ball(const double from[3], const double to[3]);
  void add_turned(const CutBody& body, const double from[3], const double to[3], const double axis[3]);
  void add_hull(const CutBody& body, const double from[3], const double to[3], const double turn[3][3]);
  void add_sampled(const CutBody& body, const double at[3], const double turn[3][3]);
  [[nodiscard]] Body shape() const;

  double level_pitch_mm_;
  float leaf_radius_mm_;  // from the middle of a leaf to its farthest sample, plus a margin for rounding and search
  std::vector<ToolSweep> sweeps_;
  std::vector<OutlineEdge> edges_;
  std::vector<SweptPlane> planes_;
  std::shared_ptr<const SampledDistance> sampled_;
  float sampled_outside_ = 0.0f;
};

// For tests: limits the number of samples computed at once (4, 8 or 16). Widths that the processor does not have are
// skipped. Returns the width in use. All widths give the same bytes.
int limit_kernel_lanes(int lanes);

}  // namespace osteon
