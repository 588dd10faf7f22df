// Foot pedals for the spindle by hidapi: a switch, or the axis of a joystick as a proportional one.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "common/input/hid_report.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

// Which of a three-pedal switch are down: bits 1 left, 2 middle, 4 right. Empty when it is no report of one.
[[nodiscard]] std::optional<std::uint8_t> take_pedal_report(std::span<const std::uint8_t> report) noexcept;

struct PedalAxisParams {
  bool inverted = false;  // rests at the axis' upper end
  double play = 0.05;     // [A] of the way at either end that counts as the end
  double near = 0.25;     // [A] of the way from its rest within which a pedal that nobody presses is first heard of
};

// A pedal's way from its rest to down. It gives nothing until it was seen at rest, so that a foot never starts a
// spindle just by being there when the device is plugged in. One that is first heard of far from its rest gives nothing
// at all: a stick that rests in the middle, or a pedal that rests at the other end, would be at rest when it is pressed
// and turn the spindle when it is let go.
class PedalAxis {
 public:
  explicit PedalAxis(const PedalAxisParams& params = {}) : params_(params) {}
  void take(double share) noexcept;  // of the axis' range, 0 … 1
  void forget() noexcept { rest_ = Rest::unknown, armed_ = false, value_ = 0.0; }
  [[nodiscard]] double value() const noexcept { return value_; }  // 0 … 1
  [[nodiscard]] bool armed() const noexcept { return armed_; }
  [[nodiscard]] bool elsewhere() const noexcept {
    return rest_ == Rest::elsewhere;
  }  // first heard of far from its rest

 private:
  enum class Rest : std::uint8_t { unknown, here, elsewhere };

  PedalAxisParams params_;
  Rest rest_ = Rest::unknown;
  bool armed_ = false;
  double value_ = 0;
};

struct FootPedalOptions {
  bool proportional = false;
  std::uint8_t switches = 7;  // which pedals of the switch turn the spindle: bits as of take_pedal_report()
  PedalAxisParams axis = {};
  std::optional<HidUsage> axis_usage = {};  // empty: the first of those that a pedal has
};

// What follows "pedal:" on the command line: left, middle or right; and "pedal-axis:", joined by colons: inverted, and
// an axis by its name (accelerator, brake, throttle, slider, x, y, z, rx, ry, rz) or usage of the generic desktop page,
// e.g. 0x32. Error invalid_input: what may be said.
[[nodiscard]] Result<FootPedalOptions> read_pedal_switch(std::string_view argument);
[[nodiscard]] Result<FootPedalOptions> read_pedal_axis(std::string_view argument);

// As a device it only reads a spindle: no place, no force.
[[nodiscard]] std::unique_ptr<HapticDevice> make_foot_pedal(const FootPedalOptions& options = {});
// Of one kind: switches, or joysticks whose axis could be a pedal.
[[nodiscard]] DeviceFinding look_for_foot_pedals(bool proportional = false);

}  // namespace osteon::haptic
