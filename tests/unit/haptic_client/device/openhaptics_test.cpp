// PHANToMs through our stand-in for libHD. Every figure here is of a simulated device.
#include "haptic_client/device/openhaptics.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <functional>
#include <numbers>

#include "tests/support/allocation_counter.hpp"
#include "tests/support/process.hpp"
#include "tests/unit/haptic_client/device/devices.hpp"

namespace osteon::haptic::test {
namespace {

using osteon::test::Arm;

class Phantom : public WithArm {
 protected:
  Phantom() : device_(make_openhaptics({OSTEON_STAND_IN_HD, {}})) {}
  // Reads until the servo has made `cycles` more cycles.
  DeviceReading after_cycles(std::uint64_t cycles) {
    const std::uint64_t until = arm()->cycles + cycles;
    EXPECT_TRUE(wait_until([&] { return (void)device_->read(), arm()->cycles >= until; }, kPatience));
    return device_->read();
  }
  // Writes a force until the servo has made `cycles` more cycles.
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
    EXPECT_EQ(arm()->opened, arm()->closed);
    EXPECT_EQ(arm()->scheduler_starts, arm()->scheduler_stops);
    EXPECT_EQ(arm().force_n(), 0.0);
  }
  std::unique_ptr<HapticDevice> device_;
};

TEST_F(Phantom, IsFoundByLooking) {
  const DeviceFinding finding = look_for_openhaptics({OSTEON_STAND_IN_HD, {}});
  EXPECT_EQ(finding.missing, "");
  ASSERT_EQ(finding.found.size(), 1u);
  EXPECT_NE(finding.found[0].find("Stand-in Arm, serial 0001"), std::string::npos);
  EXPECT_EQ(arm()->scheduler_starts, 0u);  // looking for devices moves no motor
  EXPECT_EQ(arm()->opened, 1u);
  arm()->plugged = 0;
  EXPECT_NE(look_for_openhaptics({OSTEON_STAND_IN_HD, {}}).missing.find("check its power and cable"),
            std::string::npos);
}

TEST_F(Phantom, TellsItsLimitsAndNames) {
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(device_->limits().peak_n, Arm::kPeak_n);
  EXPECT_EQ(device_->limits().continuous_n, Arm::kContinuous_n);
  EXPECT_EQ(device_->limits().stiffness_n_per_mm, Arm::kStiffness_n_per_mm);
  EXPECT_EQ(device_->limits().workspace_radius_mm, 40.0);  // the narrowest of 160 × 120 × 80 mm
  EXPECT_EQ(device_->limits().workspace_middle_mm, Vec3(0, 0, 5));
  EXPECT_EQ(device_->info().model, "Stand-in Arm");
  EXPECT_EQ(device_->info().torque_axes, 0);
}

TEST_F(Phantom, OneThatTellsNoLimitsIsNotUsed) {
  arm()->silent_limits = 1;
  const auto opened = device_->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
}

TEST_F(Phantom, ItsHandleIsReadAsATool) {
  arm()->fast = 1;
  arm().hand(10, -20, 30);
  ASSERT_TRUE(device_->open());
  DeviceReading reading = after_cycles(3000);
  EXPECT_NEAR((reading.pose_device_tool.position_mm - Vec3(10, -20, 30)).norm(), 0.0, 1e-6);
  // The stylus points along its −z, the tool along its +z, and both have the same x.
  EXPECT_NEAR((reading.pose_device_tool.direction(Vec3::UnitZ()) + Vec3::UnitZ()).norm(), 0.0, 1e-9);
  EXPECT_NEAR((reading.pose_device_tool.direction(Vec3::UnitX()) - Vec3::UnitX()).norm(), 0.0, 1e-9);
  // A quarter turn about y carries −z to −x.
  arm()->rotation[0] = arm()->rotation[2] = std::numbers::sqrt2 / 2.0;
  reading = after_cycles(100);
  EXPECT_NEAR((reading.pose_device_tool.direction(Vec3::UnitZ()) + Vec3::UnitX()).norm(), 0.0, 1e-9);
}

TEST_F(Phantom, ButtonsAreSpindleAndClutch) {
  arm()->fast = 1;
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(after_cycles(50).buttons, 0u);
  arm()->buttons = 1;
  EXPECT_EQ(after_cycles(50).spindle(), 1.0);
  arm()->buttons = 2;
  EXPECT_EQ(after_cycles(50).buttons, std::uint32_t{kClutchButton});
}

// The hand is pulled against a spring. At rest hand and spring share the way: k_h (h − x) = k x.
TEST_F(Phantom, AHundredThousandCycles) {
  arm()->fast = 1;
  arm().hand(20, 0, 0);
  ASSERT_TRUE(device_->open());
  const double hand = arm()->hand_n_per_mm, wall = 0.05;
  std::uint64_t reads = 0;
  const auto turn = [&] {
    const double x_mm = device_->read().pose_device_tool.position_mm.x();
    device_->write({Vec3(-wall * x_mm, 0, 0), Vec3(0, 0, 5)});
    ++reads;
    return x_mm;
  };
  const auto begin = arm()->cycles.load();
  const osteon::test::AllocationCounter heap;
  while (arm()->cycles < begin + 100000) turn();
  EXPECT_EQ(heap.count(), 0);
  EXPECT_GT(reads, 1000u);
  // If the machine suspends us for 3 ms, the force ends and then returns.
  EXPECT_TRUE(wait_until(
      [&] {
        double x_mm = 0.0;
        for (int i = 0; i < 10000; ++i) x_mm = turn();
        return std::abs(x_mm - 20.0 * hand / (hand + wall)) < 0.01;
      },
      kPatience));
  EXPECT_EQ(arm()->torque_nmm[2], 0.0);  // torque never becomes force, and is not sent to three motors
}

TEST_F(Phantom, NeverAsksForMoreThanThePeakNorForNonsense) {
  arm()->fast = 1;
  ASSERT_TRUE(device_->open());
  EXPECT_TRUE(shows({Vec3(300, 400, 0)}, [&] { return std::abs(arm()->force_n[0] - 0.6 * Arm::kPeak_n) < 1e-12; }));
  EXPECT_NEAR(arm()->peak_n, Arm::kPeak_n, 1e-12);
  push({Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0)}, 300);
  EXPECT_EQ(arm().force_n(), 0.0);
}

