// The Falcon's driver against an emulated device. libusb and everything above it are real.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <functional>
#include <thread>

#include "haptic_client/device/falcon.hpp"
#include "haptic_client/device/falcon_frames.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/usb/usb_stage.hpp"
#include "tests/support/wait.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using test::kPatience;
using test::wait_until;
using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;

constexpr std::size_t kImageBytes = 5000;  // not a multiple of a block

class FalconOnUsb : public testing::Test {
 protected:
  FalconOnUsb() : image_(folder_ / "falcon.bin") { test::write_running_image(image_, kImageBytes); }

  std::unique_ptr<HapticDevice> device(const std::filesystem::path& image) {
    return make_falcon({.firmware = image, .priority = 0});
  }
  AssertionResult opens(HapticDevice& falcon) {
    const Result<void> opened = falcon.open();
    return opened ? AssertionSuccess() : AssertionFailure() << opened.error().message;
  }
  // Reads as the haptic thread does, until a reading fulfils the condition.
  bool reads(HapticDevice& falcon, const std::function<bool(const DeviceReading&)>& wanted) {
    return wait_until([&] { return wanted(falcon.read()); }, kPatience);
  }
  bool becomes_ready(HapticDevice& falcon) {
    return reads(falcon, [](const DeviceReading& r) { return r.usable(); });
  }
  // Encoder counts of a position, from its rounded angles.
  void hold_at(const Eigen::Vector3d& grip_m) {
    const Eigen::Vector3d angles = *falcon_angles(grip_m);
    std::string line = "falcon encoders";
    for (int i = 0; i < 3; ++i) line += " " + std::to_string(std::lround(falcon_counts(angles[i])));
    ASSERT_EQ(usb_.command(line), "ok");
  }
  void plug(const std::string& how = "") { ASSERT_EQ(usb_.command("plug falcon " + how), "ok"); }

  test::TempDir folder_;
  std::filesystem::path image_;
  test::UsbStage usb_;
};

TEST_F(FalconOnUsb, IsFoundOnlyWhileItIsThere) {
  EXPECT_TRUE(look_for_falcon().found.empty());
  const auto falcon = device(image_);
  const Result<void> nothing = falcon->open();
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::not_found);
  EXPECT_EQ(falcon->read().status, DeviceStatus::absent);
  plug();
  const DeviceFinding finding = look_for_falcon();
  ASSERT_EQ(finding.found.size(), 1u);
  EXPECT_EQ(finding.found[0], "Novint Falcon, USB bus 1, device 5");
  EXPECT_EQ(usb_.command("unplug falcon"), "ok");
  EXPECT_TRUE(look_for_falcon().found.empty());
}

TEST_F(FalconOnUsb, LoadsItsFirmwareHomesAndReadsPlaces) {
  plug();
  usb_.command("falcon deaf 3");  // greetings may be lost
  hold_at({0.0, 0.0, 0.12});
  const auto falcon = device(image_);
  ASSERT_TRUE(opens(*falcon));
  EXPECT_EQ(usb_.falcon_told().image_bytes, kImageBytes);
  EXPECT_EQ(falcon->info().serial, "EMULATED-1");
  EXPECT_FALSE(falcon->info().turns);

  EXPECT_TRUE(reads(*falcon, [](const DeviceReading& r) { return r.status == DeviceStatus::ok; }));
  ASSERT_TRUE(becomes_ready(*falcon));
  EXPECT_EQ(falcon->advice(), "");
  const Vec3 place = falcon->read().pose_device_tool.position_mm;
  EXPECT_LT((place - Vec3(0.0, 0.0, -30.0)).norm(), 0.1)
      << place.transpose();  // 120 mm, seen from the middle at 150 mm

  hold_at({0.02, 0.01, 0.12});
  EXPECT_TRUE(reads(*falcon, [](const DeviceReading& r) {
    return (r.pose_device_tool.position_mm - Vec3(20.0, 10.0, -30.0)).norm() < 0.1;
  }));
  usb_.command("falcon buttons 4");
  EXPECT_TRUE(reads(*falcon, [](const DeviceReading& r) { return r.buttons == kSpindlePedal; }));
  usb_.command("falcon buttons 9");
  EXPECT_TRUE(reads(*falcon, [](const DeviceReading& r) { return r.buttons == kClutchButton; }));
  EXPECT_TRUE(falcon->tend());
  falcon->close();
  EXPECT_EQ(falcon->read().status, DeviceStatus::absent);
}

