// Force Dimension devices through our stand-in for libdhd. Every figure here is of a simulated device.
#include "haptic_client/device/force_dimension.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/process.hpp"
#include "tests/unit/haptic_client/device/devices.hpp"

namespace osteon::haptic::test {
namespace {

using osteon::test::Arm;
constexpr int kOmega6 = 34, kSigma7 = 104;

class ForceDimensionArm : public WithArm {
 protected:
  ForceDimensionArm() : device_(make({})) {}
  static std::unique_ptr<HapticDevice> make(std::chrono::microseconds period) {
    return make_force_dimension({.library = OSTEON_STAND_IN_DHD, .period = period});
  }
  DeviceReading push(const DeviceOutput& output, std::uint64_t cycles) {
    const std::uint64_t until = arm()->cycles + cycles;
    EXPECT_TRUE(
        wait_until([&] { return device_->write(output), (void)device_->read(), arm()->cycles >= until; }, kPatience));
    return device_->read();
  }
  // True if the device comes to show this force while it is written again and again. A machine that suspends the test
  // for 3 ms lets the force end in between.
  bool shows(const DeviceOutput& output, const std::function<bool()>& enough) {
    return wait_until([&] { return device_->write(output), (void)device_->read(), enough(); }, kPatience);
  }
  bool shows(const DeviceOutput& output, double size_n) {
    return shows(output, [&] { return std::abs(arm().force_n() - size_n) < 1e-12; });
  }
  void TearDown() override {
    device_.reset();
    EXPECT_EQ(arm()->misuse, 0u);
    EXPECT_EQ(arm()->unsafe_forces, 0u);
    EXPECT_EQ(arm()->motors_on, 0);
    EXPECT_EQ(arm()->opened, arm()->closed);
  }
  std::unique_ptr<HapticDevice> device_;  // its thread does not sleep
};

TEST_F(ForceDimensionArm, IsFoundByLooking) {
  const ForceDimensionOptions options{.library = OSTEON_STAND_IN_DHD};
  const DeviceFinding finding = look_for_force_dimension(options);
  ASSERT_EQ(finding.found.size(), 1u);
  EXPECT_EQ(finding.found[0], "stand-in omega, serial 4242");
  EXPECT_EQ(finding.missing, "");
  arm()->open_error = 20;
  EXPECT_NE(look_for_force_dimension(options).missing.find("another program"), std::string::npos);
  arm()->plugged = 0;
  EXPECT_NE(look_for_force_dimension(options).missing.find("no device is connected"), std::string::npos);
}

TEST(ForceDimensionFrame, GoesThereAndBack) {
  EXPECT_EQ(from_force_dimension(Vec3::UnitX()), Vec3::UnitZ());  // to the user
  EXPECT_EQ(from_force_dimension(Vec3::UnitY()), Vec3::UnitX());  // right
  EXPECT_EQ(from_force_dimension(Vec3::UnitZ()), Vec3::UnitY());  // up
  EXPECT_EQ(to_force_dimension(from_force_dimension({1, 2, 3})), Vec3(1, 2, 3));
}

TEST_F(ForceDimensionArm, TellsItsLimitsByItsKind) {
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(device_->limits().peak_n, 12.0);
  EXPECT_EQ(device_->limits().stiffness_n_per_mm, 5.0);
  EXPECT_FALSE(device_->info().turns);
  EXPECT_EQ(device_->info().torque_axes, 0);
  EXPECT_EQ(device_->info().driver, "3.7.0");
  device_->close();
  arm()->type = kSigma7;
  arm()->output_axes = 6;
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(device_->info().torque_axes, 3);
  EXPECT_EQ(device_->limits().peak_nmm, 200.0);
  device_->close();
  arm()->type = 7;
  const auto unknown = device_->open();
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("type 7"), std::string::npos);
}

TEST_F(ForceDimensionArm, ItsHandleIsReadAsATool) {
  arm()->type = kOmega6;
  arm().hand(10, -20, 30);
  ASSERT_TRUE(device_->open());
  DeviceReading reading = push({}, 3000);
  EXPECT_NEAR((reading.pose_device_tool.position_mm - Vec3(10, -20, 30)).norm(), 0.0, 1e-6);
  EXPECT_NEAR((reading.pose_device_tool.direction(Vec3::UnitZ()) + Vec3::UnitZ()).norm(), 0.0, 1e-9);
  // A quarter turn about the vendor's z, our y, carries −x to −y there, and −z to −x here.
  arm()->rotation[0] = arm()->rotation[3] = std::numbers::sqrt2 / 2.0;
  reading = push({}, 100);
  EXPECT_NEAR((reading.pose_device_tool.direction(Vec3::UnitZ()) + Vec3::UnitX()).norm(), 0.0, 1e-9);
}

TEST_F(ForceDimensionArm, AHundredThousandCyclesAgainstASpring) {
  arm().hand(0, 20, 0);
  ASSERT_TRUE(device_->open());
  const double hand = arm()->hand_n_per_mm, wall = 0.05;
  double asked_n = 0.0;
  const auto turn = [&] {
    const double y_mm = device_->read().pose_device_tool.position_mm.y();
    asked_n = std::max(asked_n, wall * std::abs(y_mm));
    device_->write({Vec3(0, -wall * y_mm, 0)});
    return y_mm;
  };
  const auto begin = arm()->cycles.load();
  while (arm()->cycles < begin + 100000) turn();
  // If the machine suspends us for 3 ms, the force ends and then returns.
  EXPECT_TRUE(wait_until(
      [&] {
        double y_mm = 0.0;
        for (int i = 0; i < 10000; ++i) y_mm = turn();
        return std::abs(y_mm - 20.0 * hand / (hand + wall)) < 0.01;
      },
      kPatience));
  // The arm has mass. Where forces come late, it may swing beyond 20 mm.
  EXPECT_LE(arm()->peak_n, asked_n + 1e-9);
  EXPECT_LT(asked_n, 1.5 * 20.0 * wall);
}

TEST_F(ForceDimensionArm, ShowsTorqueWhereItCan) {
  arm()->type = kSigma7;
  arm()->output_axes = 6;
  ASSERT_TRUE(device_->open());
  const auto near = [](double a, double b) { return std::abs(a - b) < 1e-9; };
  EXPECT_TRUE(shows({Vec3(0, 0, 1), Vec3(30, 0, 40)},
                    [&] { return near(arm()->torque_nmm[0], 30.0) && near(arm()->torque_nmm[2], 40.0); }));
  // 200 N mm in all.
  EXPECT_TRUE(shows({Vec3(0, 0, 100), Vec3(3000, 0, 4000)},
                    [&] { return near(arm()->torque_nmm[2], 160.0) && near(arm()->force_n[2], 12.0); }));
}

TEST_F(ForceDimensionArm, ShowsNoForceBeforeItKnowsWhereItIs) {
  arm()->calibration = 2;
  ASSERT_TRUE(device_->open());
  EXPECT_NE(device_->advice().find("ends of its range"), std::string::npos);
  EXPECT_EQ(push({Vec3(2, 0, 0)}, 300).calibration, Calibration::pending);
  EXPECT_EQ(arm().force_n(), 0.0);
  EXPECT_EQ(arm()->motors_on, 0);
  arm()->calibration = 0;
  ASSERT_TRUE(wait_until([&] { return (void)push({}, 200), device_->tend() && device_->advice().empty(); }, kPatience));
  EXPECT_TRUE(push({Vec3(2, 0, 0)}, 300).usable());
  EXPECT_TRUE(shows({Vec3(2, 0, 0)}, 2.0));
}

TEST_F(ForceDimensionArm, AForceEndsWhenItsWriterFallsSilent) {
  ASSERT_TRUE(device_->open());
  ASSERT_TRUE(shows({Vec3(2, 0, 0)}, 2.0));
  EXPECT_TRUE(wait_until([&] { return arm().force_n() == 0.0; }, kPatience));
}

TEST_F(ForceDimensionArm, UnpluggedItHasNoForceAndComesBack) {
  device_ = make(1000us);
  Heard heard;
  DeviceConnection connection(*device_, heard.notice(), {10ms, 10ms});
  ASSERT_TRUE(connection.start());
  const Holding hand(*device_, {Vec3(2, 0, 0)});
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(wait_until([&] { return arm().force_n() > 1.9 && hand.status() == DeviceStatus::ok; }, kPatience)) << i;
    arm()->plugged = 0;
    ASSERT_TRUE(wait_until([&] { return hand.status() == DeviceStatus::absent; }, kPatience)) << i;
    EXPECT_EQ(arm().force_n(), 0.0);
    EXPECT_NE(heard.last(DeviceEvent::lost).find("check its cable"), std::string::npos);
    arm()->is_open = 0;  // state of an unplugged device
    ++arm()->closed;
    arm()->plugged = 1;
  }
  ASSERT_TRUE(wait_until([&] { return heard.count(DeviceEvent::back) >= 3; }, kPatience));
  arm()->misuse = 0;  // closing a lost device
  arm()->closed = arm()->opened - 1;
}

