// The surgical tools: their dimensions, their cutting part, and the points that touch bone. Frame of every tool: tip at
// the origin, +z along the axis out of the tip, so the body is at z < 0. Millimetres.
#pragma once
#include <compare>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/tools/cut_body.hpp"

namespace osteon {

enum class ToolKind : std::uint8_t {
  drill = 1,               // cone point and cylindrical flutes
  round_burr = 2,          // sphere on a shank
  end_drill = 3,           // flat end: opens the medullary canal
  barrel_burr = 4,         // bulging cylinder
  contoured_burr = 5,      // tapered, with a rounded end
  oscillating_saw = 6,     // a blade that swings about a pivot behind it
  reciprocating_saw = 7,   // a blade that moves back and forth along its axis
  sphere_reamer = 8,       // hemisphere for the acetabulum
  cylinder_reamer = 9,     // for a canal
  outside_reamer = 10,     // hollow: planes the outside of a femoral head
  broach = 11,             // tapered stem, driven in by blows
  drill_sleeve = 12,       // guide 1: a tube that holds a drill
  distal_block = 13,       // guide 2: distal cutting block, one slot
  four_in_one_block = 14,  // guide 3: four slots for anterior, posterior and chamfer cuts
  pin = 15,
  screw = 16,
  trial_cup = 17,   // trial implant for a reamed acetabulum
  trial_stem = 18,  // trial implant for a broached canal
  mesh = 19,        // any solid, from a triangle mesh
};

// The comment of a dimension names the kinds that use it. For the others it is zero.
struct Tool {
  std::string name;   // "burr-round-5": lower case, digits, '-' and '.'
  std::string title;  // shown to people
  ToolKind kind = ToolKind::drill;
  // of the cutting part, pin or screw's thread; sleeve, cup: outer diameter; blocks: diameter of the pin holes
  double diameter_mm = 0;
  double cutting_length_mm =
      0;  // from the tip along the axis; of a saw, the toothed part; of a tool that does not cut, the whole length
  double point_angle_rad = 0;  // drill, pin, screw: full angle of the point
  double shank_diameter_mm = 0;
  double shank_length_mm = 0;  // saw: the plate behind the teeth
  double width_mm = 0;         // along x: of a blade or block; of the upper end of a broach or stem
  double thickness_mm =
      0;              // along y: of a blade or block; broach, stem: at the upper end. Cup: wall; outside reamer: back
  double set_mm = 0;  // saw: how much wider its teeth cut than the plate, both sides together
  double swing_rad = 0;         // oscillating saw: full angle of the stroke
  double stroke_mm = 0;         // reciprocating saw: full length of the stroke
  double pivot_mm = 0;          // oscillating saw: from the tooth line back to the pivot
  double taper_rad = 0;         // broach, stem, contoured burr: angle between side and axis
  double corner_mm = 0;         // radius of a barrel's bulge, of a canal reamer's edge; bevel of a broach or stem
  double bore_mm = 0;           // outside reamer, sleeve: inner diameter; blocks: height of a slot
  double thread_pitch_mm = 0;   // screw: advance per turn
  double core_diameter_mm = 0;  // screw: below the thread
  double spindle_rpm = 0;       // turns, strokes or blows per minute
  int teeth = 0;                // number of flutes or teeth
  double feed_mm_per_rev = 0;   // intended advance per turn or stroke
  int cut_level = 2;            // level of its cuts: pitch h / 2^level
  std::string law = {};         // name of its force law; empty: that of its kind
  // Kind mesh: shared by all copies of the definition, because it is immutable and up to megabytes. Otherwise null.
  std::shared_ptr<const SampledDistance> mesh = nullptr;

  [[nodiscard]] bool cuts() const;         // whether it removes bone; guides, cups and stems do not
  [[nodiscard]] CutBody cut_body() const;  // kind none for a tool that does not cut
  [[nodiscard]] double reach_mm() const { return cutting_length_mm + shank_length_mm; }
  [[nodiscard]] Digest hash() const;  // over every field
};

// The tools that come with Osteon, by name: the 24 of Niu 2008, Appendix B, and some more.
[[nodiscard]] std::span<const Tool> builtin_tools();
[[nodiscard]] Result<Tool> find_tool(std::string_view name);

// Distance to the whole real tool (cutting part and shank) in the tool's frame. Negative inside, 1-Lipschitz (Niu 2008,
// §6.1). Exact where one convex part is nearest.
[[nodiscard]] double signed_distance_mm(const Tool& tool, const Vec3& point_tool_mm);
// Unit gradient of the distance. It points out of the tool (eq. 6.2).
[[nodiscard]] Vec3 normal(const Tool& tool, const Vec3& point_tool_mm);
// Boxes of the whole tool, mm: in its frame (Local Bounding Block, Niu 2008, §6.1); at a pose, in bone's frame
// (World).
[[nodiscard]] Box local_bounds(const Tool& tool);
[[nodiscard]] Box world_bounds(const Tool& tool, const Pose& pose_bone_tool);

struct SamplePoint {
  Vec3 position_mm;  // on the surface, tool frame
  Vec3 inward;       // unit normal into the tool (Niu 2008, §6.1)
  double area_mm2;   // area of the surface that the point represents
  bool active;       // on the cutting part
};

// Points spread evenly over the surface. At least `count` of them are on the cutting part, or on the whole tool if it
// does not cut.
[[nodiscard]] std::vector<SamplePoint> sample_points(const Tool& tool, int count);

}  // namespace osteon
