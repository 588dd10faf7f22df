// Every tool of the tool box in the hand. A cutting tool takes bone where it is pushed, and the hand feels force and
// torque. A tool that does not cut only touches. A saw or broach comes out of what it has made.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "common/volume/metal.hpp"
#include "common/volume/replica.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/rendering/haptic_loop.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

// The hand at the loop without a plan. It holds the tool stiffly at its target.
class HandStage {
 public:
  HandStage(Case bone, const Tool& tool, const Pose& start)
      : replica_(std::move(bone), BodyId{}),
        loop_(LoopParams{}, {ToolModel(tool, replica_.predicted().bone().pitch_mm())}) {
    input_.pose_device_tool = start;
    loop_.take_up(0, start, WorkspaceMapping{});
    build(start);
  }
  LoopReport tick() {
    const osteon::test::AllocationCounter heap;
    const LoopReport report = loop_.tick(input_, patch_);
    allocations_ += heap.count();
    force_n_ = std::max(force_n_, report.coupling.force_n.norm());
    torque_nmm_ = std::max(torque_nmm_, report.cutting.torque_nmm);
    work_min_ = std::min(work_min_, report.cutting.force_n.dot(report.contact.moved_mm));
    const bool cuts = report.cutting.phase == CuttingPhase::cutting;
    cutting_ += cuts;
    // Contact of a cutting tool has a force. A cut has work, torque and feed, all or none, even in a tick whose turning
    // pushed the tool back by more. A broach is driven by its blows, not by a force.
    const bool worked = report.cutting.work_mj > 0.0;
    pushed_ += worked && !cuts;
    if (loop_.tool(0).tool.kind != ToolKind::broach)
      disagree_ += cuts != (report.cutting.force_n.norm() > 0.0) || (cuts && !worked) ||
                   worked != (report.cutting.feed_mm_per_s > 0.0) || worked != (report.cutting.torque_nmm > 0.0);
    touching_ += report.cutting.phase == CuttingPhase::rubbing;
    CutPiece piece;
    while (loop_.take_piece(piece)) {
      const Cut cut = cut_of(piece, loop_.tool(0), AuthorId{1}, 0);
      cuts_.push_back(cut);
      replica_.add_own(cut);
      replica_.commit(RoomSeq{++seq_}, cut, true);
    }
    if (++ticks_ % 12 == 0) build(report.pose_bone_proxy);
    return report;
  }
  LoopReport lead(const Vec3& by_mm, double seconds) {
    const Vec3 from = input_.pose_device_tool.position_mm;
    const int ticks = static_cast<int>(1000 * seconds);
    LoopReport report;
    for (int i = 1; i <= ticks; ++i) {
      input_.pose_device_tool.position_mm = from + by_mm * i / ticks;
      report = tick();
    }
    return report;
  }
  void build(const Pose& pose) {
    for (const ChangedLeaves& change : replica_.take_changes())
      builder_.changed(replica_.predicted().bone().pitch_mm(), change.level, change.origins);
    builder_.build(replica_.predicted(), loop_.tool(0), pose, patch_);
    patch_.own_cuts = replica_.last_own();
  }

  Replica replica_;
  HapticLoop loop_;
  PatchBuilder builder_;
  Patch patch_;
  LoopInput input_;
  double force_n_ = 0, torque_nmm_ = 0, work_min_ = 0;
  std::int64_t allocations_ = 0, ticks_ = 0;
  int cutting_ = 0, touching_ = 0, disagree_ = 0, pushed_ = 0;
  std::uint64_t seq_ = 0;
  std::vector<Cut> cuts_;
};

// The bone is at z > 0. It is cancellous, so that a hand's push can advance the tool. `tissue`: which part of it is
// metal.
Case block(double pitch_mm, double width_mm, double deep_mm, const std::function<Tissue(const Vec3&)>& tissue = {}) {
  return osteon::test::make_bone(
      {Vec3(-0.5 * width_mm, -0.5 * width_mm, -3), Vec3(0.5 * width_mm, 0.5 * width_mm, deep_mm)}, pitch_mm,
      [=](const Vec3& p) {
        return std::max({-p.z(), std::abs(p.x()) - 0.5 * width_mm + 3.0, std::abs(p.y()) - 0.5 * width_mm + 3.0});
      },
      [](const Vec3&) { return 0.6; }, tissue);
}

