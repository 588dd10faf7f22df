// The surgical tools: what they are made of, which part cuts, and the points that touch bone.
// Frame of every tool: tip at the origin, +z along the axis out of the tip, so the body lies at z < 0. Millimetres.
#pragma once
#include <compare>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon {

enum class ToolKind : std::uint8_t {
  drill = 1,       // cone point and cylindrical flutes
  round_burr = 2,  // sphere on a shank
};

// One length step of everything that is replicated: 2^-10 mm.
inline constexpr double kQuantum_mm = 1.0 / 1024.0;

// The cutting body as it travels and as the kernel cuts with it: integers of kQuantum_mm, so that no
// trigonometry is left to be computed in two places.
struct CutShape {
  ToolKind kind = ToolKind::drill;
  std::int32_t radius = 0;
  std::int32_t tip_height = 0;  // drill: from the point to the full radius; round burr: the radius
  std::int32_t length = 0;      // from the tip to the end of what cuts; a drill's flutes only clear the hole
  friend auto operator<=>(const CutShape&, const CutShape&) = default;
};

struct Tool {
  std::string name;
  ToolKind kind = ToolKind::drill;
  double diameter_mm = 0;
  double cutting_length_mm = 0;    // point and flutes of a drill; diameter of a round burr
  double point_angle_rad = 0;      // full angle of a drill's point; unused by a burr
  double shank_diameter_mm = 0;
  double shank_length_mm = 0;
  double spindle_rpm = 0;
  int cut_level = 2;               // the level its cuts go to: pitch h / 2^level

  [[nodiscard]] CutShape cut_shape() const;
  [[nodiscard]] double reach_mm() const { return cutting_length_mm + shank_length_mm; }
  [[nodiscard]] Digest hash() const;  // over every field
};

// The tools that come with Osteon, by name.
[[nodiscard]] std::span<const Tool> builtin_tools();
[[nodiscard]] Result<Tool> find_tool(std::string_view name);

// The tools as they really are: distance to the whole solid (cutting part and shank) in the tool's frame,
// negative inside, 1-Lipschitz, exact outside and inside each convex part (§6.1 of the dissertation).
[[nodiscard]] double signed_distance_mm(const Tool& tool, const Vec3& point_tool_mm);

struct SamplePoint {
  Vec3 position_mm;   // on the surface, tool frame
  Vec3 inward;        // unit normal into the tool (§6.1)
  double area_mm2;    // of the surface it stands for
  bool active;        // on the cutting part
};

// Points spread evenly over the surface, at least `count` of them on the cutting part.
[[nodiscard]] std::vector<SamplePoint> sample_points(const Tool& tool, int count);

}  // namespace osteon
