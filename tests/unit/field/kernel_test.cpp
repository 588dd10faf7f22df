#include "common/field/kernel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <random>

#include "common/field/field_hash.hpp"
#include "common/tools/tool_box.hpp"

namespace osteon {
namespace {

constexpr double kPitch = 0.5;

Cut cut_with(const Tool& tool, std::vector<Pose> path, int level = 2) {
  Cut cut{.author = {1}, .author_seq = 1, .lease_epoch = 1, .body = {}, .tool = tool.hash(), .level = level, .path = {}, .spindle_rpm = 1000};
  for (const Pose& pose : path) cut.path.push_back(quantise(pose));
  return cut;
}

const CutBody& body_of(const Cut& cut) {
  static const std::shared_ptr<const ToolBox> box = builtin_tool_box();
  return box->find(cut.tool)->body;
}

// The tool without shank, its flutes no longer than what cuts, so that the distance of common/tools is that of its
// cutting part.
Tool cutting_part(std::string_view name) {
  Tool tool = *find_tool(name);
  tool.cutting_length_mm = -tool.cut_body().lowest[2] * kQuantum_mm;
  tool.shank_diameter_mm = 1e-6;
  tool.shank_length_mm = 1e-6;
  return tool;
}

// The other road to a sweep's distance: the nearest of many poses between the two.
double nearest_pose_distance(const Tool& tool, const Pose& a, const Pose& b, const Vec3& point, int poses) {
  double nearest = 1e9;
  for (int i = 0; i <= poses; ++i) {
    const double t = static_cast<double>(i) / poses;
    const Pose pose{(1.0 - t) * a.position_mm + t * b.position_mm, a.rotation.slerp(t, b.rotation)};
    nearest = std::min(nearest, signed_distance_mm(tool, pose.inverse().point(point)));
  }
  return nearest;
}

std::vector<Vec3> points_around(const Vec3& centre, double reach, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(-reach, reach);
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(centre + Vec3{offset(random), offset(random), offset(random)});
  return points;
}

void expect_sweep_matches(std::string_view name, const Pose& a, const Pose& b, double tolerance_mm) {
  const Tool tool = cutting_part(name);
  const SweptTool swept(cut_with(tool, {a, b}), tool.cut_body(), kPitch);
  const Pose from = dequantise(quantise(a)), to = dequantise(quantise(b));
  for (const Vec3& point : points_around(0.5 * (a.position_mm + b.position_mm), 6.0, 300, 7)) {
    const double distance = static_cast<double>(swept.distance_mm(point));
    const double nearest = nearest_pose_distance(tool, from, to, point, 4000);
    if (nearest >= 0.0) {
      ASSERT_NEAR(distance, nearest, tolerance_mm);
    } else {
      // Within the swept volume its surface is at least as far as that of any one pose, and at most a radius away.
      ASSERT_LE(distance, nearest + tolerance_mm);
      ASSERT_GE(distance, -0.5 * tool.diameter_mm - tolerance_mm);
    }
  }
}

// Radius and cone height are rounded to a quantum, and half a quantum is left by the search for the nearest pose.
constexpr double kExact_mm = 3.0 * kQuantum_mm;

TEST(Kernel, ASphereSweptAlongALineIsACapsule) {
  const Tool burr = *find_tool("burr-round-5");
  const Pose a = pose_along({1, 2, 3}, {0, 0, -1}), b = pose_along({9, -2, 5}, {0, 0, -1});
  const SweptTool swept(cut_with(burr, {a, b}), burr.cut_body(), kPitch);
  const Vec3 p0 = a.point({0, 0, -2.5}), p1 = b.point({0, 0, -2.5}), along = p1 - p0;
  for (const Vec3& p : points_around({5, 0, 4}, 8.0, 500, 1)) {
    const double t = std::clamp((p - p0).dot(along) / along.squaredNorm(), 0.0, 1.0);
    ASSERT_NEAR(static_cast<double>(swept.distance_mm(p)), (p - p0 - t * along).norm() - 2.5, kExact_mm);
  }
}

TEST(Kernel, ADrillPushedStraightIsALongerDrill) {
  const Vec3 axis = Vec3{0.3, -0.2, -1.0}.normalized();
  expect_sweep_matches("drill-3.2", pose_along({0, 0, 0}, axis), pose_along(5.0 * axis, axis), kExact_mm);
  expect_sweep_matches("drill-3.2", pose_along({0, 0, 0}, axis), pose_along(-3.0 * axis, axis), kExact_mm);
}

TEST(Kernel, ADrillMovedSidewaysLeavesNoScallops) {
  expect_sweep_matches("drill-3.2", pose_along({0, 0, 0}, {0, 0, -1}), pose_along({6, 2, -1}, {0, 0, -1}), kExact_mm);
  expect_sweep_matches("drill-3.2", pose_along({0, 0, 0}, {0, 0, -1}), pose_along({0.05, 0, -0.2}, {0, 0, -1}), kExact_mm);
}

TEST(Kernel, ATurningToolIsCutAtPosesAQuarterPitchApart) {
  // The part of the drill that cuts here turns about its tip; sub-poses may differ by a quarter of the level's pitch.
  const Pose a = pose_along({0, 0, 0}, {0, 0, -1}), b = pose_along({0, 0, 0}, {0.06, 0, -1});
  expect_sweep_matches("drill-3.2", a, b, 0.25 * level_pitch_mm(kPitch, 2) + kExact_mm);
}

TEST(Kernel, ValuesAreWholeQuantaWithinTheBandAndNeverMinusZero) {
  const Tool drill = *find_tool("drill-3.2");
  const SweptTool swept(cut_with(drill, {pose_along({0, 0, 0}, {0, 0, -1}), pose_along({0, 0, -2}, {0, 0, -1})}), drill.cut_body(), kPitch);
  const float band = band_mm(swept.level_pitch_mm());
  for (const Coord origin : swept.leaves()) {
    std::array<float, kLeafVoxels> values;
    values.fill(band);
    swept.cut_leaf(origin, values);
    for (const float v : values) {
      ASSERT_EQ(v * 1024.0f, std::round(v * 1024.0f));
      ASSERT_LE(std::abs(v), band);
      ASSERT_NE(std::bit_cast<std::uint32_t>(v), 0x80000000u);
    }
  }
}

TEST(Kernel, NoLeafWithinTheBandIsLeftOut) {
  const Cut cut = cut_with(*find_tool("burr-round-5"), {pose_along({0, 0, 0}, {0.2, 0.1, -1}), pose_along({3, 1, -0.5}, {0.2, 0.1, -1})});
  const SweptTool swept(cut, body_of(cut), kPitch);
  const auto named = swept.leaves();
  for (std::int32_t x = -16; x < 16; ++x)
    for (std::int32_t y = -16; y < 16; ++y)
      for (std::int32_t z = -16; z < 16; ++z) {
        const Coord origin{8 * x, 8 * y, 8 * z};
        std::array<float, kLeafVoxels> values;
        values.fill(band_mm(swept.level_pitch_mm()));
        const bool changed = swept.cut_leaf(origin, values) > 0;
        ASSERT_TRUE(!changed || std::ranges::binary_search(named, origin)) << x << ' ' << y << ' ' << z;
        for (int i = 0; i < kLeafVoxels; i += 37) {
          const Vec3 p = position_mm(origin + Coord{i / 64, i / 8 % 8, i % 8}, swept.level_pitch_mm());
          const float exact = std::clamp(swept.distance_mm(p), -band_mm(swept.level_pitch_mm()), band_mm(swept.level_pitch_mm()));
          ASSERT_NEAR(values[static_cast<std::size_t>(i)], exact, 0.51 * kQuantum_mm);
        }
      }
}

class CutSet {
 public:
  void apply(const Cut& cut) {
    const SweptTool swept(cut, body_of(cut), kPitch);
    for (const Coord origin : swept.leaves()) {
      auto [leaf, added] = leaves_.try_emplace({cut.level, origin});
      if (added) leaf->second.fill(band_mm(swept.level_pitch_mm()));
      swept.cut_leaf(origin, leaf->second);
    }
  }
  [[nodiscard]] Digest hash() const {
    std::vector<FieldLeaf> leaves;
    for (const auto& [place, values] : leaves_) {
      FieldLeaf leaf{{}, place.first, place.second, {}};
      for (const float v : values) leaf.values.push_back(static_cast<std::int16_t>(std::lround(v * 1024.0f)));
      leaves.push_back(leaf);
    }
    return field_hash(leaves, kPitch);
  }

