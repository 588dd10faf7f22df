// Guides against closed forms: play, tilt, remaining freedom, and a shaky hand.
#include "common/tools/guide.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace osteon {
namespace {

Tool sleeve() {
  Tool tool;
  tool.name = tool.title = "sleeve";
  tool.kind = ToolKind::drill_sleeve;
  tool.diameter_mm = 8.0;
  tool.bore_mm = 3.5;
  tool.cutting_length_mm = 30.0;
  return tool;
}

Tool block(ToolKind kind) {
  Tool tool;
  tool.name = tool.title = "block";
  tool.kind = kind;
  tool.diameter_mm = 3.4;
  tool.bore_mm = 1.6;
  tool.width_mm = 70.0;
  tool.thickness_mm = 50.0;
  tool.cutting_length_mm = 12.0;
  return tool;
}

Tool drill(double diameter_mm = 3.2) {
  Tool tool;
  tool.name = tool.title = "drill";
  tool.kind = ToolKind::drill;
  tool.diameter_mm = tool.shank_diameter_mm = diameter_mm;
  tool.cutting_length_mm = tool.shank_length_mm = 60.0;
  tool.point_angle_rad = 2.0;
  return tool;
}

Tool saw() {
  Tool tool;
  tool.name = tool.title = "saw";
  tool.kind = ToolKind::reciprocating_saw;
  tool.width_mm = 20.0;
  tool.thickness_mm = 1.0;
  tool.set_mm = 0.3;
  tool.cutting_length_mm = 60.0;
  return tool;
}

// A general pose in the patient, so that no frame is mistaken for another.
const Pose kPlace{{12.0, -40.0, 7.0}, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Vec3(0.3, -0.5, 0.8).normalized()))};

Eigen::Quaterniond small_turn(double x, double y, double z) {
  const Vec3 v(x, y, z);
  return v.norm() > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(v.norm(), v.normalized()))
                        : Eigen::Quaterniond::Identity();
}

// In the guide's frame: how far the axis is from the bore's middle at a depth below the mouth.
Eigen::Vector2d off_axis(const GuideBore& bore, const Pose& tool, double depth_mm) {
  const Pose seen = kPlace.inverse() * tool;
  const Vec3 axis = seen.direction(Vec3::UnitZ());
  const double z = bore.entry_mm.z() + depth_mm;
  return (seen.position_mm + axis * ((z - seen.position_mm.z()) / axis.z())).head<2>() - bore.entry_mm.head<2>();
}

class ShakyHand {
 public:
  explicit ShakyHand(unsigned seed) : random_(seed) {}
  double one() { return between(-1.0, 1.0); }
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

 private:
  std::mt19937 random_;
};

double difference(const Pose& a, const Pose& b) {
  return (a.position_mm - b.position_mm).norm() + a.rotation.angularDistance(b.rotation);
}

TEST(GuideShape, OfTheThreeGuides) {
  const GuideShape tube = guide_shape(sleeve());
  ASSERT_EQ(tube.bores.size(), 1u);
  EXPECT_EQ(opening_count(tube), 1u);
  EXPECT_DOUBLE_EQ((tube.bores[0].entry_mm + 30.0 * tube.bores[0].direction).norm(), 0.0);  // it ends on the bone

  EXPECT_EQ(guide_shape(block(ToolKind::distal_block)).slots.size(), 1u);
  EXPECT_GE(guide_shape(block(ToolKind::distal_block)).pin_holes.size(), 2u);
  EXPECT_EQ(opening_count(guide_shape(drill())), 0u);
}

