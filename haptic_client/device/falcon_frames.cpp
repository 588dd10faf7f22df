#include "haptic_client/device/falcon_frames.hpp"

#include <algorithm>

namespace osteon::haptic {
namespace {

constexpr std::uint8_t kStart = '<', kEnd = '>', kShift = 'A';
constexpr std::size_t kControl = 13, kSpare = 14, kLast = 15;
constexpr std::uint8_t kHoming = 1;

FalconFrame frame_of(const FalconCounts& counts, std::uint8_t control) {
  FalconFrame frame;
  frame[0] = kStart;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto bits = static_cast<std::uint16_t>(counts[i]);
    for (std::size_t nibble = 0; nibble < 4; ++nibble)
      frame[1 + 4 * i + nibble] = static_cast<std::uint8_t>(kShift + ((bits >> (4 * nibble)) & 0xf));
  }
  frame[kControl] = static_cast<std::uint8_t>(kShift + control);
  frame[kSpare] = kShift;
  frame[kLast] = kEnd;
  return frame;
}

std::optional<FalconCounts> counts_of(const FalconFrame& frame) {
  if (frame[0] != kStart || frame[kLast] != kEnd) return std::nullopt;
  FalconCounts counts;
  for (std::size_t i = 0; i < 3; ++i) {
    std::uint16_t bits = 0;
    for (std::size_t nibble = 0; nibble < 4; ++nibble) {
      const std::uint8_t character = frame[1 + 4 * i + nibble];
      if (character < kShift || character > kShift + 0xf) return std::nullopt;
      bits = static_cast<std::uint16_t>(bits | (character - kShift) << (4 * nibble));
    }
    counts[i] = static_cast<std::int16_t>(bits);
  }
  return counts;
}

// (request, value) of an FTDI chip. 0: reset and purge, 1: modem lines, 2: flow control, 3: baud rate, 4: framing, 9:
// latency.
constexpr FalconSetting kGreetingSettings[] = {{0, 1}, {0, 2},     {9, 16},    {3, 0x4138}, {4, 8},
                                               {2, 0}, {1, 0x200}, {1, 0x100}, {1, 0x101}};
constexpr FalconSetting kLoadingSettings[] = {{1, 0x100}, {3, 0x15}};
constexpr FalconSetting kRunningSettings[] = {{9, 1}, {3, 2}, {0, 1}, {0, 2}};

}  // namespace

FalconFrame encode(const FalconCommand& command) noexcept {
  return frame_of(command.motors, static_cast<std::uint8_t>((command.lights & 0xe) | (command.homing ? kHoming : 0)));
}

std::optional<FalconCommand> decode_command(const FalconFrame& frame) noexcept {
  const std::optional<FalconCounts> motors = counts_of(frame);
  const int control = frame[kControl] - kShift;
  if (!motors || control < 0 || control > 0xf) return std::nullopt;
  return FalconCommand{*motors, (control & kHoming) != 0, static_cast<std::uint8_t>(control & 0xe)};
}

FalconFrame encode(const FalconState& state) noexcept {
  return frame_of(state.encoders, static_cast<std::uint8_t>((state.buttons & 0xf) | (state.homed & 7) << 4));
}

std::optional<FalconState> decode_state(const FalconFrame& frame) noexcept {
  const std::optional<FalconCounts> encoders = counts_of(frame);
  const int control = frame[kControl] - kShift;
  if (!encoders || control < 0) return std::nullopt;
  return FalconState{*encoders, static_cast<std::uint8_t>(control & 0xf),
                     static_cast<std::uint8_t>((control >> 4) & 7)};
}

std::optional<FalconState> FalconFrameReader::take(std::span<const std::uint8_t> bytes) noexcept {
  std::optional<FalconState> newest;
  for (const std::uint8_t byte : bytes) {
    if (byte == kStart) {
      if (have_ > 0) ++broken_;
      have_ = 0;
    } else if (have_ == 0) {
      continue;  // between frames
    }
    frame_[have_++] = byte;
    if (have_ < kFalconFrame && byte != kEnd) continue;
    if (const std::optional<FalconState> state = have_ == kFalconFrame ? decode_state(frame_) : std::nullopt)
      newest = state;
    else
      ++broken_;
    have_ = 0;
  }
  return newest;
}

std::span<const std::uint8_t> without_modem_status(std::span<const std::uint8_t> packet) noexcept {
  return packet.subspan(std::min(packet.size(), kFalconModemBytes));
}

std::span<const FalconSetting> falcon_greeting_settings() noexcept { return kGreetingSettings; }
std::span<const FalconSetting> falcon_loading_settings() noexcept { return kLoadingSettings; }
std::span<const FalconSetting> falcon_running_settings() noexcept { return kRunningSettings; }

}  // namespace osteon::haptic
