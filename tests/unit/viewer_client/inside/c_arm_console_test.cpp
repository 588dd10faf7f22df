// The C-arm as it is operated: limits, pedals, and what is counted.
#include "viewer_client/inside/c_arm_console.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Came = CArmConsole::Came;
using Clock = CArmConsole::Clock;
using radiology::View;

constexpr double kQuarter_rad = 0.5 * std::numbers::pi;
const Box kBone{Vec3(-10, -20, 0), Vec3(10, 20, 80)};

class Console : public testing::Test {
 protected:
  Console() { console_.begin(kBone, {}); }
  // Shoots what is due within a time, in steps of a millisecond. Each picture comes after `late`.
  int run(std::chrono::milliseconds time, std::chrono::milliseconds late = 0ms) {
    int pictures = 0;
    for (const Clock::time_point end = now_ + time; now_ < end; now_ += 1ms) {
      if (const auto order = console_.due(now_)) {
        under_way_ = *order;
        arrives_ = now_ + late;
      }
      if (under_way_ && now_ >= arrives_) {
        pictures += console_.came(under_way_->id, false, shot_of(*under_way_)) == Came::shot;
        under_way_.reset();
      }
    }
    return pictures;
  }
  static CArmShot shot_of(const ShotOrder& order) {
    CArmShot shot;
    shot.mode = order.mode;
    shot.position = order.position;
    shot.exposure_s = exposure_of(order.mode);
    shot.dose_area_gy_cm2 = 0.002;
    shot.seed = order.seed;
    return shot;
  }

  CArmConsole console_{1000};
  Clock::time_point now_{1h}, arrives_;
  std::optional<ShotOrder> under_way_;
};

TEST_F(Console, TurnsAndMovesWithinItsLimits) {
  EXPECT_EQ(console_.position().isocentre_mm, Vec3(0, 0, 40));
  console_.set_orbit(5.0);
  console_.set_tilt(-5.0);
  console_.set_translation(2, 1e9);
  EXPECT_NEAR(console_.position().orbit_rad, std::numbers::pi, 1e-9);
  EXPECT_NEAR(console_.position().tilt_rad, -kQuarter_rad, 1e-9);
  EXPECT_EQ(console_.position().translation_mm, Vec3(0, 0, 200));
  console_.set_orbit(-0.4);
  const CArmPosition before = console_.position();
  console_.set_orbit(std::nan(""));
  console_.set_translation(0, std::nan(""));
  for (const double far : {std::nan(""), 1e300, std::numeric_limits<double>::infinity()})
    console_.set_isocentre(Vec3(far, 0, 0));
  EXPECT_EQ(console_.position(), before);
  EXPECT_TRUE(radiology::beam_of(c_arm_at(before)).has_value());
}

// The detector is in front of the patient, at the left, and at the head (LPS).
TEST_F(Console, ViewsLookAlongTheAxesOfThePatient) {
  console_.set_translation(0, 30.0);
  const auto detector = [&](View view) {
    console_.take_view(view);
    const auto beam = radiology::beam_of(c_arm_at(console_.position()));
    const radiology::PixelGrid& grid = beam->detector;
    return Vec3((grid.at(0.5 * (grid.columns - 1), 0.5 * (grid.rows - 1)) - Vec3(0, 0, 40)) / 400.0);
  };
  EXPECT_LT((detector(View::anteroposterior) - Vec3(0, -1, 0)).norm(), 1e-9) << "and the translation has ended";
  EXPECT_LT((detector(View::lateral) - Vec3(1, 0, 0)).norm(), 1e-9);
  EXPECT_LT((detector(View::axial) - Vec3(0, 0, 1)).norm(), 1e-9);
  console_.set_isocentre({1, 2, 3});
  EXPECT_EQ(console_.position().isocentre_mm, Vec3(1, 2, 3));
  console_.set_isocentre(console_.middle_of_bone());
  EXPECT_EQ(console_.position().isocentre_mm, Vec3(0, 0, 40));
}

TEST_F(Console, ShootsOnceForAPress) {
  EXPECT_EQ(run(1s), 0) << "no X-rays unless somebody asks";
  console_.press(ShotMode::single, now_);
  EXPECT_EQ(run(1s), 1);
  console_.press(ShotMode::live, now_);
  console_.release();
  EXPECT_FALSE(console_.idle()) << "it is due";
  EXPECT_EQ(run(1s), 1) << "a tap of a pedal";
  EXPECT_TRUE(console_.idle());
  ASSERT_EQ(console_.shots().size(), 2u);
  EXPECT_EQ(console_.shots()[0].number, 1u);
  EXPECT_EQ(console_.shots()[1].number, 2u);
  EXPECT_NE(console_.shots()[0].seed, console_.shots()[1].seed) << "new photons";
}

