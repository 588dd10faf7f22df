// Tests what distinguishes plans, what their steps need, and when a step counts as done.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "haptic_client/simulation/free_hand.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

PlanStep drill_down() {
  PlanStep step = straight_down("drill-3.2", HandKind::rig);
  step.feed_mm_per_s = 4.0;
  step.to_mm = 3.0;
  return step;
}

PlanStep burr_window() {
  PlanStep step = drill_down();
  step.action = Action::burr;
  step.tool = "burr-round-5";
  step.to_mm = 0.0;
  step.window_u_mm = step.window_v_mm = 4.0;
  step.depth_mm = 2.0;
  return step;
}

// A session that ends in the middle of a hole has not completed it.
TEST(Surgeon, AStepUnderWayIsNotCompleted) {
  Bench bench(block_case(), {drill_down()});
  int cutting = 0;
  bench.run([&](const SessionTick& tick) {
    cutting += tick.report.cutting.phase == CuttingPhase::cutting;
    if (!bench.session().done()) {
      EXPECT_FALSE(bench.session().results()[0].completed) << name(tick.order.phase);
    }
  });
  EXPECT_GT(cutting, 100);
  EXPECT_TRUE(bench.session().results()[0].completed);
  EXPECT_FALSE(bench.session().results()[0].gave_up);
}

// The phase that ran out of time first is reported, though drawing the tool out and putting it down run out of time
// too.
TEST(Surgeon, SaysInWhichPhaseItGaveUp) {
  PlanStep push = drill_down();
  push.hand = HandKind::expert;
  const struct {
    PlanStep step;
    double rpm, force_n;
    unsigned events;
    SurgeonPhase phase;
  } cases[] = {{drill_down(), 0.0, 0.0, 0, SurgeonPhase::spin_up},
               {drill_down(), 1000.0, 29.0, 0, SurgeonPhase::feed},
               {push, 1000.0, 29.0, 0, SurgeonPhase::push},
               {drill_down(), 1000.0, 0.0, kUncovered, SurgeonPhase::take_up}};
  for (const auto& c : cases) {
    Surgeon surgeon(*make_ready({c.step}, block_case()));
    LoopReport report;
    report.spindle_rpm = c.rpm;
    report.coupling.force_n = {0, 0, -c.force_n};
    report.events = c.events;
    for (int tick = 0; tick < 300'000 && !surgeon.done(); ++tick) surgeon.act(report, 1e-3);
    ASSERT_TRUE(surgeon.done());
    EXPECT_FALSE(surgeon.results()[0].completed);
    ASSERT_TRUE(surgeon.results()[0].gave_up);
    EXPECT_EQ(*surgeon.results()[0].gave_up, c.phase) << name(*surgeon.results()[0].gave_up);
    EXPECT_STRNE(given_up_words(c.phase), given_up_words(SurgeonPhase::approach));
  }
}

// The tip of a bur tilted by 30 degrees lies above the lowest point of its head.
TEST(Surgeon, SaysHowDeepAStepIsToCome) {
  PlanStep through = drill_down();
  through.to_mm = 0.0;
  const auto ready = make_ready({drill_down(), through, burr_window()}, block_case());
  ASSERT_TRUE(ready) << ready.error().message;
  EXPECT_EQ(ready->steps[0].asked_mm(), 3.0);
  EXPECT_NEAR(ready->steps[1].asked_mm(), 30.0, 0.1);
  EXPECT_NEAR(ready->steps[2].asked_mm(), 2.0 - 2.5 * (1.0 - std::cos(std::numbers::pi / 6.0)), 0.05);
}

// A window hardly wider than the bur is one point, or a few close together. The hand gets time to follow there. At
// least the cap of the bur's sphere at its depth is removed.
TEST(Surgeon, BursASmallWindowAsDeepAsAsked) {
  for (const double window_mm : {2.0, 4.0, 5.5, 6.0})
    for (const double deep_mm : {1.0, 2.0}) {
      PlanStep step = burr_window();
      step.hand = HandKind::expert;
      step.window_u_mm = step.window_v_mm = window_mm;
      step.depth_mm = deep_mm;
      Bench bench(block_case(), {step});
      bench.run();
      const StepResult& result = bench.session().results()[0];
      const double asked_mm = bench.session().plan().steps[0].asked_mm();
      std::printf("  window of %.1f mm: %.2f of %.2f mm in %.1f s\n", window_mm, result.deepest_mm, asked_mm,
                  result.duration_s);
      EXPECT_TRUE(result.completed) << window_mm;
      EXPECT_GE(result.deepest_mm, 0.9 * asked_mm) << window_mm;
      const double sphere_mm = 2.5, cap_mm = result.deepest_mm + sphere_mm * (1.0 - std::cos(std::numbers::pi / 6.0));
      const double cap_mm3 = std::numbers::pi * cap_mm * cap_mm * (sphere_mm - cap_mm / 3.0);
      EXPECT_GT(bench.replica().committed().removed_mm3(), 0.95 * cap_mm3) << window_mm;
    }
}

// Bone holds a loose hand back. A step that is not as deep as asked is not completed, and the bur is still drawn out.
TEST(Surgeon, AWindowThatIsTooShallowIsNotCompleted) {
  PlanStep step = burr_window();
  step.hand = HandKind::expert;
  step.hand_stiffness_n_per_mm = 0.3;
  Bench bench(block_case(), {step});
  SurgeonPhase last = SurgeonPhase::take_up;
  bench.run([&](const SessionTick& tick) {
    if (!bench.session().done()) last = tick.order.phase;
  });
  const StepResult& result = bench.session().results()[0];
  EXPECT_LT(result.deepest_mm, 0.9 * bench.session().plan().steps[0].asked_mm());
  EXPECT_FALSE(result.completed);
  ASSERT_TRUE(result.gave_up);
  EXPECT_EQ(*result.gave_up, SurgeonPhase::sweep);
  EXPECT_EQ(last, SurgeonPhase::lift);
}

TEST(Plan, HasADigestOfItsOwn) {
  const Case bone = block_case();
  const auto digest = [&](const std::vector<PlanStep>& steps, const ToolFinder& find = find_tool) {
    const auto ready = make_ready(steps, bone, find);
    EXPECT_TRUE(ready) << ready.error().message;
    return to_hex(plan_digest(*ready));
  };
  const PlanStep step = drill_down();
  const std::string own = digest({step});
  EXPECT_EQ(digest({step}), own);
  EXPECT_NE(digest({step, step}), own);
  const auto changed = [&](auto change) {
    PlanStep other = step;
    change(other);
    return digest({other});
  };
  EXPECT_NE(changed([](PlanStep& s) { s.to_mm = 4.0; }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.tool = "drill-3.5"; }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.spindle_rpm = 900.0; }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.wear = 2.0; }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.law = "allotta"; }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.entry.point_mm = Vec3(1.1, -0.2, 0); }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.hand = HandKind::expert; }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.hand_across_n_per_mm = 0.3; }), own);
  const std::string rinsed = changed([](PlanStep& s) { s.irrigation = true; });
  EXPECT_NE(rinsed, own);
  EXPECT_NE(changed([](PlanStep& s) { s.suction = true; }), own);
  EXPECT_NE(changed([](PlanStep& s) { s.suction = true; }), rinsed);
  // A different tool of the same name.
  EXPECT_NE(digest({step},
                   [](std::string_view name) -> Result<Tool> {
                     Tool tool = *find_tool(name);
                     tool.diameter_mm = 3.3;
                     return tool;
                   }),
            own);
  const auto by_hand = [&](const char* view) {
    return to_hex(
        plan_digest(*make_free_hand({.tool = "drill-3.2", .toward = *read_view(view), .at_mm = Vec3(0, 0, 0)}, bone)));
  };
  EXPECT_EQ(by_hand("top"), by_hand("top"));
  EXPECT_NE(by_hand("top"), by_hand("bottom"));
}