TEST_F(FalconOnUsb, WhatRunsAlreadyNeedsNoFirmware) {
  plug("loaded");
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  EXPECT_TRUE(becomes_ready(*falcon));
  EXPECT_EQ(usb_.falcon_told().image_bytes, 0u);
}

TEST_F(FalconOnUsb, NoForceBeforeHoming) {
  plug("loaded");
  usb_.command("falcon homed 3");  // two axes of three
  hold_at({0.0, 0.0, 0.15});
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(reads(*falcon, [&](const DeviceReading& r) {
    falcon->write(Vec3(0.0, 0.0, 3.0));
    return r.status == DeviceStatus::ok && r.sample > 100;
  }));
  EXPECT_EQ(falcon->read().calibration, Calibration::pending);
  EXPECT_NE(falcon->advice(), "");
  const auto told = usb_.falcon_told();
  EXPECT_EQ(told.with_force, 0u);
  EXPECT_EQ(told.control, 1 | kFalconRed);
  usb_.command("falcon homed 7");
  ASSERT_TRUE(becomes_ready(*falcon));
  EXPECT_TRUE(wait_until([&] { return usb_.falcon_told().control == kFalconBlue; }, kPatience));
}

TEST_F(FalconOnUsb, MotorsDoTheWorkOfTheForceAndStopWithTheHapticThread) {
  plug("loaded");
  const Eigen::Vector3d grip_m(0.01, -0.015, 0.145);
  hold_at(grip_m);
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(becomes_ready(*falcon));
  const Vec3 force_n(1.0, -0.5, 2.0);
  bool shown = false;
  test::UsbStage::Told told;
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!shown && std::chrono::steady_clock::now() < deadline) {
    for (int i = 0; i < 40; ++i) {
      (void)falcon->read();
      falcon->write(force_n);
      std::this_thread::sleep_for(500us);
    }
    std::thread writer([&] {
      for (int i = 0; i < 40; ++i) {
        falcon->write(force_n);
        std::this_thread::sleep_for(500us);
      }
    });
    told = usb_.falcon_told();
    writer.join();
    shown = told.control == kFalconGreen;
  }
  ASSERT_TRUE(shown);
  // Compares the work of the torques −motors/10⁴ over a small move, by the inverse kinematics, with the force's
  // work.
  const Vec3 move_m(2e-4, 3e-4, -1e-4);
  const Eigen::Vector3d turned = *falcon_angles(grip_m + move_m) - *falcon_angles(grip_m - move_m);
  double work = 0.0;
  for (int i = 0; i < 3; ++i) work += -1e-4 * told.motors[static_cast<std::size_t>(i)] * turned[i];
  EXPECT_NEAR(work, force_n.dot(2.0 * move_m), 0.01 * force_n.norm() * 2.0 * move_m.norm());

  // Nothing is written any more. The force ends although the device goes on.
  EXPECT_TRUE(wait_until(
      [&] {
        const auto now = usb_.falcon_told();
        return now.motors == std::array<int, 3>{} && now.control == kFalconBlue;
      },
      kPatience));
}

struct End {
  const char* how;
  int signal;
};
class FalconsEnd : public FalconOnUsb, public testing::WithParamInterface<End> {};

// However the program ends, the last frame to the device has no force: the device may hold the last force it received.
TEST_P(FalconsEnd, StopsTheMotors) {
  plug("loaded");
  hold_at({0.0, 0.0, 0.15});
  test::Process child(test::program("hold_device"), {"falcon", "-", GetParam().how});
  ASSERT_TRUE(child.wait_for_out("holding", kPatience)) << child.err();
  // On a busy machine the device may not be ready yet.
  ASSERT_TRUE(wait_until([&] { return usb_.falcon_told().with_force > 10; }, kPatience));
  child.write("end\n");
  if (GetParam().signal) child.signal(GetParam().signal);
  ASSERT_TRUE(child.wait(kPatience));
  const auto told = usb_.falcon_told();
  EXPECT_EQ(told.motors, (std::array<int, 3>{}));
  EXPECT_EQ(told.bad_frames, 0u);
}
INSTANTIATE_TEST_SUITE_P(Ends, FalconsEnd,
                         testing::Values(End{"wait", SIGTERM}, End{"wait", SIGHUP}, End{"wait", SIGQUIT},
                                         End{"exit", 0}, End{"abort", 0}, End{"crash", 0}, End{"check", 0}),
                         [](const auto& end) { return std::string(end.param.how) + std::to_string(end.param.signal); });

