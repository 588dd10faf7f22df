// What the loop needs of any device that a hand holds: where the hand is, what it presses, and force to show it.
// Device frame: x right, y up, z to the user; millimetres, newtons, newton-millimetres. A handle's own frame is a
// tool's: its tip at the origin, +z out of the tip.
//
// Two threads use a device. The connection thread (connection.hpp) opens, tends, closes and opens again; the haptic
// thread reads and writes at any time, also while the other opens or closes: a device that is not there reads as absent
// and takes forces to nowhere. So a device keeps between its own I/O thread and the haptic thread a DeviceExchange
// (device_exchange.hpp), which also takes the force away when the haptic thread is late.
// A kind of device has in its header `std::unique_ptr<HapticDevice> make_X(options)` and `DeviceFinding look_for_X()`.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon::haptic {

// Read from the device itself where it tells them.
struct DeviceLimits {
  double peak_n = 0;  // 0: shows no force
  double continuous_n = 0;
  double stiffness_n_per_mm = 0;
  double workspace_radius_mm = 0;
  double damping_n_s_per_mm = 0;  // most that may be rendered; 0: the device does not say
  double peak_nmm = 0;            // torque; 0: shows none
  double continuous_nmm = 0;
  Vec3 workspace_middle_mm = Vec3::Zero();
};

enum class DeviceStatus : std::uint8_t {
  ok,
  warm,    // motors are warm: only the continuous force may be asked for
  fault,   // broken or silent: no force, and what was read is old
  absent,  // not opened, or unplugged: no force, and what was read is old
};

// No force is shown before `done`. A device that needs none is always done.
enum class Calibration : std::uint8_t {
  done,
  pending,  // the device or its driver is at it, or waits for the hand: HapticDevice::advice() says what is to be done
};

enum DeviceButton : std::uint32_t {
  kClutchButton = 1,  // held: the tool stays and the handle moves freely
  kSpindlePedal = 2,  // held: the spindle turns at full speed
};

struct DeviceReading {
  Pose pose_device_tool;  // the handle
  std::uint32_t buttons = 0;
  DeviceStatus status = DeviceStatus::ok;
  Calibration calibration = Calibration::done;
  double pedal = 0;          // of a proportional pedal, 0 … 1 of the tool's speed
  std::uint64_t sample = 0;  // counts the device's own samples

  // Of the spindle's full speed, by pedal or button.
  [[nodiscard]] double spindle() const noexcept { return buttons & kSpindlePedal ? 1.0 : pedal; }
  [[nodiscard]] bool usable() const noexcept {
    return (status == DeviceStatus::ok || status == DeviceStatus::warm) && calibration == Calibration::done;
  }
};

// Held until the next write. A device without torque shows the force alone: torque never becomes force.
struct DeviceOutput {
  Vec3 force_n = Vec3::Zero(), torque_nmm = Vec3::Zero();

  DeviceOutput() = default;
  DeviceOutput(const Vec3& force, const Vec3& torque = Vec3::Zero()) : force_n(force), torque_nmm(torque) {}
};

// Known once open() has succeeded; what kind of device it is (places, turns, pedals, axes) as far as possible before.
struct DeviceInfo {
  std::string model, serial, driver;  // as the device and its library name themselves; empty: it does not
  bool places = true, turns = true;   // what it reads: position, rotation
  bool pedals = false;  // it is there for the spindle: another device's spindle button becomes a second clutch
  int force_axes = 3, torque_axes = 0;  // what it shows: 0 or 3 of each
};

// The rotation of a handle that has none of its own: a tool that points away from the user.
[[nodiscard]] inline Eigen::Quaterniond pointing_away() { return {0.0, 1.0, 0.0, 0.0}; }

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;                        // closes
  [[nodiscard]] virtual std::string_view name() const = 0;  // as --device names it

  // [connection] May take seconds. Errors: not_found (no such device or library), unavailable (in use, no permission,
  // no answer), unsupported (a library of the wrong kind), internal. Each a sentence that ends in the remedy.
  [[nodiscard]] virtual Result<void> open() { return {}; }
  // [connection] Force ends at once. May be called at any time, also twice or after an open() that failed.
  virtual void close() noexcept {}
  // [connection] While open, ten times a second: what is too slow for a haptic thread (temperature, calibration). An
  // error says that the device is lost: it is closed then, and opened again when it can be.
  [[nodiscard]] virtual Result<void> tend() { return {}; }
  // [connection] What the user should do now, a sentence; empty: nothing.
  [[nodiscard]] virtual std::string advice() const { return {}; }

  // [connection] Or any thread while the connection thread does not open or close.
  [[nodiscard]] virtual DeviceLimits limits() const = 0;
  [[nodiscard]] virtual DeviceInfo info() const { return {}; }

  // [haptic]
  [[nodiscard]] virtual DeviceReading read() noexcept = 0;
  // [haptic] Of a recording: where the bone stood on its mount at the last reading, seen from where it rests, and so it
  // stands for whoever plays it. Null: nobody says, and the bone is where the room has it.
  [[nodiscard]] virtual const Pose* pose_rest_bone() const noexcept { return nullptr; }
  // [haptic] It has given its last reading for good, as a recording does at its end.
  [[nodiscard]] virtual bool over() const noexcept { return false; }
  // [haptic] Never more than the device's limits reaches the motors.
  virtual void write(const DeviceOutput& output) noexcept = 0;
};

// What a look at the machine shows of one kind of device.
struct DeviceFinding {
  std::vector<std::string> found;  // one line for each device that is there, e.g. "Phantom Omni, serial 50415500155"
  std::string missing;             // a sentence: what is not there or does not work, and the remedy; empty: nothing
  bool wrong_file = false;         // a file that the user named for it cannot be used; `missing` tells why
};

// Within `most`, same direction.
[[nodiscard]] inline Vec3 clamped(const Vec3& v, double most) noexcept {
  const double size = v.norm();
  return size > most ? Vec3(v * (most / size)) : v;
}

}  // namespace osteon::haptic
