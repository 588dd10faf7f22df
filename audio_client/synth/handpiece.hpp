// A preset made ready for one tool: its lines and modes with the tool's teeth and blade, as amplitudes.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "audio_client/presets/tool_model.hpp"
#include "audio_client/synth/noise_bank.hpp"
#include "common/mechanics/spindle.hpp"

namespace osteon {
struct Tool;
}

namespace osteon::audio {

// What a tool sounds like that has no preset of its own.
enum class HandpieceKind : std::uint8_t {
  geared_drill = 0,  // motor, two planetary sets, a drill with two flutes (8.5.2)
  direct_burr = 1,   // the motor drives the burr directly, at tens of thousands of revolutions a minute
};
inline constexpr int kHandpieceKinds = 2;

struct Partial {
  double ratio = 1;  // its frequency as a multiple of the spindle's
  LineSource source = LineSource::shaft;
  double level = 0;       // amplitude when running free at rated speed; of teeth, in bone without a change
  double rated_gain = 1;  // radiation() at rated speed
};

inline constexpr int kMaxPartials = static_cast<int>(kMostLines);
inline constexpr int kBladeModes = 5;

// Factors on the amplitudes of the sources, and of the noise.
struct Gains {
  std::array<double, kLineSources> source{};
  double noise = 1;
};

struct Handpiece {
  ToolModel model;
  int teeth = 2;  // cutting edges per turn
  std::vector<Partial> partials;
  SpindleParams spindle;                       // the motor, seen from the spindle
  NoiseBank noise;                             // of the free tool at rated speed
  std::array<double, kBladeModes> blade_hz{};  // 0: none
  // The recording's impacts at the synthesis's rate, and how far the modes give way to each.
  std::vector<std::vector<float>> clicks, click_weights;
};

// `tool`: null for none; then there are two teeth, and no blade but the preset's own.
[[nodiscard]] Handpiece make_handpiece(const ToolModel& model, const Tool* tool, double rate_hz);

// The motor with its gear, seen from the spindle: torques times reduction and efficiency, speeds through the reduction.
[[nodiscard]] SpindleParams at_spindle(const Motor& motor, double rated_rpm);

// The look-up table of materials (8.5.5, 8.6.3) at a load and a density: changes in dB below the threshold are none.
// Between the two materials the dB are a line over the density, and up to a material's load a line over the load.
// `perforated`: 1 at breakthrough, then falling to 0.
// `hardness`: density over 1.9 g/cm3.
[[nodiscard]] Gains material_gains(const ToolModel& model, double load, double hardness, double perforated) noexcept;

// How well the hand piece's body radiates, 0 to 1. It radiates little below 200 Hz, and less and less above 7 kHz
// (8.5.4: "the major frequencies are more active in the frequency range of 400-6000 Hz").
[[nodiscard]] double radiation(double hz) noexcept;

}  // namespace osteon::audio
