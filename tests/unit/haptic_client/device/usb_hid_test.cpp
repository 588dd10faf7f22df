// SpaceMouse and foot pedals on emulated hidraw nodes. hidapi and everything above it are real.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <functional>
#include <thread>

#include "common/input/hid_port.hpp"
#include "common/input/space_mouse.hpp"
#include "haptic_client/device/foot_pedal.hpp"
#include "haptic_client/device/space_mouse.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/usb/usb_stage.hpp"
#include "tests/support/wait.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using test::kPatience;
using test::wait_until;

class HidOnUsb : public testing::Test {
 protected:
  bool reads(HapticDevice& device, const std::function<bool(const DeviceReading&)>& wanted) {
    return wait_until([&] { return wanted(device.read()); }, kPatience);
  }
  test::UsbStage usb_;
};

std::string why(const Result<void>& result) { return result ? "" : result.error().message; }

TEST_F(HidOnUsb, NothingIsThere) {
  EXPECT_TRUE(look_for_space_mouse().found.empty());
  for (const bool proportional : {false, true}) EXPECT_TRUE(look_for_foot_pedals(proportional).found.empty());
  for (const auto& device : {make_space_mouse(), make_foot_pedal(), make_foot_pedal({.proportional = true})}) {
    const Result<void> opened = device->open();
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::not_found);
    EXPECT_NE(opened.error().message.find("plug it in"), std::string::npos);
    EXPECT_EQ(device->read().status, DeviceStatus::absent);
  }
}

// The message about a device that cannot be opened contains the system's reason.
TEST_F(HidOnUsb, WhyADeviceCannotBeOpened) {
  const auto said = [](int number) {
    const Error error = hid_open_error("the foot pedal", "/dev/hidraw7", number);
    EXPECT_EQ(error.code, ErrorCode::unavailable);
    return error.message;
  };
  EXPECT_EQ(said(EACCES),
            "no permission to use the foot pedal at /dev/hidraw7; install deploy/udev/70-osteon-devices.rules and "
            "plug it in again");
  EXPECT_EQ(said(ENODEV), "the foot pedal at /dev/hidraw7 was unplugged; plug it in again");
  EXPECT_EQ(said(EBUSY), "another program uses the foot pedal at /dev/hidraw7; end it");
  EXPECT_EQ(said(EIO),
            "the foot pedal at /dev/hidraw7 cannot be opened (Input/output error); unplug it and plug it in again");
  // The device vanished between search and opening.
  usb_.command("plug switch");
  const std::vector<HidFound> found = list_hid_devices();
  ASSERT_EQ(found.size(), 1u);
  usb_.command("unplug switch");
  const Result<HidPort> port = HidPort::open(found[0], "the foot pedal");
  ASSERT_FALSE(port);
  EXPECT_EQ(port.error().message, "the foot pedal at /dev/hidraw0 was unplugged; plug it in again");
}

TEST_F(HidOnUsb, EveryKnownSpaceMouseIsFound) {
  const char* const kIds[] = {"046d c603", "046d c605", "046d c606", "046d c621", "046d c623", "046d c625",
                              "046d c626", "046d c627", "046d c628", "046d c629", "046d c62b", "046d c640",
                              "256f c62e", "256f c62f", "256f c631", "256f c632", "256f c633", "256f c635",
                              "256f c636", "256f c638", "256f c63a", "256f c652"};
  int round = 0;
  for (const char* id : kIds) {
    ASSERT_EQ(usb_.command(std::string("plug spacemouse ") + id), "ok");
    const DeviceFinding finding = look_for_space_mouse();
    ASSERT_EQ(finding.found.size(), 1u) << id;
    EXPECT_EQ(finding.found[0], "SpaceMouse Compact, /dev/hidraw" + std::to_string(round++));
    usb_.command("unplug spacemouse");
  }
  usb_.command("plug spacemouse 046d c52b");  // a receiver for mice
  EXPECT_TRUE(look_for_space_mouse().found.empty());
}