// The cuts of the 4-in-1 block: anterior and posterior cuts are parallel. The chamfers are at 45 degrees between them
// and the distal cut. Every slot ends on the bone's side of the block.
TEST(GuideShape, TheFourCutsMeetAsPlanned) {
  const Tool guide = block(ToolKind::four_in_one_block);
  const GuideShape shape = guide_shape(guide);
  ASSERT_EQ(shape.slots.size(), 4u);
  for (const GuideSlot& slot : shape.slots) {
    EXPECT_NEAR((slot.entry_mm + slot.depth_mm * slot.direction).z(), 0.0, 1e-12);
    EXPECT_NEAR(slot.entry_mm.z(), -guide.cutting_length_mm, 1e-12);
    EXPECT_NEAR(slot.normal.dot(slot.direction), 0.0, 1e-12);
    EXPECT_NEAR(slot.normal.norm(), 1.0, 1e-12);
  }
  EXPECT_NEAR(shape.slots[0].normal.dot(shape.slots[1].normal), 1.0, 1e-12);
  EXPECT_NEAR(std::abs(shape.slots[2].normal.dot(shape.slots[0].normal)), std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(shape.slots[2].normal.dot(shape.slots[3].normal), 0.0, 1e-12);
  // Each chamfer points outwards and stays on its side of the block.
  EXPECT_GT(shape.slots[2].entry_mm.y(), 0.0);
  EXPECT_GT(shape.slots[2].direction.y(), 0.0);
  EXPECT_LT(shape.slots[3].entry_mm.y(), 0.0);
  EXPECT_LT(shape.slots[3].direction.y(), 0.0);
}

TEST(Guide, TakesOnlyWhatFits) {
  const GuideShape tube = guide_shape(sleeve()), cutting = guide_shape(block(ToolKind::distal_block));
  EXPECT_TRUE(fits(tube, 0, drill(3.2)));
  EXPECT_FALSE(fits(tube, 0, drill(3.6)));
  EXPECT_FALSE(fits(tube, 0, saw()));
  const std::size_t slot = cutting.pin_holes.size();
  EXPECT_TRUE(fits(cutting, slot, saw()));
  EXPECT_FALSE(fits(cutting, slot, drill(1.0)));
  Tool wide = saw();
  wide.set_mm = 0.7;  // 1.7 mm of teeth in 1.6 mm
  EXPECT_FALSE(fits(cutting, slot, wide));
}

// However the hand shakes, the axis inside the sleeve stays within the play c. A tip l beyond a sleeve of length L
// stays within c (1 + 2 l / L).
TEST(Guide, AShakyDrillStaysWithinTheSleevesPlay) {
  const Tool guide = sleeve(), tool = drill();
  const GuideShape shape = guide_shape(guide);
  const double c = 0.5 * (3.5 - 3.2), length = 30.0;
  ShakyHand hand(1);
  double largest_tip = 0.0, largest_correction = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double depth = hand.between(0.01, 80.0);
    const Pose wanted = kPlace * Pose{{4.0 * hand.one(), 4.0 * hand.one(), -length + depth},
                                      small_turn(0.3 * hand.one(), 0.3 * hand.one(), 3.0 * hand.one())};
    const auto guided = constrain(shape, 0, kPlace, tool, wanted);
    ASSERT_TRUE(guided);
    const Pose& pose = guided->pose_bone_tool;
    ASSERT_LE(off_axis(shape.bores[0], pose, 0.0).norm(), c + 1e-9);
    ASSERT_LE(off_axis(shape.bores[0], pose, std::min(depth, length)).norm(), c + 1e-9);
    const double tip = off_axis(shape.bores[0], pose, depth).norm();
    const double beyond = std::max(0.0, depth - length);
    ASSERT_LE(tip, c * (1.0 + 2.0 * beyond / length) + 1e-9);
    ASSERT_NEAR(guided->play_mm, c * (1.0 + 2.0 * beyond / length), 1e-12);
    largest_tip = std::max(largest_tip, tip);
    largest_correction = std::max(largest_correction, guided->correction_mm);
    // The position along the sleeve is the hand's own.
    ASSERT_NEAR((kPlace.inverse() * pose).position_mm.z(), (kPlace.inverse() * wanted).position_mm.z(), 1e-9);
    // Applying it once more changes nothing.
    const auto again = constrain(shape, 0, kPlace, tool, pose);
    ASSERT_TRUE(again);
    ASSERT_LT(difference(again->pose_bone_tool, pose), 1e-7);
  }
  // 50 mm beyond, c (1 + 100 / 30) = 0.65 mm is nearly reached, so the bound is tight.
  EXPECT_GT(largest_tip, 0.55);
  EXPECT_GT(largest_correction, 3.0);
}

TEST(Guide, LeavesWhatIsAllowedAsItIs) {
  const Tool tool = drill();
  const GuideShape shape = guide_shape(sleeve());
  const double c = 0.15, length = 30.0;
  ShakyHand hand(2);
  for (int i = 0; i < 5000; ++i) {
    // An axis through two points within the play, with a random turn about itself.
    const double a = 6.3 * hand.one(), b = 6.3 * hand.one(), depth = hand.between(0.5, 80.0),
                 end = std::min(depth, length);
    const Vec3 in(0.99 * c * std::cos(a), 0.99 * c * std::sin(a), -length),
        out(0.99 * c * std::cos(b), 0.99 * c * std::sin(b), -length + end);
    Pose wanted = pose_along(in + (out - in) * (depth / end), out - in);
    wanted.rotation = wanted.rotation * Eigen::AngleAxisd(3.0 * hand.one(), Vec3::UnitZ());
    const Pose there = kPlace * wanted;
    if ((out - in).head<2>().norm() > 0.9 * (out - in).z()) continue;  // steeper than can enter
    const auto guided = constrain(shape, 0, kPlace, tool, there);
    ASSERT_TRUE(guided);
    ASSERT_EQ(guided->correction_mm, 0.0);
    ASSERT_EQ(difference(guided->pose_bone_tool, there), 0.0);
    EXPECT_EQ(entered(shape, kPlace, tool, there), std::optional<std::size_t>(0));
  }
}

