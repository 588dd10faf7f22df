// Tests the user's hand at a PHANToM, with real processes on this machine. A stand-in for the device's library has a
// simulated arm and hand behind it. Covers drilling with button and clutch, a cable that is pulled during drilling, and
// every way to end.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <thread>

#include "tests/integration/stage.hpp"
#include "tests/support/devices/arm.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
constexpr auto kStageLimit = 60s;
constexpr int kSpindle = 1, kClutch = 2;  // the stylus' buttons

class PhantomInRoom : public ::testing::Test {
 protected:
  PhantomInRoom() : arm_(folder_ / "arm") { arm_->hand_n_per_mm = 0.5; }

  Process start(const Stage& stage, std::vector<std::string> more = {}) const {
    std::vector<std::string> all{"--server",
                                 stage.address(),
                                 "--plain",
                                 "--device",
                                 "phantom",
                                 "--libhd",
                                 OSTEON_STAND_IN_HD,
                                 "--tool",
                                 "drill-3.2",
                                 "--view",
                                 "top",
                                 "--at",
                                 "2,-3,0",
                                 "--status",
                                 "--summary",
                                 stage / "hand.json",
                                 "--session-log",
                                 stage / "hand.csv",
                                 "--cache",
                                 stage / "cache"};
    all.insert(all.end(), more.begin(), more.end());
    return stage.start("osteon-haptic", all);
  }
  // The simulated hand moves its target at a steady speed.
  void move_hand(double x_mm, double y_mm, double z_mm, double mm_per_s) const {
    const double from[3] = {arm_->hand_mm[0], arm_->hand_mm[1], arm_->hand_mm[2]};
    const double way = std::hypot(x_mm - from[0], y_mm - from[1], z_mm - from[2]);
    const int steps = std::max(1, static_cast<int>(std::lround(100.0 * way / mm_per_s)));
    for (int i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / steps;
      arm_.hand(from[0] + s * (x_mm - from[0]), from[1] + s * (y_mm - from[1]), from[2] + s * (z_mm - from[2]));
      std::this_thread::sleep_for(10ms);
    }
  }
  TempDir folder_;
  ArmStrings arm_;
};

TEST_F(PhantomInRoom, DrillsLosesItsCableAndDrillsOn) {
  Stage stage(24.0);
  Process haptic = start(stage);
  ASSERT_TRUE(haptic.wait_for_out("free_hand", kStageLimit)) << haptic.err();
  EXPECT_EQ(arm_->scheduler_starts, 1u);
  EXPECT_EQ(arm_.force_n(), 0.0);  // the tool waits over the bone

  // The clutch moves the handle but not the tool. Then the tool goes down to the bone with the spindle on.
  arm_->buttons = kClutch;
  std::this_thread::sleep_for(100ms);
  move_hand(0, 0, 10, 50.0);
  arm_->buttons = 0;
  std::this_thread::sleep_for(100ms);
  arm_->buttons = kSpindle;
  std::this_thread::sleep_for(700ms);
  move_hand(0, 0, -3, 8.0);  // 14 mm of the bone's: 10 mm of air and into the near cortex
  ASSERT_TRUE(wait_until([&] { return arm_.force_n() > 0.2; }, 10s)) << haptic.out();

  // The cable is pulled during drilling.
  arm_->plugged = 0;
  EXPECT_TRUE(wait_until([&] { return haptic.err().find("device lost") != std::string::npos; }, 10s));
  EXPECT_EQ(arm_.force_n(), 0.0);
  EXPECT_TRUE(haptic.running());
  arm_->plugged = 1;
  EXPECT_TRUE(wait_until([&] { return haptic.err().find("device back") != std::string::npos; }, 10s));
  // The handle is coupled to the tool where both now are, so the hand presses on from there.
  arm_->peak_n = 0.0;
  move_hand(0, 0, -14, 6.0);
  std::this_thread::sleep_for(3s);
  EXPECT_GT(arm_->peak_n, 0.2);
  // Draws the drill out of the hole, stops the spindle, and ends.
  move_hand(0, 0, 20, 30.0);
  arm_->buttons = 0;
  std::this_thread::sleep_for(1s);
  EXPECT_EQ(arm_.force_n(), 0.0);
  ASSERT_EQ(haptic.terminate(), 0) << haptic.err();
  EXPECT_EQ(arm_->scheduler_stops, arm_->scheduler_starts);
  EXPECT_EQ(arm_->is_open, 0);
  EXPECT_EQ(arm_->misuse, 0u);
  EXPECT_EQ(arm_->unsafe_forces, 0u);
  EXPECT_LE(arm_->peak_n, Arm::kPeak_n + 1e-9);

  const auto summary = read_json(stage / "hand.json");
  EXPECT_EQ(summary["device"], "phantom");
  EXPECT_EQ(summary["device_losses"], 1);
  EXPECT_EQ(summary["device_limits"]["continuous_n"], Arm::kContinuous_n);
  EXPECT_NEAR(summary["force_scale"].get<double>(), Arm::kContinuous_n / 30.0, 1e-12);
  EXPECT_EQ(summary["stopped"], false);  // how a session of a free hand ends

  // The tip stood still while the clutch was held or the device was away. It began over the given position.
  const Table log = read_table(stage / "hand.csv");
  ASSERT_GT(log.entries(), 5000u);
  std::size_t first = 0;
  while (first < log.entries() && log.texts.at("tip_x_mm")[first] != "2.00000") ++first;
  ASSERT_LT(first, log.entries());
  EXPECT_NEAR(log["tip_y_mm"][first], -3.0, 1e-3);
  EXPECT_NEAR(log["tip_z_mm"][first], 10.0, 0.3);
  double deepest = 0.0;
  for (const double z : log["tip_z_mm"]) deepest = std::max(deepest, -z);
  EXPECT_GT(deepest, 4.0);
  // The hole is a cylinder of the drill's width, as deep as the tip went. The drill's cone takes a little less, and the
  // hand's wobble a little more.
  const double cylinder = std::numbers::pi * 1.6 * 1.6 * std::min(deepest, 30.0);
  EXPECT_GT(summary["removed_mm3"].get<double>(), 0.75 * cylinder - 10.0);
  EXPECT_LT(summary["removed_mm3"].get<double>(), 1.3 * cylinder + 5.0);

  ASSERT_EQ(stage.server().terminate(), 0);
  EXPECT_EQ(read_json(stage / "server.json")["field_hash"], summary["field_hash"]);
}