TEST_F(FalconOnUsb, AForceBeyondItsLimitKeepsItsDirection) {
  plug("loaded");
  hold_at({0.0, 0.0, 0.15});
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(becomes_ready(*falcon));
  test::UsbStage::Told told;
  ASSERT_TRUE(wait_until(
      [&] {
        std::thread writer([&] {
          for (int i = 0; i < 40; ++i) {
            falcon->write(Vec3(0.0, 0.0, 1000.0));
            std::this_thread::sleep_for(500us);
          }
        });
        told = usb_.falcon_told();
        writer.join();
        return told.motors != std::array<int, 3>{};
      },
      kPatience));
  // 8 N along z are the same torque in all three legs, by symmetry. In the middle it is about 0.18 N m.
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(told.motors[static_cast<std::size_t>(i)], told.motors[0], 20.0);
  const double dz = 1e-5;
  const double slope = ((*falcon_angles({0, 0, 0.15 + dz}))[0] - (*falcon_angles({0, 0, 0.15 - dz}))[0]) / (2.0 * dz);
  EXPECT_NEAR(3.0 * -1e-4 * told.motors[0] * slope, 8.0, 0.1);
}

TEST_F(FalconOnUsb, WrongFirmwareIsOneSentence) {
  plug();
  const auto sentence = [&](const std::filesystem::path& image) {
    const auto falcon = device(image);
    const Result<void> opened = falcon->open();
    EXPECT_FALSE(opened) << image;
    EXPECT_EQ(falcon->read().status, DeviceStatus::absent);
    return opened ? std::string() : opened.error().message;
  };
  const std::string missing = sentence(folder_ / "nowhere.bin");
  EXPECT_NE(missing.find("nowhere.bin is not there"), std::string::npos) << missing;
  EXPECT_EQ(missing.find('\n'), std::string::npos);
  EXPECT_NE(sentence(folder_.path()).find("is not a file"), std::string::npos);
  std::ofstream(folder_ / "empty.bin").close();
  EXPECT_NE(sentence(folder_ / "empty.bin").find("has 0 bytes"), std::string::npos);
  EXPECT_NE(sentence({}).find("--falcon-firmware"), std::string::npos);
  test::write_other_image(folder_ / "other.bin", 700);
  const std::string other = sentence(folder_ / "other.bin");
  EXPECT_NE(other.find("other.bin but nothing in it answers"), std::string::npos) << other;
  for (const std::string& text : {missing, other}) std::printf("%s\n", text.c_str());
}

TEST_F(FalconOnUsb, AFalseEchoStopsTheLoading) {
  plug();
  usb_.command("falcon false-echo 1000");
  const auto falcon = device(image_);
  const Result<void> opened = falcon->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
  EXPECT_NE(opened.error().message.find("byte 992"), std::string::npos)
      << opened.error().message;  // of its 62-byte block
  usb_.command("falcon false-echo -1");
  EXPECT_TRUE(opens(*falcon));
}

TEST_F(FalconOnUsb, SpoiltFramesAndFailedTransfersAreOutlived) {
  plug("loaded");
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(becomes_ready(*falcon));
  usb_.command("falcon spoil 3");
  const std::uint64_t before = falcon->read().sample;
  EXPECT_TRUE(reads(*falcon, [&](const DeviceReading& r) { return r.usable() && r.sample > before + 50; }));
  EXPECT_TRUE(falcon->tend());
  usb_.command("falcon fail 1");
  const std::uint64_t later = falcon->read().sample;
  EXPECT_TRUE(reads(*falcon, [&](const DeviceReading& r) { return r.usable() && r.sample > later + 50; }));
  EXPECT_TRUE(falcon->tend());
}

TEST_F(FalconOnUsb, ABrokenBusIsADeviceError) {
  plug("loaded");
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(becomes_ready(*falcon));
  usb_.command("falcon fail 1000000");
  ASSERT_TRUE(wait_until([&] { return !falcon->tend(); }, kPatience));
  EXPECT_FALSE(falcon->read().usable());
  EXPECT_EQ(falcon->read().buttons, 0u);
  EXPECT_NE(falcon->tend().error().message.find("failed (LIBUSB_ERROR_IO)"), std::string::npos)
      << falcon->tend().error().message;
  falcon->close();
  usb_.command("falcon fail 0");
  ASSERT_TRUE(opens(*falcon));
  EXPECT_TRUE(becomes_ready(*falcon));
}

