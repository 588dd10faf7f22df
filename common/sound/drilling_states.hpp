// Finds in the recording of a drilling when the drill ran free, cut cortical or cancellous bone, and broke through
// (8.5.1, Figures 8.6 and 8.13).
//
// First, the recording is divided where its levels change, by an optimal partition. Then each part gets a state by the
// rules of 8.5.4: the harder the bone, the louder; perforation is short, with a burst at low frequencies. The rules
// compare levels within one recording. They fail if the gain changes, or if another machine runs beside the drill.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace osteon::sound {

enum class DrillingState : std::uint8_t {
  before,       // no drill has run yet
  free,         // it runs, and cuts nothing
  cortical,     // it cuts hard bone
  cancellous,   // it cuts soft bone
  perforation,  // it breaks through
  after,        // it has run, and rests
};
inline constexpr int kDrillingStates = 6;
[[nodiscard]] std::string_view name(DrillingState state);

struct TimeSpan {
  double from_s = 0, to_s = 0;
};

struct StateParams {
  double frame_s = 0.01;         // from one level to the next; more in recordings of more than kMostFrames, or 60 s
  double off_db = 25;            // a drill that rests is that much below the loudest part [A]
  double silence_db = -75;       // re full scale: below it nothing runs [A]
  double distinct_db = 3;        // if running parts differ by less, they are all free [A]
  double free_below = 0.2;       // of the way from free to loudest, in dB: below it, free [A]
  double cortical_from = 0.7;    // the same: from it on, cortical [A]
  double longest_burst_s = 0.4;  // of perforation, which "is very short" in 8.5.1 [A]
  double burst_db = 5;           // by which it exceeds the bone before it, below 400 Hz [A]
  double spindle_rpm = 1400;     // to know the lines of motor and gear; above 2745 the motor's is beyond 11025 Hz
  std::optional<TimeSpan> free;  // where the drill runs free, if the user says so
};

struct StateSpan {
  DrillingState state = DrillingState::before;
  double from_s = 0, to_s = 0;
  double level_db = 0;  // re full scale, of 50 to 8000 Hz
  double low_db = 0;    // of 50 to 400 Hz
};

// The partition compares all pairs of frames. In 300 s a frame lasts 50 ms, and a part at least three of them.
inline constexpr int kMostFrames = 6000;

// Spans in order of time, without gaps, from 0 to the end. Neighbours differ in state. Empty for less than 0.1 s.
// `rate_hz`: at least 16000.
[[nodiscard]] std::vector<StateSpan> drilling_states(std::span<const float> samples, double rate_hz,
                                                     const StateParams& params = {});

// Frames at which the levels change: the partition of `rows` rows with `columns` levels each that has the least sum of
// squared deviations from the means of its parts, plus `penalty` for each part (Jackson 2005). Parts have at least
// `shortest` rows. Returns the first row of each part. Columns are scaled to a noise of variance 1.
[[nodiscard]] std::vector<std::size_t> optimal_partition(std::span<const double> rows, std::size_t columns,
                                                         double penalty, std::size_t shortest);

}  // namespace osteon::sound