// How each tool is held against a face that looks along -z. It is pushed along z, into the bone.
Pose held(const Tool& tool) {
  const Eigen::Quaterniond lying = rotation_between(Vec3::UnitZ(), Vec3::UnitX());
  switch (tool.kind) {
    case ToolKind::round_burr:
    case ToolKind::barrel_burr:
    case ToolKind::contoured_burr:  // with its side
      return {{0.25 * tool.cutting_length_mm, 0, -0.5 * tool.diameter_mm - 0.4}, lying};
    case ToolKind::reciprocating_saw: {  // with its toothed edge: x of the tool into the bone
      const Eigen::Quaterniond edge(Eigen::AngleAxisd(-0.5 * std::numbers::pi, Vec3::UnitY()));
      return {{17.0 - tool.cutting_length_mm, 0, -0.5 * tool.width_mm - 0.4}, edge};  // its plate is beside the block
    }
    default:
      return {{0.1, -0.1, -0.4}, Eigen::Quaterniond::Identity()};
  }
}

TEST(HandTools, EveryToolThatCutsTakesBone) {
  const Case for_large = block(1.0, 70.0, 24.0), for_small = block(0.5, 40.0, 12.0);
  int tried = 0;
  for (const Tool& tool : builtin_tools()) {
    if (!tool.cuts()) continue;
    HandStage stage(tool.cut_level == 0 ? for_large : for_small, tool, held(tool));
    stage.input_.spindle_rpm = tool.spindle_rpm;
    stage.lead(Vec3::Zero(), 0.5);
    const double before = stage.replica_.removed_mm3();
    const LoopReport pushed = stage.lead({0, 0, 2.0}, 2.0);
    const LoopReport back = stage.lead({0, 0, -3.5}, 0.7);
    const double removed = stage.replica_.removed_mm3() - before;
    std::printf(
        "  %-20s cut for %4d of 2700 ticks, pushed back in %3d, %8.2f mm3, at most %6.1f N, %8.1f N mm, %.2f mm deep\n",
        tool.name.c_str(), stage.cutting_, stage.pushed_, removed, stage.force_n_, stage.torque_nmm_,
        pushed.pose_bone_proxy.position_mm.z() - held(tool).position_mm.z() - 0.4);
    // A broach moves only in its blows: one a second, of about 5 ms.
    if (tool.kind == ToolKind::broach) {
      EXPECT_GE(stage.cutting_, 2 * 5) << tool.name;
      EXPECT_LE(stage.cutting_, 3 * 7) << tool.name;
    } else {
      EXPECT_GT(stage.cutting_, 50) << tool.name;
    }
    EXPECT_GT(removed, 0.05) << tool.name;
    EXPECT_GT(stage.force_n_, 0.05) << tool.name;
    EXPECT_GE(stage.work_min_, 0.0) << tool.name;
    EXPECT_EQ(stage.disagree_, 0) << tool.name;
    // A thin bur's shank soon lies on the bone. The bur digs in, turning back to the hand's rotation lifts it, and so
    // on.
    const bool lies = held(tool).rotation.angularDistance(Eigen::Quaterniond::Identity()) > 0.1 &&
                      tool.shank_diameter_mm > 0.0 && 0.5 * (tool.diameter_mm - tool.shank_diameter_mm) < 1.0;
    EXPECT_LE(stage.pushed_, (lies ? 1.0 : 0.1) * stage.cutting_) << tool.name;
    EXPECT_EQ(stage.allocations_, 0) << tool.name;
    // When drawn back it is free: nothing jams in the hole or kerf.
    EXPECT_EQ(back.coupling.force_n.norm(), 0.0) << tool.name;
    EXPECT_NEAR((back.pose_bone_proxy.position_mm - stage.input_.pose_device_tool.position_mm).norm(), 0.0, 1e-5)
        << tool.name;
    ++tried;
  }
  EXPECT_GE(tried, 21);
}

