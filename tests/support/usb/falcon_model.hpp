// A Novint Falcon on its USB wire: the serial chip's settings, the boot loader, and firmware that exchanges frames. It
// implements the protocol by itself, independently of the tested driver. The firmware image is a made-up one.
#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace osteon::test {

// An image must begin with this to run. Any other image loads and then does not answer.
inline constexpr std::string_view kRunningImage = "emulated falcon firmware";

class FalconModel {
 public:
  // Power-on: the boot loader waits, unless firmware is loaded already.
  explicit FalconModel(bool loaded = false);

  // A control transfer of type 0x40, without data.
  void set(int request, int value);
  // Bytes that arrive at OUT, and bytes that wait for IN.
  void take(std::span<const std::uint8_t> bytes);
  std::deque<std::uint8_t> waiting;

  // The world outside: encoders, buttons, and the axes that have found their ends (−1: each after some frames of
  // homing).
  std::array<std::int16_t, 3> encoders{};
  int buttons = 0, homed = -1;
  // Faults: it does not answer; it spoils a byte in this number of frames; it misses this number of greetings; it
  // echoes wrongly from a byte on.
  bool silent = false;
  int spoil = 0, deaf = 0;
  long false_echo_at = -1;

  // What it last received.
  struct Told {
    std::array<std::int16_t, 3> motors{};
    int control = 0;
    std::uint64_t frames = 0, bad_frames = 0, with_force = 0;
    std::size_t image_bytes = 0;
    bool homing = false;
  };
  [[nodiscard]] const Told& told() const { return told_; }
  void forget_image();  // a power cut

 private:
  void answer_frame();
  void say(std::string_view text);

  int baud_ = 0, dtr_ = 0;
  bool ready_ = false, loaded_ = false;
  std::vector<std::uint8_t> line_, image_;
  int homing_frames_ = 0, seen_ends_ = 0;
  Told told_;
};

}  // namespace osteon::test
