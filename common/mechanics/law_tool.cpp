#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/mechanics/force_law.hpp"

namespace osteon {
namespace {

constexpr double kPi = std::numbers::pi;
// The teeth of a reamer or burr stand out by the usual feed of some turns [A].
constexpr double kUsualFeeds = 5.0;

double disc_mm2(double diameter_mm) noexcept { return 0.25 * kPi * diameter_mm * diameter_mm; }

void set_box(LawTool& law, double leading_area_mm2) {
  law.leading_area_mm2 = leading_area_mm2;
  law.diameter_mm = 2.0 * std::sqrt(leading_area_mm2 / kPi);  // diameter of the disc with that area
  law.arm_mm = 0.25 * law.diameter_mm;
  law.heel_mm_per_rev = 0.33 * law.diameter_mm;
  law.edge_length_mm = law.diameter_mm;
}

}  // namespace

LawTool law_tool(const Tool& tool) {
  LawTool law;
  law.teeth = std::max(1, tool.teeth);
  law.point_angle_rad = tool.point_angle_rad > 0.0 ? tool.point_angle_rad : kPi;
  law.diameter_mm = tool.kind == ToolKind::screw ? tool.core_diameter_mm : tool.diameter_mm;
  const double radius_mm = 0.5 * law.diameter_mm;
  law.heel_mm_per_rev = 0.33 * law.diameter_mm;
  law.arm_mm = 0.5 * radius_mm;
  law.edge_length_mm = law.teeth * radius_mm / std::sin(0.5 * law.point_angle_rad);
  law.leading_area_mm2 = disc_mm2(law.diameter_mm);
  const double usual_heel_mm = tool.feed_mm_per_rev > 0.0 ? kUsualFeeds * tool.feed_mm_per_rev : law.heel_mm_per_rev;

  switch (tool.kind) {
    case ToolKind::screw:
      // Its thread makes it advance by exactly its pitch per turn.
      law.heel_mm_per_rev = tool.thread_pitch_mm;
      break;
    case ToolKind::round_burr:
      // Fed sideways: the mean of sqrt(R^2 - z^2) over the disc, and half of the meridians, which are its edges.
      law.arm_mm = 8.0 / (3.0 * kPi) * radius_mm;
      law.edge_length_mm = 0.5 * law.teeth * kPi * radius_mm;
      law.heel_mm_per_rev = usual_heel_mm;
      break;
    case ToolKind::barrel_burr:
    case ToolKind::contoured_burr:
      law.arm_mm = radius_mm;
      law.edge_length_mm = 0.5 * law.teeth * tool.cutting_length_mm;
      law.heel_mm_per_rev = usual_heel_mm;
      law.leading_area_mm2 = tool.diameter_mm * tool.cutting_length_mm;
      break;
    case ToolKind::oscillating_saw:
      set_box(law, tool.width_mm * (tool.thickness_mm + tool.set_mm));
      law.stroke_mm = tool.pivot_mm * tool.swing_rad;
      law.tooth_pitch_mm = tool.width_mm / law.teeth;
      break;
    case ToolKind::reciprocating_saw:
      set_box(law, tool.cutting_length_mm * (tool.thickness_mm + tool.set_mm));
      law.stroke_mm = tool.stroke_mm;
      law.tooth_pitch_mm = tool.cutting_length_mm / law.teeth;
      break;
    case ToolKind::sphere_reamer:
    case ToolKind::cylinder_reamer:
      law.heel_mm_per_rev = usual_heel_mm;
      law.edge_length_mm = law.teeth * radius_mm;  // as seen along the feed
      break;
    case ToolKind::outside_reamer:
      law.heel_mm_per_rev = usual_heel_mm;
      law.edge_length_mm = law.teeth * 0.5 * (tool.diameter_mm - tool.bore_mm);
      law.arm_mm = 0.25 * (tool.diameter_mm + tool.bore_mm);
      law.leading_area_mm2 = disc_mm2(tool.diameter_mm) - disc_mm2(tool.bore_mm);
      break;
    case ToolKind::broach:
      set_box(law, tool.width_mm * tool.thickness_mm);
      break;
    case ToolKind::mesh: {
      double across_mm2 = 10.0;
      if (tool.mesh) {
        const Coord dims = tool.mesh->box.dims();
        const double pitch_mm = kQuantum_mm * tool.mesh->pitch;
        across_mm2 = pitch_mm * pitch_mm * dims.x * dims.y;
      }
      set_box(law, across_mm2);
      break;
    }
    default:
      break;
  }
  return law;
}

}  // namespace osteon