// Pushed down on metal, sideways and turned, no tool takes metal away. It makes no cut that a room would reject, and
// takes no metal at all.
TEST(HandTools, NoneThatCutsTakesMetal) {
  // Metal two voxels deep, and beside small tools a higher step of metal.
  const Case for_large =
      block(1.0, 70.0, 24.0, [](const Vec3& p) { return p.z() >= 2.0 ? Tissue::metal : Tissue::none; });
  const Case for_small = block(0.5, 40.0, 12.0, [](const Vec3& p) {
    return p.z() >= 1.0 || (p.x() > 4.0 && p.y() > 2.0 && p.z() >= 0.5) ? Tissue::metal : Tissue::none;
  });
  for (const Tool& tool : builtin_tools()) {
    if (!tool.cuts()) continue;
    const Case& bone = tool.cut_level == 0 ? for_large : for_small;
    const double pitch_mm = bone.pitch_mm(), metal_mm = 2.0 * pitch_mm;
    HandStage stage(bone, tool, held(tool));
    stage.input_.spindle_rpm = tool.spindle_rpm;
    stage.lead(Vec3::Zero(), 0.2);
    std::uint32_t events = 0;
    const auto see = [&](const Vec3& by_mm, double turn_rad, double seconds) {
      const Eigen::Quaterniond before = stage.input_.pose_device_tool.rotation;
      constexpr int kParts = 40;
      for (int i = 1; i <= kParts; ++i) {
        const Eigen::AngleAxisd turn(turn_rad * i / kParts, Vec3(0.6, 0.7, 0.2).normalized());
        stage.input_.pose_device_tool.rotation = before * turn;
        events |= stage.lead(by_mm / kParts, seconds / kParts).events;
      }
    };
    see({0, 0, metal_mm + 1.5}, 0.0, 1.5);
    see({0, 0, 0}, 0.15, 0.2);
    see({2.0, 1.0, 0}, -0.3, 0.4);
    see({-4.0, 1.0, 0.5}, 0.25, 0.4);
    EXPECT_GT(stage.replica_.removed_mm3(), 0.02) << tool.name;
    // The shank of this one lies on the bone before it comes so deep.
    if (tool.name != "burr-round-3.2") {
      EXPECT_NE(events & kOnMetal, 0u) << tool.name;
    }
    EXPECT_EQ(stage.disagree_, 0) << tool.name;
    EXPECT_EQ(stage.allocations_, 0) << tool.name;
    const CutField fresh(bone, BodyId{});
    const CutField* const field = &fresh;
    int refused = 0;
    for (const Cut& cut : stage.cuts_)
      refused += meets_metal(cut, fresh.tools()->find(cut.tool)->body, std::span(&field, 1));
    double deepest_mm = 0;  // of any sample of metal below what is left
    const CutField& left = stage.replica_.predicted();
    for (const Coord leaf : bone.metal_leaves())
      for (int i = 0; i < kLeafVoxels; ++i) {
        const Coord at = leaf + Coord{i >> 6, i >> 3 & 7, i & 7};
        const Vec3 p = position_mm(at, pitch_mm);
        if (bone.tissue(at) == Tissue::metal) deepest_mm = std::max(deepest_mm, left.solid_mm(p));
      }
    std::printf("  %-20s %3zu cuts, %8.2f mm3, at most %5.1f N, %.3f mm into a sample of metal\n", tool.name.c_str(),
                stage.cuts_.size(), stage.replica_.removed_mm3(), stage.force_n_, deepest_mm);
    EXPECT_EQ(refused, 0) << tool.name;
    EXPECT_LT(deepest_mm, 0.5 * pitch_mm) << tool.name;
  }
}

