// Drills through the layered block as the dissertation's reference simulations do, on virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "common/mechanics/drilling.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

PlanStep drill_step(HandKind hand) { return straight_down("drill-3.2", hand); }

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double v) { sum += v, ++count; }
  [[nodiscard]] double value() const { return count ? sum / count : 0.0; }
};

// Means over the depths at which the whole point is in one layer, half a voxel of h away from the boundaries.
struct Layers {
  Mean force[3], feed[3];
  double crossing_s[3] = {};
  double torque_max = 0, force_after = 0, work_min = 0;

  void see(const SessionTick& tick) {
    const LoopReport& report = tick.report;
    const double tip = report.pose_bone_proxy.position_mm.z();
    const double force_n = -report.coupling.force_n.z();
    work_min = std::min(work_min, report.cutting.force_n.dot(report.contact.moved_mm));
    if (tip < 1.3) torque_max = std::max(torque_max, report.cutting.torque_nmm);  // later the flutes fill up
    if (tip > 31.2) force_after = std::max(force_after, std::abs(force_n));
    if (tick.order.phase != SurgeonPhase::push && tick.order.phase != SurgeonPhase::feed) return;
    const double kTip = 0.961, kEdge = 0.3;
    const double from[] = {kTip + 0.2, 5 + kTip + kEdge, 25 + kTip + kEdge}, to[] = {5 - kEdge, 25 - kEdge, 30 - kEdge};
    for (int i = 0; i < 3; ++i)
      if (tip > from[i] && tip < to[i]) {
        force[i].add(force_n);
        crossing_s[i] += 1e-3;
      }
    for (int i = 0; i < 3; ++i) feed[i].sum = (to[i] - from[i]) / std::max(1e-9, crossing_s[i]), feed[i].count = 1;
  }
};

TEST(DrillingBlock, FeedRigFeelsTheLawsThrust) {
  PlanStep step = drill_step(HandKind::rig);
  step.feed_mm_per_s = 1.0;
  step.beyond_mm = 3.0;
  Bench bench(block_case(), {step});
  Layers layers;
  bench.run([&](const SessionTick& tick) { layers.see(tick); });
  ASSERT_TRUE(bench.session().done());
  EXPECT_NEAR(layers.force[0].value(), 28.9, 0.03 * 28.9);
  EXPECT_NEAR(layers.force[1].value(), 3.25, 0.03 * 3.25);
  EXPECT_NEAR(layers.force[2].value(), 28.9, 0.03 * 28.9);
  EXPECT_EQ(layers.force_after, 0.0);
  EXPECT_GE(layers.work_min, 0.0);
  EXPECT_NEAR(layers.torque_max, 27.0, 0.15 * 27.0);
}

TEST(DrillingBlock, FeedRigRampsOverTheConesHeight) {
  PlanStep step = drill_step(HandKind::rig);
  step.feed_mm_per_s = 1.0;
  step.to_mm = 2.0;
  Bench bench(block_case(), {step});
  // Engaged share of a cone that is z deep: (z / height)².
  int seen = 0;
  bench.run([&](const SessionTick& tick) {
    const double tip = tick.report.pose_bone_proxy.position_mm.z();
    if (tick.order.phase != SurgeonPhase::feed || tip < 0.2 || tip > 0.9) return;
    ++seen;
    // As a depth: contact points look half a pitch ahead, and stand in rings 0.1 mm apart.
    EXPECT_NEAR(0.961 * std::sqrt(tick.report.cutting.engaged), tip, 0.0625 + 0.1) << tip;
  });
  EXPECT_GT(seen, 300);
}

struct HandRun {
  Layers layers;
  StepResult result;
};

HandRun drill_by_hand(HandKind hand, double push_n = 29) {
  PlanStep step = drill_step(hand);
  step.push_n = push_n;
  Bench bench(block_case(), {step});
  HandRun run;
  bench.run([&](const SessionTick& tick) { run.layers.see(tick); });
  EXPECT_TRUE(bench.session().done());
  run.result = bench.session().surgeon().results()[0];
  std::printf("  %s: force %.2f/%.2f/%.2f N, feed %.3f/%.2f/%.3f mm/s, plunge %.2f mm, %.2f after the exit\n",
              hand == HandKind::expert ? "expert" : "novice", run.layers.force[0].value(), run.layers.force[1].value(),
              run.layers.force[2].value(), run.layers.feed[0].value(), run.layers.feed[1].value(),
              run.layers.feed[2].value(), run.result.plunge_mm, run.result.after_exit_mm);
  return run;
}

// The two hands of the reference table, each run once.
const HandRun& expert() {
  static const HandRun run = drill_by_hand(HandKind::expert);
  return run;
}
const HandRun& novice() {
  static const HandRun run = drill_by_hand(HandKind::novice);
  return run;
}