TEST_F(PhantomInRoom, WithoutItsRoomItHasNoForceAndEndsInOrder) {
  Stage stage(16.0);
  Process haptic = start(stage);
  ASSERT_TRUE(haptic.wait_for_out("free_hand", kStageLimit)) << haptic.err();
  move_hand(0, 0, -13, 15.0);  // presses, the spindle off
  ASSERT_TRUE(wait_until([&] { return arm_.force_n() > 0.2; }, 10s));
  stage.server().signal(SIGKILL);
  ASSERT_EQ(haptic.wait(30s), 1) << haptic.err();
  EXPECT_EQ(arm_.force_n(), 0.0);
  EXPECT_EQ(arm_->scheduler_stops, 1u);
  EXPECT_EQ(arm_->is_open, 0);
}

TEST_F(PhantomInRoom, WaitsForItsUserWhereItMustBeCalibrated) {
  arm_->calibration = 2;
  arm_->style = 4;
  const Stage stage(16.0);
  Process haptic = start(stage);
  EXPECT_TRUE(wait_until([&] { return haptic.err().find("inkwell") != std::string::npos; }, kStageLimit));
  EXPECT_TRUE(haptic.wait_for_out("wait", kStageLimit)) << haptic.err();
  arm_->calibration = 1;
  EXPECT_TRUE(haptic.wait_for_out("free_hand", kStageLimit));
  EXPECT_THAT(haptic.err(), testing::HasSubstr("device ready"));
  ASSERT_EQ(haptic.terminate(), 0);
  EXPECT_EQ(arm_->unsafe_forces, 0u);
}

// Only the room knows which tools it has.
TEST_F(PhantomInRoom, AToolThatTheRoomHasNotIsNamed) {
  const Stage stage(16.0);
  Process haptic =
      stage.start("osteon-haptic", {"--server", stage.address(), "--plain", "--device", "phantom", "--libhd",
                                    OSTEON_STAND_IN_HD, "--tool", "drill-99", "--cache", stage / "cache"});
  ASSERT_EQ(haptic.wait(kStageLimit), 1) << haptic.err();
  EXPECT_THAT(haptic.err(), testing::HasSubstr("the room has no tool \"drill-99\"; choose one of"));
  EXPECT_EQ(arm_->is_open, 0);
}

// A hand's recording moves the tool again, with the force scale of the recording. The session ends with the recording.
TEST_F(PhantomInRoom, AHandsRecordingIsPlayedWithItsForceScale) {
  const Stage stage(16.0);
  Process haptic = start(stage, {"--scale", "0.07", "--record", stage / "hand.h5"});
  ASSERT_TRUE(haptic.wait_for_out("free_hand", kStageLimit)) << haptic.err();
  move_hand(0, 0, -13, 15.0);
  ASSERT_TRUE(wait_until([&] { return arm_.force_n() > 0.1; }, 10s)) << haptic.out();
  ASSERT_EQ(haptic.terminate(), 0) << haptic.err();
  EXPECT_EQ(read_json(stage / "hand.json")["force_scale"], 0.07);

  const std::string recording = "recorded:" + (stage / "hand.h5").string();
  Process again = stage.start(
      "osteon-haptic", {"--server", stage.address(), "--plain", "--device", recording, "--tool", "drill-3.2", "--view",
                        "top", "--at", "2,-3,0", "--summary", stage / "again.json", "--cache", stage / "cache"});
  ASSERT_EQ(again.wait(kStageLimit), 0) << again.err();
  const auto summary = read_json(stage / "again.json");
  EXPECT_EQ(summary["device"], recording);
  EXPECT_EQ(summary["force_scale"], 0.07);
  EXPECT_EQ(summary["device_limits"]["continuous_n"], Arm::kContinuous_n);
  EXPECT_GT(summary["steps"][0]["peak_force_n"].get<double>(), 1.0);
}

