// One hand guides another's. The pull begins and ends anywhere without a jump. It brings the hands together however
// late states arrive. It gives no energy that the guiding hand's motion has not paid.
#include "haptic_client/rendering/guidance_spring.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "common/mechanics/simulated_hand.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/stability/supervised_hand.hpp"

namespace osteon::haptic::test {
namespace {

using osteon::test::OverseenHand;
using osteon::test::Random;

constexpr double kT = 1e-3, kSlew_n = 0.5, kBudget_mj = 0.01;

// States of a guiding hand over a bad connection: irregular, late, some lost, some out of order.
class BadLine {
 public:
  BadLine(int delay_ms, double jitter_ms, double loss, double hz)
      : delay_ms_(delay_ms), jitter_ms_(jitter_ms), loss_(loss), hz_(hz) {}
  GuideSeen tick(const Vec3& place_mm) {
    ++now_;
    if (std::fmod(now_ * kT * hz_, 1.0) < kT * hz_) {
      ++seq_;
      if (random_.unit() >= loss_)
        on_the_way_.push_back({now_ + delay_ms_ + random_.between(0.0, jitter_ms_), {true, seq_, place_mm}});
    }
    for (const auto& [due, seen] : on_the_way_)
      if (due <= now_ && seen.state_seq > seen_.state_seq) seen_ = seen;
    std::erase_if(on_the_way_, [&](const auto& entry) { return entry.first <= now_; });
    return seen_;
  }

