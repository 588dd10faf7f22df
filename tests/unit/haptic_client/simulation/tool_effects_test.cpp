// Tests what tools do to the hand beyond their force law, in the whole loop: clogged flutes, the grab at breakthrough,
// a saw that binds. Also that a tool resists by the law that is chosen for it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "common/volume/replica.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/rendering/haptic_loop.hpp"
#include "haptic_client/simulation/session.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::haptic::test {
namespace {

// A slab from z = 0 to `deep_mm`, wide enough for the tool.
Case slab(double deep_mm, double density_g_cm3, double pitch_mm = 0.5, double width_mm = 16.0) {
  const double half = 0.5 * width_mm;
  const auto surface = [=](const Vec3& p) {
    return std::max({-p.z(), p.z() - deep_mm, std::abs(p.x()) - half, std::abs(p.y()) - half});
  };
  return osteon::test::make_bone({Vec3(-half - 3, -half - 3, -3), Vec3(half + 3, half + 3, deep_mm + 3)}, pitch_mm,
                                 surface, [=](const Vec3&) { return density_g_cm3; });
}

// A machine that holds the handle exactly at its target, over the tool's axis.
class Rig {
 public:
  Rig(Case bone, const Tool& tool, const LoopParams& params = {}, const char* law = nullptr, double wear = 1.0,
      const Pose& start = {{0, 0, -0.5}, Eigen::Quaterniond::Identity()})
      : replica_(std::move(bone), BodyId{}, box_with(tool)),
        loop_(params, models(tool, replica_.predicted().bone().pitch_mm(), law, wear)) {
    input_.pose_device_tool = start;
    input_.spindle_rpm = tool.spindle_rpm;
    loop_.take_up(0, input_.pose_device_tool, WorkspaceMapping{});
    build(input_.pose_device_tool);
    move(Vec3::Zero(), 0.5);
  }
  LoopReport tick() {
    const LoopReport report = loop_.tick(input_, patch_);
    CutPiece piece;
    while (loop_.take_piece(piece)) {
      // No room confirms it: that would cut the same bone again, in a field that the hand does not feel.
      replica_.add_own(cut_of(piece, loop_.tool(0), AuthorId{1}, 0));
    }
    if (++ticks_ % 12 == 0) build(report.pose_bone_proxy);
    return report;
  }
  std::vector<LoopReport> move(const Vec3& by_mm, double seconds) {
    const Vec3 from = input_.pose_device_tool.position_mm;
    const int ticks = static_cast<int>(1000 * seconds);
    std::vector<LoopReport> reports;
    for (int i = 1; i <= ticks; ++i) {
      input_.pose_device_tool.position_mm = from + by_mm * i / ticks;
      reports.push_back(tick());
    }
    return reports;
  }
  // Turns the tool about an axis of its own.
  std::vector<LoopReport> turn(const Vec3& by_rad, double seconds) {
    const Eigen::Quaterniond from = input_.pose_device_tool.rotation;
    const int ticks = static_cast<int>(1000 * seconds);
    std::vector<LoopReport> reports;
    for (int i = 1; i <= ticks; ++i) {
      input_.pose_device_tool.rotation =
          from * Eigen::Quaterniond(Eigen::AngleAxisd(by_rad.norm() * i / ticks, by_rad.normalized()));
      reports.push_back(tick());
    }
    return reports;
  }
  void spindle(double rpm) { input_.spindle_rpm = rpm; }
  void irrigate(bool on) { input_.irrigation = on; }
  void set_wear(double wear) { loop_.set_wear(0, wear); }
  void set_law(const char* law) { loop_.set_law(0, *find_force_law(law)); }