// Reference table of the hands: 10 % on forces and feeds, 15 % on the plunge.
TEST(DrillingBlock, ExpertMatchesTheReference) {
  const HandRun& run = expert();
  const double force[] = {27, 11, 27}, feed[] = {0.89, 10.7, 0.89};
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(run.layers.force[i].value(), force[i], 0.1 * force[i]) << i;
    EXPECT_NEAR(run.layers.feed[i].value(), feed[i], 0.1 * feed[i]) << i;
  }
  EXPECT_GE(run.layers.feed[1].value(), 10.0 * run.layers.feed[0].value());
  EXPECT_NEAR(run.result.plunge_mm, 6.0, 0.15 * 6.0);
  // Closed form of the released hand: F/K + F/K_c.
  EXPECT_NEAR(run.result.after_exit_mm, 27 / 5.5 + 27 / 50.0, 0.15 * (27 / 5.5 + 27 / 50.0));
  EXPECT_GE(run.layers.work_min, 0.0);
  EXPECT_EQ(run.layers.force_after, 0.0);
}

TEST(DrillingBlock, NoviceMatchesTheReference) {
  const HandRun& run = novice();
  const double force[] = {28, 18, 28}, feed[] = {0.96, 17.6, 0.95};
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(run.layers.force[i].value(), force[i], 0.1 * force[i]) << i;
    EXPECT_NEAR(run.layers.feed[i].value(), feed[i], 0.1 * feed[i]) << i;
  }
  EXPECT_GE(run.layers.feed[1].value(), 10.0 * run.layers.feed[0].value());
  EXPECT_NEAR(run.result.plunge_mm, 14.4, 0.15 * 14.4);
  EXPECT_NEAR(run.result.after_exit_mm, 28 / 2.0 + 28 / 50.0, 0.15 * (28 / 2.0 + 28 / 50.0));
}

TEST(DrillingBlock, PlungeRisesWithPushAndFallsWithSkill) {
  EXPECT_LT(expert().result.plunge_mm, novice().result.plunge_mm);
  EXPECT_LT(expert().result.plunge_mm, drill_by_hand(HandKind::expert, 36).result.plunge_mm);
}

// A 3.3 N device whose hand is lighter in proportion drills the same hole.
TEST(DrillingBlock, AWeakDeviceShowsTheSameBoneLighter) {
  SimulatedDeviceParams weak;
  weak.limits = {3.3, 1.75, 3.0, 100.0};
  Bench bench(block_case(), {drill_step(HandKind::expert)}, weak);
  Layers layers;
  double rendered_max = 0;
  bench.run([&](const SessionTick& tick) {
    layers.see(tick);
    rendered_max = std::max(rendered_max, tick.report.device.force_n.norm());
  });
  EXPECT_LE(rendered_max, 3.3);
  EXPECT_NEAR(layers.force[0].value(), 27, 2.7);
  EXPECT_NEAR(layers.feed[0].value(), 0.89, 0.09);
}

// A desktop device is too soft for the coupling, so its handle moves farther than the tool. A device with little room
// moves less far. The bone under them is the same.
TEST(DrillingBlock, TheWorkspaceScaleDoesNotChangeTheBone) {
  SimulatedDeviceParams narrow;
  narrow.limits.workspace_radius_mm = 30.0;
  narrow.limits.stiffness_n_per_mm = 90.0;
  const SimulatedDeviceParams desktop = *find_simulated_device("simulated-3.3N");
  for (const SimulatedDeviceParams& device : {narrow, desktop}) {
    Bench bench(block_case(), {drill_step(HandKind::expert)}, device);
    Layers layers;
    double rendered_max = 0;
    bench.run([&](const SessionTick& tick) {
      layers.see(tick);
      rendered_max = std::max(rendered_max, tick.report.device.force_n.norm());
    });
    const double m = bench.session().loop().mapping().scale(), s = bench.session().loop().params().force_scale;
    const double coupling = bench.session().loop().coupling_n_per_mm();
    EXPECT_NE(m, 1.0) << device.name;
    EXPECT_LE(m * s * coupling, device.limits.stiffness_n_per_mm * (1.0 + 1e-12)) << device.name;
    EXPECT_LE(rendered_max, device.limits.peak_n + 1e-9) << device.name;
    EXPECT_NEAR(layers.force[0].value(), 27, 2.7) << device.name;
    EXPECT_NEAR(layers.feed[0].value(), 0.89, 0.09) << device.name;
    EXPECT_NEAR(layers.force[1].value(), 11, 1.1) << device.name;
    // Closed form of the released hand: F/K, and the coupling's stretch F/K_c. The stretch is let go at breakthrough,
    // and comes back by at most a tenth of the way.
    const double released = 27 / 5.5 + std::min(27 / coupling, 0.1 * 27 / 5.5);
    EXPECT_NEAR(bench.session().surgeon().results()[0].after_exit_mm, released, 0.15 * released) << device.name;
  }
}

