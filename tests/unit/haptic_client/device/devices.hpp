// The simulated arm of the stand-in libraries. There is one for the process, and each test gets it in its initial
// state.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>

#include "haptic_client/device/connection.hpp"
#include "tests/support/devices/arm.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::haptic::test {

using namespace std::chrono_literals;
using osteon::test::ArmStrings;
using osteon::test::wait_until;

inline constexpr auto kPatience = std::chrono::seconds(20);

class WithArm : public ::testing::Test {
 protected:
  WithArm() { arm().reset(); }
  static ArmStrings& arm() {
    static const osteon::test::TempDir folder;
    static ArmStrings the(folder / "arm");
    return the;
  }
};

// Messages of a connection.
class Heard {
 public:
  DeviceNotice notice() {
    return [this](DeviceEvent event, std::string_view, const std::string& sentence) {
      const std::lock_guard lock(mutex_);
      all_.emplace_back(event, sentence);
    };
  }
  // The last sentence of a kind. Empty: there was none.
  std::string last(DeviceEvent event) {
    const std::lock_guard lock(mutex_);
    for (auto i = all_.rbegin(); i != all_.rend(); ++i)
      if (i->first == event) return i->second;
    return {};
  }
  // True if any sentence of a kind contained `what`.
  bool said(DeviceEvent event, std::string_view what) {
    const std::lock_guard lock(mutex_);
    return std::any_of(all_.begin(), all_.end(), [&](const auto& one) {
      return one.first == event && one.second.find(what) != std::string::npos;
    });
  }
  std::size_t count(DeviceEvent event) {
    const std::lock_guard lock(mutex_);
    std::size_t n = 0;
    for (const auto& [kind, text] : all_) n += kind == event;
    return n;
  }

 private:
  std::mutex mutex_;
  std::vector<std::pair<DeviceEvent, std::string>> all_;
};

// Writes a force to a device on another thread, as a haptic loop does, until destroyed.
class Holding {
 public:
  explicit Holding(HapticDevice& device, const DeviceOutput& output)
      : thread_([this, &device, output] {
          while (!over_) {
            last_ = static_cast<int>(device.read().status);
            device.write(output);
            std::this_thread::sleep_for(1ms);
          }
        }) {}
  ~Holding() {
    over_ = true;
    thread_.join();
  }
  [[nodiscard]] DeviceStatus status() const { return static_cast<DeviceStatus>(last_.load()); }

 private:
  std::atomic<bool> over_{false};
  std::atomic<int> last_{static_cast<int>(DeviceStatus::absent)};
  std::thread thread_;
};

}  // namespace osteon::haptic::test
