// A hand that a pointer leads, on virtual time: what it does to a block of two cortices with marrow between them.
#include "haptic_client/simulation/pointer_session.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string_view>

#include "common/core/check.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/trials.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kThickness_mm = 30.0;
const Vec3 kAt_mm(0.1, -0.2, 0.0);

class PointedHand : public ::testing::Test {
 protected:
  void begin(const char* tool = "drill-3.2", ForceChoice choice = ForceChoice::proportional) {
    auto session =
        std::make_unique<PointerSession>(plan(), exchange_, SimulatedDeviceParams{}, ForceScaling(0.0, choice));
    session_ = session.get();
    bench_ = std::make_unique<Bench>(bone_, std::move(session));
    command_ = {};
    command_.target_mm = kAt_mm;
    command_.rotation = along(Vec3::UnitZ());
    command_.on_bone = true;
    command_.spindle = 1.0;
    command_.push_n = 29.0;
    command_.tool = tool_named(tool);
    command_.number = number_;
  }
  static const ReadyPlan& plan() {
    static const ReadyPlan made = [] {
      const FreeHandOptions options{.tool = "drill-3.2", .toward = Vec3::UnitZ(), .at_mm = kAt_mm};
      const auto tools = builtin_tools();
      Result<ReadyPlan> ready = make_pointed_hand(options, block_case(), {tools.begin(), tools.end()});
      OSTEON_CHECK(ready.has_value());
      return *ready;
    }();
    return made;
  }
  static int tool_named(std::string_view name) {
    const auto& tools = plan().tools;
    const auto found = std::ranges::find_if(tools, [&](const ToolModel& model) { return model.tool.name == name; });
    OSTEON_CHECK(found != tools.end());
    return static_cast<int>(found - tools.begin());
  }
  static Eigen::Quaterniond along(const Vec3& axis) { return pose_along(Vec3::Zero(), axis).rotation; }
  // On virtual time nobody waits for a thread that makes tools.
  void send() {
    session_->loop().prepare(command_.tool);
    command_.number = ++number_;
    exchange_.commands.store(command_);
  }
  // The window sends 20 times a second, as it does while the pointer rests.
  SessionTick run(int ticks, const std::function<void(const SessionTick&)>& after = {}) {
    SessionTick last;
    for (int i = 0; i < ticks; ++i) {
      if (i % 50 == 0 && sends_) send();
      last = bench_->tick();
      if (after) after(last);
      bench_->follow();
    }
    return last;
  }
  [[nodiscard]] static double depth(const SessionTick& now) { return now.report.pose_bone_proxy.position_mm.z(); }
  SessionTick press(int ticks, const std::function<void(const SessionTick&)>& after = {}) {
    command_.push = true;
    return run(ticks, after);
  }
  SessionTick release(int ticks, const std::function<void(const SessionTick&)>& after = {}) {
    command_.push = false;
    return run(ticks, after);
  }
  [[nodiscard]] PointerPhase phase() const { return session_->phase(); }
  [[nodiscard]] double removed() const { return bench_->replica().removed_mm3(); }

  Case bone_ = block_case();
  PointerExchange exchange_;
  PointerCommand command_;
  std::uint64_t number_ = 0;
  bool sends_ = true;
  std::unique_ptr<Bench> bench_;
  PointerSession* session_ = nullptr;
};

TEST_F(PointedHand, RestsAboveTheBoneAndCutsNothingThere) {
  begin();
  const SessionTick last = run(1500);
  EXPECT_EQ(session_->phase(), PointerPhase::rests);
  EXPECT_LT(depth(last), 0.0);
  EXPECT_GT(depth(last), -1.0);
  EXPECT_EQ(removed(), 0.0);
  EXPECT_GT(last.report.spindle_rpm, 500.0);
}

TEST_F(PointedHand, TheOtherHandIrrigatesAndSucksWhileTheWindowLives) {
  begin();
  command_.irrigation = true;
  const SessionTick first = run(200);
  EXPECT_EQ(first.reading.buttons & (kIrrigation | kSuction), std::uint32_t{kIrrigation});
  command_.irrigation = false;
  command_.suction = true;
  EXPECT_EQ(run(200).reading.buttons & (kIrrigation | kSuction), std::uint32_t{kSuction});
  // A window that is gone holds neither.
  sends_ = false;
  EXPECT_EQ(run(PointerSession::kSilentTicks + 200).reading.buttons & (kIrrigation | kSuction), 0u);
}