 private:
  static std::vector<ToolModel> models(const Tool& tool, double pitch_mm, const char* law, double wear) {
    std::vector<ToolModel> made;
    made.emplace_back(tool, pitch_mm, wear);
    if (law) made.back().law = find_force_law(law);
    return made;
  }
  static std::shared_ptr<const ToolBox> box_with(const Tool& tool) {
    auto box = std::make_shared<ToolBox>();
    box->add(tool);
    return box;
  }
  void build(const Pose& pose) {
    for (const ChangedLeaves& change : replica_.take_changes())
      builder_.changed(replica_.predicted().bone().pitch_mm(), change.level, change.origins);
    builder_.build(replica_.predicted(), loop_.tool(0), pose, patch_);
    patch_.own_cuts = replica_.last_own();
  }
  Replica replica_;
  HapticLoop loop_;
  PatchBuilder builder_;
  Patch patch_;
  LoopInput input_;
  std::int64_t ticks_ = 0;
};

// Mean over the cutting ticks between two depths of the tip.
struct Mean {
  double force_n = 0, torque_nmm = 0;
  int ticks = 0;
};
Mean between(const std::vector<LoopReport>& reports, double low_mm, double high_mm) {
  Mean mean;
  for (const LoopReport& r : reports) {
    const double z = r.pose_bone_proxy.position_mm.z();
    if (r.cutting.phase != CuttingPhase::cutting || z < low_mm || z > high_mm) continue;
    mean.force_n += r.cutting.force_n.norm();
    mean.torque_nmm += r.cutting.torque_nmm;
    ++mean.ticks;
  }
  if (mean.ticks > 0) {
    mean.force_n /= mean.ticks;
    mean.torque_nmm /= mean.ticks;
  }
  return mean;
}

// A feed of 1 mm/s at 1000 rpm into cortical bone: each law's own point of comparison.
TEST(ToolEffects, AToolResistsByTheLawThatIsChosen) {
  const Tool drill = *find_tool("drill-3.2");
  LoopParams params;
  params.peak_n = 200.0;
  const struct {
    const char* law;
    double newtons;
  } kLaws[] = {{nullptr, 28.9}, {"chi", 28.9}, {"allotta", 53.5}, {"spring-damper", 29.0}, {"multi-point", 28.9}};
  for (const auto& chosen : kLaws) {
    Rig rig(slab(12.0, 1.9), drill, params, chosen.law);
    // The coupling's stretch settles within about force / K_c / feed, a second.
    const Mean mean = between(rig.move({0, 0, 7.5}, 7.5), 4.5, 5.9);
    ASSERT_GT(mean.ticks, 500) << (chosen.law ? chosen.law : "default");
    // The spindle droops by some percent under the load.
    EXPECT_NEAR(mean.force_n, chosen.newtons, 0.05 * chosen.newtons) << (chosen.law ? chosen.law : "default");
  }
}

// What hand and cutting got from the coupling, minus what the hand put in, from forces and the handle's path alone.
// Nothing is scaled.
class GivenEnergy {
 public:
  void see(const LoopReport& now) {
    given_mj_ += shown_n_.dot(now.pose_bone_device.position_mm - handle_mm_) + now.cutting.work_mj;
    most_mj_ = std::max(most_mj_, given_mj_);
    shown_n_ = now.coupling.device_n;
    handle_mm_ = now.pose_bone_device.position_mm;
  }
  [[nodiscard]] double most_mj() const { return most_mj_; }