TEST_F(ForceDimensionArm, ADeviceErrorIsReportedWithItsRemedy) {
  ASSERT_TRUE(device_->open());
  arm()->next_error = 7;
  push({}, 100);
  EXPECT_TRUE(device_->tend());  // one answer too late
  arm()->lasting_error = 12;
  arm()->error_cycles = 1000000;
  Result<void> well;
  ASSERT_TRUE(wait_until([&] { return !(well = device_->tend()); }, kPatience));
  EXPECT_NE(well.error().message.find("not ready"), std::string::npos);
  EXPECT_EQ(device_->read().status, DeviceStatus::fault);
  arm()->error_cycles = 0;
}

TEST_F(ForceDimensionArm, AMissingOrWrongLibraryIsOneClearMessage) {
  auto opened = make_force_dimension({.library = "/nowhere/libdhd.so"})->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::not_found);
  EXPECT_NE(opened.error().message.find("install the vendor's Force Dimension SDK"), std::string::npos);
  opened = make_force_dimension({.library = OSTEON_STAND_IN_HD})->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
  EXPECT_NE(opened.error().message.find("dhdGetDeviceCount"), std::string::npos);
}

TEST_F(ForceDimensionArm, ItsMotorsEndWithTheProgram) {
  for (const char* how : {"exit", "abort", "crash"}) {
    arm().reset();
    osteon::test::Process child(osteon::test::program("hold_device"), {"force-dimension", OSTEON_STAND_IN_DHD, how});
    child.write("end\n");
    ASSERT_TRUE(child.wait(kPatience)) << how;
    EXPECT_GT(arm()->peak_n, 0.9) << how;
    EXPECT_EQ(arm()->emergency_stops, 1u) << how;
    EXPECT_EQ(arm()->motors_on, 0) << how;
    arm()->opened = arm()->closed.load();
    arm()->misuse = 0;  // its thread may ask once more before the process ends
    arm()->unsafe_forces = 0;
  }
}

}  // namespace
}  // namespace osteon::haptic::test
