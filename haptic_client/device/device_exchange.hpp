// Exchanges readings and forces between a device's own I/O thread and the haptic thread. Neither ever waits. A force
// ends by itself when its writer stops writing. A reading that no longer changes becomes a fault.
#pragma once
#include <atomic>
#include <chrono>

#include "common/runtime/triple_buffer.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

class DeviceExchange {
 public:
  using Time = std::chrono::steady_clock::time_point;
  // Three ticks of the haptic thread. After the third missed tick, the device's next frame shows no force.
  static constexpr std::chrono::milliseconds kForceHeld{3};
  static constexpr int kReadsWithoutSample = 20;  // reads without a sample until the device is silent; assumption [A]

  explicit DeviceExchange(Time::duration force_held = kForceHeld) : force_held_(force_held) { go_absent(); }

  // [I/O, or the connection thread while no I/O thread runs]
  void publish(const DeviceReading& reading) noexcept {
    last_ = reading;
    last_.sample = ++samples_;
    readings_.store(last_);
  }
  // [as publish] From now on the reading is absent or fault, at its last pose.
  void go(DeviceStatus status) noexcept {
    last_.status = status;
    last_.buttons = 0;
    last_.pedal = 0.0;
    publish(last_);
  }
  void go_absent() noexcept { go(DeviceStatus::absent); }
  // [I/O] The force that is wanted now; none when the haptic thread has written nothing for `force_held`. The age
  // counts from the time of writing. So a force ends on time even if this thread is late to see it.
  [[nodiscard]] DeviceOutput demanded(Time now) noexcept {
    if (outputs_.refresh()) any_written_ = true;
    const Written& last = outputs_.value();
    return any_written_ && now - last.at < force_held_ ? last.output : DeviceOutput{};
  }
  // [I/O or connection thread, while no I/O thread runs] Discards everything that was written before.
  void forget_output() noexcept {
    outputs_.refresh();
    any_written_ = false;
  }

  // [haptic] The newest reading, with no buttons while it is not ok.
  [[nodiscard]] DeviceReading read() noexcept {
    if (readings_.refresh())
      reads_since_ = 0;
    else if (reads_since_ < kReadsWithoutSample)
      ++reads_since_;
    DeviceReading reading = readings_.value();
    if (reads_since_ >= kReadsWithoutSample && reading.status != DeviceStatus::absent) {
      reading.status = DeviceStatus::fault;
      reading.buttons = 0;
      reading.pedal = 0.0;
    }
    return reading;
  }
  // [haptic] `now`: of the same clock as in demanded().
  void write(const DeviceOutput& output, Time now = std::chrono::steady_clock::now()) noexcept {
    outputs_.store({output, now});
  }

 private:
  struct Written {
    DeviceOutput output;
    Time at{};
  };

  const Time::duration force_held_;
  TripleBuffer<DeviceReading> readings_;
  TripleBuffer<Written> outputs_;
  DeviceReading last_;         // I/O
  std::uint64_t samples_ = 0;  // I/O
  bool any_written_ = false;   // I/O
  int reads_since_ = 0;        // haptic
};

}  // namespace osteon::haptic