 private:
  Vec3 shown_n_ = Vec3::Zero(), handle_mm_ = Vec3::Zero();
  double given_mj_ = 0, most_mj_ = 0;
};

// A drill is fed at 1 mm/s, and its wear and law change in the bone. Wear enters Chi's thrust in proportion, and the
// thrust is as N^-0.3327: a spindle that droops more has a little more. Another law has its own thrust. The spring's
// force grows no faster than the hand stretches it: K v in a second.
TEST(ToolEffects, AChangeOfWearOrLawInTheBoneChangesTheThrustWithoutAJump) {
  LoopParams params;
  params.peak_n = 200.0;
  Rig rig(slab(22.0, 1.9), *find_tool("drill-3.2"), params);
  rig.irrigate(true);  // clogged flutes would add to the thrust
  GivenEnergy given;
  double before_n = 0.0, most_rise_n = 0.0, shown_n = 0.0, most_shown_n = 0.0;
  // Drills on, and returns thrust and speed of the last second. By then the spring has settled.
  const auto drill_on = [&](double seconds) {
    Mean mean;
    double rpm = 0.0;
    const auto reports = rig.move({0, 0, seconds}, seconds);
    for (const LoopReport& r : reports) {
      given.see(r);
      most_rise_n =
          std::max(most_rise_n, r.coupling.force_n.norm() - std::exchange(before_n, r.coupling.force_n.norm()));
      most_shown_n =
          std::max(most_shown_n, r.coupling.device_n.norm() - std::exchange(shown_n, r.coupling.device_n.norm()));
      EXPECT_LE(r.coupling.energy.worst_mj, 0.01);
    }
    for (std::size_t i = reports.size() - 1000; i < reports.size(); ++i) {
      mean.force_n += 1e-3 * reports[i].cutting.force_n.norm();
      rpm += 1e-3 * reports[i].spindle_rpm;
    }
    return std::pair(mean.force_n, rpm);
  };
  const auto [sharp_n, sharp_rpm] = drill_on(5.0);
  most_rise_n = most_shown_n = 0.0;  // of the entry
  rig.set_wear(2.0);
  const auto [blunt_n, blunt_rpm] = drill_on(5.0);
  rig.set_wear(1.0);
  const auto [again_n, again_rpm] = drill_on(4.0);
  rig.set_law("allotta");
  const auto [allotta_n, allotta_rpm] = drill_on(6.0);
  const double droop = std::pow(blunt_rpm / sharp_rpm, -0.3327);
  std::printf(
      "  thrust: %.2f N sharp, %.2f N at wear 2, %.2f N sharp again, %.2f N by Allotta's law; a tick's rise at "
      "most %.4f N, shown %.4f N; given %.4f mJ\n",
      sharp_n, blunt_n, again_n, allotta_n, most_rise_n, most_shown_n, given.most_mj());
  EXPECT_NEAR(sharp_n, 28.9, 0.03 * 28.9);
  EXPECT_NEAR(blunt_n / sharp_n, 2.0 * droop, 0.01);
  EXPECT_NEAR(again_n / sharp_n, 1.0, 0.01);
  EXPECT_NEAR(allotta_n, 53.49 * 1000.0 / allotta_rpm, 0.01 * 53.49);  // goes with the feed in a turn
  EXPECT_LE(most_rise_n, params.stiffness_n_per_mm * 1.0 * params.dt_s + 1e-6);
  // Damping and the filter's lag add to that, each by a few times as much.
  EXPECT_LE(most_shown_n, 0.3);
  EXPECT_LE(given.most_mj(), 0.01);
}

// The work of cutting blunts a tool further from where it was set. Clogging and the like stay as they were.
TEST(ToolEffects, ReportsSayHowBluntTheToolIsAndByWhichLawItCuts) {
  Rig rig(slab(12.0, 1.9), *find_tool("drill-3.2"));
  EXPECT_EQ(rig.tick().cutting.wear, 1.0);
  EXPECT_EQ(rig.tick().cutting.law, find_force_law("chi"));
  rig.set_wear(1.5);
  rig.set_law("spring-damper");
  const LoopReport set = rig.tick();
  EXPECT_EQ(set.cutting.wear, 1.5);
  EXPECT_EQ(set.cutting.law, find_force_law("spring-damper"));
  rig.irrigate(false);
  const auto reports = rig.move({0, 0, 6.0}, 6.0);
  EXPECT_GT(reports.back().cutting.wear, 1.5);
  EXPECT_LT(reports.back().cutting.wear, 1.51);
  const double full = reports.back().cutting.flutes_full;
  ASSERT_GT(full, 0.1);
  rig.set_wear(3.0);
  EXPECT_NEAR(rig.tick().cutting.flutes_full, full, 1e-3);
  // Blunter than cutting alone can make it: it stays so.
  EXPECT_EQ(rig.move({0, 0, 1.0}, 1.0).back().cutting.wear, 3.0);
}

// Chi's law was made for 0.3 to 2.0 g/cm3 and 0.5 to 3 mm/s. Every cutting tick says which limits it exceeds. Other
// ticks say nothing.
TEST(ToolEffects, ALawSaysWhereItIsOutsideItsRange) {
  const Tool drill = *find_tool("drill-3.2");
  const struct {
    double density, feed;
    unsigned outside;
  } kMoments[] = {{1.9, 1.0, 0u},
                  {0.2, 1.0, static_cast<unsigned>(OutOfRange::density)},
                  {0.6, 5.0, static_cast<unsigned>(OutOfRange::feed)},
                  {0.2, 5.0, static_cast<unsigned>(OutOfRange::density) | static_cast<unsigned>(OutOfRange::feed)}};
  for (const auto& moment : kMoments) {
    Rig rig(slab(12.0, moment.density), drill);
    int cutting = 0;
    // By 2 mm the drill has the feed of its hand.
    for (const LoopReport& r : rig.move({0, 0, 5.0}, 5.0 / moment.feed)) {
      const double z = r.pose_bone_proxy.position_mm.z();
      if (r.cutting.phase != CuttingPhase::cutting)
        EXPECT_EQ(r.cutting.out_of_range, 0u);
      else if (z > 2.0 && z < 3.7) {
        ++cutting;
        EXPECT_EQ(r.cutting.out_of_range, moment.outside)
            << moment.density << " g/cm3, " << r.cutting.feed_mm_per_s << " mm/s";
      }
    }
    EXPECT_GT(cutting, 200);
  }
}

// A bar 10 mm wide under a blade of 19 mm with 14 teeth: 10 / (19/14) teeth are in it, of which 0.15 bear. Each has the
// thrust of its depth of cut at 1 mm/s, and 4 N along the cut, which the crank feels and the hand along the stroke.
TEST(ToolEffects, ASawsForceIsOfTheTeethOverTheBar) {
  const Tool saw = *find_tool("saw-oscillating-2");
  const auto bar = osteon::test::make_bone(
      {Vec3(-8, -10, -3), Vec3(8, 10, 15)}, 0.5,
      [](const Vec3& p) {
        return std::max({-p.z(), p.z() - 12.0, std::abs(p.x()) - 5.0, std::abs(p.y()) - 7.0});
      },
      [](const Vec3&) { return 1.9; });
  Rig rig(bar, saw);
  const auto reports = rig.move({0, 0, 4.0}, 4.0);
  const Mean mean = between(reports, 1.5, 3.0);
  ASSERT_GT(mean.ticks, 1000);
  const double pitch = 19.0 / 14.0, stroke = 80.0 * 5.0 * std::numbers::pi / 180.0, bearing = 0.15 * 10.0 / pitch;
  const double depth_um = 1e3 * 1.0 * pitch / (0.15 * 2.0 * stroke * 200.0);
  const double thrust_n = bearing * 7.5 * (1.0 + 0.3 * (depth_um - 2.0) / 8.0);
  std::printf("  saw over 10 mm: %.2f N, by hand %.2f N; %.2f N mm, by hand %.2f N mm\n", mean.force_n, thrust_n,
              mean.torque_nmm, bearing * 4.0 * stroke / std::numbers::pi);
  // Contact points are half a millimetre apart.
  EXPECT_NEAR(mean.force_n, thrust_n, 0.06 * thrust_n);
  EXPECT_NEAR(mean.torque_nmm, bearing * 4.0 * stroke / std::numbers::pi, 0.06 * mean.torque_nmm);
  // The hand feels what the motor's port lets through: 0.6 of friction's 0.3, along the stroke and 200 times a second.
  double sum_n = 0.0, square = 0.0, aside = 0.0;
  int ticks = 0;
  for (const LoopReport& r : reports) {
    const double z = r.pose_bone_proxy.position_mm.z();
    if (r.cutting.phase != CuttingPhase::cutting || z < 1.5 || z > 3.0) continue;
    sum_n += r.motor.device_n.x();
    square += r.motor.device_n.x() * r.motor.device_n.x();
    aside = std::max(aside, r.motor.device_n.tail<2>().norm());
    ++ticks;
  }
  const double most_n = std::min(bearing * 4.0, 0.6 * 0.3 * thrust_n);
  EXPECT_NEAR(std::sqrt(square / ticks), most_n / std::numbers::sqrt2, 0.08 * most_n);
  EXPECT_NEAR(sum_n / ticks, 0.0, 0.01 * most_n);
  EXPECT_NEAR(aside, 0.0, 1e-6);
}

// A reamer over a hole of half its radius meets half of its edges, though three quarters of its face. Its thrust is
// half.
TEST(ToolEffects, AReamersThrustIsOfTheEdgesInBone) {
  const Tool reamer = *find_tool("reamer-cylinder");
  const auto thrust_n = [&](double hole_mm) {
    const auto block = osteon::test::make_bone(
        {Vec3(-13, -13, -3), Vec3(13, 13, 15)}, 0.5,
        [=](const Vec3& p) {
          const double face = std::max({-p.z(), p.z() - 12.0, std::abs(p.x()) - 10.0, std::abs(p.y()) - 10.0});
          return hole_mm > 0.0 ? std::max(face, hole_mm - p.head<2>().norm()) : face;
        },
        [](const Vec3&) { return 0.6; });
    Rig rig(block, reamer);
    const Mean mean = between(rig.move({0, 0, 4.0}, 8.0), 2.2, 3.0);
    EXPECT_GT(mean.ticks, 1000);
    return mean.force_n;
  };
  // Computed by hand: 0.5 mm/s, 300 rpm, 6 teeth give chips of 1/60 mm. All six edges of 6 mm. Chi's growth with
  // density.
  const double whole_n = (0.5 * 200.0 / 60.0 + 0.01) * 36.0 * std::pow(0.6 / 1.9, 1.1841);
  const double whole = thrust_n(0.0), ring = thrust_n(3.0);
  std::printf("  reamer: %.2f N, by hand %.2f N; over a hole of half its radius %.2f N\n", whole, whole_n, ring);
  EXPECT_NEAR(whole, whole_n, 0.05 * whole_n);  // its spindle droops a little
  EXPECT_NEAR(ring / whole, 0.5, 0.04);
}

// 15 mm of cortical bone are ten diameters of a 1.5 mm drill. Torque and thrust rise, and withdrawal clears the flutes.
TEST(ToolEffects, ADeepHoleClogsTheDrillUntilItIsDrawnBack) {
  Tool thin = *find_tool("drill-3.2");
  thin.diameter_mm = 1.5;
  thin.shank_diameter_mm = 1.5;
  Rig rig(slab(16.0, 1.9), thin);
  const auto first = rig.move({0, 0, 13.0}, 13.0);
  const Mean shallow = between(first, 2.0, 6.0), deep = between(first, 11.5, 12.4);
  ASSERT_GT(deep.ticks, 200);
  // At 12 mm the flutes are full to 0.8: 1 + 5 (0.8 - 0.5)/0.5 = 4 times the torque, and 1.3 times the thrust.
  EXPECT_NEAR(deep.force_n / shallow.force_n, 1.3, 0.06);
  EXPECT_NEAR(deep.torque_nmm / shallow.torque_nmm, 1.3 * 4.0, 0.5);
  rig.move({0, 0, -6.0}, 0.6);
  rig.move({0, 0, 5.9}, 0.6);
  const Mean cleared = between(rig.move({0, 0, 1.5}, 1.5), 12.6, 13.5);
  ASSERT_GT(cleared.ticks, 200);
  EXPECT_NEAR(cleared.torque_nmm / shallow.torque_nmm, 1.0, 0.06);
}

Tool thin_drill() {
  Tool thin = *find_tool("drill-3.2");
  thin.diameter_mm = thin.shank_diameter_mm = 1.5;
  return thin;
}

// The same hole under irrigation: 1 mm/s of a 1.5 mm drill fill a fifteenth of its flutes in a second, of which water
// leaves 4 s / 15 s at most. That is below the onset, so that the drill resists at 12 mm as at 4 mm.
TEST(ToolEffects, IrrigationKeepsADeepHoleFree) {
  Rig rig(slab(16.0, 1.9), thin_drill());
  rig.irrigate(true);
  const auto ticks = rig.move({0, 0, 13.0}, 13.0);
  const Mean shallow = between(ticks, 2.0, 6.0), deep = between(ticks, 11.5, 12.4);
  ASSERT_GT(deep.ticks, 200);
  EXPECT_NEAR(deep.force_n / shallow.force_n, 1.0, 0.03);
  EXPECT_NEAR(deep.torque_nmm / shallow.torque_nmm, 1.0, 0.03);
  EXPECT_NEAR(ticks.back().cutting.flutes_full, 4.0 / 15.0 * (1.0 - std::exp(-12.0 / 4.0)), 0.02);
  for (const LoopReport& tick : ticks) ASSERT_LE(tick.coupling.energy.worst_mj, 0.01);
}

// A drill that has clogged is rinsed for 3 s where it stands: 0.8 of its flutes fall to 0.8 exp(-3/4) = 0.38, and it
// cuts as at first. The hand gets no energy from the chips that leave.
TEST(ToolEffects, ACloggedDrillCutsAgainAfterItWasRinsed) {
  Rig rig(slab(16.0, 1.9), thin_drill());
  const auto dry = rig.move({0, 0, 12.5}, 12.5);
  const Mean shallow = between(dry, 2.0, 6.0), clogged = between(dry, 11.0, 11.9);
  const double full = dry.back().cutting.flutes_full;
  ASSERT_GT(full, 0.7);
  rig.irrigate(true);
  const auto rinsed = rig.move(Vec3::Zero(), 3.0);
  rig.irrigate(false);
  const auto again = rig.move({0, 0, 1.0}, 1.0);
  const Mean freed = between(again, 12.2, 13.0);
  ASSERT_GT(freed.ticks, 200);
  std::printf("  torque: %.2f N mm at first, %.2f N mm clogged, %.2f N mm after rinsing; flutes %.2f, then %.2f\n",
              shallow.torque_nmm, clogged.torque_nmm, freed.torque_nmm, full, rinsed.back().cutting.flutes_full);
  EXPECT_GT(clogged.torque_nmm / shallow.torque_nmm, 3.0);
  EXPECT_NEAR(freed.torque_nmm / shallow.torque_nmm, 1.0, 0.06);
  EXPECT_NEAR(rinsed.back().cutting.flutes_full, full * std::exp(-3.0 / 4.0), 0.02);
  for (const auto* part : {&dry, &rinsed, &again})
    for (const LoopReport& tick : *part) ASSERT_LE(tick.coupling.energy.worst_mj, 0.01);
}

// A barrel bur lies on a shorter bar of cortical bone and is pressed in with its side, its teeth 3 mm from the axis.
// Its own motor has 80 N mm, four times a drill's power at twenty times its speed.
// At less than 80 / 3 N it goes on. At more it stalls in the bone and goes no farther. It turns again when it is drawn
// back.
TEST(ToolEffects, ABurThatIsPressedTooHardStalls) {
  const Tool bur = *find_tool("burr-barrel");
  const Pose lying{{4, 0, -3.5}, rotation_between(Vec3::UnitZ(), Vec3::UnitX())};
  Rig rig(slab(20.0, 1.9, 0.5, 7.0), bur, {}, nullptr, 1.0, lying);
  const double most_nmm = 80.0, arm_mm = 3.0, droop = 0.7 * 20.0 * 20.0 / 4.0;
  double least_rpm = 1e9, torque_nmm = 0.0, pressed_n = 0.0;
  for (const LoopReport& r : rig.move({0, 0, 5.5}, 1.5)) {
    least_rpm = std::min(least_rpm, r.spindle_rpm);
    torque_nmm = std::max(torque_nmm, r.cutting.torque_nmm);
    pressed_n = std::max(pressed_n, r.coupling.force_n.norm());
    EXPECT_FALSE(r.events & kStalled);
  }
  std::printf("  bur pressed with %.1f N: %.1f N mm, down to %.0f rpm\n", pressed_n, torque_nmm, least_rpm);
  EXPECT_LT(pressed_n, most_nmm / arm_mm);
  EXPECT_GT(torque_nmm, 5.0);
  EXPECT_GE(least_rpm, 20'000.0 - 1.02 * droop * torque_nmm);

  rig.move({0, 0, 9.0}, 0.15);  // faster than its teeth can cut
  rig.move(Vec3::Zero(), 0.35);
  double way_mm = 0.0, least_n = 1e9;
  for (const LoopReport& r : rig.move(Vec3::Zero(), 0.5)) {
    EXPECT_TRUE(r.events & kStalled);
    EXPECT_LT(r.spindle_rpm, 1.0);
    way_mm += r.contact.moved_mm.norm();
    least_n = std::min(least_n, r.coupling.force_n.norm());
  }
  std::printf("  and with %.1f N it stands\n", least_n);
  EXPECT_GT(least_n, most_nmm / arm_mm);
  EXPECT_LT(way_mm, 0.1);

  const LoopReport out = rig.move({0, 0, -16.0}, 1.5).back();
  EXPECT_FALSE(out.events & kStalled);
  EXPECT_NEAR(out.spindle_rpm, 20'000.0, 200.0);
}

// The motor's port pulls a drill forward only while its rim is left, and not on the way in.
TEST(ToolEffects, ADrillGrabsWhenItBreaksThrough) {
  const Tool drill = *find_tool("drill-3.2");
  Rig rig(slab(4.0, 1.9), drill);
  double in_mm = 1e9, out_mm = -1e9, largest = 0.0;
  for (const LoopReport& r : rig.move({0, 0, 7.5}, 7.5)) {
    // The vibration has no mean and is small beside a lasting pull.
    const double pull = r.motor.device_n.z();
    if (pull < 2.0) continue;
    in_mm = std::min(in_mm, r.pose_bone_proxy.position_mm.z());
    out_mm = std::max(out_mm, r.pose_bone_proxy.position_mm.z());
    largest = std::max(largest, pull);
  }
  EXPECT_GT(largest, 2.0);
  EXPECT_LE(largest, 0.3 * 30.0);  // friction times the normal force
  // From the point where the tip comes out to the end of the cone, 0.96 mm further.
  EXPECT_GT(in_mm, 3.9);
  EXPECT_LT(out_mm, 5.2);
}

// A blade pressed against the side of its kerf jams. It goes on when the hand lets it straighten.
TEST(ToolEffects, ASawThatIsPressedAsideBinds) {
  const Tool saw = *find_tool("saw-oscillating-2");
  Rig rig(slab(12.0, 0.6, 0.5, 30.0), saw);
  rig.move({0, 0, 4.0}, 2.0);
  const auto cutting = rig.move({0, 0, 1.0}, 0.5);
  const auto feed = [](const std::vector<LoopReport>& reports) {
    double way = 0.0;
    for (const LoopReport& r : reports) way += r.contact.moved_mm.z();
    return way;
  };
  EXPECT_GT(feed(cutting), 0.5);
  // 0.9 mm sideways at 50 N/mm: 45 N on the wall.
  rig.move({0, 0.9, 0}, 0.2);
  EXPECT_LT(feed(rig.move({0, 0, 0.5}, 0.5)), 0.1);
  rig.move({0, -0.9, 0}, 0.2);
  EXPECT_GT(feed(rig.move({0, 0, 0.5}, 0.5)), 0.3);
}

// A blade turned by a degree about its width or its length, more than its play, is wedged between the walls. Pushed on
// with 25 N it stalls, and the hand feels the turn's own spring, K times its arm squared. When straight again it goes
// on.
TEST(ToolEffects, ASawThatIsTurnedInItsKerfStands) {
  const Tool saw = *find_tool("saw-oscillating-2");
  constexpr double kTurn_rad = 0.02;
  const auto feed = [](const std::vector<LoopReport>& reports) {
    double way = 0.0;
    for (const LoopReport& r : reports) way += r.contact.moved_mm.z();
    return way;
  };
  for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitZ())}) {
    Rig rig(slab(12.0, 0.6, 0.5, 30.0), saw);
    rig.move({0, 0, 6.0}, 3.0);
    const double torque_nmm = -rig.turn(kTurn_rad * axis, 0.2).back().coupling.torque_nmm.dot(axis);
    const double turned = feed(rig.move({0, 0, 0.5}, 0.5));
    rig.turn(-kTurn_rad * axis, 0.2);
    const double straight = feed(rig.move({0, 0, 0.5}, 0.5));
    const double spring_nmm = LoopParams{}.stiffness_n_per_mm * Proxy::kTurnArm_mm * Proxy::kTurnArm_mm * kTurn_rad;
    std::printf("  turned about %s: %.0f of %.0f N mm, %.2f mm on, and %.2f mm when it is straight again\n",
                axis.x() > 0 ? "x" : "z", torque_nmm, spring_nmm, turned, straight);
    EXPECT_LE(torque_nmm, 1.01 * spring_nmm);
    EXPECT_GT(torque_nmm, 0.75 * spring_nmm);  // the rest is play
    EXPECT_LT(turned, 0.1);
    EXPECT_GT(straight, 0.3);
  }
}

