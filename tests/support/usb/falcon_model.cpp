#include "tests/support/usb/falcon_model.hpp"

#include <algorithm>

namespace osteon::test {
namespace {

constexpr int kSetModem = 1, kSetBaud = 3;
constexpr int kBoot = 0x4138, kLoad = 0x15, kRun = 2;
constexpr int kDtrOff = 0x100, kDtrOn = 0x101;
constexpr std::string_view kGreeting("\x0a\x43\x0d"), kGreetingAnswer("\x0a\x44\x2c\x0d");
constexpr int kFramesToAnEnd = 20;  // of homing, for each axis

int nibble(std::uint8_t character) { return character >= 'A' && character <= 'P' ? character - 'A' : -1; }

}  // namespace

FalconModel::FalconModel(bool loaded) : loaded_(loaded) {
  if (loaded) image_.assign(kRunningImage.begin(), kRunningImage.end());
}

void FalconModel::forget_image() {
  loaded_ = ready_ = false;
  image_.clear();
  seen_ends_ = homing_frames_ = 0;
}

void FalconModel::say(std::string_view text) { waiting.insert(waiting.end(), text.begin(), text.end()); }

void FalconModel::set(int request, int value) {
  if (request == 0) line_.clear();
  if (request == kSetModem && (value == kDtrOff || value == kDtrOn)) dtr_ = value == kDtrOn;
  if (request != kSetBaud) return;
  baud_ = value;
  line_.clear();
  // A reset by its line restarts the boot loader.
  if (value == kBoot) forget_image();
  if (value == kRun)
    loaded_ = std::string_view(reinterpret_cast<const char*>(image_.data()), image_.size()).starts_with(kRunningImage);
}

void FalconModel::take(std::span<const std::uint8_t> bytes) {
  if (silent) return;
  if (baud_ == kLoad && dtr_ == 0) {
    for (const std::uint8_t byte : bytes) {
      const bool first = !ready_;
      ready_ = ready_ || byte == 'A';
      if (!first) image_.push_back(byte);
      const bool lie = !first && false_echo_at >= 0 && static_cast<long>(image_.size()) > false_echo_at;
      if (ready_) waiting.push_back(lie ? static_cast<std::uint8_t>(byte ^ 0x40) : byte);
    }
    told_.image_bytes = image_.size();
    return;
  }
  for (const std::uint8_t byte : bytes) {
    line_.push_back(byte);
    if (baud_ == kBoot) {
      if (line_.size() > kGreeting.size()) line_.erase(line_.begin());
      if (dtr_ == 1 && std::equal(line_.begin(), line_.end(), kGreeting.begin(), kGreeting.end())) {
        line_.clear();
        if (deaf > 0)
          --deaf;
        else
          say(kGreetingAnswer);
      }
    } else if (baud_ == kRun && loaded_) {
      if (byte == '<') line_ = {byte};
      if (line_.size() < 16) continue;
      answer_frame();
      line_.clear();
    } else {
      line_.clear();
    }
  }
}

void FalconModel::answer_frame() {
  std::array<std::int16_t, 3> motors{};
  bool good = line_[0] == '<' && line_[15] == '>' && nibble(line_[13]) >= 0 && line_[14] == 'A';
  for (std::size_t axis = 0; axis < 3; ++axis) {
    int sum = 0;
    for (std::size_t digit = 4; digit-- > 0;) {
      const int value = nibble(line_[1 + 4 * axis + digit]);
      good = good && value >= 0;
      sum = 16 * sum + value;
    }
    motors[axis] = static_cast<std::int16_t>(sum < 32768 ? sum : sum - 65536);
  }
  if (!good) {
    ++told_.bad_frames;
    return;
  }
  told_.motors = motors;
  told_.control = nibble(line_[13]);
  told_.homing = (told_.control & 1) != 0;
  ++told_.frames;
  if (motors != std::array<std::int16_t, 3>{}) ++told_.with_force;
  if (told_.homing && ++homing_frames_ % kFramesToAnEnd == 0) seen_ends_ = std::min(7, 2 * seen_ends_ + 1);

  std::string text = "<";
  for (const std::int16_t encoder : encoders) {
    unsigned rest = static_cast<std::uint16_t>(encoder);
    for (int digit = 0; digit < 4; ++digit, rest /= 16) text += static_cast<char>('A' + rest % 16);
  }
  text += static_cast<char>('A' + buttons + 16 * (homed >= 0 ? homed : seen_ends_));
  text += "A>";
  if (spoil > 0) {
    --spoil;
    text[static_cast<std::size_t>(1 + told_.frames % 12)] = '?';
  }
  say(text);
}

}  // namespace osteon::test
