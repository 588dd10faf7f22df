// Tests the coupling's rules, each by its own arithmetic: energy ledger, slack, offset, smoothing, and the motor's
// port.
#include "haptic_client/rendering/coupling.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptic_client/rendering/motor_port.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::haptic::test {
namespace {

using osteon::test::Random;

constexpr double kT = 1e-3;

constexpr double kArm_mm = 20.0;  // of a turn

// A sampled wall with spring and damper, whose force is held for a tick. Returns the energy that it gives to a handle
// that is thrown about at random with no more than `most_mm_per_s2`. Most of one contact, mJ. `turned`: the same about
// an axis, at the arm of a turn.
struct Wall {
  double worst_mj = -1e9;
  int contacts = 0;
};
Wall bounce(double stiffness_n_per_mm, double damping_share, double most_mm_per_s2, bool monitored,
            bool turned = false) {
  const auto wrench = [turned](double n) {
    const Vec3 of(n, 0, 0);
    return turned ? Wrench{.torque_nmm = kArm_mm * of} : Wrench{.force_n = of};
  };
  Random random(7);
  EnergyLedger ledger;
  double x = -0.05, v = 0.0, e_before = 0.0, force = 0.0, given = 0.0;
  Wall wall;
  bool inside = false;
  for (int i = 0; i < 400'000; ++i) {
    // A soft pull keeps it near the wall. Otherwise it is random.
    const double a =
        std::clamp(most_mm_per_s2 * random.between(-1.0, 1.0) - 40.0 * v - 4e4 * x, -most_mm_per_s2, most_mm_per_s2);
    v += a * kT;
    x += v * kT;
    given += -force * v * kT;  // force is outward, -x
    const Vec3 way_mm(v * kT, 0, 0), nothing = Vec3::Zero();
    ledger.observe(turned ? nothing : way_mm, turned ? Vec3(way_mm / kArm_mm) : nothing);
    const double e = std::max(0.0, x);
    const bool touching = e > 0.0;
    const double spring = stiffness_n_per_mm * e;
    const double damping = std::clamp(damping_share * stiffness_n_per_mm * (e - e_before), -spring, spring);
    ledger.settle(0.0, 0.5 * stiffness_n_per_mm * e * e);
    const Wrench shown = ledger.limited(wrench(-(spring + damping)), wrench(-damping), touching);
    force = monitored  ? -(turned ? shown.torque_nmm.x() / kArm_mm : shown.force_n.x())
            : touching ? spring + damping
                       : 0.0;
    e_before = e;
    if (inside && !touching) {
      wall.worst_mj = std::max(wall.worst_mj, given);
      ++wall.contacts;
      given = 0.0;
    }
    inside = touching;
  }
  return wall;
}

// If a hand accelerates no faster than assumed, no contact gives more than the allowance.
TEST(EnergyLedger, NoContactGivesMoreThanItsAllowance) {
  const EnergyParams params;
  for (const double stiffness : {5.0, 50.0})
    for (const double damping : {0.0, 1.0}) {
      const Wall wall = bounce(stiffness, damping, params.surprise_mm_per_s2, true);
      EXPECT_GT(wall.contacts, 1000);
      EXPECT_LE(wall.worst_mj, params.allowance_mj + 1e-12) << stiffness << ' ' << damping;
      // A turn is accounted for as the move at its arm.
      EXPECT_NEAR(bounce(stiffness, damping, params.surprise_mm_per_s2, true, true).worst_mj, wall.worst_mj, 1e-6);
    }
  // The same without the monitor: a sampled spring gives energy away.
  EXPECT_GT(bounce(50.0, 0.0, params.surprise_mm_per_s2, false).worst_mj, 0.01);
}

// Nobody has put anything in. Force and torque together may give the allowance over the way and the turn that a handle
// at rest can make in a tick: 0.01 mm each, for the turn at its arm. Both are scaled down by one share.
TEST(EnergyLedger, ForceAndTorqueAreHeldBackTogether) {
  EnergyLedger ledger(EnergyParams{.allowance_mj = 0.006, .surprise_mm_per_s2 = 1e4, .calm_mm_per_s2 = 1e4});
  ledger.observe(Vec3::Zero());
  ledger.settle(0.0, 0.0);
  const Wrench wanted{{0.0, 3.0, 4.0}, {0.0, 0.0, 140.0}};  // 5 N, and 7 N at the arm
  const Wrench shown = ledger.limited(wanted, {}, true);
  const double share = 0.006 / (0.01 * (5.0 + 7.0));
  EXPECT_NEAR((shown.force_n - share * wanted.force_n).norm(), 0.0, 1e-12);
  EXPECT_NEAR((shown.torque_nmm - share * wanted.torque_nmm).norm(), 0.0, 1e-12);
  EXPECT_TRUE(ledger.report().held_back);
  // The hand yields to both as far as was foreseen. That uses the allowance, and no more is shown.
  ledger.observe(0.01 * wanted.force_n.normalized(), 0.01 / kArm_mm * Vec3::UnitZ());
  EXPECT_NEAR(ledger.report().episode_mj, 0.006, 1e-12);
  ledger.settle(0.0, 0.0);
  EXPECT_NEAR(ledger.limited(wanted, {}, true).torque_nmm.norm(), 0.0, 1e-9);
}

// Pressing in and out at constant speed costs the hand what a damper of k·T costs, twice k·T·v·way, and a tick's
// worth.
TEST(EnergyLedger, CountsWhatTheDamperTook) {
  const double k = 50.0, d = 0.01;
  const int n = 50;
  EnergyLedger ledger(EnergyParams{.surprise_mm_per_s2 = 0.0});  // so even a motion is not limited
  double e_before = 0.0, given_mj = 0.0, moved = d;
  for (int i = 1; i <= 2 * n; ++i) {
    moved = i <= n ? d : -d;
    const double e = d * (i <= n ? i : 2 * n - i);
    ledger.observe({moved, 0, 0});
    const double spring = k * e, damping = std::clamp(k * (e - e_before), -spring, spring);
    ledger.settle(0.0, 0.5 * k * e * e);
    static_cast<void>(ledger.limited({{-(spring + damping), 0, 0}}, {{-damping, 0, 0}}, e > 0.0));
    e_before = e;
  }
  given_mj = ledger.report().ended_mj;
  ASSERT_TRUE(ledger.report().ended);
  // Inwards: force of tick i over the way of tick i + 1. The sum over in and out of k·(e ± d)·d was computed by
  // hand.
  double expected = 0.0;
  for (int i = 1; i < n; ++i) expected -= k * d * (i + 1) * d;  // in, i = 1 … n-1
  expected += k * d * (n + 1) * d;                              // turning: the damper still pushes
  for (int i = n + 1; i < 2 * n; ++i) expected += k * d * (2 * n - i - 1) * d;
  EXPECT_NEAR(given_mj, expected, 1e-9);
  EXPECT_LT(given_mj, 0.0);
}

// Feed follows force: the hand goes on steadily, and the tool follows under 20 N. What the hand pays goes into cutting,
// to the last microjoule. What it paid before is in the spring, and is lost when that is let go.
TEST(EnergyLedger, CuttingIsPaidByTheHand) {
  const double k = 50.0, feed = 0.002;
  EnergyLedger ledger(EnergyParams{.surprise_mm_per_s2 = 0.0});
  double e = 0.0, at_rest = 0.0;
  for (int i = 0; i < 600; ++i) {
    const bool pressing = i < 200;  // first the spring alone is stretched, to 20 N
    ledger.observe({feed, 0, 0});
    if (pressing) e += feed;
    ledger.settle(pressing ? 0.0 : k * e * feed, 0.5 * k * e * e);
    static_cast<void>(ledger.limited({{-k * e, 0, 0}}, {}, true));
    if (i == 200) at_rest = ledger.report().episode_mj;
  }
  EXPECT_NEAR(ledger.report().episode_mj, at_rest, 1e-9);
  EXPECT_NEAR(at_rest, -0.5 * k * e * e, k * e * feed);
  EXPECT_EQ(ledger.report().tank_mj, 0.0);  // nothing was damped
}

// A hand presses in by d per tick. A damper of k·T takes k·d² per tick, and sampling gives half of it back. So after
// n ticks the tank holds k·d²·(n/2 − 1): the first tick has no force yet, and half a tick of the spring is not
// paid yet. What the spring loses in another way is lost: the tank takes it neither at once nor by later damping.
TEST(EnergyLedger, TheTankHoldsWhatDampingTookAndNoMore) {
  const double k = 50.0, d = 0.01, share_mj = k * d * d;
  EnergyLedger ledger(EnergyParams{.surprise_mm_per_s2 = 0.0});
  double e = 0.0;
  const auto press = [&](double moved, double stretched, double damping_n) {
    ledger.observe({moved, 0, 0});
    e += stretched;
    ledger.settle(0.0, 0.5 * k * e * e);
    static_cast<void>(ledger.limited({{-(k * e + damping_n), 0, 0}}, {{-damping_n, 0, 0}}, true));
  };
  for (int i = 0; i < 50; ++i) press(d, d, k * d);
  EXPECT_NEAR(ledger.report().tank_mj, share_mj * (50 / 2 - 1), 1e-9);
  // The spring is let go from 0.5 mm to 0.2 mm while the hand stands still.
  const double before_mj = ledger.report().tank_mj;
  press(0.0, -0.3, 0.0);
  EXPECT_NEAR(ledger.report().tank_mj, before_mj, 1e-9);
  for (int i = 0; i < 20; ++i) press(d, d, k * d);
  EXPECT_NEAR(ledger.report().tank_mj, before_mj + share_mj * (20 / 2 - 1), 1e-9);
  // The hand goes on, and the spring slips at the same force: nothing is damped. The first of these ticks still has the
  // damping of the tick before.
  press(d, 0.0, 0.0);
  const double slipping_mj = ledger.report().tank_mj;
  for (int i = 0; i < 10; ++i) press(d, 0.0, 0.0);
  EXPECT_NEAR(ledger.report().tank_mj, slipping_mj, 1e-9);
  // It gives what it holds, once.
  const double stored_mj = ledger.report().stored_mj;
  EXPECT_NEAR(ledger.draw(1.0), slipping_mj, 1e-12);
  EXPECT_NEAR(ledger.report().stored_mj, stored_mj + slipping_mj, 1e-12);
  EXPECT_EQ(ledger.draw(1.0), 0.0);
}

class CouplingAtWall : public ::testing::Test {
 protected:
  CouplingAtWall() {
    moment_.stiffness_n_per_mm = 50.0;
    moment_.limit_n = 60.0;
    moment_.touching = true;
    step_.contact = true;
  }
  CouplingForce to(const Vec3& handle_mm, const Vec3& proxy_mm) {
    moment_.proxy_before_mm = moment_.proxy_mm;
    moment_.handle_mm = handle_mm;
    moment_.proxy_mm = proxy_mm;
    ledger_.observe(handle_mm - handle_mm_);
    handle_mm_ = handle_mm;
    const CouplingForce force = coupling_.step(moment_, step_, ledger_, kT, 2e-3);
    static_cast<void>(
        ledger_.limited({force.spring_n + force.damping_n, force.turn_spring_nmm + force.turn_damping_nmm},
                        {force.damping_n, force.turn_damping_nmm}, moment_.touching));
    return force;
  }
  Coupling coupling_;
  EnergyLedger ledger_;
  CouplingMoment moment_;
  ProxyStep step_;
  Vec3 handle_mm_ = Vec3::Zero();
};

// Beyond f_max / k the handle slips. In free air the slip is reduced by a tenth of the way.
TEST_F(CouplingAtWall, SlackTakesWhatTheDeviceCannotShow) {
  for (int i = 1; i <= 200; ++i) to({0, 0, 0.01 * i}, Vec3::Zero());
  const CouplingForce force = to({0, 0, 2.0}, Vec3::Zero());
  EXPECT_NEAR(force.spring_n.z(), -60.0, 1e-9);
  EXPECT_NEAR(coupling_.offset_mm().z(), -(2.0 - 60.0 / 50.0), 1e-9);
  // On the way back the force falls at once: the slip beyond the limit is forgotten.
  EXPECT_NEAR(to({0, 0, 1.9}, Vec3::Zero()).spring_n.z(), -55.0, 1e-9);

  moment_.touching = false;
  const double before = coupling_.offset_mm().norm();
  double way = 0.0;
  Vec3 handle(0, 0, 1.9);
  for (int i = 0; i < 30; ++i) {
    handle += Vec3(0.05, 0, -0.1);
    way += Vec3(0.05, 0, -0.1).norm();
    to(handle, handle + coupling_.offset_mm());
  }
  EXPECT_NEAR(coupling_.offset_mm().norm(), before - 0.1 * way, 1e-9);
  for (int i = 0; i < 300; ++i) to(handle += Vec3(0.1, 0, 0), handle + coupling_.offset_mm());
  EXPECT_EQ(coupling_.offset_mm().norm(), 0.0);
}

TEST_F(CouplingAtWall, BreakthroughLetsTheWholeStretchGoOnce) {
  for (int i = 1; i <= 50; ++i) to({0, 0, 0.01 * i}, Vec3::Zero());
  step_.breakthrough = true;
  const CouplingForce force = to({0, 0, 0.5}, Vec3::Zero());
  EXPECT_TRUE(force.breakthrough);
  EXPECT_EQ(force.spring_n.norm(), 0.0);
  EXPECT_NEAR(coupling_.offset_mm().z(), -0.5, 1e-12);
  // A hundredth of that is not a breakthrough.
  step_.breakthrough = false;
  coupling_.reset(Vec3::Zero(), Vec3::Zero());
  to({0, 0, 0.005}, Vec3::Zero());
  step_.breakthrough = true;
  EXPECT_FALSE(to({0, 0, 0.005}, Vec3::Zero()).breakthrough);
}

// Bone comes back and pushes the proxy out by 0.3 mm under a handle that stands still. The hand feels nothing of it,
// and the stored energy does not rise.
TEST_F(CouplingAtWall, ReturnedBoneStoresNothing) {
  CouplingForce force;
  for (int i = 1; i <= 20; ++i) force = to({0, 0, 0.01 * i}, Vec3::Zero());
  const double before_mj = ledger_.report().stored_mj, before_n = force.spring_n.norm();
  const double tank_mj = ledger_.report().tank_mj;
  force = to({0, 0, 0.2}, {0, 0, -0.3});
  EXPECT_TRUE(force.returned);
  EXPECT_NEAR(force.spring_n.norm(), before_n, 1e-9);
  EXPECT_LE(ledger_.report().stored_mj, before_mj + 1e-12);
  EXPECT_NEAR(coupling_.offset_mm().z(), -0.3, 1e-9);
  // It presses again only as fast as damping pays. Small motions of the hand get no more than the hand's work and the
  // tank's energy.
  double handle = 0.2, paid_mj = tank_mj;
  for (int i = 0; i < 200; ++i) {
    const double next = 0.2 + 0.02 * std::sin(0.2 * i);
    const double moved = next - handle;
    const double offset = coupling_.offset_mm().norm();
    to({0, 0, next}, {0, 0, -0.3});
    paid_mj += 2.0 * 50.0 * moved * moved;  // most that a damper of k · 2 ms can take of this motion
    const double released = offset - coupling_.offset_mm().norm();
    EXPECT_GE(released, -1e-12);
    if (released > 0.0) {
      paid_mj -= ledger_.report().stored_mj -
                 0.5 * 50.0 * std::pow(std::sqrt(2.0 * ledger_.report().stored_mj / 50.0) - released, 2);
    }
    EXPECT_GE(paid_mj, -1e-6) << i;
    handle = next;
  }
  EXPECT_LT(coupling_.offset_mm().norm(), 0.3);
  EXPECT_GT(coupling_.offset_mm().norm(), 0.0);
}

// The frame of the bone turns by a quarter about x, so what pointed along -z now points along y. Both parts of the
// offset are the hand's and are the same vectors in the new axes: what bone pushed out, and what the device cannot
// show.
TEST_F(CouplingAtWall, TheOffsetIsGivenInTheNewAxesWhenTheBoneTurns) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(std::numbers::pi / 2.0, Vec3::UnitX()));
  for (int i = 1; i <= 20; ++i) to({0, 0, 0.01 * i}, Vec3::Zero());
  ASSERT_TRUE(to({0, 0, 0.2}, {0, 0, -0.3}).returned);
  coupling_.turn(quarter);
  EXPECT_NEAR((coupling_.offset_mm() - Vec3(0, 0.3, 0)).norm(), 0.0, 1e-9);

  coupling_.reset(Vec3::Zero(), Vec3::Zero());
  ledger_.reset();
  moment_.proxy_mm.setZero();
  handle_mm_.setZero();
  for (int i = 1; i <= 200; ++i) to({0, 0, 0.01 * i}, Vec3::Zero());
  coupling_.turn(quarter);
  EXPECT_NEAR((coupling_.offset_mm() - Vec3(0, 2.0 - 60.0 / 50.0, 0)).norm(), 0.0, 1e-9);
}

