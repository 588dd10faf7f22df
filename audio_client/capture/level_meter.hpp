// Shows the level of a recording while it runs: a bar on a terminal, otherwise a line every 10 s. Written to standard
// error.
#pragma once
#include <cstddef>
#include <span>

namespace osteon::audio {

class LevelMeter {
 public:
  // `rate_hz` and `channels`: of the samples.
  LevelMeter(double rate_hz, unsigned channels);
  ~LevelMeter();  // ends the line
  LevelMeter(const LevelMeter&) = delete;
  LevelMeter& operator=(const LevelMeter&) = delete;

  void add(std::span<const float> samples);  // interleaved

  [[nodiscard]] float peak() const { return peak_; }              // of everything so far
  [[nodiscard]] std::size_t clipped() const { return clipped_; }  // samples at full scale
  [[nodiscard]] double seconds() const;

 private:
  void show();

  double rate_hz_;
  unsigned channels_;
  bool terminal_;
  std::size_t samples_ = 0, shown_ = 0;
  float peak_ = 0, recent_ = 0;
  std::size_t clipped_ = 0;
};

}  // namespace osteon::audio