// No allowed axis is nearer. Compared with random allowed ones, by the measure in the header.
TEST(Guide, FindsTheNearestAxis) {
  const Tool tool = drill();
  const GuideShape shape = guide_shape(sleeve());
  const double c = 0.15, length = 30.0;
  ShakyHand hand(3);
  const auto measure = [&](const Pose& a, const Pose& b) {
    const Eigen::Vector2d middle = off_axis(shape.bores[0], a, 15.0) - off_axis(shape.bores[0], b, 15.0);
    const Eigen::Vector2d rise_a = off_axis(shape.bores[0], a, 1.0) - off_axis(shape.bores[0], a, 0.0);
    const Eigen::Vector2d rise_b = off_axis(shape.bores[0], b, 1.0) - off_axis(shape.bores[0], b, 0.0);
    return middle.squaredNorm() + (4.0 * length * (rise_a - rise_b)).squaredNorm();
  };
  for (int i = 0; i < 300; ++i) {
    const double depth = hand.between(2.0, 60.0), end = std::min(depth, length);
    const Pose wanted = kPlace * Pose{{0.6 * hand.one(), 0.6 * hand.one(), -length + depth},
                                      small_turn(0.02 * hand.one(), 0.02 * hand.one(), 0)};
    const auto guided = constrain(shape, 0, kPlace, tool, wanted);
    ASSERT_TRUE(guided);
    const double best = measure(guided->pose_bone_tool, wanted);
    for (int j = 0; j < 300; ++j) {
      // Random axes in the play, half of them close to the answer.
      const bool beside = j % 2;
      const auto place = [&](double z) {
        Eigen::Vector2d v = beside ? Eigen::Vector2d(off_axis(shape.bores[0], guided->pose_bone_tool, z) +
                                                     0.02 * Eigen::Vector2d(hand.one(), hand.one()))
                                   : Eigen::Vector2d(c * hand.one(), c * hand.one());
        return Eigen::Vector2d(v.norm() > c ? v * (c / v.norm()) : v);
      };
      const Eigen::Vector2d u = place(0.0), v = place(end);
      const Vec3 in(u.x(), u.y(), -length), out(v.x(), v.y(), -length + end);
      const Pose other = kPlace * pose_along(in + (out - in) * (depth / end), out - in);
      ASSERT_GE(measure(other, wanted), best - 1e-9) << i;
    }
  }
}

// A trembling hand goes in, works and comes out again in small steps. The guided tool never jumps.
TEST(Guide, NothingJumps) {
  struct Scene {
    GuideShape shape;
    std::size_t opening;
    Tool tool;
    double length, lead_in;
  };
  const GuideShape cutting = guide_shape(block(ToolKind::distal_block));
  const Scene scenes[] = {{guide_shape(sleeve()), 0, drill(), 30.0, 1.75},
                          {cutting, cutting.pin_holes.size(), saw(), 12.0, 1.8}};
  for (const Scene& scene : scenes) {
    std::optional<std::size_t> held;
    Pose before = kPlace * Pose{{0, 0, -scene.length - 4.0}, Eigen::Quaterniond::Identity()}, wanted_before = before;
    double worst = 0.0;
    int inside = 0;
    for (int i = 0; i <= 40000; ++i) {
      const double t = i / 40000.0, depth = -4.0 + 60.0 * std::sin(3.14159265 * t);
      const Pose wanted =
          kPlace * Pose{{1.3 * std::sin(211.0 * t), 1.1 * std::sin(170.0 * t + 1.0), -scene.length + depth},
                        small_turn(0.05 * std::sin(190.0 * t), 0.05 * std::cos(140.0 * t), 0.06 * std::sin(230.0 * t))};
      if (!held) held = entered(scene.shape, kPlace, scene.tool, wanted);
      Pose now = wanted;
      if (held) {
        ASSERT_EQ(*held, scene.opening);
        const auto guided = constrain(scene.shape, *held, kPlace, scene.tool, wanted);
        if (guided)
          now = guided->pose_bone_tool;
        else
          held.reset();
        inside += guided.has_value();
      }
      // As far as the hand itself moved in this step, plus the lever of a line that is held at its other end.
      const double step = difference(wanted, wanted_before);
      if (i > 0) worst = std::max(worst, (now.position_mm - before.position_mm).norm() - 8.0 * step);
      before = now;
      wanted_before = wanted;
    }
    EXPECT_GT(inside, 35000);
    EXPECT_LT(worst, 0.1) << "play " << (scene.opening == 0 ? 0.15 : 0.3);
    EXPECT_FALSE(held);
  }
}

