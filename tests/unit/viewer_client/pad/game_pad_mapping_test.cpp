// A game pad's controls against closed forms.
#include "viewer_client/pad/game_pad_mapping.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace osteon {
namespace {

using Eigen::Vector2d;

Vector2d along(double angle, double out) { return out * Vector2d(std::cos(angle), std::sin(angle)); }

GamePadState pulled(double right, double left = 0.0) {
  GamePadState state;
  state.right_trigger = right;
  state.left_trigger = left;
  return state;
}

TEST(PadStick, TheDeadZoneIsRoundAndTheResponseASquareFromItsEdge) {
  constexpr double kRest = 0.2;
  for (double angle = 0.0; angle < 6.28; angle += 0.1) {
    EXPECT_EQ(shaped_stick(along(angle, 0.199999), kRest), Vector2d::Zero());
    // u = (0.6 − 0.2) / (1 − 0.2) = 1/2, and 1/2² is a quarter, in the stick's own direction.
    EXPECT_NEAR((shaped_stick(along(angle, 0.6), kRest) - along(angle, 0.25)).norm(), 0.0, 1e-12);
    EXPECT_NEAR((shaped_stick(along(angle, 1.0), kRest) - along(angle, 1.0)).norm(), 0.0, 1e-12);
  }
  // A stick that reaches its corners is not faster there.
  EXPECT_NEAR((shaped_stick(Vector2d(-1, 1), kRest) - Vector2d(-1, 1).normalized()).norm(), 0.0, 1e-12);
}

TEST(PadStick, ItBeginsWithoutAStepAndWithoutACorner) {
  constexpr double kRest = 0.2;
  for (const double beyond : {1e-2, 1e-3, 1e-4}) {
    const double slope = shaped_stick(Vector2d(kRest + beyond, 0), kRest).x() / beyond;
    EXPECT_NEAR(slope, beyond / (0.8 * 0.8), 1e-9);  // goes to zero with the way
  }
}

TEST(GamePadMapping, TheRightTriggerPushesFrom1To40NewtonsInProportion) {
  GamePadMapping control;
  EXPECT_FALSE(control.step({}).push);
  constexpr double kPulled = GamePadMapping::kTriggerPulled;
  // The softest push is the first one.
  for (const double share : {1e-6, 0.1, 0.25, 0.5, 1.0}) {
    const GamePadCommand command = control.step(pulled(kPulled + share * (1.0 - kPulled)));
    EXPECT_TRUE(command.push);
    EXPECT_NEAR(command.push_n, 1.0 + 39.0 * share, 1e-9);
    EXPECT_EQ(command.push_begins, share == 1e-6);
  }
  // It stays the softest until the trigger counts as released.
  EXPECT_EQ(control.step(pulled(0.5 * (kPulled + GamePadMapping::kTriggerRest))).push_n, 1.0);
  EXPECT_FALSE(control.step({}).push);
  EXPECT_EQ(control.step({}).push_n, 0.0);
}

TEST(GamePadMapping, ATriggerThatTremblesAtItsEdgePushesOnce) {
  GamePadMapping control;
  (void)control.step({});
  int begins = 0;
  for (const double at : {0.10, 0.11, 0.13, 0.11, 0.13, 0.09, 0.13}) begins += control.step(pulled(at)).push_begins;
  EXPECT_EQ(begins, 1);
  EXPECT_FALSE(control.step(pulled(0.07)).push);
  EXPECT_FALSE(control.step(pulled(0.11)).push);
}

TEST(GamePadMapping, WhatIsHeldWhenThePadComesOrIsLetGoCountsFromItsNextPressOn) {
  GamePadState all = pulled(1.0, 1.0);
  all.a = all.b = true;
  GamePadMapping control;
  const auto nothing = [](const GamePadCommand& command) {
    return !command.push && !command.spindle && !command.toggles_spindle && !command.undoes;
  };
  EXPECT_TRUE(nothing(control.step(all)));
  (void)control.step({});
  GamePadCommand command = control.step(all);
  EXPECT_TRUE(command.push_begins && command.toggles_spindle && command.undoes);
  EXPECT_EQ(command.spindle, true);
  // Let go, the push and the spindle end, and do not come back while the triggers are held.
  command = control.release_all();
  EXPECT_TRUE(command.used && !command.push);
  EXPECT_EQ(command.spindle, false);
  EXPECT_TRUE(nothing(control.step(all)));
  EXPECT_FALSE(control.release_all().spindle);
  (void)control.step({});
  EXPECT_TRUE(control.step(all).push_begins);
}

TEST(GamePadMapping, ButtonsCountOnceForEachPress) {
  GamePadMapping control;
  GamePadState a, b, left = pulled(0.0, 1.0);
  a.a = b.b = true;
  int toggles = 0, undoes = 0, on = 0, off = 0;
  for (const GamePadState& state :
       {GamePadState(), a, a, a, GamePadState(), a, GamePadState(), b, b, GamePadState(), left, left, a}) {
    const GamePadCommand command = control.step(state);
    toggles += command.toggles_spindle;
    undoes += command.undoes;
    on += command.spindle == true;
    off += command.spindle == false;
  }
  EXPECT_EQ(toggles, 3);
  EXPECT_EQ(undoes, 1);
  EXPECT_EQ(on, 1);
  EXPECT_EQ(off, 1);
}

TEST(GamePadMapping, APadAtRestIsNotUsedAfterItsLastChange) {
  GamePadMapping control;
  EXPECT_FALSE(control.step({}).used);
  GamePadState drift;
  drift.left = Vector2d(0.05, -0.05);  // within the dead zone
  EXPECT_FALSE(control.step(drift).used);
  GamePadState stick;
  stick.right = Vector2d(0, 1);
  const GamePadCommand command = control.step(stick);
  EXPECT_TRUE(command.used);
  EXPECT_EQ(command.turn, Vector2d(0, 1));
  EXPECT_EQ(command.slide, Vector2d::Zero());
  EXPECT_TRUE(control.step({}).used);  // the last change
  EXPECT_FALSE(control.step({}).used);
}

TEST(GamePadRumble, TheHeavyMotorIsTheRootOfTheShareOfTheBudget) {
  EXPECT_NEAR(rumble_of(7.5, 30.0, false).low, 0.5, 1e-12);
  EXPECT_EQ(rumble_of(30.0, 30.0, false), (GamePadRumble{1.0, 0.0}));
  EXPECT_EQ(rumble_of(300.0, 30.0, false), (GamePadRumble{1.0, 0.0}));
  // Only the ratio counts, and more force is more rumble.
  double before = 0.0;
  for (double force = 0.5; force <= 30.0; force += 0.5) {
    const GamePadRumble felt = rumble_of(force, 30.0, false);
    EXPECT_GT(felt.low, before);
    EXPECT_NEAR(felt.low, rumble_of(2.0 * force, 60.0, false).low, 1e-12);
    before = felt.low;
  }
}

TEST(GamePadRumble, TheLightMotorRunsOnlyWhileMaterialGoesAndForceIsThere) {
  EXPECT_NEAR(rumble_of(7.5, 30.0, true).high, 0.25, 1e-12);
  EXPECT_EQ(rumble_of(0.0, 30.0, true), GamePadRumble{});
  EXPECT_EQ(rumble_of(0.29, 30.0, true), GamePadRumble{});
  EXPECT_EQ(rumble_of(10.0, 0.0, true), GamePadRumble{});
  EXPECT_EQ(rumble_of(std::nan(""), 30.0, true), GamePadRumble{});
}

}  // namespace
}  // namespace osteon
