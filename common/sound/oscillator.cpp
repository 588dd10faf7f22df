#include "common/sound/oscillator.hpp"

#include <algorithm>
#include <numbers>

namespace osteon::sound {
namespace {

// Adds (a + da i) cos(2 pi (t + i (w + i (u + i v)))), i from the first to the last sample that is in `sound`.
struct Segment {
  double amplitude = 0, slope = 0;
  double turns = 0, linear = 0, square = 0, cube = 0;
};
void add_segment(std::span<float> sound, std::ptrdiff_t begin, int count, const Segment& s) {
  const auto size = static_cast<std::ptrdiff_t>(sound.size());
  const int first = static_cast<int>(std::clamp<std::ptrdiff_t>(-begin, 0, count));
  const int last = static_cast<int>(std::clamp<std::ptrdiff_t>(size - begin, 0, count));
  for (int i = first; i < last; ++i) {
    const double turns = s.turns + i * (s.linear + i * (s.square + i * s.cube));
    sound[static_cast<std::size_t>(begin + i)] += static_cast<float>(s.amplitude + i * s.slope) * cosine(turns);
  }
}

}  // namespace

void add_cubic(std::span<float> sound, std::ptrdiff_t begin, int count, const Sinusoid& from, const Sinusoid& to,
               double rate_hz) {
  // All in turns and samples.
  const double t = count, from_turns = 0.5 * from.phase * std::numbers::inv_pi,
               to_turns = 0.5 * to.phase * std::numbers::inv_pi;
  const double from_rate = from.hz / rate_hz, to_rate = to.hz / rate_hz;
  const double whole = std::round(from_turns + 0.5 * t * (from_rate + to_rate) - to_turns);
  const double left = to_turns + whole - from_turns - from_rate * t;
  const double change = to_rate - from_rate;
  add_segment(sound, begin, count,
              {.amplitude = from.amplitude,
               .slope = (to.amplitude - from.amplitude) / t,
               .turns = from_turns,
               .linear = from_rate,
               .square = (3.0 * left / t - change) / t,
               .cube = (change - 2.0 * left / t) / (t * t)});
}

double add_linear(std::span<float> sound, std::ptrdiff_t begin, int count, const Sinusoid& from, const Sinusoid& to,
                  double turns, double rate_hz) {
  const double t = count, from_rate = from.hz / rate_hz, to_rate = to.hz / rate_hz;
  add_segment(sound, begin, count,
              {.amplitude = from.amplitude,
               .slope = (to.amplitude - from.amplitude) / t,
               .turns = turns,
               .linear = from_rate,
               .square = 0.5 * (to_rate - from_rate) / t,
               .cube = 0});
  const double end = turns + 0.5 * t * (from_rate + to_rate);
  return end - std::floor(end);
}

}  // namespace osteon::sound