// A blade stays in the slot's plane within the play, at every corner of its part in the slot. It is free in the plane.
TEST(Guide, ABladeStaysInItsSlotsPlane) {
  const Tool guide = block(ToolKind::four_in_one_block), tool = saw();
  const GuideShape shape = guide_shape(guide);
  const double c = 0.5 * (1.6 - 1.0);
  ShakyHand hand(4);
  for (std::size_t s = 0; s < shape.slots.size(); ++s) {
    const GuideSlot& slot = shape.slots[s];
    const std::size_t opening = shape.pin_holes.size() + s;
    Eigen::Matrix3d axes;
    axes << slot.normal.cross(slot.direction), slot.normal, slot.direction;
    const Pose pose_bone_slot = kPlace * Pose{slot.entry_mm, Eigen::Quaterniond(axes)};
    double largest = 0.0;
    for (int i = 0; i < 2000; ++i) {
      const double depth = hand.between(0.01, 50.0);
      const Pose wanted = pose_bone_slot * Pose{{8.0 * hand.one(), 3.0 * hand.one(), depth},
                                                small_turn(0.1 * hand.one(), 0.1 * hand.one(), 0.1 * hand.one())};
      const auto guided = constrain(shape, opening, kPlace, tool, wanted);
      ASSERT_TRUE(guided);
      const Pose seen = pose_bone_slot.inverse() * guided->pose_bone_tool;
      const Vec3 normal = seen.direction(Vec3::UnitY()), axis = seen.direction(Vec3::UnitZ());
      for (const double z : {0.0, std::min(depth, slot.depth_mm)})
        for (const double side : {-1.0, 1.0}) {
          const double x =
              seen.position_mm.x() + axis.x() * (z - seen.position_mm.z()) / axis.z() + side * 0.5 * tool.width_mm;
          // The blade's plane at that point.
          const double y =
              seen.position_mm.y() -
              (normal.x() * (x - seen.position_mm.x()) + normal.z() * (z - seen.position_mm.z())) / normal.y();
          ASSERT_LE(std::abs(y), c + 1e-6) << depth;
          largest = std::max(largest, std::abs(y));
        }
      ASSERT_NEAR(seen.position_mm.z(), depth, 1e-9);
      const auto again = constrain(shape, opening, kPlace, tool, guided->pose_bone_tool);
      ASSERT_LT(difference(again->pose_bone_tool, guided->pose_bone_tool), 1e-5);
    }
    EXPECT_GT(largest, 0.9 * c);
    // Along the flat and in yaw the hand moves the blade freely, within the slot's width.
    const Pose free = pose_bone_slot * Pose{{5.0, 0.1, 20.0}, small_turn(0, 0.05, 0)};
    const auto guided = constrain(shape, opening, kPlace, tool, free);
    EXPECT_EQ(guided->correction_mm, 0.0);
    EXPECT_EQ(difference(guided->pose_bone_tool, free), 0.0);
    // Turned over, it fits as well.
    const Pose over = free * Pose{Vec3::Zero(), Eigen::Quaterniond(0, 0, 0, 1)};
    EXPECT_EQ(difference(constrain(shape, opening, kPlace, tool, over)->pose_bone_tool, over), 0.0);
  }
}

TEST(Guide, LetsGoOfADrawnOutToolAndOfOneBesideIt) {
  const GuideShape shape = guide_shape(sleeve());
  const auto at = [](const Vec3& tip, double tilt) { return kPlace * Pose{tip, small_turn(tilt, 0, 0)}; };
  EXPECT_FALSE(constrain(shape, 0, kPlace, drill(), at({0, 0, -35.0}, 0)));
  EXPECT_TRUE(constrain(shape, 0, kPlace, drill(), at({2.0, 0, -20.0}, 0)));
  EXPECT_FALSE(entered(shape, kPlace, drill(), at({2.0, 0, -20.0}, 0)));  // beside the sleeve
  EXPECT_TRUE(entered(shape, kPlace, drill(), at({0.5, 0, -30.6}, 0)));   // in the lead-in
  EXPECT_FALSE(entered(shape, kPlace, drill(), at({0.5, 0, -30.6}, 1.2)));
  EXPECT_FALSE(entered(shape, kPlace, drill(4.0), at({0, 0, -30.6}, 0)));
}

}  // namespace
}  // namespace osteon
