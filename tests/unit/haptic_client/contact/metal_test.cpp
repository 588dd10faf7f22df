// Metal under the tool, on virtual time. The tool stands on it as on steel, cuts nothing, and goes on beside it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/volume/metal.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kPitch_mm = 0.5, kPlate_mm = 5.0;  // depth of the plate's first samples
constexpr double kRadius_mm = 1.6;

// Compact bone at z > 0 with a plate of metal across it.
Case plate_case() {
  return osteon::test::make_bone(
      {Vec3(-10, -10, 0), Vec3(10, 10, 20)}, kPitch_mm,
      [](const Vec3& p) {
        return std::max({-p.z(), p.z() - 20.0, std::abs(p.x()) - 10.0, std::abs(p.y()) - 10.0});
      },
      [](const Vec3& p) { return p.z() >= kPlate_mm && p.z() <= 7.0 ? 2.1 : 1.9; },
      [](const Vec3& p) { return p.z() >= kPlate_mm && p.z() <= 7.0 ? Tissue::metal : Tissue::none; });
}

PlanStep drill_to(double to_mm, HandKind hand) {
  PlanStep step = straight_down("drill-3.2", hand);
  step.feed_mm_per_s = 2.0;
  step.to_mm = to_mm;
  return step;
}

bool metal_is_whole(const CutField& field) {
  const Case& bone = field.bone();
  for (const Coord leaf : bone.metal_leaves())
    for (int i = 0; i < kLeafVoxels; ++i) {
      const Coord at = leaf + Coord{i >> 6, i >> 3 & 7, i & 7};
      if (bone.tissue(at) == Tissue::metal && !(field.solid_mm(position_mm(at, bone.pitch_mm())) < 0.0)) return false;
    }
  return true;
}

// Number of cuts that a room would reject.
int refused(const std::vector<Cut>& cuts, const CutField& field) {
  const CutField* const one = &field;
  return static_cast<int>(std::ranges::count_if(
      cuts, [&](const Cut& cut) { return meets_metal(cut, field.tools()->find(cut.tool)->body, std::span(&one, 1)); }));
}

// A rig goes to its target whatever the force. The force on metal is the coupling's stretch.
TEST(Metal, HoldsADrillAsSteelWould) {
  Bench bench(plate_case(), {drill_to(kPlate_mm + 0.8, HandKind::rig)});
  int stands = 0, off = 0;
  double deepest_mm = 0, strongest_n = 0, densest = 0;
  std::size_t cuts_then = 0, cuts_last = 0;
  bench.run([&](const SessionTick& tick) {
    const LoopReport& r = tick.report;
    deepest_mm = std::max(deepest_mm, r.pose_bone_proxy.position_mm.z());
    densest = std::max(densest, r.cutting.density_g_cm3);
    if (!(r.events & kOnMetal)) return;
    EXPECT_NE(r.cutting.phase, CuttingPhase::idle);
    // A tick may reach the metal by a last cut. The cuts that were open then are closed in the ticks after it.
    if (r.cutting.phase == CuttingPhase::cutting) return;
    if (++stands == 100) cuts_then = bench.cuts().size();
    if (stands >= 100) cuts_last = bench.cuts().size();
    EXPECT_EQ(r.cutting.feed_mm_per_s, 0.0);
    EXPECT_TRUE(r.cutting.force_n.isZero());
    EXPECT_EQ(r.cutting.torque_nmm, 0.0);
    const double stretch_mm =
        (r.pose_bone_device.position_mm + r.coupling.offset_mm - r.pose_bone_proxy.position_mm).norm();
    const double pull_n = bench.session().loop().coupling_n_per_mm() * stretch_mm;
    strongest_n = std::max(strongest_n, r.coupling.force_n.norm());
    if (!(r.events & kForceLimited)) off += std::abs(r.coupling.force_n.norm() - pull_n) > 0.05 * pull_n;
  });
  const StepResult& result = bench.session().results()[0];
  std::printf("  stood %d ms at %.2f mm, up to %.1f N\n", stands, deepest_mm, strongest_n);
  EXPECT_GT(stands, 2000);
  EXPECT_EQ(off, 0);
  // The point stops where metal begins between two samples, and no deeper than the first of them.
  EXPECT_GT(deepest_mm, kPlate_mm - kPitch_mm);
  EXPECT_LT(deepest_mm, kPlate_mm);
  EXPECT_GT(strongest_n, 30.0);
  EXPECT_LE(densest, 2.1 + 1e-6) << "metal does not count as dense bone";
  EXPECT_EQ(cuts_last, cuts_then) << "a stopped tool sends nothing";
  EXPECT_TRUE(metal_is_whole(bench.replica().committed()));
  EXPECT_EQ(refused(bench.cuts(), CutField(plate_case(), BodyId{})), 0);
  // The hole: a cylinder that ends in the point's cone of 118 degrees.
  const double cone_mm = kRadius_mm / std::tan(59.0 / 180.0 * std::numbers::pi);
  const double hole_mm3 = std::numbers::pi * kRadius_mm * kRadius_mm * (deepest_mm - 2.0 / 3.0 * cone_mm);
  EXPECT_NEAR(bench.replica().committed().removed_mm3(), hole_mm3, 0.05 * hole_mm3);
  // It gives up within its time limit, and gives the reason.
  EXPECT_FALSE(result.completed);
  ASSERT_TRUE(result.gave_up);
  EXPECT_EQ(*result.gave_up, SurgeonPhase::feed);
  EXPECT_LT(result.duration_s, 40.0);
  EXPECT_NEAR(result.on_metal_s, 1e-3 * stands, 0.05);
  EXPECT_NE(std::string(given_up_words(result)).find("metal"), std::string::npos);
  EXPECT_EQ(std::string(given_up_words(SurgeonPhase::feed)).find("metal"), std::string::npos);
}

