// A Novint Falcon as its USB wire shows it: the serial chip's settings, the boot loader, and firmware that exchanges
// frames. Knows the protocol by itself, independent of the driver that is tested against it. The image is a made-up
// one.
#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace osteon::test {

// What an image must begin with to run; all else loads and then says nothing.
inline constexpr std::string_view kRunningImage = "emulated falcon firmware";

class FalconModel {
 public:
  // A power-on: the boot loader waits, unless firmware is there already.
  explicit FalconModel(bool loaded = false);

  // A control transfer of type 0x40, without data.
  void set(int request, int value);
  // What arrives at OUT, and what waits for IN.
  void take(std::span<const std::uint8_t> bytes);
  std::deque<std::uint8_t> waiting;

  // The world outside: encoders, buttons, which axes have found their ends (−1: each after some frames of homing).
  std::array<std::int16_t, 3> encoders{};
  int buttons = 0, homed = -1;
  // Trouble: it says nothing; it spoils a byte of so many frames; it misses so many greetings; it echoes falsely from a
  // byte on.
  bool silent = false;
  int spoil = 0, deaf = 0;
  long false_echo_at = -1;

  // What it was told last.
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
