// The drive of a tool and its audible partials, all locked to the spindle.
#pragma once
#include <cstdint>
#include <vector>

namespace osteon::audio {

enum class HandpieceKind : std::uint8_t {
  geared_drill = 0,  // motor, two planetary sets, a drill with two flutes (8.5.2)
  direct_burr = 1,   // the motor drives the burr directly, at tens of thousands of revolutions a minute
};
inline constexpr int kHandpieceKinds = 2;

// The source of a partial determines how it grows with the load.
enum class Source : std::uint8_t { shaft, motor, motor_mesh, output_mesh, tooth };

struct Partial {
  double ratio = 1;  // its frequency as a multiple of the spindle's
  Source source = Source::shaft;
  double level = 0;  // amplitude when running free; for teeth, at full drive
};

struct Handpiece {
  HandpieceKind kind = HandpieceKind::geared_drill;
  int teeth = 2;            // cutting edges per turn
  double rated_rpm = 1400;  // speed at which the levels apply; below it they fall in proportion
  double air_level = 0;     // noise of bearings, brushes and fan at rated speed, before its filter
  std::vector<Partial> partials;
};

inline constexpr int kMaxPartials = 48;

[[nodiscard]] Handpiece make_handpiece(HandpieceKind kind);

// How well the hand piece's body radiates, 0 to 1. It radiates little below 200 Hz, and less and less above 7 kHz
// (8.5.4: "the major frequencies are more active in the frequency range of 400-6000 Hz").
[[nodiscard]] double radiation(double hz) noexcept;

}  // namespace osteon::audio