TEST_F(FalconOnUsb, SilenceIsADeviceError) {
  plug("loaded");
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(becomes_ready(*falcon));
  usb_.command("falcon silent 1");
  EXPECT_TRUE(reads(*falcon, [](const DeviceReading& r) { return !r.usable(); }));
  ASSERT_TRUE(wait_until([&] { return !falcon->tend(); }, kPatience));
  EXPECT_NE(falcon->tend().error().message.find("stopped answering"), std::string::npos);
}

TEST_F(FalconOnUsb, UnpluggedAtAnyMomentAndPluggedInAgain) {
  const auto falcon = device(image_);
  for (const char* when : {"running", "homing", "running"}) {
    plug();
    ASSERT_TRUE(opens(*falcon)) << when;
    if (std::string(when) == "running") {
      ASSERT_TRUE(becomes_ready(*falcon));
      falcon->write(Vec3(0.0, 0.0, 2.0));
    }
    usb_.command("unplug falcon");
    EXPECT_TRUE(reads(*falcon, [](const DeviceReading& r) { return !r.usable() && r.buttons == 0; })) << when;
    ASSERT_TRUE(wait_until([&] { return !falcon->tend(); }, kPatience)) << when;
    const Error why = falcon->tend().error();
    EXPECT_EQ(why.code, ErrorCode::unavailable);
    std::printf("%s: %s\n", when, why.message.c_str());
    EXPECT_NE(why.message.find("unplugged"), std::string::npos) << why.message;
    falcon->close();
    EXPECT_FALSE(falcon->open());  // no device is there
  }
  plug();
  ASSERT_TRUE(opens(*falcon));
  EXPECT_TRUE(becomes_ready(*falcon));
  // A force from before the device went is forgotten.
  const auto told = usb_.falcon_told();
  EXPECT_EQ(told.with_force, 0u);
}

TEST_F(FalconOnUsb, UnpluggedWhileItsFirmwareIsLoaded) {
  plug();
  const auto falcon = device(image_);
  std::thread puller([&] {
    EXPECT_TRUE(wait_until([&] { return usb_.falcon_told().image_bytes > 500; }, kPatience));
    usb_.command("unplug falcon");
  });
  const Result<void> opened = falcon->open();
  puller.join();
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("unplugged"), std::string::npos) << opened.error().message;
  EXPECT_EQ(falcon->read().status, DeviceStatus::absent);
}

TEST_F(FalconOnUsb, TheHapticThreadNeitherAllocatesNorWaits) {
  plug("loaded");
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(becomes_ready(*falcon));
  double sum = 0.0;
  const test::AllocationCounter heap;
  for (int i = 0; i < 20000; ++i) {
    sum += falcon->read().pose_device_tool.position_mm.z();
    falcon->write(Vec3(0.0, 0.0, 1.0));
  }
  EXPECT_EQ(heap.count(), 0);
  EXPECT_NE(sum, 0.123);
  falcon->close();
  const test::AllocationCounter closed;
  for (int i = 0; i < 1000; ++i) {
    (void)falcon->read();
    falcon->write(Vec3(0.0, 0.0, 1.0));
  }
  EXPECT_EQ(closed.count(), 0);
}

// Thousands of frames each way while the grip moves. The full count of 10⁵ is measured elsewhere.
TEST_F(FalconOnUsb, ThousandsOfCycles) {
  constexpr std::uint64_t kCycles = 2000;
  plug("loaded");
  const auto falcon = device({});
  ASSERT_TRUE(opens(*falcon));
  ASSERT_TRUE(becomes_ready(*falcon));
  const auto begun = usb_.falcon_told();
  const std::uint64_t first = falcon->read().sample;
  ASSERT_TRUE(wait_until(
      [&] {
        const DeviceReading r = falcon->read();
        falcon->write(Vec3(0.5, 0.0, 0.5));
        return r.sample > first + kCycles;
      },
      60s));
  const auto told = usb_.falcon_told();
  EXPECT_GE(told.frames - begun.frames, kCycles);
  EXPECT_EQ(told.bad_frames, 0u);
  EXPECT_GT(told.with_force, kCycles / 10);
}

}  // namespace
}  // namespace osteon::haptic

int main(int argc, char** argv) {
  osteon::test::enter_usb_emulation(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
