// Foot pedals for the spindle by hidapi: a switch, or the axis of a joystick as a proportional one.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "common/input/hid_report.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

// Which of a three-pedal switch are down: bits 1 left, 2 middle, 4 right. Empty when it is no report of one.
[[nodiscard]] std::optional<std::uint8_t> take_pedal_report(std::span<const std::uint8_t> report) noexcept;

struct PedalAxisParams {
  bool inverted = false;  // released at the axis' upper end
  double play = 0.05;     // [A] of the way at either end that counts as the end
};

// A pedal's way from released to down. It gives nothing until it was seen released, so that a foot (or a stick whose rest is
// in the middle) never starts a spindle just by being there when the device is plugged in.
class PedalAxis {
 public:
  explicit PedalAxis(const PedalAxisParams& params = {}) : params_(params) {}
  void take(double share) noexcept;  // of the axis' range, 0 … 1
  void forget() noexcept { armed_ = false, value_ = 0.0; }
  [[nodiscard]] double value() const noexcept { return value_; }  // 0 … 1
  [[nodiscard]] bool armed() const noexcept { return armed_; }

 private:
  PedalAxisParams params_;
  bool armed_ = false;
  double value_ = 0;
};

struct FootPedalOptions {
  bool proportional = false;
  std::uint8_t switches = 7;     // which pedals of the switch turn the spindle
  PedalAxisParams axis = {};
  std::uint16_t axis_usage = 0;  // of the generic desktop page, e.g. 0x32 for z; 0: the first of those a pedal has
};

// As a device it only reads a spindle: no place, no force.
[[nodiscard]] std::unique_ptr<HapticDevice> make_foot_pedal(const FootPedalOptions& options = {});
// Of one kind: switches, or joysticks whose axis could be a pedal.
[[nodiscard]] DeviceFinding look_for_foot_pedals(bool proportional = false);

}  // namespace osteon::haptic
