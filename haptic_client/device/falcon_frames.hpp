// Novint Falcon: the bytes of its USB protocol, without the USB transfer. Frames have 16 characters in both directions,
// '<' … '>'. All characters between are shifted to printable ones. A 16-bit number is four nibbles, the lowest first.
// The facts are those of libnifalcon.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "haptic_client/device/falcon_kinematics.hpp"

namespace osteon::haptic {

inline constexpr std::size_t kFalconFrame = 16;
using FalconFrame = std::array<std::uint8_t, kFalconFrame>;

enum FalconButton : std::uint8_t { kFalconPlus = 1, kFalconForward = 2, kFalconCentre = 4, kFalconMinus = 8 };
enum FalconLight : std::uint8_t { kFalconGreen = 2, kFalconBlue = 4, kFalconRed = 8 };
inline constexpr std::uint8_t kFalconAllHomed = 7;

struct FalconCommand {
  FalconCounts motors{};
  bool homing = false;  // the device searches the ends of its axes while the user moves the grip in and out
  std::uint8_t lights = 0;
};

struct FalconState {
  FalconCounts encoders{};
  std::uint8_t buttons = 0;  // FalconButton
  std::uint8_t homed = 0;    // one bit for each axis that knows its end
};

// [haptic] Bytes sent to the device; decode_command reads them as a device would.
[[nodiscard]] FalconFrame encode(const FalconCommand& command) noexcept;
[[nodiscard]] std::optional<FalconCommand> decode_command(const FalconFrame& frame) noexcept;

// [haptic] Bytes received from the device; empty for anything that is not a whole frame.
[[nodiscard]] FalconFrame encode(const FalconState& state) noexcept;
[[nodiscard]] std::optional<FalconState> decode_state(const FalconFrame& frame) noexcept;

// Finds frames in a stream in which bytes may be missing or wrong.
class FalconFrameReader {
 public:
  // Takes the bytes of an IN packet after its two of modem status. Returns the newest whole frame in them, if any.
  [[nodiscard]] std::optional<FalconState> take(std::span<const std::uint8_t> bytes) noexcept;
  // Number of frames that began but were not complete.
  [[nodiscard]] std::uint64_t broken() const noexcept { return broken_; }
  void reset() noexcept { have_ = 0; }

 private:
  FalconFrame frame_{};
  std::size_t have_ = 0;
  std::uint64_t broken_ = 0;
};

// Every IN packet of the device's serial chip begins with two bytes of modem status, even without data.
inline constexpr std::size_t kFalconModemBytes = 2;
[[nodiscard]] std::span<const std::uint8_t> without_modem_status(std::span<const std::uint8_t> packet) noexcept;

// One setting of the serial chip: a control transfer of type 0x40 to index 0, without data.
struct FalconSetting {
  std::uint8_t request;
  std::uint16_t value;
};
// The settings in order: to reach the boot loader; to load an image; to exchange the frames above.
[[nodiscard]] std::span<const FalconSetting> falcon_greeting_settings() noexcept;
[[nodiscard]] std::span<const FalconSetting> falcon_loading_settings() noexcept;
[[nodiscard]] std::span<const FalconSetting> falcon_running_settings() noexcept;

inline constexpr std::array<std::uint8_t, 3> kFalconGreeting{0x0a, 0x43, 0x0d};
inline constexpr std::array<std::uint8_t, 4> kFalconGreetingAnswer{0x0a, 0x44, 0x2c, 0x0d};
inline constexpr int kFalconGreetings = 100;        // attempts, because the first ones may be lost
inline constexpr std::uint8_t kFalconReady = 0x41;  // sent, and returned by the device, before the image
inline constexpr std::size_t kFalconPiece = 62;     // bytes of the image in one transfer; the boot loader echoes them

}  // namespace osteon::haptic
