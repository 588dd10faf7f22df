#include "common/mechanics/cutting_effects.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "common/mechanics/force_law.hpp"

namespace osteon {
namespace {

constexpr double kDt = 1e-3;

// wear = blunt - (blunt - 1) exp(-W / W0) with the work W of the torque, whatever the ticks in which it is done.
TEST(Bluntness, GrowsByTheWorkOfCutting) {
  for (const double dt : {5e-4, 1e-3, 1e-2}) {
    Bluntness edge;
    const int ticks = static_cast<int>(std::lround(100.0 / dt));
    for (int i = 0; i < ticks; ++i) edge.step({}, 30.0, 1000.0, dt);
    const double work_j = 1e-3 * 30.0 * (1000.0 / 60.0 * 2.0 * std::numbers::pi) * 100.0;
    EXPECT_NEAR(edge.wear(), 2.0 - std::exp(-work_j / 10'000.0), 1e-6) << dt;
  }
}

TEST(Bluntness, NeverPassesBluntAndIdlingCostsNothing) {
  Bluntness edge;
  for (int i = 0; i < 1000; ++i) edge.step({}, 5000.0, 1000.0, 1.0);
  EXPECT_LE(edge.wear(), 2.0);
  EXPECT_GT(edge.wear(), 1.999);
  Bluntness idle(1.2), worn(3.0);
  idle.step({}, 0.0, 1000.0, 1.0);
  worn.step({}, 100.0, 1000.0, 1.0);
  EXPECT_EQ(idle.wear(), 1.2);
  EXPECT_EQ(worn.wear(), 3.0);  // given as worse than blunt: it does not become sharper
}

// The flutes are full after ten diameters of cortical bone, and empty again after one and a half of withdrawal. The
// effect is felt from half full on.
TEST(FluteClogging, FillsByDepthAndClearsByWithdrawal) {
  const CloggingParams params;
  FluteClogging flutes;
  const auto drill = [&](double diameters, double density) {
    for (int i = 0; i < 100; ++i) flutes.step(params, 3.2, 0.01 * diameters * 3.2, 1.0, density, 0.0);
  };
  drill(5.0, 1.9);
  EXPECT_NEAR(flutes.level(), 0.5, 1e-9);
  EXPECT_NEAR(flutes.torque_factor(params), 1.0, 1e-9);
  drill(2.5, 1.9);
  EXPECT_NEAR(flutes.torque_factor(params), 3.5, 1e-9);
  EXPECT_NEAR(flutes.thrust_factor(params), 1.25, 1e-9);
  drill(20.0, 1.9);
  EXPECT_EQ(flutes.level(), 1.0);
  EXPECT_EQ(flutes.torque_factor(params), 6.0);
  for (int i = 0; i < 24; ++i) flutes.step(params, 3.2, 0.0, 0.0, 0.0, 0.1);  // half of the way to clear
  EXPECT_NEAR(flutes.level(), 0.5, 1e-9);
  for (int i = 0; i < 30; ++i) flutes.step(params, 3.2, 0.0, 0.0, 0.0, 0.1);
  EXPECT_EQ(flutes.level(), 0.0);
  drill(5.0, 0.38);  // a fifth as dense, a fifth of the chips
  EXPECT_NEAR(flutes.level(), 0.1, 1e-9);
}

// Pecking, five diameters and back each time, is never felt. A single pass to the same depth is.
TEST(FluteClogging, PeckingKeepsTheFlutesOpen) {
  FluteClogging pecked, straight;
  for (int peck = 0; peck < 4; ++peck) {
    for (int i = 0; i < 1600; ++i) {
      pecked.step({}, 3.2, 0.01, 1.0, 1.9, 0.0);
      straight.step({}, 3.2, 0.01, 1.0, 1.9, 0.0);
      EXPECT_NEAR(pecked.torque_factor({}), 1.0, 1e-9);
    }
    for (int i = 0; i < 60; ++i) pecked.step({}, 3.2, 0.0, 0.0, 0.0, 0.1);
  }
  EXPECT_EQ(straight.level(), 1.0);
}

// A bicortical hole of 5 mm cortex, 20 mm medulla and 5 mm cortex is drilled in a single pass without any effect.
TEST(FluteClogging, ABicorticalHoleIsNoDepth) {
  FluteClogging flutes;
  const struct { double thickness, density; } kLayers[] = {{5.0, 1.9}, {20.0, 0.3}, {5.0, 1.9}};
  for (const auto& layer : kLayers)
    for (int i = 0; i < 100; ++i) flutes.step({}, 3.2, 0.01 * layer.thickness, 1.0, layer.density, 0.0);
  EXPECT_EQ(flutes.torque_factor({}), 1.0);
  EXPECT_EQ(flutes.thrust_factor({}), 1.0);
}

// Water takes a fixed share of the chips in each moment, so that L(t) = L0 exp(-t / tau), whatever the ticks.
TEST(Irrigation, WashesTheFlutesByAnExponential) {
  CloggingParams params;
  params.rinse_s = 3.0;
  for (const double dt : {5e-4, 1e-3, 1e-2, 0.5}) {
    FluteClogging flutes;
    flutes.step(params, 3.2, 26.0, 1.0, 1.9, 0.0);
    ASSERT_NEAR(flutes.level(), 26.0 / 32.0, 1e-12);
    double t_s = 0.0;
    while (t_s < 9.0 - 1e-9) {
      flutes.step_rinsed(params, 3.2, 0.0, 0.0, 0.0, 0.0, dt);
      t_s += dt;
      ASSERT_NEAR(flutes.level(), 26.0 / 32.0 * std::exp(-t_s / 3.0), 1e-9) << dt;
    }
  }
}

// A drill that fills by r each second has r tau (1 - exp(-t / tau)) in its flutes, and r tau in the end. At 1 mm/s in
// cortical bone r is 1/32, so that it never clogs. Dry it is full after 32 s.
TEST(Irrigation, KeepsADrillThatGoesOnSteadilyFromClogging) {
  CloggingParams params;
  params.rinse_s = 3.0;
  for (const double dt : {1e-3, 1e-2, 0.25}) {
    FluteClogging rinsed, dry;
    double t_s = 0.0;
    while (t_s < 40.0 - 1e-9) {
      rinsed.step_rinsed(params, 3.2, 1.0 * dt, 1.0, 1.9, 0.0, dt);
      dry.step(params, 3.2, 1.0 * dt, 1.0, 1.9, 0.0);
      t_s += dt;
      ASSERT_NEAR(rinsed.level(), 3.0 / 32.0 * (1.0 - std::exp(-t_s / 3.0)), 1e-9) << dt;
      ASSERT_EQ(rinsed.torque_factor(params), 1.0);
    }
    EXPECT_EQ(dry.torque_factor(params), 6.0);
  }
}

// Whatever a hand does, the flutes hold no less than nothing, no more than they can, and no more than dry.
TEST(Irrigation, NeverHoldsMoreChipsThanDryFlutesOrLessThanNone) {
  std::minstd_rand random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    FluteClogging rinsed, dry;
    for (int i = 0; i < 400; ++i) {
      const bool back = share(random) < 0.3;
      const double way_mm = std::pow(10.0, 4.0 * share(random) - 2.0), engaged = share(random);
      const double cut_mm = back ? 0.0 : way_mm, back_mm = back ? way_mm : 0.0;
      rinsed.step_rinsed({}, 3.2, cut_mm, engaged, 1.9, back_mm, std::pow(10.0, 3.0 * share(random) - 4.0));
      dry.step({}, 3.2, cut_mm, engaged, 1.9, back_mm);
      ASSERT_GE(rinsed.level(), 0.0);
      ASSERT_LE(rinsed.level(), dry.level());
      ASSERT_LE(dry.level(), 1.0);
    }
  }
}

// Without water the sum is what it was before there was any, to the bit: recordings and journals repeat.
TEST(Irrigation, WithoutItNothingChangesToTheBit) {
  std::minstd_rand random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  CuttingEffects effects(*find_tool("drill-3.2"));
  double level = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    EffectMoment moment{.spindle_rpm = 1000, .engaged = share(random), .density_g_cm3 = 1.9 * share(random)};
    moment.advance_mm = 0.05 * (share(random) - 0.2);
    moment.cutting = moment.advance_mm > 0.0;
    effects.step(moment, kDt);
    if (moment.cutting) level += moment.engaged * moment.density_g_cm3 / 1.9 * moment.advance_mm / (10.0 * 3.2);
    if (!moment.cutting) level -= -moment.advance_mm / (1.5 * 3.2);
    level = std::clamp(level, 0.0, 1.0);
    ASSERT_EQ(effects.clogging().level(), level) << i;
  }
}

// The share of the point in bone while the point comes out: from 1 to 0.
std::vector<double> coming_out(int steps) {
  std::vector<double> shares;
  for (int i = 0; i <= steps; ++i) shares.push_back(1.0 - static_cast<double>(i) / steps);
  return shares;
}

TEST(BreakthroughGrab, PullsWhileTheRimIsThere) {
  const GrabParams params;
  BreakthroughGrab grab;
  for (const double share : coming_out(100)) {
    grab.step(params, share, true, 30.0 * share, false);
    if (share < 0.9 && share > 0.02) {
      EXPECT_TRUE(grab.grabbing());
      // 0.15 of the last thrust of the whole point, on the parabola at a share of 0.9.
      EXPECT_NEAR(grab.pull_n(params), 0.15 * 27.0 * 4.0 * share * (1.0 - share), 1e-9);
      EXPECT_NEAR(grab.torque_factor(params), 1.0 + 4.0 * share * (1.0 - share), 1e-9);
    }
  }
  EXPECT_FALSE(grab.grabbing());
  EXPECT_EQ(grab.pull_n(params), 0.0);
}

TEST(BreakthroughGrab, DoesNothingOnTheWayIn) {
  BreakthroughGrab grab;
  auto shares = coming_out(50);
  std::ranges::reverse(shares);
  for (const double share : shares) {
    grab.step({}, share, true, 30.0 * share, false);
    EXPECT_EQ(grab.pull_n({}), 0.0);
  }
}

TEST(BreakthroughGrab, IsOverWhenTheDrillIsDrawnBackAndBoundedByTheThrust) {
  BreakthroughGrab grab;
  grab.step({}, 1.0, true, 30.0, false);
  double largest = 0.0;
  for (const double share : coming_out(1000)) {
    grab.step({}, share, true, 20.0, false);
    largest = std::max(largest, grab.pull_n({}));
  }
  EXPECT_LE(largest, 0.15 * 30.0);
  grab.step({}, 1.0, true, 30.0, false);
  grab.step({}, 0.5, true, 30.0, false);
  EXPECT_GT(grab.pull_n({}), 0.0);
  grab.step({}, 0.5, false, 0.0, true);
  EXPECT_EQ(grab.pull_n({}), 0.0);
  // Without cutting, as with the spindle off, it is never armed.
  BreakthroughGrab idle;
  idle.step({}, 1.0, false, 0.0, false);
  idle.step({}, 0.5, true, 10.0, false);
  EXPECT_EQ(idle.pull_n({}), 0.0);
}

TEST(SawBinding, DragsJamsAndComesFreeWithHysteresis) {
  SawBinding blade;
  blade.step({}, 20.0);
  EXPECT_NEAR(blade.drag_n({}), 6.0, 1e-12);
  EXPECT_FALSE(blade.jammed());
  blade.step({}, 30.0);
  EXPECT_TRUE(blade.jammed());
  blade.step({}, 16.0);
  EXPECT_TRUE(blade.jammed());
  blade.step({}, 15.0);
  EXPECT_FALSE(blade.jammed());
  blade.step({}, 16.0);
  EXPECT_FALSE(blade.jammed());
}

// A broach whose hand follows every blow as far as the blow allows.
struct FollowedBroach {
  BroachDrive drive;
  double way_mm = 0, last_mm = 0;
  void step(double blows_per_minute, double area_mm2, double density, double held_n, double dt_s = kDt) {
    last_mm = drive.step({}, blows_per_minute, area_mm2, density, held_n, last_mm, dt_s);
    way_mm += last_mm;
  }
};

// A given number of blows a second, each with its advance, on bone that stays the same: way = blows · E / R.
TEST(BroachDrive, AdvancesByItsBlows) {
  const double area = 400.0, density = 0.3;
  const double advance = 3920.0 / (130.0 * (0.3 / 1.9) * (0.3 / 1.9) * area);
  for (const double dt : {5e-4, 1e-3, 2e-3}) {
    FollowedBroach broach;
    for (int i = 0; i < std::lround(4.5 / dt); ++i) broach.step(60.0, area, density, 20.0, dt);
    EXPECT_EQ(broach.drive.blows(), 5) << dt;  // at 0, 1, 2, 3, 4 s
    EXPECT_NEAR(broach.way_mm, 5.0 * advance, 1e-9) << dt;
    EXPECT_FALSE(broach.drive.seated());
  }
}

TEST(BroachDrive, StandsBetweenBlowsAndSpreadsEachOverTheContact) {
  FollowedBroach broach;
  int moving = 0;
  for (int i = 0; i < 1000; ++i) {
    broach.step(60.0, 400.0, 0.3, 20.0);
    moving += broach.last_mm > 1e-12 ? 1 : 0;
  }
  EXPECT_GE(moving, 5);  // 5 ms
  EXPECT_LE(moving, 6);
}

// A taper: resistance grows with depth, R = k x. Each blow does less, and none goes below 0.1 mm. At x = E/(0.1 k) it
// is seated, to within the last advance.
TEST(BroachDrive, StopsWhenSeated) {
  const double density = 0.5, strength = 130.0 * (0.5 / 1.9) * (0.5 / 1.9);
  const double area_per_mm = 100.0, seat_mm = 3920.0 / (0.1 * strength * area_per_mm);
  FollowedBroach broach;
  for (int i = 0; i < 2'000'000 && !broach.drive.seated(); ++i)
    broach.step(120.0, area_per_mm * broach.way_mm, density, 20.0);
  ASSERT_TRUE(broach.drive.seated());
  EXPECT_NEAR(broach.way_mm, seat_mm, 0.1);
  const double seated_mm = broach.way_mm;
  for (int i = 0; i < 5000; ++i) broach.step(120.0, area_per_mm * broach.way_mm, density, 20.0);
  EXPECT_EQ(broach.way_mm, seated_mm);
  // When there is room again, it goes on.
  for (int i = 0; i < 1000; ++i) broach.step(120.0, 50.0, density, 20.0);
  EXPECT_GT(broach.way_mm, seated_mm);
}

// Half of the area at which a blow of E = 3920 N mm drives it 0.1 mm: half seated, and the next blow goes 0.2 mm.
TEST(BroachDrive, SaysHowNearItIsToBeingSeated) {
  const double density = 0.5, seat_mm2 = 3920.0 / (0.1 * 130.0 * (0.5 / 1.9) * (0.5 / 1.9));
  BroachDrive drive;
  EXPECT_EQ(drive.seating(), 0.0);
  for (const double share : {0.25, 0.5, 0.9}) {
    drive.step({}, 60.0, share * seat_mm2, density, 20.0, 0.0, kDt);
    EXPECT_NEAR(drive.seating(), share, 1e-9);
    EXPECT_NEAR(blow_advance_mm({}, share * seat_mm2, GramsPerCm3{density}) * drive.seating(), 0.1, 1e-9);
  }
  drive.step({}, 60.0, 2.0 * seat_mm2, density, 20.0, 0.0, kDt);
  EXPECT_EQ(drive.seating(), 1.0);
  // A hand that only rests leaves it where it is. One that draws it back does not.
  drive.step({}, 60.0, 0.0, 0.0, 0.0, -0.4, kDt);
  EXPECT_EQ(drive.seating(), 1.0);
  drive.step({}, 60.0, 0.0, 0.0, 0.0, -0.2, kDt);
  EXPECT_EQ(drive.seating(), 0.0);
}

// Whoever listens by the number of blows would take a number that begins anew for none.
TEST(BroachDrive, GoesOnCountingWhenItIsTakenUpAgain) {
  FollowedBroach broach;
  EXPECT_EQ(broach.drive.impulse_n_s(), 0.0);
  for (int i = 0; i < 1500; ++i) broach.step(60.0, 400.0, 0.3, 20.0);
  EXPECT_EQ(broach.drive.blows(), 2);
  EXPECT_EQ(broach.drive.impulse_n_s(), 2.8);
  broach.drive.take_up();
  EXPECT_EQ(broach.drive.blows(), 2);
  EXPECT_EQ(broach.drive.seating(), 0.0);
  broach.step(60.0, 400.0, 0.3, 20.0);
  EXPECT_EQ(broach.drive.blows(), 3) << "the first blow comes at once";
}

TEST(BroachDrive, BouncesWhenHeldLooselyAndRestsWhenNotHeld) {
  FollowedBroach firm, loose, resting;
  for (int i = 0; i < 500; ++i) {
    firm.step(60.0, 400.0, 0.3, 5.0);
    loose.step(60.0, 400.0, 0.3, 2.5);
    resting.step(60.0, 400.0, 0.3, 0.0);
  }
  EXPECT_NEAR(loose.way_mm, 0.5 * firm.way_mm, 1e-9);
  EXPECT_EQ(resting.way_mm, 0.0);
  EXPECT_EQ(resting.drive.blows(), 0);
}

// A hand that follows by half a millimetre a blow. The broach goes only so far, and the rest of a blow is not saved for
// later.
TEST(BroachDrive, GoesNoFurtherThanTheHandFollows) {
  BroachDrive drive;
  double way = 0.0, gone = 0.0, in_blow = 0.0;
  int blows = 0;
  for (int i = 0; i < 3000; ++i) {
    const double may = drive.step({}, 60.0, 400.0, 0.3, 20.0, gone, kDt);
    if (drive.blows() != blows) in_blow = 0.0;
    blows = drive.blows();
    gone = std::min(may, 0.5 - in_blow);
    in_blow += gone;
    way += gone;
  }
  EXPECT_NEAR(way, 3 * 0.5, 1e-9);
}

// A hand that follows slowly gets what it followed while a blow lasted, about 5 ms, and nothing more until the next
// blow.
TEST(BroachDrive, ABlowIsOverWhenItsContactIs) {
  BroachDrive drive;
  double way = 0.0, gone = 0.0;
  int moving = 0;
  for (int i = 0; i < 3000; ++i) {
    gone = std::min(drive.step({}, 60.0, 400.0, 0.3, 20.0, gone, kDt), 1e-3);  // 1 mm/s
    way += gone;
    moving += gone > 0.0 ? 1 : 0;
  }
  EXPECT_EQ(drive.blows(), 3);
  EXPECT_GE(moving, 3 * 5);
  EXPECT_LE(moving, 3 * 7);
  EXPECT_NEAR(way, 1e-3 * moving, 1e-12);
}

// A blow drives a blunt broach half as far.
TEST(BroachDrive, GoesHalfAsFarWhenTwiceBlunt) {
  const auto way_mm = [](double wear) {
    CuttingEffects effects(*find_tool("broach-2"), wear);
    EffectMoment moment{
        .spindle_rpm = 60.0, .engaged = 1.0, .engaged_area_mm2 = 400.0, .density_g_cm3 = 0.6, .push_n = 20.0};
    double way = 0.0;
    for (int i = 0; i < 500; ++i) {
      moment.advance_mm = kDt * effects.felt({}).max_feed_mm_per_s;
      way += moment.advance_mm;
      effects.step(moment, kDt);
    }
    return way;
  };
  EXPECT_NEAR(way_mm(1.0), 3920.0 / (130.0 * (0.6 / 1.9) * (0.6 / 1.9) * 400.0), 1e-6);
  EXPECT_NEAR(way_mm(2.0), 0.5 * way_mm(1.0), 1e-6);
}

// Handpieces of equal power: largest torque times speed is constant, and so is the droop at a share of the largest
// torque.
TEST(Motor, KeepsItsPowerAtEverySpeed) {
  const SpindleParams drill = motor_of(*find_tool("drill-3.2")), burr = motor_of(*find_tool("burr-round-5"));
  EXPECT_EQ(drill.full_rpm, 1000.0);
  EXPECT_EQ(drill.droop_rpm_per_nmm, SpindleParams{}.droop_rpm_per_nmm);
  EXPECT_EQ(burr.full_rpm, 20'000.0);
  EXPECT_NEAR(burr.most_nmm * burr.full_rpm, 4.0 * drill.most_nmm * drill.full_rpm, 1e-6);
  const SpindleParams slow = motor_of(*find_tool("drill-5-16in"));
  EXPECT_EQ(slow.full_rpm, 600.0);
  EXPECT_NEAR(slow.most_nmm * slow.full_rpm, drill.most_nmm * drill.full_rpm, 1e-6);
  const auto droop = [](const SpindleParams& motor) {
    return motor.droop_rpm_per_nmm * motor.most_nmm / motor.full_rpm;
  };
  EXPECT_NEAR(droop(burr), droop(drill), 1e-9);
  const SpindleParams reamer = motor_of(*find_tool("reamer-sphere"));
  EXPECT_NEAR(reamer.most_nmm * reamer.full_rpm, 4.0 * drill.most_nmm * drill.full_rpm, 1e-6);
}

// The law's torque stalls the spindle at a thrust that it cannot turn against. The spindle turns again when the thrust
// falls.
TEST(Motor, StallsByTheLawsTorqueAndRecovers) {
  const Tool tool = *find_tool("drill-5-16in");
  const ForceLaw& law = *find_force_law("allotta");
  const SpindleParams motor = motor_of(tool);
  Spindle spindle;
  const auto run = [&](double thrust_n, double seconds) {
    for (int i = 0; i < std::lround(seconds / kDt); ++i) {
      const LawInputs in{.spindle_rpm = spindle.rpm, .density_g_cm3 = 1.9, .engaged = 1.0};
      spindle.step(motor, tool.spindle_rpm, law.torque_nmm(law_tool(tool), in, thrust_n), kDt);
    }
  };
  run(0.0, 1.0);
  EXPECT_NEAR(spindle.rpm, tool.spindle_rpm, 1e-6);
  // M = T D / (4 sin(beta/2)): the thrust whose torque is the motor's largest.
  const double most_thrust = motor.most_nmm * 4.0 * std::sin(59.0 * std::numbers::pi / 180.0) / tool.diameter_mm;
  run(0.9 * most_thrust, 1.0);
  EXPECT_GT(spindle.rpm, 0.5 * tool.spindle_rpm);
  EXPECT_FALSE(spindle.stalled);
  run(1.3 * most_thrust, 5.0);
  EXPECT_TRUE(spindle.stalled);
  EXPECT_EQ(spindle.rpm, 0.0);
  run(0.1 * most_thrust, 1.0);
  EXPECT_FALSE(spindle.stalled);
  EXPECT_GT(spindle.rpm, 0.9 * tool.spindle_rpm);
}

FeedLaw cortical_law(const CuttingEffects& effects, const Tool& tool) {
  const LawInputs in{.spindle_rpm = tool.spindle_rpm, .density_g_cm3 = 1.9, .engaged = 1.0, .wear = effects.wear()};
  return effects.felt(default_law(tool).feed_law(law_tool(tool), in));
}

TEST(CuttingEffects, AFreshToolFeelsAsItsLaw) {
  for (const char* name : {"drill-3.2", "burr-round-5", "saw-oscillating-1", "reamer-sphere"}) {
    const Tool tool = *find_tool(name);
    const CuttingEffects effects(tool);
    const LawInputs in{.spindle_rpm = tool.spindle_rpm, .density_g_cm3 = 1.9, .engaged = 1.0};
    const FeedLaw plain = default_law(tool).feed_law(law_tool(tool), in), felt = cortical_law(effects, tool);
    EXPECT_EQ(felt.offset_n, plain.offset_n);
    EXPECT_EQ(felt.scale_n, plain.scale_n);
    EXPECT_EQ(felt.max_feed_mm_per_s, plain.max_feed_mm_per_s);
    EXPECT_EQ(effects.torque_nmm(12.0), 12.0);
  }
}

TEST(CuttingEffects, ADeepHoleClogsADrillButNoBurr) {
  const Tool drill = *find_tool("drill-3.2"), burr = *find_tool("burr-round-5");
  CuttingEffects drilling(drill), burring(burr);
  const EffectMoment deeper{.spindle_rpm = 1000,
                            .engaged = 1.0,
                            .density_g_cm3 = 1.9,
                            .cutting = true,
                            .cutting_n = 29.0,
                            .advance_mm = 0.01};
  for (int i = 0; i < 4000; ++i) {
    drilling.step(deeper, kDt);
    burring.step(deeper, kDt);
  }
  const double clean_n = resistance_n(cortical_law(CuttingEffects(drill), drill), 1.0);
  EXPECT_NEAR(resistance_n(cortical_law(drilling, drill), 1.0), 1.5 * clean_n, 1e-9);
  EXPECT_NEAR(drilling.torque_nmm(10.0), 60.0, 1e-9);
  EXPECT_EQ(burring.torque_nmm(10.0), 10.0);
  // Withdrawal clears the flutes.
  for (int i = 0; i < 100; ++i) drilling.step({.spindle_rpm = 1000, .advance_mm = -0.1}, kDt);
  EXPECT_EQ(drilling.torque_nmm(10.0), 10.0);
}

// A clogged drill is rinsed where it stands. After tau ln 2 its flutes are half full, and chips leave freely again.
TEST(CuttingEffects, IrrigationFreesACloggedDrillAndDoesNothingToABurr) {
  const Tool drill = *find_tool("drill-3.2"), burr = *find_tool("burr-round-5");
  CuttingEffects drilling(drill), burring(burr);
  drilling.clogging_params.rinse_s = burring.clogging_params.rinse_s = 2.0;
  EffectMoment moment{.spindle_rpm = 1000, .engaged = 1.0, .density_g_cm3 = 1.9, .cutting = true, .advance_mm = 0.01};
  for (int i = 0; i < 4000; ++i) drilling.step(moment, kDt);
  ASSERT_EQ(drilling.clogging().level(), 1.0);
  moment.cutting = false;
  moment.advance_mm = 0.0;
  moment.irrigation = true;
  const int half = static_cast<int>(std::ceil(2.0 * std::numbers::ln2 / kDt));
  for (int i = 0; i < half / 2; ++i) drilling.step(moment, kDt);
  // Half of the way in time: 1 / sqrt 2 in the flutes, and 1 + 5 (0.7071 - 0.5) / 0.5 times the torque.
  EXPECT_NEAR(drilling.torque_nmm(10.0), 10.0 * (1.0 + 10.0 * (std::numbers::sqrt2 / 2.0 - 0.5)), 0.05);
  for (int i = half / 2; i < half; ++i) drilling.step(moment, kDt);
  EXPECT_EQ(drilling.torque_nmm(10.0), 10.0);
  EXPECT_NEAR(drilling.clogging().level(), 0.5, 1e-3);
  // Without water the chips stay.
  const double left = drilling.clogging().level();
  moment.irrigation = false;
  for (int i = 0; i < 1000; ++i) drilling.step(moment, kDt);
  EXPECT_EQ(drilling.clogging().level(), left);

  moment.cutting = moment.irrigation = true;
  moment.advance_mm = 0.01;
  for (int i = 0; i < 4000; ++i) burring.step(moment, kDt);
  EXPECT_EQ(burring.clogging().level(), 0.0);
  EXPECT_EQ(burring.torque_nmm(10.0), 10.0);
}

TEST(CuttingEffects, AJammedSawStandsAndABroachWaitsForItsBlow) {
  const Tool saw = *find_tool("saw-oscillating-1"), broach = *find_tool("broach-1");
  CuttingEffects sawing(saw), broaching(broach);
  sawing.step({.spindle_rpm = 12'000, .engaged = 1.0, .cutting = true, .kerf_pressure_n = 35.0}, kDt);
  EXPECT_EQ(cortical_law(sawing, saw).max_feed_mm_per_s, 0.0);
  EXPECT_GT(sawing.torque_nmm(0.0), 0.0);
  sawing.step({.spindle_rpm = 12'000, .engaged = 1.0, .kerf_pressure_n = 0.0}, kDt);
  EXPECT_GT(cortical_law(sawing, saw).max_feed_mm_per_s, 0.0);

  const LawInputs soft{.spindle_rpm = 60, .density_g_cm3 = 0.3, .engaged = 1.0};
  const FeedLaw blows = default_law(broach).feed_law(law_tool(broach), soft);
  ASSERT_GT(blows.max_feed_mm_per_s, 0.0);
  EXPECT_EQ(broaching.felt(blows).max_feed_mm_per_s, 0.0);  // no blow yet
  EffectMoment held{.spindle_rpm = 60,
                    .engaged = 1.0,
                    .engaged_area_mm2 = law_tool(broach).leading_area_mm2,
                    .density_g_cm3 = 0.3,
                    .push_n = 20.0};
  double way = 0.0;
  for (int i = 0; i < 10'000; ++i) {
    broaching.step(held, kDt);
    // Solved as the proxy does: a firmly held broach goes as far as the blow drives it.
    held.advance_mm = solve_feed(broaching.felt(blows), 50.0, 0.4, kDt).feed_mm_per_s * kDt;
    way += held.advance_mm;
  }
  EXPECT_NEAR(way / 10.0, blows.max_feed_mm_per_s, 0.01 * blows.max_feed_mm_per_s);
}

TEST(CuttingEffects, ADrillGrabsAndABurrDoesNot) {
  CuttingEffects drill(*find_tool("drill-3.2")), burr(*find_tool("burr-round-5"));
  double pulled = 0.0;
  for (int i = 0; i <= 100; ++i) {
    const double left = 1.0 - 0.01 * i;
    const EffectMoment out{
        .spindle_rpm = 1000, .engaged = left, .cutting = true, .cutting_n = 30.0, .advance_mm = 1e-3};
    drill.step(out, kDt);
    burr.step(out, kDt);
    pulled = std::max(pulled, drill.pull_n());
    EXPECT_EQ(burr.pull_n(), 0.0);
  }
  EXPECT_NEAR(pulled, 0.15 * 30.0, 1e-9);
  EXPECT_EQ(drill.pull_n(), 0.0);
}

}  // namespace
}  // namespace osteon