// The end of a shank 80 mm from the tip meets a wall while the hand turns and does not move. With both springs in
// series, the move bears 1/17 of the way that the end is kept from, and the turn's arm 4/17.
// If torque is shown, the turn pays for both. If it is not, nothing that nobody paid for may be stored.
TEST_F(CouplingAtWall, ATurnPaysForTheMoveItCauses) {
  for (const bool six_axes : {true, false}) {
    coupling_.reset(Vec3::Zero(), Vec3::Zero());
    ledger_.reset();
    moment_.stiffness_nmm_per_rad = six_axes ? 50.0 * kArm_mm * kArm_mm : 0.0;
    moment_.limit_nmm = six_axes ? 1e4 : 0.0;
    moment_.proxy_mm.setZero();
    moment_.turn_rad.setZero();
    const double step_rad = 1e-4;
    bool returned = false;
    CouplingForce force;
    for (int i = 1; i <= 400; ++i) {
      const double kept_mm = 80.0 * step_rad * i;
      moment_.turn_before_rad = moment_.turn_rad + Vec3(0, step_rad, 0);
      moment_.turn_rad = {0, 4.0 / 17.0 * kept_mm / kArm_mm, 0};
      force = to(Vec3::Zero(), {kept_mm / 17.0, 0, 0});
      returned |= force.returned;
      const double expected_n = six_axes ? 50.0 * kept_mm / 17.0 : 0.0;
      EXPECT_NEAR(force.spring_n.x(), expected_n, 1e-9) << i;
      EXPECT_NEAR(force.turn_spring_nmm.y(), -80.0 * expected_n, 1e-6) << i;
      EXPECT_NEAR(ledger_.report().stored_mj, 0.5 * expected_n * kept_mm, 1e-9) << i;
    }
    EXPECT_EQ(returned, !six_axes);
    // The turn is also damped with k·2 ms of its rotation in this tick.
    const double damping_nmm = six_axes ? 2.0 * 50.0 * kArm_mm * kArm_mm * step_rad * 16.0 / 17.0 : 0.0;
    EXPECT_NEAR(force.turn_damping_nmm.y(), -damping_nmm, 1e-9);
  }
}