 private:
  double delay_ms_, jitter_ms_, loss_, hz_;
  double now_ = 0;
  std::uint64_t seq_ = 0;
  Random random_{11};
  GuideSeen seen_;
  std::deque<std::pair<double, GuideSeen>> on_the_way_;
};

// A guided hand in the air. Device and bone frames are alike.
struct Led {
  explicit Led(double holds_n_per_mm) : hand(params(holds_n_per_mm), Vec3::Zero()) {}
  static HandParams params(double holds_n_per_mm) {
    HandParams params = expert_hand();
    params.stiffness_n_per_mm = params.lateral_n_per_mm = holds_n_per_mm;
    return params;
  }
  // Runs one tick. Returns the force of the pull on the hand.
  Vec3 tick(const GuideSeen& seen, double share = 1.0) {
    hand.step({.mode = HandMode::carry, .target_mm = rest_mm}, force_n, kT);
    const Vec3 moved_mm = hand.position_mm() - handle_mm;
    given_mj += force_n.dot(moved_mm);
    handle_mm = hand.position_mm();
    pull.see(seen);
    const Vec3 before_n = force_n;
    const double far_mm_per_s = 60.0 + std::min(400.0, (pull.smoothed_mm() - smoothed_mm).norm() / kT);
    smoothed_mm = pull.smoothed_mm();
    force_n =
        pull.step({.handle_mm = handle_mm, .guide_mm = smoothed_mm, .share = share, .room_n = 60.0, .slew_n = kSlew_n});
    // The far end moves no faster than the other hand plus what it catches up. It can put in no more energy than this.
    paid_mj += std::max(force_n.norm(), before_n.norm()) * far_mm_per_s * kT;
    over_mj = std::max(over_mj, given_mj - paid_mj);
    const double square = before_n.squaredNorm();
    const Vec3 kept_n =
        square > 0.0 ? Vec3(std::clamp(force_n.dot(before_n) / square, 0.0, 1.0) * before_n) : Vec3(Vec3::Zero());
    step_n = std::max(step_n, (force_n - kept_n).norm());
    most_n = std::max(most_n, force_n.norm());
    return force_n;
  }
  Hand hand;
  GuidanceSpring pull;
  Vec3 rest_mm = Vec3::Zero(), handle_mm = Vec3::Zero(), force_n = Vec3::Zero(), smoothed_mm = Vec3::Zero();
  double given_mj = 0, paid_mj = 0, over_mj = -1e9, step_n = 0, most_n = 0;
};

class GuideOverLine : public ::testing::TestWithParam<int> {};

// It begins 25 mm away, follows a circle, rests, is silent, and comes back 40 mm elsewhere.
TEST_P(GuideOverLine, BringsTheHandAlongWithoutAJump) {
  Led led(0.02);  // a hand that does not resist
  BadLine line(GetParam(), 20.0, 0.3, 60.0);
  double far_mm = 0.0, rested_mm = 1e9;
  const auto place = [](int i) {
    const double angle = i < 2000 ? 0.0 : i < 8000 ? 1e-3 * (i - 2000) : 6.0;
    return Vec3(25.0 + 10.0 * std::sin(angle), 10.0 * (1.0 - std::cos(angle)), 5.0);
  };
  EXPECT_LT(led.tick(line.tick(place(0))).norm(), 0.01);
  for (int i = 1; i < 11'000; ++i) {
    led.tick(line.tick(place(i)));
    if (i > 3500 && i < 8000) far_mm = std::max(far_mm, (led.handle_mm - place(i)).norm());
    if (i > 10'000) rested_mm = std::min(rested_mm, (led.handle_mm - place(i)).norm());
  }
  // At 10 mm/s it lags by the delay of the states and some tens of milliseconds.
  std::printf(
      "  %d ms late: %.2f mm behind, %.3f mm off at rest, %.2f N at most, step %.3f N, over %.4f mJ, worst %.5f mJ\n",
      GetParam(), far_mm, rested_mm, led.most_n, led.step_n, led.over_mj, led.pull.energy().worst_mj);
  EXPECT_LT(far_mm, 10.0 * (1e-3 * GetParam() + 0.2) + 0.2);
  EXPECT_LT(rested_mm, 0.2);
  // In silence the pull begins to fade within a quarter of a second, and is gone within another.
  GuideSeen last = line.tick(place(11'000));
  for (int i = 0; i < 520; ++i) led.tick(last);
  EXPECT_EQ(led.force_n.norm(), 0.0);
  EXPECT_FALSE(led.pull.pulls());
  last.place_mm += Vec3(-40, 0, 10);
  ++last.state_seq;
  EXPECT_LT(led.tick(last).norm(), 0.01);
  for (int i = 0; i < 4000; ++i) {
    if (i % 16 == 0) ++last.state_seq;
    led.tick(last);
  }
  EXPECT_LT((led.handle_mm - last.place_mm).norm(), 0.2);
  EXPECT_LE(led.step_n, kSlew_n + 1e-9);
  EXPECT_LE(led.over_mj, kBudget_mj);
  EXPECT_LE(led.pull.energy().worst_mj, kBudget_mj);
}

INSTANTIATE_TEST_SUITE_P(Delays, GuideOverLine, ::testing::Values(0, 50, 150));

// A hand that resists feels no more than the bound, and the pull does not build up.
TEST(GuidanceSpring, AHandThatHoldsBackFeelsABoundedPull) {
  Led led(5.5);
  GuideSeen seen{true, 1, {80, 0, 0}};
  for (int i = 0; i < 5000; ++i) {
    if (i % 16 == 0) ++seen.state_seq;
    led.tick(seen);
  }
  EXPECT_NEAR(led.force_n.norm(), 30.0, 0.5);
  EXPECT_LE(led.most_n, 30.0 + 1e-9);
  EXPECT_NEAR(led.handle_mm.x(), 30.0 / 5.5, 0.3);
  // Half the share gives half the pull, and no share gives none.
  for (int i = 0; i < 1000; ++i) {
    if (i % 16 == 0) ++seen.state_seq;
    led.tick(seen, 0.5);
  }
  EXPECT_NEAR(led.force_n.norm(), 15.0, 0.5);
  for (int i = 0; i < 400; ++i) {
    if (i % 16 == 0) ++seen.state_seq;
    led.tick(seen, 0.0);
  }
  EXPECT_EQ(led.force_n.norm(), 0.0);
  EXPECT_LE(led.step_n, kSlew_n + 1e-9);
}

// A rig throws the handle about near a guide that stands still. The spring must give back no more than it got.
TEST(GuidanceSpring, AHandleThatIsThrownAboutGetsNothingForNothing) {
  Random random(5);
  GuidanceSpring pull;
  GuideSeen seen{true, 1, {0.5, 0.2, 0}};
  Vec3 x = Vec3::Zero(), v = Vec3::Zero(), force = Vec3::Zero();
  double given_mj = 0.0, paid_mj = 0.0, over_mj = -1e9, moved_mm = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    if (i % 16 == 0) ++seen.state_seq;
    const Vec3 a = random.in_cube(8000.0) - 40.0 * v - 4e3 * x;
    v += a * kT;
    x += v * kT;
    given_mj += force.dot(v * kT);
    moved_mm += (v * kT).norm();
    pull.see(seen);
    force =
        pull.step({.handle_mm = x, .guide_mm = pull.smoothed_mm(), .share = 1.0, .room_n = 60.0, .slew_n = kSlew_n});
    paid_mj += force.norm() * 60.0 * kT;
    over_mj = std::max(over_mj, given_mj - paid_mj);
  }
  EXPECT_GT(moved_mm, 500.0);
  EXPECT_LE(over_mj, kBudget_mj);
  EXPECT_LE(pull.energy().worst_mj, kBudget_mj);
}

// The same with contact that comes and goes at once beside the pull. The pull compensates that (slew.hpp) in any
// direction.
// The handle stays so near that the far end stands where the guide does. All work that the hand gets is then the
// spring's, whose store was empty.
TEST(GuidanceSpring, MakesUpForContactOutOfWhatTheHandHasPaid) {
  Random random(9);
  GuidanceSpring pull;
  GuideSeen seen{true, 1, Vec3::Zero()};
  GuideMoment moment{.share = 1.0, .room_n = 60.0, .slew_n = kSlew_n};
  const auto step = [&](int i) {
    if (i % 16 == 0) ++seen.state_seq;
    pull.see(seen);
    moment.guide_mm = pull.smoothed_mm();
    return pull.step(moment);
  };
  Vec3 force = Vec3::Zero(), v = Vec3::Zero();
  for (int i = 0; i < 1000; ++i) force = step(i);
  ASSERT_EQ(force.norm(), 0.0);
  double given_mj = 0.0, most_mj = 0.0, aside_n = 0.0, far_mm = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const Vec3 a = random.in_cube(5000.0) - 20.0 * v - 1e3 * moment.handle_mm;
    v += a * kT;
    moment.handle_mm += v * kT;
    given_mj += force.dot(v * kT);
    most_mj = std::max(most_mj, given_mj);
    far_mm = std::max(far_mm, moment.handle_mm.norm());
    moment.together_n = moment.rest_n + force;
    moment.together_slew_n = kSlew_n;
    if (i % 30 == 0) moment.rest_n = random.unit() < 0.5 ? Vec3(Vec3::Zero()) : random.in_cube(8.0);
    force = step(i);
    aside_n = std::max(aside_n, force.cross(moment.handle_mm.normalized()).norm());
  }
  ASSERT_GT(far_mm, 1.0);
  ASSERT_LT(far_mm, 5.0);
  EXPECT_GT(aside_n, 2.0) << "it compensates for contact";
  EXPECT_LE(most_mj, kBudget_mj);
  std::printf("  %.2f mm away, %.5f mJ given at most, %.2f mJ in the end; %.2f N aside\n", far_mm, most_mj, given_mj,
              aside_n);
}

// A lost device, a clutch, or a late loop: the force is zero at once, and the pull begins anew from the handle's
// position.
TEST(GuidanceSpring, BeginsAnewAfterASafetyZero) {
  Led led(0.02);
  GuideSeen seen{true, 1, {30, 0, 0}};
  for (int i = 0; i < 300; ++i) {
    if (i % 16 == 0) ++seen.state_seq;
    led.tick(seen);
  }
  ASSERT_GT(led.force_n.norm(), 1.0);
  EXPECT_EQ(led.pull
                .step({.handle_mm = led.handle_mm,
                       .guide_mm = led.smoothed_mm,
                       .share = 1.0,
                       .room_n = 60.0,
                       .slew_n = kSlew_n,
                       .safe = false})
                .norm(),
            0.0);
  led.force_n.setZero();
  led.step_n = 0.0;
  EXPECT_LT(led.tick(seen).norm(), 0.01);
  for (int i = 0; i < 300; ++i) {
    if (i % 16 == 0) ++seen.state_seq;
    led.tick(seen);
  }
  EXPECT_LE(led.step_n, kSlew_n + 1e-9);
}

// In the loop: a hand that works in the bone is guided aside while it is stopped, and is released again. With the
// contact, no step exceeds the slew limit, and no force exceeds the device's or the instructor's limit.
class LedAtTheBone : public ::testing::TestWithParam<std::tuple<int, bool>> {};
TEST_P(LedAtTheBone, PullAndContactTogetherStayWithinTheLimits) {
  const auto [delay_ms, weak] = GetParam();
  OverseenHand hand({.delay_ms = delay_ms, .weak = weak});
  hand.pedal = true;
  hand.run(400);
  BadLine line(delay_ms, 20.0, 0.3, 60.0);
  const double s = hand.loop().params().force_scale;
  std::int64_t led = 0;
  for (int i = 0; i < 14'000; ++i) {
    hand.command.target_mm = Vec3(4.0 * std::sin(1.5e-3 * i), 0, std::min(3.0, -3.0 + 6e-3 * i));
    Restrictions word;
    word.guide = AuthorId{2};
    word.guide_share = 800;
    if (i == 3000) hand.decide(word);
    word.stopped = true;
    if (i == 5000) hand.decide(word);
    word.force_limit = 1000;
    if (i == 7000) hand.decide(word);
    if (i == 9000) hand.undo(80);
    if (i == 11'000) hand.decide({});
    hand.guide = line.tick(Vec3(-5.0 + 3.0 * std::cos(2e-3 * i), 3.0, 2.5));
    const LoopReport now = hand.tick();
    led += (now.events & kHandGuided) != 0;
    ASSERT_LE(now.device.force_n.norm(), hand.loop().params().peak_n + 1e-9);
    if (i > 7200 + delay_ms && i < 11'000) {
      ASSERT_LE(now.device.force_n.norm(), 10.0 * s + 1e-9) << i;
    }
    if (i > 11'600 + delay_ms) {
      ASSERT_EQ(now.guidance.device_n.norm(), 0.0) << i;
    }
  }
  const osteon::test::Crossed& crossed = hand.crossed();
  std::printf("  %d ms, %s: step over slew %.3f, contact %.5f mJ, pull %.5f mJ, led %lld ms\n", delay_ms,
              weak ? "weak" : "strong", crossed.step_over_slew, crossed.worst_mj, crossed.led_mj,
              static_cast<long long>(led));
  EXPECT_GT(led, 6000);
  EXPECT_GT(crossed.cutting, 500);
  EXPECT_LE(crossed.step_over_slew, 1.0 + 1e-6);
  EXPECT_LE(crossed.worst_mj, kBudget_mj);
  EXPECT_LE(crossed.led_mj, kBudget_mj);
  EXPECT_EQ(crossed.allocations, 0);
}

// A hand is guided into bone that holds it, and a force limit is set. Both forces come down together.
TEST(LimitOfForce, LetsNeitherContactNorPullGoAtOnce) {
  OverseenHand hand({});
  Restrictions led;
  led.stopped = true;  // the bur rubs
  led.guide = AuthorId{2};
  led.guide_share = 1000;
  hand.decide(led);
  LoopReport now;
  const auto run = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      if (i % 16 == 0) ++hand.guide.state_seq;
      now = hand.tick();
    }
  };
  hand.command.target_mm = Vec3(0, 0, 1.0);
  hand.guide = {true, 1, Vec3(0, 0, 6.0)};
  run(4000);
  const Vec3 contact_n = now.coupling.device_n, pull_n = now.guidance.device_n;
  ASSERT_GT(pull_n.norm(), 5.0);
  ASSERT_GT(contact_n.norm(), pull_n.norm());
  ASSERT_LT(contact_n.dot(pull_n), 0.0);
  led.force_limit = 400;
  hand.decide(led);
  run(1);
  EXPECT_GT(now.guidance.device_n.norm(), pull_n.norm() - 2.0 * kSlew_n);
  EXPECT_GT(now.coupling.device_n.norm(), contact_n.norm() - 2.0 * kSlew_n);
  run(2000);
  EXPECT_LE((now.coupling.device_n.norm() + now.guidance.device_n.norm()) / hand.loop().params().force_scale,
            4.0 + 1e-9);
  EXPECT_LE(hand.crossed().step_over_slew, 1.0 + 1e-6);
  EXPECT_LE(hand.crossed().worst_mj, kBudget_mj);
}

// Another person's bur beside the own one pushes it aside, within the same limit for all forces together. A partner who
// guides the hand or has taken its tool pushes nothing, whatever program and tool they use.
TEST(PartnersTool, PushesTheHandUnlessItLeadsIt) {
  for (const bool weak : {false, true}) {
    OverseenHand hand({.weak = weak});
    const SolidLattice solid(*find_tool("burr-round-5"));
    const double s = hand.loop().params().force_scale;
    hand.pedal = true;
    double most_n = 0.0;
    for (int i = 0; i < 9000; ++i) {
      hand.command.target_mm = Vec3(4.0 * std::sin(1.5e-3 * i), 0, std::min(1.5, -3.0 + 6e-3 * i));
      // About two millimetres within it, to and fro. It jumps there, as states do.
      const Vec3 beside_mm(3.5 + 2.0 * std::sin(0.7e-3 * (i - i % 16)), 0, hand.command.target_mm.z());
      hand.partners = {{2, {beside_mm, Eigen::Quaterniond::Identity()}, 0.03, &solid}};
      Restrictions led;
      led.guide = AuthorId{2};
      led.guide_share = 300;
      if (i == 6000) hand.decide(led);
      if (i == 7500) hand.decide({.taken_by = AuthorId{77}});  // a console of the person whose hand is 2
      const LoopReport now = hand.tick();
      most_n = std::max(most_n, now.partners.device_n.norm());
      if (i > 6001) {
        ASSERT_EQ(now.partners.device_n.norm(), 0.0) << i;
      }
    }
    std::printf("  %s: %.2f N of the partner's tool, step over slew %.3f\n", weak ? "weak" : "strong", most_n,
                hand.crossed().step_over_slew);
    EXPECT_GT(most_n, 0.5 * s);
    EXPECT_LE(most_n, 6.0 * s + 1e-9);
    EXPECT_LE(hand.crossed().step_over_slew, 1.0 + 1e-6);
    EXPECT_LE(hand.crossed().worst_mj, kBudget_mj);
    EXPECT_EQ(hand.crossed().allocations, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Lines, LedAtTheBone, ::testing::Combine(::testing::Values(0, 50, 150), ::testing::Bool()));

}  // namespace
}  // namespace osteon::haptic::test
