// The cut kernel: signed distance to a swept tool on the samples of one leaf. One translation unit, + − × ÷ √ in a
// fixed order, contraction off, so that equal cuts give equal bytes on every compiler and processor.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/field/cut.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon {

// Changes whenever any value that the kernel can produce changes; programs that differ do not join.
inline constexpr std::uint32_t kKernelVersion = 2;

// A cut field's values are multiples of kQuantum_mm, clipped to this many of its voxels.
inline constexpr int kBandVoxels = 4;
// The clip of a level in quanta, rounded down, and in mm; also the value where nothing was cut.
[[nodiscard]] constexpr std::int32_t band_quanta(double level_pitch) {
  return static_cast<std::int32_t>(kBandVoxels * level_pitch * 1024.0);
}
[[nodiscard]] constexpr float band_mm(double level_pitch) {
  return static_cast<float>(band_quanta(level_pitch)) * static_cast<float>(kQuantum_mm);
}

// How one translation of the cutting body is evaluated. The distance to a convex body is convex along a line, and that
// to a body of revolution that reaches its axis grows with the distance from the axis. What follows from it:
enum class SweepKind : std::uint8_t {
  ball,     // a capsule, in closed form
  axial,    // a turned body moving along its axis is a turned body with a stretched outline
  across,   // a turned body moving across its axis: the nearest pose is the one whose axis is nearest
  oblique,  // both: search for the nearest pose by golden section
  hull,     // a translated hull is a hull again
  sampled,  // one pose; translations come as several
};

// The cutting body at one rotation, translated. Places in mm relative to `start_mm`, directions in the bone frame.
struct ToolSweep {
  SweepKind kind;
  int search_steps;             // oblique
  double start_mm[3];           // a ball's centre, else the tip
  double min_mm[3], max_mm[3];  // box of everything that the sweep removes
  float motion_mm[3];           // ball
  float inverse_square;         // ball: 1 / |motion|², 0 without motion
  float radius;                 // ball; turned with a dome: the widest
  float axis[3], u[3], v[3];    // turned: +z of the tool, and two directions across it; sampled: +z, +x, +y
  float across_mm, along_mm;    // turned: motion along u and along the axis
  float length_mm;              // oblique: of the motion
  float dome, up_mm, down_mm;   // turned: radius of the ball, 0 for none, and how far the sweep moves its centre
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

// A cut's leaves, and for each the sweeps that matter in it, so that nothing is found out twice.
struct CutPlan {
  struct Leaf {
    Coord origin;
    std::uint32_t first, count;  // in `near`
    bool removed;                // every sample lies deeper than the band
  };
  struct Near {
    std::uint32_t sweep;
    float nearest_mm;  // lower bound of the distance to it in the leaf
  };
  std::vector<Leaf> leaves;  // sorted
  std::vector<Near> near;
  std::int64_t visited = 0;  // leaves of the world bounding block, the planned ones among them
};

struct LeafChange {
  int modified = 0;       // samples
  bool computed = false;  // whether distances had to be evaluated
  bool removed = false;   // of a changed leaf: every sample is now at the lower end of the band
};

// A cut made ready for one pitch: its path as translations of the cutting body. They are exact, but for those of rings
// and sampled bodies, which are taken in steps of a quarter pitch, and for the search of oblique ones, which leaves
// 0.03 pitches. Rotations are taken in steps that move no point by more than a quarter pitch.
class SweptTool {
 public:
  // `body`: of the cut's tool. `pitch_mm`: h of the case; the level comes from the cut.
  SweptTool(const Cut& cut, const CutBody& body, double pitch_mm);

  [[nodiscard]] double level_pitch_mm() const { return level_pitch_mm_; }
  // Leaves (by origin, in samples of the level) that the cut can change; sorted, without repetition.
  [[nodiscard]] std::vector<Coord> leaves() const;
  [[nodiscard]] CutPlan plan() const;
  [[nodiscard]] CutPlan plan(std::span<const Coord> leaves) const;  // of these leaves only

  // values = min(values, distance), z fastest as in OpenVDB. Values are written only where they change, so several
  // threads may cut different leaves at once.
  LeafChange cut_leaf(const CutPlan& plan, const CutPlan::Leaf& leaf, std::span<float, kLeafVoxels> values) const;
  int cut_leaf(Coord origin, std::span<float, kLeafVoxels> values) const;  // returns how many samples changed
  // Unclipped, unquantised distance at one point, mm; for tests and for reference.
  [[nodiscard]] float distance_mm(const Vec3& point_bone_mm) const;

  [[nodiscard]] std::span<const ToolSweep> sweeps() const { return sweeps_; }

  // What the evaluation reads.
  struct Body {
    std::span<const OutlineEdge> edges;
    std::span<const SweptPlane> planes;
    const SampledDistance* sampled = nullptr;
    float sampled_outside = 0.0f;  // least distance on the lattice's faces, mm
  };

 private:
  void add_ball(const double from[3], const double to[3]);
  void add_turned(const CutBody& body, const double from[3], const double to[3], const double axis[3]);
  void add_hull(const CutBody& body, const double from[3], const double to[3], const double turn[3][3]);
  void add_sampled(const CutBody& body, const double at[3], const double turn[3][3]);
  [[nodiscard]] Body shape() const;

  double level_pitch_mm_;
  float leaf_radius_mm_;  // from a leaf's middle to its farthest sample, and room for rounding and search
  std::vector<ToolSweep> sweeps_;
  std::vector<OutlineEdge> edges_;
  std::vector<SweptPlane> planes_;
  std::shared_ptr<const SampledDistance> sampled_;
  float sampled_outside_ = 0.0f;
};

// For the tests: how wide the kernel computes from now on (4, 8 or 16 samples at once); what the processor does not
// have is passed over. Returns the width in use. The same bytes for each.
int limit_kernel_lanes(int lanes);

}  // namespace osteon