// A torque at its limit stores its work, the limit times the further turn. Turning back gets no more.
TEST_F(CouplingAtWall, ATurnStoresNoMoreThanIsShown) {
  moment_.stiffness_nmm_per_rad = 20'000.0;
  moment_.limit_nmm = 600.0;
  double work_mj = 0.0;
  constexpr int kTicks = 2000;
  for (int i = 1; i <= kTicks; ++i) {
    moment_.turn_before_rad = moment_.turn_rad = {0, 0.1 * i / kTicks, 0};
    const CouplingForce force = to(Vec3::Zero(), Vec3::Zero());
    EXPECT_NEAR(force.turn_spring_nmm.y(), -std::min(600.0, 20'000.0 * 0.1 * i / kTicks), 1e-9);
    EXPECT_LE(force.turn_damping_nmm.norm(), force.turn_spring_nmm.norm() + 1e-9);
    work_mj -= force.turn_spring_nmm.y() * 0.1 / kTicks;
  }
  // 0.03 rad to the limit, 0.07 at it.
  EXPECT_NEAR(ledger_.report().stored_mj, 0.5 * 600.0 * 0.03 + 600.0 * 0.07, 1e-9);
  EXPECT_NEAR(work_mj, ledger_.report().stored_mj, 0.05);
}

// (7.15): a step of the cutting force comes through as 1 - exp(-t / 2 ms). A force that is not from cutting comes at
// once.
TEST_F(CouplingAtWall, OnlyTheCuttingForceIsSmoothed) {
  for (int i = 1; i < 80; ++i) to({0, 0, 0.005 * i}, Vec3::Zero());  // pressed by a hand, which pays for the spring
  step_.cutting = true;
  step_.cutting_force_n = {0, 0, 10};
  to({0, 0, 0.4}, Vec3::Zero());
  to({0, 0, 0.4}, Vec3::Zero());
  step_.cutting_force_n = {0, 0, 20};
  for (int i = 1; i <= 10; ++i) {
    const CouplingForce force = to({0, 0, 0.4}, Vec3::Zero());
    EXPECT_NEAR(force.spring_n.z(), -20.0, 1e-9);
    EXPECT_NEAR(force.spring_n.z() + force.cutting_lag_n.z(), -20.0 + 10.0 * std::exp(-i * kT / 2e-3), 1e-9) << i;
  }
  step_.cutting = false;
  step_.cutting_force_n.setZero();
  EXPECT_EQ(to({0, 0, 0.4}, Vec3::Zero()).cutting_lag_n.norm(), 0.0);
}

MotorMoment turning(double rpm, const Vec3& normal_n) {
  MotorMoment moment;
  moment.pedal = true;
  moment.spindle_rpm = rpm;
  moment.teeth = 2;
  moment.normal_n = normal_n;
  moment.cutting = true;
  moment.across_n = 0.5 * normal_n.norm();  // milling's K_r
  return moment;
}

// Bone is at +x of a tool that points along +z and turns clockwise for its holder. Its flank moves towards +y there,
// and the bone holds it back.
TEST(MotorPort, DragsAgainstTheFlank) {
  MotorPort port;
  MotorMoment moment = turning(30000, {-10, 0, 0});
  Vec3 force;
  for (int i = 0; i < 500; ++i) force = port.step(moment, kT);
  EXPECT_NEAR(force.y(), -MotorPortParams{}.drag * 0.3 * 10.0, 1e-3);
  EXPECT_NEAR(force.x(), 0.0, 1e-9);  // vibration of teeth at 1 kHz is for the ear
  EXPECT_NEAR(force.z(), 0.0, 1e-9);
  // A rubbing tool drags by friction, and a cutting tool as its law says. The edges all round a reamer do not drag.
  moment.cutting = false;
  moment.across_n = 0.0;
  EXPECT_NEAR(port.step(moment, kT).y(), -MotorPortParams{}.drag * 0.3 * 10.0, 1e-3);
  moment.cutting = true;
  moment.across_n = 1.2;
  EXPECT_NEAR(port.step(moment, kT).y(), -1.2, 1e-3);
  moment.across_n = 0.0;
  EXPECT_NEAR(port.step(moment, kT).norm(), 0.0, 1e-3);
  moment.across_n = 5.0;
  moment.normal_n = {0, 0, -10};  // at the pole nothing slides sideways
  for (int i = 0; i < 500; ++i) force = port.step(moment, kT);
  EXPECT_NEAR(force.norm(), 0.0, 1e-9);
}

// Teeth that move to and fro 100 times a second pull along their stroke, at most with the law's force. There is no
// mean, and no force sideways or out of the bone. At 12 000 strokes a minute the pull lasts as long as the loop can
// show it. Beyond 300 strokes a second there is none.
TEST(MotorPort, ASawPullsToAndFroAlongItsStroke) {
  for (const auto& [strokes, amplitude_n] : {std::pair{6000.0, 1.5}, {12'000.0, 1.5}, {24'000.0, 0.0}}) {
    MotorPort port;
    MotorMoment moment = turning(strokes, {0, 0, -10});
    moment.teeth = 14;
    moment.stroke = Vec3::UnitX();
    moment.across_n = 1.5;
    Vec3 sum = Vec3::Zero(), square = Vec3::Zero();
    double most = 0.0;
    constexpr int kTicks = 10'000, kSettled = 1000;
    for (int i = 0; i < kSettled; ++i) static_cast<void>(port.step(moment, kT));
    for (int i = 0; i < kTicks; ++i) {
      const Vec3 force = port.step(moment, kT);
      sum += force;
      square += force.cwiseAbs2();
      most = std::max(most, std::abs(force.x()));
    }
    EXPECT_NEAR(sum.norm() / kTicks, 0.0, 1e-3) << strokes;
    EXPECT_NEAR(std::sqrt(square.x() / kTicks), amplitude_n / std::numbers::sqrt2, 0.01) << strokes;
    EXPECT_LE(most, amplitude_n + 1e-3) << strokes;
    EXPECT_NEAR(square.y() + square.z(), 0.0, 1e-12) << strokes;
  }
}

TEST(MotorPort, StaysWithinFrictionAndEndsWithThePedal) {
  MotorPort port;
  Random random(3);
  double most = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 normal = random.between(0.0, 40.0) * random.direction();
    MotorMoment moment = turning(random.between(0.0, 20000.0), normal);
    moment.cutting = i % 3 > 0;
    moment.across_n = random.between(0.0, 100.0);
    if (i % 2 > 0) moment.stroke = random.direction();
    const Vec3 force = port.step(moment, kT);
    EXPECT_LE(force.norm(), 0.3 * normal.norm() + 1e-12);
    most = std::max(most, force.norm());
  }
  EXPECT_GT(most, 5.0);
  MotorMoment moment = turning(3000, {-20, 0, 0});
  for (int i = 0; i < 100; ++i) static_cast<void>(port.step(moment, kT));
  EXPECT_GT(port.step(moment, kT).norm(), 1.0);
  moment.pedal = false;  // the spindle still runs down
  Vec3 force;
  for (int i = 0; i < 10; ++i) force = port.step(moment, kT);
  EXPECT_NEAR(force.norm(), 0.0, 1e-12);
}

// 1000 rpm and two lips bite 33 times a second. The force's mean over many turns is the drag alone.
TEST(MotorPort, VibrationHasNoMean) {
  MotorPort port;
  MotorMoment moment = turning(1000, {0, 0, -20});
  double sum = 0.0, square = 0.0;
  constexpr int kTicks = 30'000;
  for (int i = 0; i < kTicks; ++i) {
    const Vec3 force = port.step(moment, kT);
    sum += force.z();
    square += force.z() * force.z();
  }
  EXPECT_NEAR(sum / kTicks, 0.0, 0.01);
  const double amplitude = MotorPortParams{}.vibration * 0.3 * 20.0;
  EXPECT_NEAR(std::sqrt(square / kTicks), amplitude / std::numbers::sqrt2, 0.02 * amplitude);
}

}  // namespace
}  // namespace osteon::haptic::test
