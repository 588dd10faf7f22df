#include "common/tools/guide.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteon {
namespace {

// Pin holes lie in the two ends of a block, so that no slot crosses them: from its ends to their middles, and to the
// ends of its slots, in diameters of a pin hole.
constexpr double kPinFromEnd = 1.5, kSlotFromEnd = 3.0;
// A 4-in-1 block's slots leave its bone side at these shares of half its thickness: the chamfers run outwards from
// there and meet the anterior and posterior cuts.
constexpr double kStraightAt = 0.8, kChamferAt = 0.6;

void add_pin_holes(const Tool& block, GuideShape& shape) {
  const double x = 0.5 * block.width_mm - kPinFromEnd * block.diameter_mm;
  for (const double side : {-1.0, 1.0})
    shape.pin_holes.push_back({{side * x, 0, -block.cutting_length_mm}, Vec3::UnitZ(), block.diameter_mm, block.cutting_length_mm});
}

GuideSlot straight_slot(const Tool& block, double y) {
  return {{0, y, -block.cutting_length_mm}, Vec3::UnitZ(), Vec3::UnitY(), block.bore_mm,
          block.width_mm - 2.0 * kSlotFromEnd * block.diameter_mm, block.cutting_length_mm};
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
    default: break;
  }
  return shape;
}

}  // namespace osteon