// A bur dragged over metal under pressure neither cuts nor reports a cut.
TEST(HandTools, ABurDraggedOverMetalSendsNothing) {
  const Tool bur = *find_tool("burr-round-5");
  HandStage stage(block(0.5, 40.0, 12.0, [](const Vec3&) { return Tissue::metal; }), bur, held(bur));
  stage.input_.spindle_rpm = bur.spindle_rpm;
  stage.lead({0, 0, 1.4}, 0.5);
  EXPECT_NE(stage.lead(Vec3::Zero(), 0.1).events & kOnMetal, 0u);
  const std::size_t before = stage.cuts_.size();
  const Vec3 from = stage.tick().pose_bone_proxy.position_mm;
  const LoopReport dragged = stage.lead({4, 2, 0}, 0.5);
  EXPECT_GT((dragged.pose_bone_proxy.position_mm - from).norm(), 3.0);
  EXPECT_GT(-dragged.coupling.force_n.z(), 20.0);
  EXPECT_EQ(stage.cuts_.size(), before);
  EXPECT_EQ(stage.cutting_, 0);
  EXPECT_EQ(stage.replica_.removed_mm3(), 0.0);
}

// A hand rocks a bur hard in its groove, by 9 degrees 1.5 times a second. Turning cuts nothing and lifts it out, and
// its coupling cuts it in again. In a tick with more lifting than cutting it rubs, but the cuts in it had their work.
TEST(HandTools, ARockedBurIsPushedBackAndCutsAgain) {
  const Tool bur = *find_tool("burr-round-3.2");
  const Case bone = block(0.5, 40.0, 12.0);
  const ToolModel model(bur, bone.pitch_mm());
  Replica replica(bone, BodyId{});
  PatchBuilder builder;
  Patch patch;
  Proxy proxy;
  CutRecorder recorder;
  const Pose start = held(bur);
  proxy.place(start);
  std::uint64_t cuts = 0;
  int cutting = 0, pushed = 0;
  double work_mj = 0, pushed_mj = 0;
  for (int i = 0; i < 6000; ++i) {
    if (i % 12 == 0) {
      for (const ChangedLeaves& change : replica.take_changes())
        builder.changed(bone.pitch_mm(), change.level, change.origins);
      builder.build(replica.predicted(), model, proxy.pose(), patch);
      patch.own_cuts = replica.last_own();
    }
    const double t = 1e-3 * i, rock = 0.15 * std::sin(2.0 * std::numbers::pi * 1.5 * t);
    const Pose device{start.position_mm + Vec3(0, 0.5 * t, std::min(2.0, t)),
                      Eigen::AngleAxisd(rock, Vec3(0.3, 1.0, 0.2).normalized()) * start.rotation};
    const ProxyStep step = proxy.step(model, patch, device, bur.spindle_rpm, 50.0, true, 1e-3);
    ASSERT_TRUE(step.covered);
    cutting += step.cutting;
    work_mj += step.cutting_work_mj;
    if (step.pushed_back_mj > 0.0) {
      ++pushed;
      pushed_mj += step.pushed_back_mj;
      EXPECT_FALSE(step.cutting);
      EXPECT_TRUE(step.contact);
      EXPECT_EQ(step.cutting_force_n.norm() + step.across_n, 0.0);
      EXPECT_GT(step.cutting_work_mj, 0.0);
      EXPECT_GT(step.torque_nmm, 0.0);
    }
    if (!recorder.recording()) {
      if (step.near_bone && proxy.begin_sweep(model)) recorder.begin(proxy.cut_pose(), bur.cutting_length_mm);
      continue;
    }
    recorder.add(proxy.cut_pose());
    CutPiece piece;
    if (!recorder.due() || !recorder.close(piece)) continue;
    piece.author_seq = ++cuts;
    proxy.closed(model, cuts);
    const Cut cut = cut_of(piece, model, AuthorId{1}, 0);
    replica.add_own(cut);
    replica.commit(RoomSeq{cuts}, cut, true);
  }
  std::printf("  rocked bur: %d ticks cut, %d pushed it back; %.3g mJ beside %.3g mJ of cutting\n", cutting, pushed,
              pushed_mj, work_mj);
  EXPECT_GT(cutting, 1000);
  EXPECT_GT(pushed, 0);
  EXPECT_LT(pushed, cutting);
  EXPECT_LT(pushed_mj, 0.5 * work_mj);
}