// The bone begins at z = 0. The depth counts from there, wherever on the axis the plan's point lies.
TEST(Plan, ADrillStopsAtTheTargetOfItsEntry) {
  const Case bone = block_case();
  PlanStep step = straight_down("drill-3.2", HandKind::expert);
  step.entry.target_mm = Vec3(0.1, -0.2, 7.5);
  for (const double entry_mm : {-4.0, 0.0, 3.0}) {
    step.entry.point_mm = Vec3(0.1, -0.2, entry_mm);
    const auto ready = make_ready({step}, bone);
    ASSERT_TRUE(ready) << ready.error().message;
    EXPECT_NEAR(ready->steps[0].asked_mm(), 7.5, 1e-3) << entry_mm;
  }
  step.to_mm = 3.0;
  EXPECT_EQ(make_ready({step}, bone)->steps[0].asked_mm(), 3.0) << "to_mm says otherwise";
  step.to_mm = 0.0;
  const auto refused = [&](double target_mm) {
    step.entry.target_mm = Vec3(0.1, -0.2, target_mm);
    const auto ready = make_ready({step}, bone);
    return ready ? std::string() : ready.error().message;
  };
  EXPECT_NE(refused(-1.0).find("entry.target_mm lies before the bone"), std::string::npos);
  EXPECT_NE(refused(1000.0).find("entry.target_mm is deeper"), std::string::npos);
}

}  // namespace
}  // namespace osteon::haptic::test
