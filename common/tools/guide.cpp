#include "common/tools/guide.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>

namespace osteon {
namespace {

// Pin holes are in the two ends of a block, so that no slot crosses them. Distances from the ends to the middles of the
// holes, and to the ends of the slots, in diameters of a pin hole.
constexpr double kPinFromEnd = 1.5, kSlotFromEnd = 3.0;
// The slots of a 4-in-1 block leave its bone side at these fractions of half its thickness. From there the chamfers run
// outwards and meet the anterior and posterior cuts.
constexpr double kStraightAt = 0.8, kChamferAt = 0.6;

void add_pin_holes(const Tool& block, GuideShape& shape) {
  const double x = 0.5 * block.width_mm - kPinFromEnd * block.diameter_mm;
  for (const double side : {-1.0, 1.0})
    shape.pin_holes.push_back(
        {{side * x, 0, -block.cutting_length_mm}, Vec3::UnitZ(), block.diameter_mm, block.cutting_length_mm});
}

// The lead-in: a cone of 45 degrees before the mouth, half as deep as the opening is wide. It guides the tip to the
// mouth.
constexpr double kLeadIn = 0.5;
// Largest slope of the tool against the opening at which it still enters.
constexpr double kMostSlope = 1.0;
// Weight of a change of slope against a change of position, in lengths of the opening. So a trembling tool is moved
// rather than rotated.
constexpr double kSlopeWeight = 4.0;

using Vec2 = Eigen::Vector2d;

// An opening's own frame: x and y across it (y along a slot's normal), z the direction of insertion, origin in the
// middle of its mouth.
struct Opening {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns, guide frame
  Vec3 mouth_mm = Vec3::Zero();
  double length_mm = 0;
  Vec2 play_mm = Vec2::Zero();  // across; bore: both equal; slot: along its flat, across it
  double roll_arm_mm = 0;       // slot: half the blade's width
  double lead_in_mm = 0;
  bool slot = false;
};

bool turns(ToolKind kind) {
  return kind == ToolKind::drill || kind == ToolKind::end_drill || kind == ToolKind::cylinder_reamer ||
         kind == ToolKind::pin || kind == ToolKind::screw;
}
bool saws(ToolKind kind) { return kind == ToolKind::oscillating_saw || kind == ToolKind::reciprocating_saw; }

// The size of a turning tool that a bore must fit, and the width of a blade that a slot must fit along its flat.
double tool_diameter_mm(const Tool& tool) { return std::max(tool.diameter_mm, tool.shank_diameter_mm); }
double swept_width_mm(const Tool& tool) { return tool.width_mm + 2.0 * tool.pivot_mm * std::sin(0.5 * tool.swing_rad); }

Opening opening_for(const GuideShape& shape, std::size_t index, const Tool& tool) {
  Opening opening;
  const std::size_t holes = shape.bores.size() + shape.pin_holes.size();
  if (index < holes) {
    const GuideBore& bore =
        index < shape.bores.size() ? shape.bores[index] : shape.pin_holes[index - shape.bores.size()];
    opening.axes = pose_along(Vec3::Zero(), bore.direction).rotation.toRotationMatrix();
    opening.mouth_mm = bore.entry_mm;
    opening.length_mm = bore.length_mm;
    opening.play_mm = Vec2::Constant(0.5 * (bore.diameter_mm - tool_diameter_mm(tool)));
    opening.lead_in_mm = kLeadIn * bore.diameter_mm;
    return opening;
  }
  const GuideSlot& slot = shape.slots[index - holes];
  opening.slot = true;
  opening.axes.col(0) = slot.normal.cross(slot.direction);
  opening.axes.col(1) = slot.normal;
  opening.axes.col(2) = slot.direction;
  opening.mouth_mm = slot.entry_mm;
  opening.length_mm = slot.depth_mm;
  // The slot holds the plate. The teeth only need to pass through.
  opening.play_mm = {0.5 * (slot.width_mm - swept_width_mm(tool)), 0.5 * (slot.height_mm - tool.thickness_mm)};
  opening.roll_arm_mm = 0.5 * tool.width_mm;
  opening.lead_in_mm = kLeadIn * slot.height_mm + 1.0;
  return opening;
}

// A tool's axis in an opening's frame: where it crosses the middle of the opening, its slope, and the depth of its tip.
struct Line {
  Vec2 middle_mm, slope;
  double tip_mm = 0;  // z of the tip
  double roll = 0;    // slot: slope of the blade along x
};

Vec2 at(const Line& line, double z_mm, double length_mm) {
  return line.middle_mm + (z_mm - 0.5 * length_mm) * line.slope;
}

// A condition on the line: at this depth its distance from the middle is limited.
struct Hold {
  double z_mm = 0;
  double widening_mm = 0;  // allowed in addition to the play, in the lead-in
};
struct Holds {
  std::array<Hold, 2> hold;
  int count = 0;
};
// Conditions from the mouth to the tip or the end. Before the mouth, only the tip in the cone.
Holds holds_of(double tip_mm, double length_mm) {
  if (tip_mm <= 0.0) return {{Hold{tip_mm, -tip_mm}, Hold{}}, 1};
  return {{Hold{0.0, 0.0}, Hold{std::min(tip_mm, length_mm), 0.0}}, 2};
}

// Smallest change of (middle, weight · slope) for which the line stays within `radius` (plus widening) of zero at its
// holds. With multipliers k and l of the two conditions, G the Gram matrix of their rows and u the line at the holds,
// (I + G diag(k, l)) u = u_wanted. For a given k, the l that fulfils the second condition has a closed form. k is
// bracketed.
template <class V>  // Vec2 in a bore, double in a slot
void nearest(V& middle, V& slope, const Holds& holds, double length_mm, double radius_mm) {
  const auto size = [](const V& v) {
    if constexpr (std::is_same_v<V, double>)
      return std::abs(v);
    else
      return v.norm();
  };
  const double weight_mm = kSlopeWeight * length_mm;
  const auto row = [&](int i) { return (holds.hold[static_cast<std::size_t>(i)].z_mm - 0.5 * length_mm) / weight_mm; };
  const auto limit = [&](int i) { return radius_mm + holds.hold[static_cast<std::size_t>(i)].widening_mm; };
  const double a = row(0), b = row(1), r0 = limit(0), r1 = limit(1);
  const double g00 = 1.0 + a * a, g11 = 1.0 + b * b, g01 = 1.0 + a * b;
  const V w0 = middle + a * weight_mm * slope, w1 = middle + b * weight_mm * slope;
  const bool two = holds.count == 2;
  if (size(w0) <= r0 && (!two || size(w1) <= r1)) return;

  // With a limit of zero width, nothing would rest exactly on it.
  constexpr double kNo_mm = 1e-12;
  V u0 = w0, u1 = w1;
  double k = 0.0, l = 0.0;
  const auto solve = [&](double try_k) {
    k = try_k;
    const V numerator = (1.0 + g00 * k) * w1 - g01 * k * w0;
    // Determinant (1 + g00 k) + l (g11 + (g00 g11 − g01²) k).
    const double rise = g11 + (g00 * g11 - g01 * g01) * k;
    l = two ? std::max(0.0, (size(numerator) / std::max(r1, kNo_mm) - (1.0 + g00 * k)) / rise) : 0.0;
    const double determinant = (1.0 + g00 * k) + l * rise;
    u0 = ((1.0 + g11 * l) * w0 - g01 * l * w1) / determinant;
    u1 = numerator / determinant;
    return size(u0) - r0;
  };
  if (solve(0.0) > 0.0) {
    double low = 0.0, high = 1.0;
    while (solve(high) > 0.0 && high < 1e14) low = high, high *= 4.0;
    for (int i = 0; i < 80 && high - low > 1e-15 * high; ++i) {
      const double middle_k = 0.5 * (low + high);
      (solve(middle_k) > 0.0 ? low : high) = middle_k;
    }
    solve(high);
  }
  middle -= k * u0 + l * u1;
  slope -= (a * k * u0 + b * l * u1) / weight_mm;
}

// Change of a slot's line across its flat, squared.
double change(double middle, double slope, const Line& wanted, double length_mm) {
  const double turn = kSlopeWeight * length_mm * (slope - wanted.slope.y());
  return (middle - wanted.middle_mm.y()) * (middle - wanted.middle_mm.y()) + turn * turn;
}

// A blade that rolls uses up play at both its edges, so roll and play across share the room.
void nearest_in_slot(Line& line, const Holds& holds, const Opening& opening) {
  nearest(line.middle_mm.x(), line.slope.x(), holds, opening.length_mm, opening.play_mm.x());
  const Line wanted = line;
  const double play = opening.play_mm.y(), arm = std::max(1e-6, opening.roll_arm_mm),
               weight = kSlopeWeight * opening.length_mm;
  const auto across = [&](double lift) {
    line.middle_mm.y() = wanted.middle_mm.y();
    line.slope.y() = wanted.slope.y();
    nearest(line.middle_mm.y(), line.slope.y(), holds, opening.length_mm, play - lift);
    const double turn = weight * (std::abs(wanted.roll) - lift / arm);
    return change(line.middle_mm.y(), line.slope.y(), wanted, opening.length_mm) + turn * turn;
  };
  // Convex in the lift of the blade's edges, which is at most the wanted lift.
  double low = 0.0, high = std::min(play + holds.hold[0].widening_mm, std::abs(wanted.roll) * arm);
  if (across(high) <= 0.0) return;
  constexpr double kGolden = 0.6180339887498949;
  double one = high - kGolden * (high - low), two = low + kGolden * (high - low);
  double cost_one = across(one), cost_two = across(two);
  for (int i = 0; i < 60; ++i) {
    if (cost_one <= cost_two) {
      high = two, two = one, cost_two = cost_one;
      cost_one = across(one = high - kGolden * (high - low));
    } else {
      low = one, one = two, cost_one = cost_two;
      cost_two = across(two = low + kGolden * (high - low));
    }
  }
  const double lift = 0.5 * (low + high);
  across(lift);
  line.roll = std::copysign(lift / arm, wanted.roll);
}

// A tool in an opening's frame as a line. Larger slopes than can enter are limited.
Line line_of(const Opening& opening, const Pose& tool) {
  Line line;
  const Vec3 axis = tool.direction(Vec3::UnitZ());
  const double across = std::hypot(axis.x(), axis.y());
  if (axis.z() * kMostSlope >= across)
    line.slope = axis.head<2>() / axis.z();
  else
    line.slope = across > 0.0 ? Vec2(axis.head<2>() * (kMostSlope / across)) : Vec2(kMostSlope, 0.0);
  line.tip_mm = tool.position_mm.z();
  line.middle_mm = tool.position_mm.head<2>() + (0.5 * opening.length_mm - line.tip_mm) * line.slope;
  if (opening.slot) {
    // The blade's flat as y = roll · x + …. It does not matter which side faces up.
    const Vec3 normal = tool.direction(Vec3::UnitY());
    const double up = std::abs(normal.y()), side = normal.y() < 0.0 ? normal.x() : -normal.x();
    line.roll = up * kMostSlope >= std::abs(side) && up > 0.0 ? side / up : std::copysign(kMostSlope, side);
  }
  return line;
}

bool same(const Line& a, const Line& b) { return a.middle_mm == b.middle_mm && a.slope == b.slope && a.roll == b.roll; }

Pose pose_of(const Opening& opening, const Line& line, const Pose& wanted) {
  Pose pose;
  const Vec2 tip = at(line, line.tip_mm, opening.length_mm);
  pose.position_mm = {tip.x(), tip.y(), line.tip_mm};
  const Vec3 axis = Vec3(line.slope.x(), line.slope.y(), 1.0).normalized();
  if (!opening.slot) {
    pose.rotation = (rotation_between(wanted.direction(Vec3::UnitZ()), axis) * wanted.rotation).normalized();
    return pose;
  }
  Vec3 normal = Vec3(-line.roll, 1.0, line.roll * line.slope.x() - line.slope.y()).normalized();
  if (wanted.direction(Vec3::UnitY()).y() < 0.0) normal = -normal;
  Eigen::Matrix3d axes;
  axes.col(2) = axis;
  axes.col(1) = normal;
  axes.col(0) = normal.cross(axis);
  pose.rotation = Eigen::Quaterniond(axes).normalized();
  return pose;
}

Line nearest_line(const Opening& opening, const Line& wanted) {
  Line line = wanted;
  const Holds holds = holds_of(line.tip_mm, opening.length_mm);
  if (opening.slot)
    nearest_in_slot(line, holds, opening);
  else
    nearest(line.middle_mm, line.slope, holds, opening.length_mm, opening.play_mm.x());
  return line;
}

Pose pose_bone_opening(const Opening& opening, const Pose& pose_bone_guide) {
  return pose_bone_guide * Pose{opening.mouth_mm, Eigen::Quaterniond(opening.axes)};
}

GuideSlot straight_slot(const Tool& block, double y) {
  return {{0, y, -block.cutting_length_mm},
          Vec3::UnitZ(),
          Vec3::UnitY(),
          block.bore_mm,
          block.width_mm - 2.0 * kSlotFromEnd * block.diameter_mm,
          block.cutting_length_mm};
}

GuideSlot chamfer_slot(const Tool& block, double exit_y) {
  GuideSlot slot = straight_slot(block, 0.0);
  const double side = exit_y > 0.0 ? 1.0 : -1.0, half_root = std::numbers::sqrt2 / 2.0;
  slot.direction = {0, side * half_root, half_root};
  slot.normal = {0, half_root, -side * half_root};
  slot.entry_mm = {0, exit_y - side * block.cutting_length_mm, -block.cutting_length_mm};
  slot.depth_mm = std::numbers::sqrt2 * block.cutting_length_mm;
  return slot;
}

}  // namespace

GuideShape guide_shape(const Tool& guide) {
  GuideShape shape;
  switch (guide.kind) {
    case ToolKind::drill_sleeve:
      shape.bores.push_back({{0, 0, -guide.cutting_length_mm}, Vec3::UnitZ(), guide.bore_mm, guide.cutting_length_mm});
      break;
    case ToolKind::distal_block:
      shape.slots.push_back(straight_slot(guide, 0.0));
      add_pin_holes(guide, shape);
      break;
    case ToolKind::four_in_one_block: {
      const double half = 0.5 * guide.thickness_mm;
      for (const double side : {1.0, -1.0}) shape.slots.push_back(straight_slot(guide, side * kStraightAt * half));
      for (const double side : {1.0, -1.0}) shape.slots.push_back(chamfer_slot(guide, side * kChamferAt * half));
      add_pin_holes(guide, shape);
      break;
    }
    default:
      break;
  }
  return shape;
}

std::size_t opening_count(const GuideShape& shape) noexcept {
  return shape.bores.size() + shape.pin_holes.size() + shape.slots.size();
}

bool fits(const GuideShape& shape, std::size_t opening, const Tool& tool) noexcept {
  const Opening its = opening_for(shape, opening, tool);
  if (its.play_mm.minCoeff() < 0.0) return false;
  return its.slot ? saws(tool.kind) && 2.0 * its.play_mm.y() >= tool.set_mm : turns(tool.kind);
}

std::optional<std::size_t> entered(const GuideShape& shape, const Pose& pose_bone_guide, const Tool& tool,
                                   const Pose& pose_bone_tool) noexcept {
  constexpr double kAllowed_mm = 1e-9;
  for (std::size_t i = 0; i < opening_count(shape); ++i) {
    if (!fits(shape, i, tool)) continue;
    const Opening opening = opening_for(shape, i, tool);
    const Pose seen = pose_bone_opening(opening, pose_bone_guide).inverse() * pose_bone_tool;
    const Vec3 axis = seen.direction(Vec3::UnitZ()), flat = seen.direction(Vec3::UnitY());
    if (seen.position_mm.z() < -opening.lead_in_mm || axis.z() * kMostSlope < std::hypot(axis.x(), axis.y())) continue;
    if (opening.slot && std::abs(flat.y()) * kMostSlope < std::abs(flat.x())) continue;
    const Line wanted = line_of(opening, seen), line = nearest_line(opening, wanted);
    if ((line.middle_mm - wanted.middle_mm).norm() < kAllowed_mm && (line.slope - wanted.slope).norm() < kAllowed_mm &&
        std::abs(line.roll - wanted.roll) < kAllowed_mm)
      return i;
  }
  return std::nullopt;
}

std::optional<GuidedPose> constrain(const GuideShape& shape, std::size_t opening, const Pose& pose_bone_guide,
                                    const Tool& tool, const Pose& wanted_bone_tool) noexcept {
  const Opening its = opening_for(shape, opening, tool);
  const Pose pose_bone_its = pose_bone_opening(its, pose_bone_guide);
  const Pose wanted = pose_bone_its.inverse() * wanted_bone_tool;
  if (wanted.position_mm.z() < -its.lead_in_mm) return std::nullopt;

  GuidedPose guided;
  guided.depth_mm = wanted.position_mm.z();
  const double play = its.play_mm.y();
  guided.play_mm = guided.depth_mm < 0.0
                       ? play - guided.depth_mm
                       : play * (1.0 + 2.0 * std::max(0.0, guided.depth_mm - its.length_mm) / its.length_mm);
  const Line asked = line_of(its, wanted), line = nearest_line(its, asked);
  const Vec3 axis = wanted.direction(Vec3::UnitZ());
  if (same(asked, line) && axis.z() * kMostSlope >= std::hypot(axis.x(), axis.y())) {
    guided.pose_bone_tool = wanted_bone_tool;
    return guided;
  }
  const Pose pose = pose_of(its, line, wanted);
  guided.correction_mm = (pose.position_mm - wanted.position_mm).norm();
  guided.pose_bone_tool = pose_bone_its * pose;
  return guided;
}

}  // namespace osteon
