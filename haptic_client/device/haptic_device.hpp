// The interface of any device that a hand holds: it gives the hand's pose and buttons, and shows force. Device frame: x
// right, y up, z to the user; millimetres, newtons, newton-millimetres. A handle's own frame is a tool's: its tip at
// the origin, +z out of the tip.
//
// Two threads use a device. The connection thread (connection.hpp) opens, tends, closes and reopens it. The haptic
// thread reads and writes at any time, even while the other opens or closes. A missing device reads as absent and
// ignores forces. So a DeviceExchange (device_exchange.hpp) is between the device's own I/O thread and the haptic
// thread. The exchange also removes the force when the haptic thread is late.
//
// The header of each kind of device has `std::unique_ptr<HapticDevice> make_X(options)` and `DeviceFinding
// look_for_X()`.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon::haptic {

// Read from the device itself where it reports them.
struct DeviceLimits {
  double peak_n = 0;  // 0: shows no force
  double continuous_n = 0;
  double stiffness_n_per_mm = 0;
  double workspace_radius_mm = 0;
  double damping_n_s_per_mm = 0;  // largest damping that may be rendered; 0: the device does not say
  double peak_nmm = 0;            // torque; 0: shows none
  double continuous_nmm = 0;
  Vec3 workspace_middle_mm = Vec3::Zero();
};

enum class DeviceStatus : std::uint8_t {
  ok,
  warm,    // motors are warm: only the continuous force may be commanded
  fault,   // broken or silent: no force, and the reading is old
  absent,  // not opened, or unplugged: no force, and the reading is old
};

// No force is shown before `done`. A device without calibration is always done.
enum class Calibration : std::uint8_t {
  done,
  pending,  // in progress, or waits for the user: HapticDevice::advice() says what to do
};

enum DeviceButton : std::uint32_t {
  kClutchButton = 1,  // held: the tool stays and the handle moves freely
  kSpindlePedal = 2,  // held: the spindle turns at full speed
  // What the other hand does, as long as it is set.
  kIrrigation = 4,
  kSuction = 8,
  kHandCuts = 16,  // of a pointer's hand: it pushes or draws the tool out, so the tool may cut
};

// The bits of what the other hand does.
[[nodiscard]] constexpr std::uint32_t other_hand(bool irrigation, bool suction) noexcept {
  return (irrigation ? kIrrigation : 0u) | (suction ? kSuction : 0u);
}

struct DeviceReading {
  Pose pose_device_tool;  // the handle
  std::uint32_t buttons = 0;
  DeviceStatus status = DeviceStatus::ok;
  Calibration calibration = Calibration::done;
  double pedal = 0;          // of a proportional pedal, 0 … 1 of the tool's speed
  std::uint64_t sample = 0;  // counts the device's own samples

  // Share of the spindle's full speed, by pedal or button.
  [[nodiscard]] double spindle() const noexcept { return buttons & kSpindlePedal ? 1.0 : pedal; }
  [[nodiscard]] bool usable() const noexcept {
    return (status == DeviceStatus::ok || status == DeviceStatus::warm) && calibration == Calibration::done;
  }
};

// Held until the next write. A device without torque shows only the force: torque never becomes force.
struct DeviceOutput {
  Vec3 force_n = Vec3::Zero(), torque_nmm = Vec3::Zero();

  DeviceOutput() = default;
  DeviceOutput(const Vec3& force, const Vec3& torque = Vec3::Zero()) : force_n(force), torque_nmm(torque) {}
};

// Known once open() has succeeded. The kind of device (places, turns, pedals, axes) is known before, as far as
// possible.
struct DeviceInfo {
  std::string model, serial, driver;  // as the device and its library report them; empty: not reported
  bool places = true, turns = true;   // what it reads: position, rotation
  bool pedals = false;                // it drives the spindle; a spindle button on another device is then a clutch, too
  int force_axes = 3, torque_axes = 0;  // what it shows: 0 or 3 of each
};

// The rotation for a handle without rotation: a tool that points away from the user.
[[nodiscard]] inline Eigen::Quaterniond pointing_away() { return {0.0, 1.0, 0.0, 0.0}; }

class HapticDevice {
 public:
  virtual ~HapticDevice() = default;                        // closes
  [[nodiscard]] virtual std::string_view name() const = 0;  // as --device names it

  // [connection] May take seconds. Errors: not_found (no such device or library), unavailable (in use, no permission,
  // no answer), unsupported (a library of the wrong kind), internal. Each is a sentence that ends in the remedy.
  [[nodiscard]] virtual Result<void> open() { return {}; }
  // [connection] Ends force at once. May be called at any time, even twice or after a failed open().
  virtual void close() noexcept {}
  // [connection] Called ten times a second while open. Does what is too slow for a haptic thread (temperature,
  // calibration). An error says that the device is lost. It is then closed, and reopened when possible.
  [[nodiscard]] virtual Result<void> tend() { return {}; }
  // [connection] What the user should do now, as a sentence; empty: nothing.
  [[nodiscard]] virtual std::string advice() const { return {}; }

  // [connection] Or any thread while the connection thread neither opens nor closes.
  [[nodiscard]] virtual DeviceLimits limits() const = 0;
  [[nodiscard]] virtual DeviceInfo info() const { return {}; }

  // [haptic]
  [[nodiscard]] virtual DeviceReading read() noexcept = 0;
  // [haptic] Of a recording: pose of the bone on its mount at the last reading, relative to its rest pose. A client
  // that plays the recording uses this pose, too. Null: not recorded; the room gives the bone's pose.
  [[nodiscard]] virtual const Pose* pose_rest_bone() const noexcept { return nullptr; }
  // [haptic] It has given its last reading, as a recording does at its end.
  [[nodiscard]] virtual bool over() const noexcept { return false; }
  // [haptic] Never sends more than the device's limits to the motors.
  virtual void write(const DeviceOutput& output) noexcept = 0;
};

// What was found on the machine of one kind of device.
struct DeviceFinding {
  std::vector<std::string> found;  // one line for each present device, e.g. "Phantom Omni, serial 50415500155"
  std::string missing;             // a sentence: what is missing or does not work, and the remedy; empty: nothing
  bool wrong_file = false;         // a file that the user named for it cannot be used; `missing` says why
};

// `v` shortened to at most `most`, same direction.
[[nodiscard]] inline Vec3 clamped(const Vec3& v, double most) noexcept {
  const double size = v.norm();
  return size > most ? Vec3(v * (most / size)) : v;
}

}  // namespace osteon::haptic
