// A Falcon for the hand, a SpaceMouse for the rotation and a pedal for the spindle, all emulated and held by their
// connections.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "haptic_client/device/connection.hpp"
#include "haptic_client/device/device_list.hpp"
#include "tests/support/usb/usb_stage.hpp"
#include "tests/support/wait.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using test::kPatience;
using test::wait_until;

class Together : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* device : {"falcon loaded", "spacemouse", "switch"})
      ASSERT_EQ(usb_.command(std::string("plug ") + device), "ok");
    Result<std::unique_ptr<CombinedDevice>> made = make_devices("falcon+spacemouse+pedal", {});
    ASSERT_TRUE(made) << made.error().message;
    device_ = std::move(*made);
    for (const auto& part : device_->parts()) {
      connections_.push_back(std::make_unique<DeviceConnection>(
          *part,
          [this](DeviceEvent event, std::string_view, const std::string& sentence) {
            const std::lock_guard lock(mutex_);
            if (event == DeviceEvent::lost) lost_.push_back(sentence);
          },
          ConnectionPace{20ms, 50ms}));
      const Result<void> started = connections_.back()->start();
      ASSERT_TRUE(started) << started.error().message;
    }
    ASSERT_TRUE(reads([](const DeviceReading& r) { return r.usable(); }));
  }
  void TearDown() override { connections_.clear(); }

  bool reads(const std::function<bool(const DeviceReading&)>& wanted) {
    return wait_until([&] { return wanted(device_->read()); }, kPatience);
  }
  bool was_told(const std::string& part) {
    return wait_until(
        [&] {
          const std::lock_guard lock(mutex_);
          return std::any_of(lost_.begin(), lost_.end(),
                             [&](const std::string& s) { return s.find(part) != std::string::npos; });
        },
        kPatience);
  }

  test::UsbStage usb_;
  std::unique_ptr<CombinedDevice> device_;
  std::mutex mutex_;
  std::vector<std::string> lost_;
  std::vector<std::unique_ptr<DeviceConnection>> connections_;
};

TEST_F(Together, EachGivesItsPart) {
  const double z_mm = device_->read().pose_device_tool.position_mm.z();
  usb_.command("falcon encoders -304 -304 -304");
  EXPECT_TRUE(reads([&](const DeviceReading& r) { return std::abs(r.pose_device_tool.position_mm.z() - z_mm) > 1.0; }));
  const Eigen::Quaterniond before = device_->read().pose_device_tool.rotation;
  usb_.report("spacemouse", {1, 0, 0, 0, 0, 0, 0, 0x5e, 0x01, 0, 0, 0, 0});
  EXPECT_TRUE(reads([&](const DeviceReading& r) { return r.pose_device_tool.rotation.angularDistance(before) > 0.1; }));
  usb_.report("switch", {2, 0});
  EXPECT_TRUE(reads([](const DeviceReading& r) { return r.spindle() == 1.0; }));
  usb_.report("switch", {0, 0});
  // If there is a pedal, a button of the hand's device does not control the spindle.
  usb_.command("falcon buttons 4");
  EXPECT_TRUE(reads([](const DeviceReading& r) { return (r.buttons & kClutchButton) && r.spindle() == 0.0; }));
}

TEST_F(Together, WhateverIsUnpluggedComesBackByItself) {
  usb_.report("switch", {1, 0});
  ASSERT_TRUE(reads([](const DeviceReading& r) { return r.spindle() == 1.0; }));
  usb_.command("unplug switch");
  EXPECT_TRUE(reads([](const DeviceReading& r) { return r.usable() && r.spindle() == 0.0; }));
  EXPECT_TRUE(was_told("foot pedal"));
  usb_.command("plug switch");
  EXPECT_TRUE(wait_until([&] { return connections_[2]->connected(); }, kPatience));
  usb_.report("switch", {1, 0});
  EXPECT_TRUE(reads([](const DeviceReading& r) { return r.spindle() == 1.0; }));

  usb_.command("unplug spacemouse");
  EXPECT_TRUE(reads([](const DeviceReading& r) { return !r.usable(); }));
  EXPECT_TRUE(was_told("SpaceMouse"));
  usb_.command("plug spacemouse");
  EXPECT_TRUE(reads([](const DeviceReading& r) { return r.usable(); }));

  usb_.command("unplug falcon");
  EXPECT_TRUE(reads([](const DeviceReading& r) { return !r.usable(); }));
  EXPECT_TRUE(was_told("Falcon"));
  // Forces written while the device is away are dropped, and not stored for later.
  device_->write(Vec3(0.0, 0.0, 3.0));
  usb_.command("plug falcon loaded");
  EXPECT_TRUE(reads([](const DeviceReading& r) { return r.usable(); }));
  EXPECT_EQ(usb_.falcon_told().with_force, 0u);
}

TEST_F(Together, AllAreListed) {
  int found = 0;
  for (const DeviceLine& line : look_for_devices({})) {
    if (line.name == "falcon" || line.name == "spacemouse" || line.name == "pedal")
      found += static_cast<int>(line.finding.found.size());
  }
  EXPECT_EQ(found, 3);
}

}  // namespace
}  // namespace osteon::haptic