TEST_F(Phantom, WarmMotorsGetTheContinuousForce) {
  ASSERT_TRUE(device_->open());
  EXPECT_TRUE(shows({Vec3(3, 0, 0)}, 3.0));
  for (const int error : {0x0200, 0x0201, 0x0204}) {  // warm; more force than it allows
    arm()->next_error = error;
    EXPECT_EQ(push({Vec3(3, 0, 0)}, 30).status, DeviceStatus::warm) << error;
    EXPECT_TRUE(shows({Vec3(3, 0, 0)}, Arm::kContinuous_n));
    EXPECT_TRUE(device_->tend());
    arm()->fast = 1;
    EXPECT_EQ(push({Vec3(3, 0, 0)}, 4000).status, DeviceStatus::ok);  // two seconds of its time later
    arm()->fast = 0;
  }
  arm()->temperature = 0.95;
  EXPECT_EQ(push({Vec3(3, 0, 0)}, 250).status, DeviceStatus::warm);
}

TEST_F(Phantom, CalibratesItselfWhereItCan) {
  arm()->calibration = 1;
  ASSERT_TRUE(device_->open());
  EXPECT_EQ(arm()->calibration, 0);
  EXPECT_EQ(after_cycles(10).calibration, Calibration::done);
  EXPECT_EQ(device_->advice(), "");
}

TEST_F(Phantom, ShowsNoForceBeforeTheUserHasCalibratedIt) {
  arm()->calibration = 2;
  arm()->style = 4;  // an inkwell
  ASSERT_TRUE(device_->open());
  EXPECT_NE(device_->advice().find("inkwell"), std::string::npos);
  const DeviceReading reading = push({Vec3(2, 0, 0)}, 50);
  EXPECT_EQ(reading.calibration, Calibration::pending);
  EXPECT_FALSE(reading.usable());
  EXPECT_EQ(arm().force_n(), 0.0);
  arm()->calibration = 1;  // the stylus is in it
  ASSERT_TRUE(device_->tend());
  EXPECT_EQ(device_->advice(), "");
  EXPECT_TRUE(push({Vec3(2, 0, 0)}, 50).usable());
  EXPECT_TRUE(shows({Vec3(2, 0, 0)}, 2.0));
}

TEST_F(Phantom, IsResetByItsButtonWhereTheUserHoldsIt) {
  arm()->calibration = 2;
  arm()->style = 1;
  ASSERT_TRUE(device_->open());
  EXPECT_NE(device_->advice().find("front button"), std::string::npos);
  ASSERT_TRUE(device_->tend());
  EXPECT_EQ(arm()->calibration, 2);
  arm()->buttons = 1;
  after_cycles(20);
  ASSERT_TRUE(device_->tend());
  EXPECT_EQ(arm()->calibration, 0);
}

TEST_F(Phantom, AForceEndsWhenItsWriterFallsSilent) {
  ASSERT_TRUE(device_->open());
  ASSERT_TRUE(shows({Vec3(2, 0, 0)}, 2.0));
  EXPECT_TRUE(wait_until([&] { return arm().force_n() == 0.0; }, kPatience));
}

TEST_F(Phantom, AServoLoopThatStopsIsNoticed) {
  ASSERT_TRUE(device_->open());
  after_cycles(10);
  arm()->stalled = 1;
  EXPECT_TRUE(wait_until([&] { return device_->read().status == DeviceStatus::fault; }, kPatience));
  Result<void> well;
  EXPECT_TRUE(wait_until([&] { return !(well = device_->tend()); }, kPatience));
  EXPECT_NE(well.error().message.find("servo loop"), std::string::npos);
  arm()->stalled = 0;
}