// Runs of ticks in which the tool moves on: start, distance and duration of each.
struct Stretch {
  double from_mm = 0, way_mm = 0;
  int ticks = 0;
};
std::vector<Stretch> runs_of(const std::vector<LoopReport>& reports) {
  std::vector<Stretch> runs;
  bool moved = false;
  for (const LoopReport& r : reports) {
    const bool moves = r.contact.moved_mm.z() > 1e-6;
    if (moves && !moved) runs.push_back({r.pose_bone_proxy.position_mm.z() - r.contact.moved_mm.z()});
    if (moves) {
      runs.back().way_mm += r.contact.moved_mm.z();
      ++runs.back().ticks;
    }
    moved = moves;
  }
  return runs;
}
// Section of the keel broach `deep_mm` in a face. It is 40 x 12 mm at the top, with 5 degrees of taper over its 40 mm
// and corners bevelled by 1.5 mm.
double section_mm2(double deep_mm) {
  const double less = 2.0 * (40.0 - deep_mm) * std::tan(5.0 * std::numbers::pi / 180.0);
  return (40.0 - less) * (12.0 - less) - 2.0 * 1.5 * 1.5;
}

// E = 0.7 (2.8 N s)^2 / (2 · 0.7 kg) of a blow against the resistance of the broach's section. Each blow drives it so
// far, within about 5 ms. In between it stays however hard it is pushed. Without blows it stays for good.
TEST(ToolEffects, ABroachGoesByBlows) {
  LoopParams params;
  params.peak_n = 400.0;  // leaves the hand room to lead over the next blow
  const Tool broach = *find_tool("broach-2");
  Rig rig(slab(20.0, 0.6, 0.5, 50.0), broach, params);
  rig.move({0, 0, 6.0}, 3.0);
  int blows = 0;
  const std::vector<LoopReport> reports = rig.move({0, 0, 8.5}, 6.0);
  for (const Stretch& run : runs_of(reports)) {
    const double advance_mm = 3920.0 / (130.0 * (0.6 / 1.9) * (0.6 / 1.9) * section_mm2(run.from_mm));
    std::printf("  a blow at %.2f mm: %.3f mm in %d ms, by hand %.3f mm\n", run.from_mm, run.way_mm, run.ticks,
                advance_mm);
    // The 38 points on the end's face, 160 mm2, represent 173 mm2. The area that a blow is spent on is that exact.
    EXPECT_NEAR(run.way_mm, advance_mm, 0.08 * advance_mm);
    EXPECT_GE(run.ticks, 5);
    EXPECT_LE(run.ticks, 7);
    ++blows;
  }
  EXPECT_EQ(blows, 6);  // 60 a minute
  EXPECT_EQ(reports.back().cutting.blows - reports.front().cutting.blows, 6u);
  for (const LoopReport& r : {reports.front(), reports.back()}) {
    const double resistance_n = 130.0 * (0.6 / 1.9) * (0.6 / 1.9) * section_mm2(r.pose_bone_proxy.position_mm.z());
    EXPECT_NEAR(r.cutting.seated, 0.1 * resistance_n / 3920.0, 0.08 * 0.1 * resistance_n / 3920.0);
  }
  EXPECT_GT(reports.back().cutting.seated, reports.front().cutting.seated);
  rig.spindle(0.0);
  rig.move(Vec3::Zero(), 1.0);  // it runs down, and its points, slightly within its faces, come to rest
  double way = 0.0;
  for (const LoopReport& r : rig.move({0, 0, 1.0}, 3.0)) way += r.contact.moved_mm.z();
  EXPECT_NEAR(way, 0.0, 0.01);  // a hundredth of the hand's way: remaining settling
  rig.spindle(60.0);
  EXPECT_GE(runs_of(rig.move({0, 0, 1.0}, 2.0)).size(), 1u);
}

