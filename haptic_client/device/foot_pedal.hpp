// Foot pedals for the spindle by hidapi: a switch, or a joystick's axis as a proportional pedal.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "common/input/hid_report.hpp"
#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

// Which pedals of a three-pedal switch are down: bits 1 left, 2 middle, 4 right. Empty when it is no report of such a
// switch.
[[nodiscard]] std::optional<std::uint8_t> take_pedal_report(std::span<const std::uint8_t> report) noexcept;

struct PedalAxisParams {
  bool inverted = false;  // the pedal's rest is the axis' upper end
  double play = 0.05;     // [A] share of the range at either end that counts as the end
  // [A] share of the range from its rest within which the first reading of an unpressed pedal must lie.
  double near = 0.25;
};

// The travel of a pedal from its rest to fully down. Its value is zero until the pedal was seen at rest. So a foot that
// is on the pedal when the device is plugged in never starts a spindle. A pedal whose first reading is far from its
// rest stays at zero. Examples are a stick that rests in the middle, or a pedal that rests at the other end. These
// would be at rest when pressed, and would turn the spindle when released.
class PedalAxis {
 public:
  explicit PedalAxis(const PedalAxisParams& params = {}) : params_(params) {}
  void take(double share) noexcept;  // of the axis' range, 0 … 1
  void forget() noexcept { rest_ = Rest::unknown, armed_ = false, value_ = 0.0; }
  [[nodiscard]] double value() const noexcept { return value_; }  // 0 … 1
  [[nodiscard]] bool armed() const noexcept { return armed_; }
  // The first reading was far from its rest.
  [[nodiscard]] bool elsewhere() const noexcept { return rest_ == Rest::elsewhere; }

 private:
  enum class Rest : std::uint8_t { unknown, here, elsewhere };

  PedalAxisParams params_;
  Rest rest_ = Rest::unknown;
  bool armed_ = false;
  double value_ = 0;
};

struct FootPedalOptions {
  bool proportional = false;
  std::uint8_t switches = 7;  // which pedals of the switch drive the spindle: bits as of take_pedal_report()
  std::uint8_t irrigation = 0, suction = 0;  // likewise, of what the other hand does
  PedalAxisParams axis = {};
  std::optional<HidUsage> axis_usage = {};  // empty: the first usage that a pedal can have
};

// The text after "pedal:" on the command line: left, middle or right for the spindle, irrigation-SIDE, suction-SIDE,
// joined by colons. Pedals that are not named turn the spindle, if none is named for it. The text after "pedal-axis:",
// joined by colons: inverted, and an axis. The axis is given by its name (accelerator, brake, throttle, slider, x, y,
// z, rx, ry, rz) or by its usage of the generic desktop page, e.g. 0x32. Error invalid_input: lists the permitted
// values.
[[nodiscard]] Result<FootPedalOptions> read_pedal_switch(std::string_view argument);
[[nodiscard]] Result<FootPedalOptions> read_pedal_axis(std::string_view argument);

// As a device it reads only a spindle: no position, no force.
[[nodiscard]] std::unique_ptr<HapticDevice> make_foot_pedal(const FootPedalOptions& options = {});
// Looks for one kind: switches, or joysticks whose axis could be a pedal.
[[nodiscard]] DeviceFinding look_for_foot_pedals(bool proportional = false);

}  // namespace osteon::haptic