TEST_F(Phantom, UnpluggedItHasNoForceAndComesBack) {
  Heard heard;
  DeviceConnection connection(*device_, heard.notice(), {10ms, 10ms});
  ASSERT_TRUE(connection.start());
  const Holding hand(*device_, {Vec3(2, 0, 0)});
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(wait_until([&] { return arm().force_n() > 1.9 && hand.status() == DeviceStatus::ok; }, kPatience)) << i;
    arm()->plugged = 0;
    ASSERT_TRUE(wait_until([&] { return hand.status() == DeviceStatus::absent; }, kPatience)) << i;
    EXPECT_EQ(arm().force_n(), 0.0);
    EXPECT_FALSE(connection.connected());
    EXPECT_NE(heard.last(DeviceEvent::lost).find("check its cable"), std::string::npos);
    arm()->plugged = 1;
  }
  ASSERT_TRUE(wait_until([&] { return heard.count(DeviceEvent::back) >= 3; }, kPatience));
  // A machine that stops the device's thread for long enough causes one more loss.
  EXPECT_GE(connection.losses(), 3);
  EXPECT_EQ(static_cast<std::size_t>(connection.losses()), heard.count(DeviceEvent::lost));
}

TEST_F(Phantom, ADeviceErrorEndsTheForceAndIsReported) {
  Heard heard;
  DeviceConnection connection(*device_, heard.notice(), {10ms, 10ms});
  ASSERT_TRUE(connection.start());
  const Holding hand(*device_, {Vec3(2, 0, 0)});
  ASSERT_TRUE(wait_until([&] { return arm().force_n() > 1.9; }, kPatience));
  // One bad frame is no reason to reconnect. Many are.
  arm()->next_error = 0x0304;
  std::this_thread::sleep_for(100ms);
  EXPECT_FALSE(heard.said(DeviceEvent::lost, "0x0304"));
  arm()->lasting_error = 0x0303;
  arm()->error_cycles = 100;
  ASSERT_TRUE(wait_until([&] { return heard.said(DeviceEvent::lost, "0x0303"); }, kPatience));
  arm()->error_cycles = 0;
  EXPECT_TRUE(wait_until([&] { return arm().force_n() > 1.9; }, kPatience));
}

TEST_F(Phantom, FailuresOfOpeningAreSentences) {
  arm()->open_error = 0x0600;
  auto opened = device_->open();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("licence"), std::string::npos);
  arm()->open_error = 0;
  const auto other = make_openhaptics({OSTEON_STAND_IN_HD, "no such name"});
  opened = other->open();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("\"no such name\""), std::string::npos);
  // Only one at a time.
  ASSERT_TRUE(device_->open());
  opened = other->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::exists);
}

TEST_F(Phantom, AMissingOrWrongLibraryIsOneClearMessage) {
  auto opened = make_openhaptics({"/nowhere/libHD.so", {}})->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::not_found);
  EXPECT_NE(opened.error().message.find("install the vendor's OpenHaptics"), std::string::npos);

  opened = make_openhaptics({OSTEON_STAND_IN_DHD, {}})->open();  // of another vendor
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
  EXPECT_NE(opened.error().message.find("hdInitDevice"), std::string::npos);

  const osteon::test::TempDir folder;
  std::ofstream(folder / "libHD.so") << "no library\n";
  opened = make_openhaptics({folder / "libHD.so", {}})->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
}

struct End {
  const char* how;
  int signal;
};
class PhantomsEnd : public Phantom, public ::testing::WithParamInterface<End> {};

// The scheduler is stopped however the program ends. Otherwise some devices must be unplugged.
TEST_P(PhantomsEnd, StopsTheScheduler) {
  const End end = GetParam();
  osteon::test::Process child(osteon::test::program("hold_device"), {"phantom", OSTEON_STAND_IN_HD, end.how});
  ASSERT_TRUE(child.wait_for_out("holding", kPatience)) << child.err();
  child.write("end\n");
  if (end.signal) child.signal(end.signal);
  ASSERT_TRUE(child.wait(kPatience));
  // A thread that looks after the device may begin to open it anew just then. It must stop what it starts.
  EXPECT_GE(arm()->scheduler_starts, 1u);
  EXPECT_EQ(arm()->scheduler_stops, arm()->scheduler_starts);
  EXPECT_GT(arm()->peak_n, 0.9);
  EXPECT_EQ(arm().force_n(), 0.0);
  arm()->opened = arm()->closed.load();  // a crash leaves the handle to the system
}
INSTANTIATE_TEST_SUITE_P(Ends, PhantomsEnd,
                         ::testing::Values(End{"wait", SIGTERM}, End{"wait", SIGINT}, End{"wait", SIGHUP},
                                           End{"wait", SIGQUIT}, End{"exit", 0}, End{"abort", 0}, End{"crash", 0},
                                           End{"check", 0}),
                         [](const auto& end) { return std::string(end.param.how) + std::to_string(end.param.signal); });

}  // namespace
}  // namespace osteon::haptic::test