TEST_F(HidOnUsb, ASpaceMouseMovesAndTurnsAToolAndLightsUp) {
  usb_.command("plug spacemouse");
  const auto mouse = make_space_mouse();
  ASSERT_EQ(why(mouse->open()), "");
  EXPECT_EQ(usb_.command("written spacemouse"), "4 1 ");
  EXPECT_EQ(mouse->limits().peak_n, 0.0);
  EXPECT_EQ(mouse->info().force_axes, 0);
  ASSERT_TRUE(reads(*mouse, [](const DeviceReading& r) { return r.usable(); }));
  const Pose start = mouse->read().pose_device_tool;
  EXPECT_EQ(start.position_mm, Vec3::Zero());

  usb_.report("spacemouse", {1, 0x5e, 0x01, 0, 0, 0, 0});  // all the way to the right
  EXPECT_TRUE(reads(*mouse, [](const DeviceReading& r) { return r.pose_device_tool.position_mm.x() > 5.0; }));
  usb_.report("spacemouse", {1, 0, 0, 0, 0, 0, 0, 0x5e, 0x01, 0, 0, 0, 0});  // about its x
  EXPECT_TRUE(reads(*mouse, [&](const DeviceReading& r) {
    return r.pose_device_tool.rotation.angularDistance(start.rotation) > 0.05;
  }));
  usb_.report("spacemouse", {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  usb_.report("spacemouse", {3, 1, 0});
  ASSERT_TRUE(reads(*mouse, [](const DeviceReading& r) { return r.buttons == kSpindlePedal; }));
  const Pose rest = mouse->read().pose_device_tool;
  EXPECT_NEAR(rest.position_mm.y(), 0.0, 1e-9);
  const Eigen::AngleAxisd turned(rest.rotation * start.rotation.conjugate());
  EXPECT_NEAR(turned.axis().x(), 1.0, 1e-9);
  usb_.report("spacemouse", {3, 2, 0});
  ASSERT_TRUE(reads(*mouse, [](const DeviceReading& r) { return r.buttons == kClutchButton; }));
  EXPECT_EQ(mouse->read().pose_device_tool.position_mm, rest.position_mm);
  usb_.report("spacemouse", {0x17, 9});
  EXPECT_TRUE(wait_until([&] { return mouse->advice().find("9 %") != std::string::npos; }, kPatience));
  mouse->close();
  EXPECT_EQ(usb_.command("written spacemouse"), "4 0 ");
}

TEST_F(HidOnUsb, ALostDeflectionEndsByItself) {
  usb_.command("plug spacemouse");
  const auto mouse = make_space_mouse({.light = false});
  ASSERT_EQ(why(mouse->open()), "");
  EXPECT_EQ(usb_.command("written spacemouse"), "");
  usb_.report("spacemouse", {1, 0x5e, 0x01, 0, 0, 0, 0});  // and never again
  ASSERT_TRUE(reads(*mouse, [](const DeviceReading& r) { return r.pose_device_tool.position_mm.x() > 1.0; }));
  EXPECT_TRUE(wait_until(
      [&] {
        const double before = mouse->read().pose_device_tool.position_mm.x();
        std::this_thread::sleep_for(50ms);
        return mouse->read().pose_device_tool.position_mm.x() == before;
      },
      kPatience));
  EXPECT_LT(mouse->read().pose_device_tool.position_mm.x(), 99.0);  // long before the end of its travel
}

TEST_F(HidOnUsb, ACameraFollowsWhicheverCapIsThere) {
  std::atomic<int> said{0};
  SpaceMouseWatch watch([&](const std::string& sentence) {
    std::printf("%s\n", sentence.c_str());
    ++said;
  });
  EXPECT_EQ(watch.cap().push, Vec3::Zero());
  for (int round = 0; round < 2; ++round) {
    usb_.command("plug spacemouse");
    ASSERT_TRUE(wait_until([&] { return said == 2 * round + 1; }, kPatience));
    usb_.report("spacemouse", {1, 0, 0, 0, 0, 0x5e, 0x01});
    EXPECT_TRUE(wait_until([&] { return watch.cap().push == Vec3(0.0, -1.0, 0.0); }, kPatience));
    usb_.command("unplug spacemouse");
    EXPECT_TRUE(wait_until([&] { return watch.cap().push == Vec3::Zero(); }, kPatience));
    ASSERT_TRUE(wait_until([&] { return said == 2 * round + 2; }, kPatience));
  }
}

TEST_F(HidOnUsb, ASwitchTurnsTheSpindle) {
  usb_.command("plug switch");
  ASSERT_EQ(look_for_foot_pedals().found, std::vector<std::string>{"VEC Footpedal (foot pedal), /dev/hidraw0"});
  EXPECT_TRUE(look_for_foot_pedals(true).found.empty());
  const auto pedal = make_foot_pedal({.switches = 2});
  ASSERT_EQ(why(pedal->open()), "");
  EXPECT_TRUE(pedal->info().pedals);
  ASSERT_TRUE(reads(*pedal, [](const DeviceReading& r) { return r.usable() && r.spindle() == 0.0; }));
  usb_.report("switch", {2, 0});
  EXPECT_TRUE(reads(*pedal, [](const DeviceReading& r) { return r.spindle() == 1.0; }));
  usb_.report("switch", {5, 0});  // the other two
  EXPECT_TRUE(reads(*pedal, [](const DeviceReading& r) { return r.spindle() == 0.0; }));
}

TEST_F(HidOnUsb, AJoysticksAxisTurnsItAsFastAsItIsDown) {
  usb_.command("plug joystick");
  ASSERT_EQ(look_for_foot_pedals(true).found, std::vector<std::string>{"Emulated Pedals (joystick), /dev/hidraw0"});
  EXPECT_TRUE(look_for_foot_pedals(false).found.empty());
  const auto pedal = make_foot_pedal({.proportional = true, .axis = {.play = 0.0}});
  ASSERT_EQ(why(pedal->open()), "");
  usb_.report("joystick", {0, 0, 0x80, 0x00});  // already a little down
  ASSERT_TRUE(
      wait_until([&] { return usb_.command("unread joystick") == "0" && !pedal->advice().empty(); }, kPatience));
  EXPECT_EQ(pedal->read().spindle(), 0.0);
  EXPECT_EQ(pedal->advice(), "release the foot pedal once; until then the spindle does not turn");
  usb_.report("joystick", {0, 0, 0, 0});
  ASSERT_TRUE(wait_until([&] { return pedal->advice().empty(); }, kPatience));
  usb_.report("joystick", {0, 0, 0x00, 0x01});  // 256 of 1023; z comes before x if both exist
  EXPECT_TRUE(reads(*pedal, [](const DeviceReading& r) { return std::abs(r.spindle() - 256.0 / 1023.0) < 1e-9; }));
  usb_.report("joystick", {0, 0xff, 0xff, 0x03});
  EXPECT_TRUE(reads(*pedal, [](const DeviceReading& r) { return r.spindle() == 1.0; }));

  const auto other =
      // an axis that the device does not have
      make_foot_pedal({.proportional = true, .axis_usage = HidUsage{1, 0x35}});
  const Result<void> opened = other->open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
}

// A pedal that rests at its axis' upper end turns the spindle when it is pressed, or never.
TEST_F(HidOnUsb, AnAxisThatRestsAtItsUpperEndIsInverted) {
  usb_.command("plug joystick");
  FootPedalOptions options = *read_pedal_axis("z:inverted");
  options.axis.play = 0.0;
  const auto pedal = make_foot_pedal(options), wrong = make_foot_pedal(*read_pedal_axis("z"));
  const std::vector<std::uint8_t> rest{0, 0, 0xff, 0x03}, pressed{0, 0, 0x00, 0x00};
  ASSERT_EQ(why(wrong->open()), "");
  usb_.report("joystick", rest);
  ASSERT_TRUE(wait_until([&] { return wrong->advice().find("pedal-axis:inverted") != std::string::npos; }, kPatience));
  for (const auto& report : {pressed, rest}) {
    usb_.report("joystick", report);
    ASSERT_TRUE(wait_until([&] { return usb_.command("unread joystick") == "0"; }, kPatience));
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(wrong->read().spindle(), 0.0);
  }
  wrong->close();
  ASSERT_EQ(why(pedal->open()), "");
  usb_.report("joystick", rest);
  ASSERT_TRUE(wait_until([&] { return pedal->advice().empty(); }, kPatience));
  usb_.report("joystick", {0, 0, 0x00, 0x03});  // 768 of 1023 from its lower end
  EXPECT_TRUE(reads(*pedal, [](const DeviceReading& r) { return std::abs(r.spindle() - 255.0 / 1023.0) < 1e-9; }));
  usb_.report("joystick", pressed);
  EXPECT_TRUE(reads(*pedal, [](const DeviceReading& r) { return r.spindle() == 1.0; }));
}

TEST_F(HidOnUsb, UnpluggedAndPluggedInAgain) {
  struct Kind {
    const char* name;
    std::unique_ptr<HapticDevice> device;
    std::vector<std::uint8_t> pressed;
  };
  Kind kinds[] = {{"spacemouse", make_space_mouse(), {3, 1, 0}}, {"switch", make_foot_pedal(), {1, 0}}};
  for (Kind& kind : kinds) {
    const std::string name = kind.name;
    for (int round = 0; round < 3; ++round) {
      usb_.command("plug " + name);
      ASSERT_EQ(why(kind.device->open()), "") << name;
      usb_.report(name, kind.pressed);
      ASSERT_TRUE(reads(*kind.device, [](const DeviceReading& r) { return r.spindle() == 1.0; })) << name;
      usb_.command("unplug " + name);
      EXPECT_TRUE(reads(*kind.device, [](const DeviceReading& r) { return !r.usable() && r.spindle() == 0.0; }))
          << name;
      ASSERT_TRUE(wait_until([&] { return !kind.device->tend(); }, kPatience)) << name;
      EXPECT_NE(kind.device->tend().error().message.find("unplugged"), std::string::npos);
      kind.device->close();
      EXPECT_FALSE(kind.device->open());
    }
    std::printf("%s: %s\n", kind.name, kind.device->open().error().message.c_str());
  }
}

TEST_F(HidOnUsb, TheHapticThreadDoesNotAllocate) {
  usb_.command("plug spacemouse");
  usb_.command("plug switch");
  const auto mouse = make_space_mouse();
  const auto pedal = make_foot_pedal();
  ASSERT_EQ(why(mouse->open()), "");
  ASSERT_EQ(why(pedal->open()), "");
  const test::AllocationCounter heap;
  for (int i = 0; i < 10000; ++i) {
    (void)mouse->read();
    mouse->write({});
    (void)pedal->read();
    pedal->write({});
  }
  EXPECT_EQ(heap.count(), 0);
}

// No report of a burst is lost. A thousand a second are more than any of these devices sends.
TEST_F(HidOnUsb, ThousandsOfReports) {
  usb_.command("plug switch");
  const auto pedal = make_foot_pedal();
  ASSERT_EQ(why(pedal->open()), "");
  for (int i = 0; i < 1000; ++i) usb_.report("switch", {static_cast<std::uint8_t>(i & 1), 0});
  EXPECT_TRUE(wait_until([&] { return usb_.command("unread switch") == "0"; }, kPatience));
  usb_.report("switch", {4, 0});
  EXPECT_TRUE(reads(*pedal, [](const DeviceReading& r) { return r.spindle() == 1.0; }));
  EXPECT_TRUE(pedal->tend());
}

}  // namespace
}  // namespace osteon::haptic

int main(int argc, char** argv) {
  osteon::test::enter_usb_emulation(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
