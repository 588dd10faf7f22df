// A hand that a pointer leads, on virtual time: what it does to a block of two cortices with marrow between them.
#include "haptic_client/simulation/pointer_session.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/core/check.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kThickness_mm = 30.0;
const Vec3 kAt_mm(0.1, -0.2, 0.0);

class PointedHand : public ::testing::Test {
 protected:
  void begin(const std::string& tool = "drill-3.2") {
    FreeHandOptions options{.tool = tool, .toward = Vec3::UnitZ(), .at_mm = kAt_mm};
    const auto tools = builtin_tools();
    Result<ReadyPlan> plan = make_pointed_hand(options, bone_, {tools.begin(), tools.end()});
    OSTEON_CHECK(plan.has_value());
    auto session = std::make_unique<PointerSession>(std::move(*plan), exchange_, SimulatedDeviceParams{}, 0.0);
    session_ = session.get();
    bench_ = std::make_unique<Bench>(bone_, std::move(session));
    command_.target_mm = kAt_mm;
    command_.rotation = pose_along(kAt_mm, Vec3::UnitZ()).rotation;
    command_.on_bone = true;
    command_.spindle = 1.0;
    command_.push_n = 29.0;
  }
  void send() {
    ++command_.number;
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
  [[nodiscard]] double removed() const { return bench_->replica().removed_mm3(); }

  Case bone_ = block_case();
  PointerExchange exchange_;
  PointerCommand command_;
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
  run(60000, [&](const SessionTick& now) {
    deepest_mm = std::max(deepest_mm, depth(now));
    if (session_->phase() == PointerPhase::reacts && pushed_off_mm == 0.0) pushed_off_mm = depth(now);
    if (session_->phase() == PointerPhase::reacts) command_.push = true;  // the person still holds the button
  });
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

TEST_F(PointedHand, SilenceEndsPushAndSpindle) {
  begin();
  run(1500);
  command_.push = true;
  run(3000);
  sends_ = false;
  const SessionTick last = run(5000);
  EXPECT_LT(last.report.spindle_rpm, 1.0);
  EXPECT_LT(depth(last), 0.0);
  const double before = removed();
  sends_ = true;
  command_.push = false;
  run(1000);
  command_.push = true;
  run(4000);
  EXPECT_GT(removed(), before);
}

TEST_F(PointedHand, AnotherToolComesIntoTheHand) {
  begin();
  run(1500);
  const auto& tools = session_->plan().tools;
  for (std::size_t i = 0; i < tools.size(); ++i)
    if (tools[i].tool.name == "burr-round-5") command_.tool = static_cast<int>(i);
  ASSERT_NE(command_.tool, 0);
  const SessionTick last = run(1500);
  EXPECT_EQ(last.report.tool, command_.tool);
  EXPECT_EQ(session_->phase(), PointerPhase::rests);
}

TEST_F(PointedHand, StaysPassiveUnderJumpsStallsAndRandomPushes) {
  begin();
  std::mt19937 random(23);
  const auto uniform = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random);
  };
  const int tools = static_cast<int>(session_->plan().tools.size());
  int next = 0;
  double most_n = 0.0;
  const int ticks = 100'000;
  for (int i = 0; i < ticks; ++i) {
    if (i == next) {
      command_.target_mm = Vec3(uniform(-5, 5), uniform(-5, 5), uniform(-0.5, 0.5));
      command_.rotation =
          pose_along(Vec3::Zero(), Vec3(uniform(-0.6, 0.6), uniform(-0.6, 0.6), 1.0).normalized()).rotation;
      command_.on_bone = uniform(0, 1) < 0.9;
      command_.push = uniform(0, 1) < 0.6;
      command_.fine = uniform(0, 1) < 0.3;
      command_.push_n = uniform(1, 40);
      command_.spindle = uniform(0, 1) < 0.8 ? 1.0 : 0.0;
      if (uniform(0, 1) < 0.05) command_.tool = static_cast<int>(uniform(0, tools));
      send();
      next = i + static_cast<int>(uniform(0, 1) < 0.1 ? uniform(300, 2000) : uniform(1, 200));
    }
    const SessionTick now = bench_->tick(uniform(0, 1) < 0.002 ? 30 : 1);
    bench_->follow();
    const double force_n = now.report.device.force_n.norm();
    ASSERT_TRUE(std::isfinite(force_n)) << i;
    most_n = std::max(most_n, force_n);
    // The bounds of tests/unit/haptic_client/rendering/stability_test.cpp.
    ASSERT_LE(now.report.coupling.energy.worst_mj, 0.01) << i;
    ASSERT_LE(now.report.coupling.energy.generated_mj, 1.0) << i;
  }
  EXPECT_LE(most_n, 60.0 + 1e-9);
  EXPECT_GT(most_n, 5.0);
  EXPECT_GT(removed(), 10.0);
}

}  // namespace
}  // namespace osteon::haptic::test