// Eight pulses a second, each of 20 ms; live, 15 pictures with the tube on all the time.
TEST_F(Console, ShootsAtTheRateOfThePedalWhileItIsHeld) {
  console_.press(ShotMode::pulse, now_);
  EXPECT_NEAR(run(10s), 80, 1);
  console_.release();
  EXPECT_EQ(run(1s), 0);
  EXPECT_NEAR(console_.totals().exposure_s, 80 * 0.02, 0.021);
  console_.begin(kBone, {});
  console_.press(ShotMode::live, now_);
  EXPECT_NEAR(run(10s), 150, 1);
  console_.release();
  EXPECT_NEAR(console_.totals().exposure_s, 10.0, 0.1);
  EXPECT_NEAR(console_.totals().dose_area_gy_cm2, 150 * 0.002, 0.0021);
}

TEST_F(Console, TappingAPedalIsNotFasterThanHoldingIt) {
  int pictures = 0;
  for (int tap = 0; tap < 1000; ++tap) {
    console_.press(ShotMode::pulse, now_);
    console_.release();
    pictures += run(10ms);
  }
  EXPECT_NEAR(pictures, 80, 1);
}

TEST_F(Console, AMachineThatIsLateShootsLessAndCatchesUpOnNothing) {
  console_.press(ShotMode::pulse, now_);
  EXPECT_NEAR(run(10s, 499ms), 20, 1);
  EXPECT_NEAR(run(10s), 80, 1);
}

// While the arm moves, the next coarse picture takes the place of the whole one.
TEST_F(Console, MovesOnAfterACoarsePicture) {
  console_.press(ShotMode::live, now_);
  const auto first = console_.due(now_);
  ASSERT_TRUE(first);
  now_ += 1s;
  EXPECT_FALSE(console_.due(now_)) << "one is on its way";
  EXPECT_EQ(console_.came(first->id, true, shot_of(*first)), Came::shot);
  EXPECT_FALSE(console_.due(now_)) << "the whole picture comes";
  EXPECT_EQ(console_.came(first->id, false, shot_of(*first)), Came::finer);
  const auto second = console_.due(now_);
  ASSERT_TRUE(second);
  EXPECT_EQ(console_.came(second->id, true, shot_of(*second)), Came::shot);
  console_.set_orbit(0.2);
  now_ += 1s;
  const auto third = console_.due(now_);
  ASSERT_TRUE(third) << "the arm is elsewhere";
  EXPECT_EQ(third->position.orbit_rad, 0.2);
  EXPECT_EQ(console_.came(second->id, false, shot_of(*second)), Came::dropped);
  EXPECT_EQ(console_.totals().shots, 2u);
}

TEST_F(Console, WhatWasDroppedDoesNotCount) {
  console_.press(ShotMode::live, now_);
  const auto order = console_.due(now_);
  ASSERT_TRUE(order);
  console_.stop();
  EXPECT_FALSE(console_.held());
  EXPECT_EQ(console_.came(order->id, false, shot_of(*order)), Came::dropped);
  EXPECT_EQ(console_.totals().shots, 0u);
  console_.press(ShotMode::single, now_);
  EXPECT_EQ(run(10ms), 1) << "it can go on";
}

TEST_F(Console, ASessionGoesOnWithItsShots) {
  console_.press(ShotMode::pulse, now_);
  run(1s);
  const std::vector<CArmShot> kept(console_.shots().begin(), console_.shots().end());
  CArmConsole other(5);
  other.begin(kBone, kept);
  EXPECT_EQ(other.totals().shots, kept.size());
  EXPECT_DOUBLE_EQ(other.totals().exposure_s, console_.totals().exposure_s);
  EXPECT_DOUBLE_EQ(other.totals().dose_area_gy_cm2, console_.totals().dose_area_gy_cm2);
  other.press(ShotMode::single, now_);
  const auto order = other.due(now_);
  ASSERT_TRUE(order);
  ASSERT_EQ(other.came(order->id, false, shot_of(*order)), Came::shot);
  EXPECT_EQ(other.shots().back().number, kept.back().number + 1);
}

}  // namespace
}  // namespace osteon