TEST_F(PhantomInRoom, WhatIsWrongIsSaidBeforeAServerIsLookedFor) {
  const auto said = [&](std::vector<std::string> more) {
    std::vector<std::string> all{"--server", "127.0.0.1:1", "--plain", "--timeout", "0"};
    all.insert(all.end(), more.begin(), more.end());
    const RunResult result = run(program("osteon-haptic"), all, 20s);
    EXPECT_EQ(result.exit_code, 1);
    return result.err;
  };
  using testing::HasSubstr;
  EXPECT_THAT(said({}), HasSubstr("needs a --plan"));
  EXPECT_THAT(said({"--device", "phantom"}), HasSubstr("--tool is missing"));
  EXPECT_THAT(said({"--device", "phantom", "--tool", "guide-1"}), HasSubstr("guide-1\" takes no bone"));
  EXPECT_THAT(said({"--device", "phantom", "--tool", "drill-3.2", "--law", "hooke"}), HasSubstr("--law"));
  EXPECT_THAT(said({"--device", "phantom", "--tool", "drill-3.2", "--view", "above"}), HasSubstr("--view must be"));
  EXPECT_THAT(said({"--device", "phantom", "--tool", "drill-3.2", "--at", "here"}), HasSubstr("--at"));
  EXPECT_THAT(said({"--device", "phantom+phantom", "--tool", "drill-3.2"}), HasSubstr("cannot be added"));
  EXPECT_THAT(said({"--device", "simulated+pedal", "--tool", "drill-3.2"}), HasSubstr("name it alone"));
  EXPECT_THAT(said({"--device", "fantom"}), HasSubstr("there is no device \"fantom\""));
  EXPECT_THAT(said({"--device", "recorded:/nowhere.h5", "--tool", "drill-3.2"}), HasSubstr("/nowhere.h5"));
  EXPECT_THAT(said({"--device", "falcon", "--falcon-firmware", "/nowhere.bin", "--tool", "drill-3.2"}),
              HasSubstr("/nowhere.bin is not there; correct the path of --falcon-firmware"));
  EXPECT_THAT(said({"--device", "phantom", "--tool", "drill-3.2"}), HasSubstr("install the vendor's OpenHaptics"));
  EXPECT_THAT(said({"--device", "phantom", "--libhd", OSTEON_STAND_IN_DHD, "--tool", "drill-3.2"}),
              HasSubstr("hdInitDevice"));
  arm_->plugged = 0;
  EXPECT_THAT(said({"--device", "phantom", "--libhd", OSTEON_STAND_IN_HD, "--tool", "drill-3.2"}),
              HasSubstr("check its power and cable"));
  EXPECT_THAT(said({"--device", "force-dimension", "--libdhd", OSTEON_STAND_IN_DHD, "--tool", "drill-3.2"}),
              HasSubstr("check power, cable"));
}

TEST_F(PhantomInRoom, DevicesAreListedWithWhatIsMissing) {
  using testing::HasSubstr;
  RunResult list =
      run(program("osteon-haptic"), {"devices", "--libhd", OSTEON_STAND_IN_HD, "--libdhd", OSTEON_STAND_IN_DHD});
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_THAT(list.out, HasSubstr("found: Stand-in Arm, serial 0001"));
  EXPECT_THAT(list.out, HasSubstr("found: stand-in omega, serial 4242"));
  list = run(program("osteon-haptic"), {"devices"});
  EXPECT_EQ(list.exit_code, 0);
  EXPECT_THAT(list.out, HasSubstr("not here: OpenHaptics (libHD.so) is not installed"));
  EXPECT_THAT(list.out, HasSubstr("not here: Force Dimension's libdhd is not installed"));
  for (const char* name : {"simulated", "pointer", "falcon", "spacemouse", "pedal ", "pedal-axis", "recorded"})
    EXPECT_THAT(list.out, HasSubstr(name));
  list = run(program("osteon-haptic"), {"devices", "--libhd", "/nowhere/libHD.so"});
  EXPECT_EQ(list.exit_code, 1);
  EXPECT_THAT(list.out, HasSubstr("there is no file /nowhere/libHD.so"));
  EXPECT_EQ(arm_->opened, arm_->closed);
}

}  // namespace
}  // namespace osteon::test