// If the bone is already gone, the hand goes through and comes back.
TEST(DrillingBlock, TheSameHoleTwiceEnds) {
  const PlanStep step = drill_step(HandKind::expert);
  Bench bench(block_case(), {step, step});
  bench.run();
  ASSERT_TRUE(bench.session().done());
  const std::vector<StepResult>& results = bench.session().surgeon().results();
  EXPECT_TRUE(results[0].completed && results[1].completed);
  EXPECT_TRUE(results[0].broke_through);
  EXPECT_FALSE(results[1].broke_through);
  EXPECT_NEAR(results[1].deepest_mm, 30.0, 0.2);
  EXPECT_LT(results[1].peak_force_n, 1.0);
}

// A step ends whatever the tool reports: a spindle that does not start, one that does not stop, or bone that never
// yields.
TEST(Surgeon, NoStepGoesOnForEver) {
  for (const HandKind hand : {HandKind::expert, HandKind::rig})
    for (const double rpm : {0.0, 1000.0})
      for (const double force_n : {0.0, 29.0}) {
        Surgeon surgeon(*make_ready({drill_step(hand)}, block_case()));
        LoopReport report;
        report.spindle_rpm = rpm;
        report.coupling.force_n = {0, 0, -force_n};
        double time_s = 0;
        for (; time_s < 300.0 && !surgeon.done(); time_s += 1e-3) surgeon.act(report, 1e-3);
        EXPECT_TRUE(surgeon.done()) << rpm << " rpm, " << force_n << " N";
        EXPECT_FALSE(surgeon.results()[0].completed) << rpm << " rpm, " << force_n << " N";
      }
}

// A hole that the rig drilled quickly, made once.
const Bench& quick_hole() {
  static const std::unique_ptr<Bench> made = [] {
    PlanStep step = drill_step(HandKind::rig);
    step.feed_mm_per_s = 3.0;
    step.beyond_mm = 3.0;
    auto bench = std::make_unique<Bench>(block_case(), std::vector{step});
    bench->run();
    return bench;
  }();
  return *made;
}

// The hole in the block is the drill's cylinder: 30 mm long. The block's faces are its mouth and exit.
TEST(DrillingBlock, RemovesTheClosedFormVolume) {
  const Replica& replica = quick_hole().replica();
  EXPECT_NEAR(replica.committed().removed_mm3(), std::numbers::pi * 1.6 * 1.6 * 30.0,
              0.02 * std::numbers::pi * 1.6 * 1.6 * 30.0);
  EXPECT_EQ(replica.unconfirmed(), 0u);
  EXPECT_EQ(replica.committed().hash(), replica.predicted().hash());
}

// Paths are connected, numbered without gaps, and closed in time.
TEST(DrillingBlock, CutsFormOneChain) {
  const std::vector<Cut>& cuts = quick_hole().cuts();
  ASSERT_GT(cuts.size(), 1000u);
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    EXPECT_EQ(cuts[i].author_seq, i + 1);
    EXPECT_GE(cuts[i].path.size(), 2u);
    if (i > 0) {
      EXPECT_EQ(cuts[i].path.front(), cuts[i - 1].path.back()) << i;
    }
  }
}

// The force does not depend on how late patches and acknowledgements arrive.
TEST(DrillingBlock, LatePatchesDoNotChangeTheForce) {
  PlanStep step = drill_step(HandKind::expert);
  double plunge[2], force[2];
  int i = 0;
  for (const BenchDelays& delays : {BenchDelays{2, 2}, BenchDelays{60, 250}}) {
    Bench bench(block_case(), {step}, {}, 0.0, delays);
    Layers layers;
    bench.run([&](const SessionTick& tick) { layers.see(tick); });
    plunge[i] = bench.session().surgeon().results()[0].plunge_mm;
    force[i++] = layers.force[1].value();
  }
  EXPECT_NEAR(plunge[0], plunge[1], 0.1);
  EXPECT_NEAR(force[0], force[1], 0.02 * force[0]);
}

TEST(HapticLoop, DoesNotAllocate) {
  PlanStep step = drill_step(HandKind::expert);
  Bench bench(block_case(), {step});
  std::int64_t allocations = 0;
  int cutting = 0;
  for (int i = 0; i < 6000; ++i) {
    const osteon::test::AllocationCounter heap;
    const SessionTick tick = bench.tick();
    allocations += heap.count();
    cutting += tick.report.cutting.phase == CuttingPhase::cutting;
    bench.follow();
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(cutting, 1000);
}

}  // namespace
}  // namespace osteon::haptic::test