// Six times blunt and in 1 g/cm3, a blow drives it 0.1 mm when 3920 N mm / 0.1 mm = 6 · 130 (1/1.9)^2 A: 181 mm2, 2.5
// mm deep. There it is seated: blows go on and the hand pushes, but nothing moves.
TEST(ToolEffects, ABroachStopsWhenSeated) {
  Tool broach = *find_tool("broach-2");
  broach.spindle_rpm = 240;
  Rig rig(slab(20.0, 1.0, 0.5, 50.0), broach, {}, nullptr, 6.0);
  const std::vector<Stretch> runs = runs_of(rig.move({0, 0, 6.0}, 12.0));
  ASSERT_GT(runs.size(), 15u);
  double way = 0.0;
  LoopReport last;
  for (const LoopReport& r : rig.move({0, 0, 1.0}, 3.0)) {
    way += r.contact.moved_mm.z();
    last = r;
  }
  EXPECT_EQ(way, 0.0);
  const double deep_mm = last.pose_bone_proxy.position_mm.z(), seat_mm2 = 39200.0 / (6.0 * 130.0 / (1.9 * 1.9));
  std::printf("  seated %.2f mm deep after %zu blows, its section %.1f mm2, by hand %.1f mm2; %.1f N of push\n",
              deep_mm, runs.size(), section_mm2(deep_mm), seat_mm2, last.coupling.force_n.norm());
  EXPECT_NEAR(section_mm2(deep_mm), seat_mm2, 0.08 * seat_mm2);  // as above
  EXPECT_EQ(last.cutting.seated, 1.0);
  EXPECT_EQ(last.cutting.blow_impulse_n_s, 2.8);
  EXPECT_GT(last.coupling.force_n.norm(), 20.0);
}

// With the effects off, a tool follows its law alone.
TEST(ToolEffects, CanBeSwitchedOff) {
  Tool thin = *find_tool("drill-3.2");
  thin.diameter_mm = 1.5;
  thin.shank_diameter_mm = 1.5;
  LoopParams params;
  params.tool_effects = false;
  Rig rig(slab(16.0, 1.9), thin, params);
  const auto reports = rig.move({0, 0, 13.0}, 13.0);
  EXPECT_NEAR(between(reports, 11.5, 12.4).torque_nmm / between(reports, 2.0, 6.0).torque_nmm, 1.0, 0.03);
}

}  // namespace
}  // namespace osteon::haptic::test
