// A game pad's controls against closed forms.
#include "viewer_client/pad/pad_control.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace osteon {
namespace {

using Eigen::Vector2d;

Vector2d along(double angle, double out) { return out * Vector2d(std::cos(angle), std::sin(angle)); }

PadState pulled(double right, double left = 0.0) {
  PadState state;
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

TEST(PadControl, TheRightTriggerPushesFrom1To40NewtonsInProportion) {
  PadControl control;
  EXPECT_FALSE(control.step({}).push);
  constexpr double kPulled = PadControl::kTriggerPulled;
  // The softest push is the first one.
  for (const double share : {1e-6, 0.1, 0.25, 0.5, 1.0}) {
    const PadOrder order = control.step(pulled(kPulled + share * (1.0 - kPulled)));
    EXPECT_TRUE(order.push);
    EXPECT_NEAR(order.push_n, 1.0 + 39.0 * share, 1e-9);
    EXPECT_EQ(order.push_begins, share == 1e-6);
  }
  // It stays the softest until the trigger counts as released.
  EXPECT_EQ(control.step(pulled(0.5 * (kPulled + PadControl::kTriggerRest))).push_n, 1.0);
  EXPECT_FALSE(control.step({}).push);
  EXPECT_EQ(control.step({}).push_n, 0.0);
}

TEST(PadControl, ATriggerThatTremblesAtItsEdgePushesOnce) {
  PadControl control;
  (void)control.step({});
  int begins = 0;
  for (const double at : {0.10, 0.11, 0.13, 0.11, 0.13, 0.09, 0.13}) begins += control.step(pulled(at)).push_begins;
  EXPECT_EQ(begins, 1);
  EXPECT_FALSE(control.step(pulled(0.07)).push);
  EXPECT_FALSE(control.step(pulled(0.11)).push);
}

TEST(PadControl, WhatIsHeldWhenThePadComesOrIsLetGoCountsFromItsNextPressOn) {
  PadState all = pulled(1.0, 1.0);
  all.a = all.b = true;
  PadControl control;
  const auto nothing = [](const PadOrder& order) {
    return !order.push && !order.spindle && !order.toggles_spindle && !order.undoes;
  };
  EXPECT_TRUE(nothing(control.step(all)));
  (void)control.step({});
  PadOrder order = control.step(all);
  EXPECT_TRUE(order.push_begins && order.toggles_spindle && order.undoes);
  EXPECT_EQ(order.spindle, true);
  // Let go, the push and the spindle end, and do not come back while the triggers are held.
  order = control.let_go();
  EXPECT_TRUE(order.used && !order.push);
  EXPECT_EQ(order.spindle, false);
  EXPECT_TRUE(nothing(control.step(all)));
  EXPECT_FALSE(control.let_go().spindle);
  (void)control.step({});
  EXPECT_TRUE(control.step(all).push_begins);
}

TEST(PadControl, ButtonsCountOnceForEachPress) {
  PadControl control;
  PadState a, b, left = pulled(0.0, 1.0);
  a.a = b.b = true;
  int toggles = 0, undoes = 0, on = 0, off = 0;
  for (const PadState& state : {PadState(), a, a, a, PadState(), a, PadState(), b, b, PadState(), left, left, a}) {
    const PadOrder order = control.step(state);
    toggles += order.toggles_spindle;
    undoes += order.undoes;
    on += order.spindle == true;
    off += order.spindle == false;
  }
  EXPECT_EQ(toggles, 3);
  EXPECT_EQ(undoes, 1);
  EXPECT_EQ(on, 1);
  EXPECT_EQ(off, 1);
}

TEST(PadControl, APadAtRestIsNotUsedAfterItsLastChange) {
  PadControl control;
  EXPECT_FALSE(control.step({}).used);
  PadState drift;
  drift.left = Vector2d(0.05, -0.05);  // within the dead zone
  EXPECT_FALSE(control.step(drift).used);
  PadState stick;
  stick.right = Vector2d(0, 1);
  const PadOrder order = control.step(stick);
  EXPECT_TRUE(order.used);
  EXPECT_EQ(order.turn, Vector2d(0, 1));
  EXPECT_EQ(order.slide, Vector2d::Zero());
  EXPECT_TRUE(control.step({}).used);  // the last change
  EXPECT_FALSE(control.step({}).used);
}

TEST(PadRumble, TheHeavyMotorIsTheRootOfTheShareOfTheBudget) {
  EXPECT_NEAR(rumble_of(7.5, 30.0, false).low, 0.5, 1e-12);
  EXPECT_EQ(rumble_of(30.0, 30.0, false), (PadRumble{1.0, 0.0}));
  EXPECT_EQ(rumble_of(300.0, 30.0, false), (PadRumble{1.0, 0.0}));
  // Only the ratio counts, and more force is more rumble.
  double before = 0.0;
  for (double force = 0.5; force <= 30.0; force += 0.5) {
    const PadRumble felt = rumble_of(force, 30.0, false);
    EXPECT_GT(felt.low, before);
    EXPECT_NEAR(felt.low, rumble_of(2.0 * force, 60.0, false).low, 1e-12);
    before = felt.low;
  }
}

TEST(PadRumble, TheLightMotorRunsOnlyWhileMaterialGoesAndForceIsThere) {
  EXPECT_NEAR(rumble_of(7.5, 30.0, true).high, 0.25, 1e-12);
  EXPECT_EQ(rumble_of(0.0, 30.0, true), PadRumble{});
  EXPECT_EQ(rumble_of(0.29, 30.0, true), PadRumble{});
  EXPECT_EQ(rumble_of(10.0, 0.0, true), PadRumble{});
  EXPECT_EQ(rumble_of(std::nan(""), 30.0, true), PadRumble{});
}

}  // namespace
}  // namespace osteon