 private:
  std::map<std::pair<int, Coord>, std::array<float, kLeafVoxels>> leaves_;
};

std::vector<Cut> random_cuts(int count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-4.0, 4.0), step(-1.0, 1.0);
  std::vector<Cut> cuts;
  for (int i = 0; i < count; ++i) {
    const auto tools = builtin_tools().first(3);
    const Tool& tool = tools[static_cast<std::size_t>(i) % tools.size()];
    const Vec3 axis{step(random), step(random), -1.5}, tip{place(random), place(random), place(random)};
    const Vec3 turned = axis + 0.02 * Vec3{step(random), step(random), 0.0};
    const Pose from = pose_along(tip, axis);
    const Pose to = pose_along(tip + Vec3{step(random), step(random), step(random)}, i % 4 == 0 ? turned : axis);
    cuts.push_back(cut_with(tool, {from, to}, i % 3));
  }
  return cuts;
}

TEST(Kernel, TheFieldIsAFunctionOfTheSetOfCuts) {
  std::vector<Cut> cuts = random_cuts(40);
  CutSet in_order;
  for (const Cut& cut : cuts) in_order.apply(cut);
  std::mt19937 random(5);
  for (int order = 0; order < 5; ++order) {
    std::ranges::shuffle(cuts, random);
    CutSet shuffled;
    for (const Cut& cut : cuts) shuffled.apply(cut);
    for (std::size_t i = 0; i < cuts.size(); i += 3) shuffled.apply(cuts[i]);  // some come twice
    EXPECT_EQ(shuffled.hash(), in_order.hash());
  }
  CutSet fewer;
  for (std::size_t i = 1; i < cuts.size(); ++i) fewer.apply(cuts[i]);
  EXPECT_NE(fewer.hash(), in_order.hash());
}

// The value was written down once; gcc and clang, optimised or not, with and without AVX, must all give it. It changes
// only together with kKernelVersion.
TEST(Kernel, EqualCutsGiveEqualBytesOnEveryCompiler) {
  CutSet set;
  for (const Cut& cut : random_cuts(40)) set.apply(cut);
  EXPECT_EQ(to_hex(set.hash()), "06e8462d5db567c17af2a68d40549fc1284e5a74c9a592e17490d325aa7f32e6");
}

TEST(FieldHash, LeavesAtTheBandCountAsAbsent) {
  const auto band = static_cast<std::int16_t>(band_quanta(kPitch));
  const FieldLeaf untouched{{}, 0, {0, 0, 0}, std::vector<std::int16_t>(kLeafVoxels, band)};
  FieldLeaf cut{{}, 0, {8, 0, 0}, std::vector<std::int16_t>(kLeafVoxels, band)};
  cut.values[3] = -5;
  EXPECT_EQ(field_hash({untouched, cut}, kPitch), field_hash({cut}, kPitch));
  FieldLeaf elsewhere = cut;
  elsewhere.origin = {16, 0, 0};
  EXPECT_EQ(field_hash({cut, elsewhere}, kPitch), field_hash({elsewhere, cut}, kPitch));
  EXPECT_NE(field_hash({cut}, kPitch), field_hash({elsewhere}, kPitch));
}

TEST(Cut, PosesSurviveQuantisationToHalfAQuantum) {
  const Pose pose = pose_along({12.3456, -7.8901, 100.0}, {0.3, 0.4, -0.8});
  const Pose back = dequantise(quantise(pose));
  EXPECT_LE((back.position_mm - pose.position_mm).cwiseAbs().maxCoeff(), 0.5 * kQuantum_mm + 1e-12);
  EXPECT_LT(back.rotation.angularDistance(pose.rotation), 1e-4);
}

}  // namespace
}  // namespace osteon