// A hand that pushes feels its own push.
TEST(Metal, BearsThePushOfAHand) {
  PlanStep step = drill_to(kPlate_mm + 0.8, HandKind::expert);
  step.push_n = 29.0;
  Bench bench(plate_case(), {step});
  int stands = 0;
  double sum_n = 0;
  int counted = 0;
  bench.run([&](const SessionTick& tick) {
    if (!(tick.report.events & kOnMetal) || tick.order.phase != SurgeonPhase::push) return;
    if (++stands < 2000) return;
    sum_n += tick.report.coupling.force_n.norm();
    ++counted;
  });
  ASSERT_GT(counted, 10000);
  EXPECT_NEAR(sum_n / counted, 29.0, 0.05 * 29.0);
  ASSERT_TRUE(bench.session().results()[0].gave_up);
  EXPECT_EQ(*bench.session().results()[0].gave_up, SurgeonPhase::push);
  EXPECT_NE(std::string(given_up_words(bench.session().results()[0])).find("metal"), std::string::npos);
  EXPECT_TRUE(metal_is_whole(bench.replica().committed()));
}

// Two millimetres beside the edge of a plate that covers half the bone, the drill does not meet it. The hole is the
// same, bit for bit.
TEST(Metal, DoesNothingBesideIt) {
  const auto half_plate = [](bool metal) {
    return osteon::test::make_bone(
        {Vec3(-10, -10, 0), Vec3(10, 10, 12)}, kPitch_mm,
        [](const Vec3& p) {
          return std::max({-p.z(), p.z() - 12.0, std::abs(p.x()) - 10.0, std::abs(p.y()) - 10.0});
        },
        [](const Vec3&) { return 1.9; },
        [=](const Vec3& p) { return metal && p.x() >= 4.0 && p.z() >= 2.0 ? Tissue::metal : Tissue::none; });
  };
  const auto run = [](const Case& bone) {
    Bench bench(bone, {drill_to(6.0, HandKind::rig)});
    std::uint32_t events = 0;
    double most_n = 0;
    bench.run([&](const SessionTick& tick) {
      events |= tick.report.events;
      most_n = std::max(most_n, tick.report.coupling.force_n.norm());
    });
    EXPECT_TRUE(bench.session().results()[0].completed);
    EXPECT_EQ(events & kOnMetal, 0u);
    EXPECT_EQ(bench.session().results()[0].on_metal_s, 0.0);
    return std::pair(bench.replica().committed().hash(), most_n);
  };
  EXPECT_EQ(run(half_plate(true)), run(half_plate(false)));
}

// A bur moves over a window of which half is metal. It takes the other half.
TEST(Metal, StaysWhereABurGoesOver) {
  const Case bone = osteon::test::make_bone(
      {Vec3(-10, -10, 0), Vec3(10, 10, 8)}, kPitch_mm,
      [](const Vec3& p) {
        return std::max({-p.z(), p.z() - 8.0, std::abs(p.x()) - 10.0, std::abs(p.y()) - 10.0});
      },
      [](const Vec3&) { return 1.9; }, [](const Vec3& p) { return p.x() >= 1.0 ? Tissue::metal : Tissue::none; });
  PlanStep step = straight_down("burr-round-5", HandKind::expert);
  step.action = Action::burr;
  step.window_u_mm = step.window_v_mm = 8.0;
  step.depth_mm = 1.5;
  Bench bench(bone, {step});
  int stands = 0;
  bench.run([&](const SessionTick& tick) { stands += (tick.report.events & kOnMetal) != 0; });
  std::printf("  stood %d ms, %.1f mm3 taken\n", stands, bench.replica().committed().removed_mm3());
  EXPECT_GT(stands, 100);
  EXPECT_GT(bench.replica().committed().removed_mm3(), 5.0);
  EXPECT_TRUE(metal_is_whole(bench.replica().committed()));
  EXPECT_EQ(refused(bench.cuts(), CutField(bone, BodyId{})), 0);
}

}  // namespace
}  // namespace osteon::haptic::test