// Both hands drill to the same place. The one that irrigates has fewer chips in its flutes.
TEST_F(PointedHand, IrrigationReachesTheToolsFlutes) {
  double full[2] = {};
  for (const bool irrigation : {false, true}) {
    begin();
    command_.irrigation = irrigation;
    run(1500);
    press(6000, [&](const SessionTick& now) {
      if (depth(now) < 4.0) full[irrigation] = std::max(full[irrigation], now.report.cutting.flutes_full);
    });
    release(10);
  }
  std::printf("flutes: %.3f dry, %.3f under irrigation\n", full[0], full[1]);
  EXPECT_GT(full[0], 0.05);
  EXPECT_LT(full[1], full[0]);
}

TEST_F(PointedHand, WaitsAboveTheBoneUntilThePointerMeetsIt) {
  begin();
  command_.on_bone = false;
  const SessionTick last = run(300);
  const Vec3 from_entry = last.report.pose_bone_proxy.position_mm - kAt_mm;
  EXPECT_LT(depth(last), -2.0);
  EXPECT_LT(from_entry.head<2>().norm(), 0.1);
  EXPECT_LT((last.report.pose_bone_proxy.rotation * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-6);
  EXPECT_EQ(last.report.spindle_rpm, 0.0);
  EXPECT_EQ(removed(), 0.0);
  // Then it comes from its height above the place that the pointer meets, as ever.
  command_.on_bone = true;
  run(1500);
  EXPECT_EQ(session_->phase(), PointerPhase::rests);
  EXPECT_EQ(removed(), 0.0);
}

TEST_F(PointedHand, PushesThroughBothWallsAndPlungesAsASimulatedSurgeonDoes) {
  // The surgeon with the same hand: how far beyond the bone the tip goes.
  Bench surgeon(bone_, {straight_down("drill-3.2")});
  double surgeon_mm = 0.0;
  surgeon.run([&](const SessionTick& now) { surgeon_mm = std::max(surgeon_mm, depth(now) - kThickness_mm); });
  ASSERT_GT(surgeon_mm, 1.0);

  begin();
  run(1500);
  command_.push = true;
  double deepest_mm = 0.0, pushed_off_mm = 0.0;
  const auto see = [&](const SessionTick& now) {
    deepest_mm = std::max(deepest_mm, depth(now));
    if (phase() == PointerPhase::reacts && pushed_off_mm == 0.0) pushed_off_mm = depth(now);
  };
  for (int s = 0; s < 60 && phase() != PointerPhase::reacts; ++s) run(1000, see);
  run(2000, see);  // the plunge takes less than one
  // In the marrow it pushed on. It let go where the far wall ends.
  EXPECT_GT(pushed_off_mm, kThickness_mm - 1.0);
  const double plunge_mm = deepest_mm - kThickness_mm;
  EXPECT_NEAR(plunge_mm / surgeon_mm, 1.0, 0.2) << plunge_mm << " mm, surgeon " << surgeon_mm << " mm";
  RecordProperty("plunge_ratio", std::to_string(plunge_mm / surgeon_mm));
  std::printf("plunge: pointer %.2f mm, simulated surgeon %.2f mm\n", plunge_mm, surgeon_mm);
}

TEST_F(PointedHand, CutsAtALightPushToo) {
  begin();
  run(1500);
  command_.push = true;
  command_.push_n = 10.0;
  const SessionTick last = run(5000);
  EXPECT_EQ(session_->phase(), PointerPhase::pushes);
  EXPECT_GT(depth(last), 0.5);
  EXPECT_GT(removed(), 1.0);
}

TEST_F(PointedHand, ComesOutWhenTheButtonIsUp) {
  begin();
  run(1500);
  command_.push = true;
  EXPECT_GT(depth(run(4000)), 1.0);
  command_.push = false;
  const SessionTick last = run(3000);
  EXPECT_EQ(session_->phase(), PointerPhase::rests);
  EXPECT_LT(depth(last), 0.0);
}

TEST_F(PointedHand, ComesFromOutsideOnTheBonesOtherSideToo) {
  begin();
  command_.target_mm = kAt_mm + Vec3(0, 0, kThickness_mm);
  command_.rotation = pose_along(Vec3::Zero(), -Vec3::UnitZ()).rotation;
  const SessionTick last = run(1500);
  EXPECT_EQ(session_->phase(), PointerPhase::rests);
  EXPECT_GT(depth(last), kThickness_mm);
  EXPECT_LT(depth(last), kThickness_mm + 1.0);
  EXPECT_EQ(removed(), 0.0);
}

TEST_F(PointedHand, AJumpTakesTheToolOffTheBone) {
  begin();
  run(1500);
  command_.target_mm = kAt_mm + Vec3(4.5, 4.5, 0.0) - Vec3(9.0, 0.0, 0.0);
  double most_n = 0.0;
  run(2000, [&](const SessionTick& now) { most_n = std::max(most_n, now.report.coupling.force_n.norm()); });
  EXPECT_EQ(session_->phase(), PointerPhase::rests);
  EXPECT_EQ(removed(), 0.0);
  EXPECT_LT(most_n, 2.0);
}

// The last message counts for as many ticks as it may, and not for one more.
TEST_F(PointedHand, SilenceEndsPushAndSpindle) {
  begin();
  run(1500);
  press(3000);
  ASSERT_EQ(phase(), PointerPhase::pushes);
  send();
  sends_ = false;
  EXPECT_GT(run(PointerSession::kSilentTicks + 1).commanded_rpm, 0.0);
  EXPECT_EQ(phase(), PointerPhase::pushes);
  EXPECT_EQ(run(1).commanded_rpm, 0.0);
  EXPECT_EQ(phase(), PointerPhase::withdraws);
  const SessionTick silent = run(3000, [](const SessionTick& now) { EXPECT_EQ(now.commanded_rpm, 0.0); });
  EXPECT_EQ(phase(), PointerPhase::away);
  EXPECT_LT(silent.report.spindle_rpm, 1.0);
  EXPECT_LT(depth(silent), -10.0);

  // A message brings tool and spindle back. The button that was held all the time does not push.
  const double before = removed();
  sends_ = true;
  const SessionTick back = run(1500);
  EXPECT_EQ(phase(), PointerPhase::rests);
  EXPECT_GT(back.commanded_rpm, 0.0);
  EXPECT_EQ(removed(), before);
  release(100);
  press(4000);
  EXPECT_GT(removed(), before);
}

// A patch that is late says nothing of the bone, so nothing has given way.
TEST_F(PointedHand, PushesOnThroughTicksWithoutAPatch) {
  begin();
  run(1500);
  press(3000);
  ASSERT_EQ(phase(), PointerPhase::pushes);
  for (int i = 0; i < 20; ++i) {
    const SessionTick now = bench_->tick_without_patch();
    EXPECT_TRUE(now.report.events & kUncovered);
    EXPECT_EQ(phase(), PointerPhase::pushes);
  }
  const double before = removed();
  run(2000);
  EXPECT_EQ(phase(), PointerPhase::pushes);
  EXPECT_GT(removed(), before);
}

// The worker then passes on no late ticks (HapticWorker.CountsLateTicksForADeviceButNotForASimulatedHand).
TEST_F(PointedHand, HasNoTimeButItsTicks) {
  begin();
  EXPECT_TRUE(session_->simulated_time());
}

// A hand that has let go does not push again by itself, however long the button is held.
TEST_F(PointedHand, LetsGoAtABreakthroughAndNotInMarrow) {
  begin();
  command_.push_n = 40.0;
  run(1500);
  double released_mm = 0.0;
  press(15000, [&](const SessionTick& now) {
    if (phase() == PointerPhase::reacts && released_mm == 0.0) released_mm = depth(now);
  });
  EXPECT_EQ(phase(), PointerPhase::reacts);
  EXPECT_NEAR(released_mm, kThickness_mm, 1.0);
  const double settled_mm = depth(run(1000));
  const SessionTick held = run(3000, [&](const SessionTick&) { ASSERT_EQ(phase(), PointerPhase::reacts); });
  EXPECT_NEAR(depth(held), settled_mm, 0.01) << "it is neither pushed nor drawn";

  release(3000);
  EXPECT_EQ(phase(), PointerPhase::rests);
  press(100);
  EXPECT_EQ(phase(), PointerPhase::pushes);
}

TEST_F(PointedHand, WithdrawsAlongItsAxis) {
  begin();
  const Vec3 axis = Vec3(0.2, -0.1, 1.0).normalized();
  command_.rotation = along(axis);
  run(1500);
  press(6000);
  ASSERT_EQ(phase(), PointerPhase::pushes);
  double off_mm = 0.0, deepest_mm = 0.0;
  double before_mm = 1e9;
  release(3000, [&](const SessionTick& now) {
    if (phase() != PointerPhase::withdraws) return;
    const Vec3 from_mm = now.report.pose_bone_proxy.position_mm - kAt_mm;
    const double deep_mm = from_mm.dot(axis);
    off_mm = std::max(off_mm, (from_mm - deep_mm * axis).norm());
    deepest_mm = std::max(deepest_mm, deep_mm);
    EXPECT_LT(deep_mm, before_mm + 0.02);
    before_mm = deep_mm;
  });
  EXPECT_EQ(phase(), PointerPhase::rests);
  EXPECT_GT(deepest_mm, 1.0);
  // The hand is stiff across: 20 N/mm. A drill that is drawn out meets far less than 10 N.
  EXPECT_LT(off_mm, 0.5);
  // A turning tool that rests cuts nothing, wherever the pointer goes over the surface.
  const double before = removed();
  for (int i = 0; i <= 40; ++i) {
    command_.target_mm = Vec3(-4.0 + 0.2 * i, 3.0, 0.0);
    run(50);
  }
  EXPECT_EQ(removed(), before);
}

// A tool that a person has turned away from the normal would touch the bone with its edge before its tip does. It rests
// higher.
TEST_F(PointedHand, ATiltedToolCutsNothingWhereItRests) {
  for (const char* tool : {"drill-3.2", "burr-round-5", "saw-oscillating-1"})
    for (const double tilt_rad : {0.3, 1.1}) {
      SCOPED_TRACE(std::string(tool) + " tilted by " + std::to_string(tilt_rad));
      begin(tool);
      const Vec3 axis(std::sin(tilt_rad), 0.0, std::cos(tilt_rad));
      command_.rotation = along(axis);
      double most_n = 0.0;
      const auto see = [&](const SessionTick& now) { most_n = std::max(most_n, now.report.coupling.force_n.norm()); };
      const SessionTick last = run(1200, see);
      EXPECT_EQ(phase(), PointerPhase::rests);
      EXPECT_GT(last.commanded_rpm, 0.0);
      // A sphere of radius r touches a plane where its middle is r above it: (h + r) cos(tilt) = r + 0.3 mm.
      const double height_mm = (kAt_mm - last.report.pose_bone_proxy.position_mm).dot(axis);
      if (tool == std::string_view("burr-round-5")) {
        EXPECT_NEAR(height_mm, (2.5 + 0.3) / std::cos(tilt_rad) - 2.5, 0.1);
      }
      EXPECT_EQ(most_n, 0.0);
      // Nor does it on its way over the surface, to and fro.
      for (int i = 0; i <= 20; ++i) {
        command_.target_mm.x() = (i % 2 ? 2.4 : -2.4) + 0.1 * i;
        run(80, see);
      }
      EXPECT_LT(most_n, 2.0);
      // An edge that is turned fast comes down faster than the hand goes up. It touches, but cuts nothing.
      for (int i = 0; i < 4; ++i) {
        const double rad = i % 2 ? tilt_rad : tilt_rad - 0.7;
        command_.rotation = along(Vec3(std::sin(rad), 0.0, std::cos(rad)));
        EXPECT_GT(run(400).commanded_rpm, 0.0);
      }
      EXPECT_EQ(removed(), 0.0);
    }
}

// A hand that pushed with Shift is elsewhere than the pointer. The tool comes out before it goes there.
TEST_F(PointedHand, ComesOutBeforeItFollowsThePointer) {
  begin();
  run(1500);
  press(3000);
  command_.fine = true;
  for (int i = 0; i < 10; ++i) {
    command_.target_mm.x() += 0.5;
    run(50);
  }
  double most_n = 0.0, sideways_mm = 0.0;
  const SessionTick last = release(3000, [&](const SessionTick& now) {
    if (phase() != PointerPhase::rests) return;
    most_n = std::max(most_n, now.report.coupling.force_n.norm());
    const Vec3& tip_mm = now.report.pose_bone_proxy.position_mm;
    if (tip_mm.z() > 0.0) sideways_mm = std::max(sideways_mm, tip_mm.x() - kAt_mm.x());
  });
  EXPECT_EQ(phase(), PointerPhase::rests);
  EXPECT_LT((last.report.pose_bone_proxy.position_mm - command_.target_mm).norm(), 0.4);
  EXPECT_LT(most_n, 2.0);
  EXPECT_LT(sideways_mm, 0.7) << "the hand was moved by half a millimetre";
}

TEST_F(PointedHand, AJumpToAnotherSideGoesThroughNoBone) {
  begin();
  run(1500);
  ASSERT_EQ(phase(), PointerPhase::rests);
  double most_n = 0.0;
  const Vec3 middle_mm(0.1, -0.2, 15.0);
  // The block's six faces, as ways from its middle to them.
  for (const Vec3& way_mm : {Vec3(0, 0, 15), Vec3(0, 0, -15), Vec3(5.9, 0, 0), Vec3(-6.1, 0, 0), Vec3(0, 6.2, 0),
                             Vec3(0, -5.8, 0), Vec3(0, 0, 15)}) {
    command_.target_mm = middle_mm + way_mm;
    command_.rotation = along(-way_mm.normalized());
    const SessionTick last = run(1000, [&](const SessionTick& now) {
      most_n = std::max({most_n, now.report.coupling.force_n.norm(), now.report.device.force_n.norm()});
    });
    EXPECT_EQ(phase(), PointerPhase::rests) << way_mm.transpose();
    EXPECT_NEAR((last.report.pose_bone_proxy.position_mm - command_.target_mm).norm(), 0.3, 0.1) << way_mm.transpose();
    EXPECT_GT(last.commanded_rpm, 0.0);
  }
  EXPECT_EQ(removed(), 0.0);
  EXPECT_LT(most_n, 2.0);
}

// Only motion of the pointer across the axis counts, a tenth of it with Shift. Shift alone moves nothing.
TEST_F(PointedHand, FineMotionIsATenth) {
  begin();
  run(1500);
  Vec3 at_mm = press(1000).order.hand.target_mm;
  const auto moved_mm = [&](bool fine, const Vec3& by_mm) {
    command_.fine = fine;
    command_.target_mm += by_mm;
    const Vec3 from_mm = at_mm;
    at_mm = run(500).order.hand.target_mm;
    return Vec3(at_mm - from_mm);
  };
  EXPECT_NEAR((moved_mm(true, {0, 0, 0}) - Vec3(0, 0, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((moved_mm(true, {5, 0, 0}) - Vec3(0.5, 0, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((moved_mm(true, {0, -5, 3}) - Vec3(0, -0.5, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((moved_mm(false, {0, 0, 0}) - Vec3(0, 0, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((moved_mm(false, {-2, 1, -4}) - Vec3(-2, 1, 0)).norm(), 0.0, 1e-9);
  EXPECT_EQ(phase(), PointerPhase::pushes);
}

TEST_F(PointedHand, AnotherToolComesIntoTheHand) {
  begin();
  run(1500);
  const int drill = command_.tool, burr = tool_named("burr-round-5");
  ASSERT_NE(burr, drill);
  command_.tool = burr;
  EXPECT_EQ(run(3).report.tool, burr);
  run(1500);
  EXPECT_EQ(phase(), PointerPhase::rests);
  EXPECT_EQ(removed(), 0.0);

  // A tool in the bone stays in the hand, at its own speed, until it is out.
  command_.tool = drill;
  run(1500);
  press(3000);
  const double drill_rpm = plan().tools[static_cast<std::size_t>(drill)].tool.spindle_rpm;
  ASSERT_NE(plan().tools[static_cast<std::size_t>(burr)].tool.spindle_rpm, drill_rpm);
  const auto keeps = [&](const SessionTick& now) {
    if (phase() != PointerPhase::pushes && phase() != PointerPhase::withdraws) return;
    ASSERT_EQ(now.report.tool, drill);
    ASSERT_EQ(now.commanded_rpm, drill_rpm);
  };
  command_.tool = burr;
  command_.spindle_rpm = 33.0;  // of the bur
  EXPECT_GT(depth(run(500, keeps)), 0.5);
  EXPECT_EQ(phase(), PointerPhase::pushes);
  const SessionTick last = release(3000, keeps);
  EXPECT_EQ(phase(), PointerPhase::rests);
  EXPECT_EQ(last.report.tool, burr);
  EXPECT_EQ(last.commanded_rpm, 33.0);
}

// Feed at which the hand's push and the drill's thrust are equal, by the laws as published: Chi (7.3) or Allotta
// (7.1), each with wear in proportion. At a feed v the hand gives F - (B + K · 0.3 s) v.
double steady_feed_mm_per_s(bool chi, double wear, double rpm, double push_n) {
  const HandParams hand = expert_hand();
  const auto excess_n = [&](double v) {
    const double chi_n = 134.6 * std::pow(rpm, -0.3327) * std::pow(v, 0.5189) * std::pow(1.9, 1.1841);
    const double allotta_n = 5.0 * 130.0 * (60.0 * v / rpm) * 1.6 * std::sin(0.5 * 118.0 * std::numbers::pi / 180.0);
    return wear * (chi ? chi_n : allotta_n) + (hand.damping_n_s_per_mm + hand.stiffness_n_per_mm * hand.follow_s) * v -
           push_n;
  };
  double low = 0.0, high = 10.0;
  for (int i = 0; i < 60; ++i) (excess_n(0.5 * (low + high)) < 0.0 ? low : high) = 0.5 * (low + high);
  return low;
}

// Wear and law of the message act in the bone, in the middle of a push.
TEST_F(PointedHand, WearAndLawOfAMessageActWhileTheToolCuts) {
  begin();
  run(1500);
  press(1900);
  ASSERT_GT(depth(run(1)), 1.1) << "the cone is in the cortex";
  const auto expect_feed = [&](bool chi, double wear, int ticks) {
    run(500);  // the hand comes to its new balance
    const double from_mm = depth(run(1));
    double rpm = 0.0;
    const double to_mm = depth(run(ticks, [&](const SessionTick& now) { rpm += now.report.spindle_rpm / ticks; }));
    ASSERT_EQ(phase(), PointerPhase::pushes);
    ASSERT_LT(to_mm, 4.9) << "the cortex has ended";
    const double feed = (to_mm - from_mm) / (1e-3 * ticks), expected = steady_feed_mm_per_s(chi, wear, rpm, 29.0);
    std::printf("  %s, wear %.0f: %.3f mm/s, by hand %.3f mm/s\n", chi ? "Chi" : "Allotta", wear, feed, expected);
    EXPECT_NEAR(feed, expected, 0.06 * expected);
    ASSERT_TRUE(exchange_.states.refresh());
    EXPECT_NEAR(exchange_.states.value().wear, wear, 0.01);
    EXPECT_EQ(exchange_.states.value().law->name, chi ? "chi" : "allotta");
  };
  expect_feed(true, 1.0, 500);
  command_.wear = 2.0;
  expect_feed(true, 2.0, 1000);
  command_.law = find_force_law("allotta");
  expect_feed(false, 2.0, 1000);
  command_.wear = 1.0;
  expect_feed(false, 1.0, 500);
}

// Each tool has its own wear and law. A message that comes again does not sharpen a tool that work has blunted.
TEST_F(PointedHand, WearAndLawAreThoseOfTheToolThatTheMessageNames) {
  const auto state = [&] {
    exchange_.states.refresh();
    return exchange_.states.value();
  };
  begin();
  const int drill = command_.tool;
  command_.wear = 1.5;
  command_.law = find_force_law("multi-point");
  run(1500);
  press(3000);
  EXPECT_GT(state().wear, 1.5);
  release(3000);
  const double worn = state().wear;
  EXPECT_LT(worn, 1.51);
  command_.tool = tool_named("burr-round-5");
  command_.wear = 0.0;
  command_.law = nullptr;
  run(1500);
  ASSERT_EQ(state().tool, command_.tool);
  EXPECT_EQ(state().wear, 1.0);
  EXPECT_EQ(state().law->name, "milling");
  // Without a word the drill is as blunt as it was, and has its own law.
  command_.tool = drill;
  run(1500);
  EXPECT_EQ(state().wear, worn);
  EXPECT_EQ(state().law->name, "chi");
}

// The hand gets the logarithm of what the bone gives, and with the feed cue within a smaller budget.
TEST_F(PointedHand, GetsTheForceAsItIsChosen) {
  for (const ForceChoice choice : {ForceChoice::proportional, ForceChoice::compressed, ForceChoice::feed_cue}) {
    SCOPED_TRACE(name(choice));
    begin("drill-3.2", choice);
    run(1500);
    press(3000);
    double bone_n = 0.0, hand_n = 0.0;
    constexpr int kTicks = 500;
    press(kTicks, [&](const SessionTick&) {
      ASSERT_TRUE(exchange_.states.refresh());
      bone_n += exchange_.states.value().force_bone_n.norm() / kTicks;
      hand_n += exchange_.states.value().force_hand_n.dot(-Vec3::UnitZ()) / kTicks;
    });
    ASSERT_EQ(phase(), PointerPhase::pushes);
    ASSERT_GT(bone_n, 20.0);
    // 60 N become the device's 30 N, or 0.3 of them: F0 ln(1 + 60 N / F0) is 30 N for F0 = 23.88 N, and s is 1.
    // 9 N are reached with F0 = 3 N and s = 0.985.
    const double expected_n = choice == ForceChoice::proportional ? bone_n
                              : choice == ForceChoice::compressed ? 23.88 * std::log1p(bone_n / 23.88)
                                                                  : 0.985 * 3.0 * std::log1p(bone_n / 3.0);
    std::printf("  bone %.2f N, hand %.2f N, by hand %.2f N\n", bone_n, hand_n, expected_n);
    // The motor's drag and the cue have no mean along the axis.
    EXPECT_NEAR(hand_n, expected_n, 0.05 * expected_n);
    release(10);
  }
}

TEST_F(PointedHand, DoesNotAllocate) {
  begin();
  std::int64_t allocations = 0;
  int pushed = 0;
  for (int i = 0; i < 6000; ++i) {
    command_.push = i > 1000 && i < 4000;
    if (i == 2500) command_.wear = 2.0, command_.law = find_force_law("allotta");
    if (i == 4800) command_.wear = 0.0, command_.law = nullptr, command_.tool = tool_named("burr-round-5");
    if (i == 5400) command_.target_mm = kAt_mm + Vec3(0, 0, kThickness_mm), command_.rotation = along(-Vec3::UnitZ());
    if (i % 50 == 0) send();
    const osteon::test::AllocationCounter heap;
    bench_->tick();
    allocations += heap.count();
    pushed += phase() == PointerPhase::pushes;
    bench_->follow();
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(pushed, 2000);
}

// Energy that the shown force and the cutting gave in each contact, from forces and the handle's motion alone. The
// device's frame is the bone's, and nothing is scaled.
struct GivenEnergy {
  double contact_mj = 0.0, worst_mj = 0.0, generated_mj = 0.0, net_mj = 0.0;
  long contacts = 0;

  void see(const SessionTick& now) {
    const Vec3& handle_mm = now.reading.pose_device_tool.position_mm;
    if (now.order.take_up)
      finish();  // the hand has let go, and holds a tool elsewhere
    else
      contact_mj += shown_n_.dot(handle_mm - handle_mm_);
    contact_mj += now.report.cutting.work_mj;
    shown_n_ = now.report.coupling.device_n;
    handle_mm_ = handle_mm;
    const CuttingPhase phase = now.report.cutting.phase;
    if (phase == CuttingPhase::rubbing || phase == CuttingPhase::cutting || !shown_n_.isZero())
      open_ = true;
    else
      finish();
  }
  void finish() {
    contacts += open_;
    worst_mj = std::max(worst_mj, contact_mj);
    generated_mj += std::max(0.0, contact_mj);
    net_mj += contact_mj;
    contact_mj = 0.0;
    open_ = false;
  }

 private:
  Vec3 shown_n_ = Vec3::Zero(), handle_mm_ = Vec3::Zero();
  bool open_ = false;
};

// What a pointer may do at its worst: it jumps to any side, is silent for up to two seconds, pushes with any force, and
// changes tools, their wear and their laws. The machine misses ticks.
class WildPointer {
 public:
  explicit WildPointer(unsigned seed) : random_(seed) {}
  // True: there is a new command.
  bool change(PointerCommand& command, int tick, int tools) {
    if (tick != next_) return false;
    const int side = static_cast<int>(uniform(0, 6));
    const double sign = side % 2 ? 1.0 : -1.0;
    Vec3 axis(uniform(-0.6, 0.6), uniform(-0.6, 0.6), uniform(-0.6, 0.6));
    command.target_mm = Vec3(uniform(-5, 5), uniform(-5, 5), uniform(1, 29));
    const int way = maybe(0.5) ? 2 : side / 2;  // half of the time on the faces that are drilled
    axis[way] = -sign;
    command.target_mm[way] = way == 2 ? 15.0 + sign * 15.0 : sign * 6.0;
    command.target_mm[way] += uniform(-0.5, 0.5);
    command.rotation = pose_along(Vec3::Zero(), axis.normalized()).rotation;
    command.on_bone = maybe(0.9);
    command.push = maybe(0.6);
    command.fine = maybe(0.3);
    command.push_n = uniform(1, 40);
    command.spindle = maybe(0.8) ? 1.0 : maybe(0.5) ? uniform(0, 1) : 0.0;
    if (maybe(0.05)) command.tool = static_cast<int>(uniform(0, tools));
    command.wear = maybe(0.3) ? uniform(1, 5) : 0.0;
    next_ = tick + static_cast<int>(maybe(0.1) ? uniform(300, 2000) : uniform(1, 300));
    return true;
  }
  // One that fits, or null.
  const ForceLaw* law_for(const Tool& tool) {
    const auto laws = force_laws();
    const ForceLaw& any = laws[static_cast<std::size_t>(uniform(0, static_cast<double>(laws.size())))];
    return any.fits(tool.kind) ? &any : nullptr;
  }
  int periods() { return maybe(0.002) ? static_cast<int>(uniform(2, 30)) : 1; }
  bool maybe(double share) { return uniform(0, 1) < share; }

 private:
  double uniform(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  std::mt19937 random_;
  int next_ = 0;
};

// Points of tools take long, so each is made when the pointer first wants it, while the hand ticks on.
TEST_F(PointedHand, WaitsOffTheBoneForAToolThatIsBeingMade) {
  begin();
  run(1500);
  ASSERT_EQ(phase(), PointerPhase::rests);
  const int burr = tool_named("burr-round-5");
  ASSERT_FALSE(session_->loop().ready(burr));
  command_.tool = burr;
  command_.push = true;
  command_.number = ++number_;
  exchange_.commands.store(command_);
  sends_ = false;
  run(60);
  EXPECT_EQ(phase(), PointerPhase::away);
  EXPECT_FALSE(session_->loop().ready(burr));
  EXPECT_EQ(removed(), 0.0);

  exchange_.wanted.want(burr);
  EXPECT_TRUE(osteon::test::wait_until([&] { return session_->loop().ready(burr); }, std::chrono::seconds(10)));
  sends_ = true;
  command_.push = false;
  const SessionTick last = run(1500);
  EXPECT_EQ(phase(), PointerPhase::rests);
  EXPECT_EQ(last.report.tool, burr);
  press(1000);
  EXPECT_GT(removed(), 0.0);
}

TEST_F(PointedHand, StaysPassiveUnderJumpsStallsAndRandomPushes) {
  // A million ticks in deploy/nightly. Else 40'000, in which the pointer changes about 160 times.
  const unsigned rounds = osteon::test::trials(10, 1);
  const int ticks = static_cast<int>(osteon::test::trials(100'000, 40'000));
  double worst_mj = 0.0, generated_mj = 0.0, net_mj = 0.0, most_n = 0.0, removed_mm3 = 0.0;
  long contacts = 0, touching = 0, late = 0;
  for (unsigned round = 0; round < rounds; ++round) {
    SCOPED_TRACE(round);
    begin();
    WildPointer wild(23 + round);
    GivenEnergy given;
    const int tools = static_cast<int>(plan().tools.size());
    for (int i = 0; i < ticks; ++i) {
      if (wild.change(command_, i, tools)) {
        command_.law = wild.law_for(plan().tools[static_cast<std::size_t>(command_.tool)].tool);
        send();
      }
      const SessionTick now = bench_->tick(wild.periods());
      bench_->follow();
      const double force_n = now.report.device.force_n.norm();
      ASSERT_TRUE(std::isfinite(force_n) && now.report.pose_bone_proxy.position_mm.allFinite()) << i;
      most_n = std::max(most_n, force_n);
      given.see(now);
      touching += !now.report.coupling.device_n.isZero();
      late += (now.report.events & kMissedTicks) != 0;
      // The bounds of tests/unit/haptic_client/rendering/stability_test.cpp.
      ASSERT_LE(given.worst_mj, 0.01) << i;
      ASSERT_LE(now.report.coupling.energy.worst_mj, 0.01) << i;
    }
    given.finish();
    ASSERT_EQ(session_->loop().mapping().scale(), 1.0);
    worst_mj = std::max(worst_mj, given.worst_mj);
    generated_mj += given.generated_mj;
    net_mj += given.net_mj;
    contacts += given.contacts;
    removed_mm3 += removed();
  }
  std::printf(
      "passivity: %u ticks, %ld touching, %ld contacts, worst %.5f mJ, generated %.4f mJ, net %.1f mJ, at most %.1f N, "
      "%ld late ticks, removed %.0f mm3\n",
      rounds * static_cast<unsigned>(ticks), touching, contacts, worst_mj, generated_mj, net_mj, most_n, late,
      removed_mm3);
  EXPECT_LE(worst_mj, 0.01);
  EXPECT_LE(generated_mj, 1.0);
  EXPECT_LT(net_mj, 0.0);
  EXPECT_LE(most_n, SimulatedDeviceParams{}.limits.peak_n + 1e-9);
  // Otherwise the test would prove nothing.
  EXPECT_GT(most_n, 5.0);
  EXPECT_GT(touching, ticks / 10);
  EXPECT_GT(contacts, ticks / 2000);
  EXPECT_GT(late, ticks / 2000);
  EXPECT_GT(removed_mm3, 10.0);
}

}  // namespace
}  // namespace osteon::haptic::test
