#include "audio_client/capture/level_meter.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace osteon::audio {
namespace {

constexpr double kTerminal_s = 0.1, kLines_s = 10.0;  // from one picture to the next
constexpr float kFullScale = 0.9999F;
constexpr double kQuiet_db = -60.0;

double decibel(float amplitude) { return amplitude > 0 ? 20.0 * std::log10(static_cast<double>(amplitude)) : -120.0; }

}  // namespace

LevelMeter::LevelMeter(double rate_hz, unsigned channels)
    : rate_hz_(rate_hz), channels_(channels), terminal_(::isatty(STDERR_FILENO) == 1) {}

LevelMeter::~LevelMeter() {
  if (terminal_ && shown_ > 0) std::fputc('\n', stderr);
}

double LevelMeter::seconds() const {
  return static_cast<double>(samples_) / (rate_hz_ * static_cast<double>(channels_));
}

void LevelMeter::add(std::span<const float> samples) {
  for (const float x : samples) {
    const float size = std::abs(x);
    recent_ = std::max(recent_, size);
    clipped_ += size >= kFullScale;
  }
  peak_ = std::max(peak_, recent_);
  samples_ += samples.size();
  const double every_s = terminal_ ? kTerminal_s : kLines_s;
  if (static_cast<double>(samples_ - shown_) >= every_s * rate_hz_ * channels_) show();
}

void LevelMeter::show() {
  shown_ = samples_;
  const double level_db = decibel(recent_);
  recent_ = 0;
  if (!terminal_) {
    std::fprintf(stderr, "recording: %.0f s, %.1f dB\n", seconds(), level_db);
    return;
  }
  constexpr int kWidth = 40;
  const int filled = static_cast<int>(kWidth * std::clamp(1.0 - level_db / kQuiet_db, 0.0, 1.0));
  const std::string bar(static_cast<std::size_t>(filled), '#');
  std::fprintf(stderr, "\rrecording %7.1f s [%-*s] %6.1f dB%s", seconds(), kWidth, bar.c_str(), level_db,
               clipped_ > 0 ? " clipped" : "");
  std::fflush(stderr);
}

}  // namespace osteon::audio