TEST(HandTools, WhatDoesNotCutOnlyTouches) {
  for (const char* name : {"trial-cup-50", "trial-stem", "guide-1"}) {
    const Tool tool = *find_tool(name);
    HandStage stage(block(1.0, 70.0, 24.0), tool, {{0, 0, -0.5}, Eigen::Quaterniond::Identity()});
    stage.input_.spindle_rpm = 1000;
    const LoopReport report = stage.lead({0, 0, 1.5}, 0.5);
    EXPECT_EQ(stage.cutting_, 0) << name;
    EXPECT_GT(stage.touching_, 100) << name;
    EXPECT_LT(report.pose_bone_proxy.position_mm.z(), 0.6) << name;
    EXPECT_GT(-report.coupling.force_n.z(), 10.0) << name;
    EXPECT_EQ(stage.replica_.removed_mm3(), 0.0) << name;
  }
}

// A blade goes on in its own plane, and does not move across its flat, in its kerf and in the air beside it.
TEST(Saw, GoesInItsPlaneOnly) {
  const Tool saw = *find_tool("saw-oscillating-2");
  HandStage stage(block(0.5, 40.0, 12.0), saw, held(saw));
  stage.input_.spindle_rpm = saw.spindle_rpm;
  stage.lead(Vec3::Zero(), 0.5);
  const LoopReport in = stage.lead({0, 0, 3.4}, 6.0);
  EXPECT_GT(in.pose_bone_proxy.position_mm.z(), 1.0);
  const double y = in.pose_bone_proxy.position_mm.y(), z = in.pose_bone_proxy.position_mm.z();
  const LoopReport aside = stage.lead({0, 1.0, 0}, 0.3);
  EXPECT_NEAR(aside.pose_bone_proxy.position_mm.y(), y, 0.5 * saw.set_mm + 0.15);
  EXPECT_LT(aside.coupling.force_n.y(), -20.0);
  EXPECT_GT(aside.pose_bone_proxy.position_mm.z(), z - 0.2);
  stage.lead({0, -1.0, 0}, 0.3);
  const LoopReport out = stage.lead({0, 0, -5.0}, 0.5);
  EXPECT_EQ(out.coupling.force_n.norm(), 0.0);
}

// In its own hole, drilled at an angle through a face, a drill neither jams nor is held on its way out.
TEST(OwnHole, DoesNotJamAtAnyAngle) {
  for (const double degrees : {0.0, 10.0, 20.0, 30.0}) {
    PlanStep step;
    step.action = Action::drill;
    step.tool = "drill-3.2";
    step.hand = HandKind::rig;
    step.feed_mm_per_s = 2;
    step.to_mm = 9;
    step.entry.point_mm = Vec3(0.1, -0.2, 0);
    const double a = degrees * std::numbers::pi / 180.0;
    step.entry.axis = Vec3(std::sin(a) * std::cos(0.7), std::sin(a) * std::sin(0.7), std::cos(a));
    Bench bench(block_case(24.0), {step});
    double deepest = 0, out_n = 0, spindle_nmm = 0, turning_nmm = 0;
    bench.run([&](const SessionTick& tick) {
      const double depth =
          (tick.report.pose_bone_proxy.position_mm - Vec3(0.1, -0.2, 0)).dot(step.entry.axis->normalized());
      deepest = std::max(deepest, depth);
      if (tick.order.phase != SurgeonPhase::retract || depth >= deepest - 1.0) return;
      out_n = std::max(out_n, tick.report.coupling.force_n.norm());
      spindle_nmm = std::max(spindle_nmm, tick.report.cutting.torque_nmm);
      turning_nmm = std::max(turning_nmm, tick.report.coupling.torque_nmm.norm());
    });
    std::printf("  own hole at %2.0f degrees: %.2f mm deep, at most %.3f N and %.3f N mm on the way out\n", degrees,
                deepest, out_n, turning_nmm);
    EXPECT_TRUE(bench.session().surgeon().results()[0].completed) << degrees;
    EXPECT_GE(deepest, 9.0) << degrees;
    EXPECT_LT(out_n, 0.5) << degrees;
    EXPECT_EQ(spindle_nmm, 0.0) << degrees;
    EXPECT_LT(turning_nmm, 1.0) << degrees;
  }
}

}  // namespace
}  // namespace osteon::haptic::test
