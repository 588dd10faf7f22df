// The sound of a group of tools as numbers: what a preset says. Frequencies of lines are orders of the spindle's, so a
// load that slows the spindle lowers all of them by one ratio.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/sound/gearbox.hpp"

namespace osteon::audio {

// What the tool's motion is. An order counts turns, or strokes. Blows have no lines.
enum class Drive : std::uint8_t { rotation, strokes, blows };

// The source of a line determines how it changes with the material (8.5.4).
enum class LineSource : std::uint8_t { shaft, motor, motor_mesh, output_mesh, teeth, body };
inline constexpr int kLineSources = 6;
using SourceLevels_db = std::array<double, kLineSources>;
[[nodiscard]] std::string_view source_name(LineSource source);

struct Line {
  double order = 1;  // its frequency over that of the spindle is this ...
  double teeth = 0;  // ... and this times the number of teeth
  LineSource source = LineSource::shaft;
  double level_db = 0;  // of its amplitude, re full scale: free at rated speed; of teeth, in bone without a change
};

// A motor with a torque-speed line, by the numbers of its own shaft. It drives the spindle through a gear.
struct Motor {
  double reduction = 1;           // turns of the motor in one of the spindle
  double efficiency = 0.85;       // of the gear [A]
  double droop_rpm_per_Nmm = 10;  // speed that the motor loses under torque
  double most_Nmm = 50;           // more torque stops it
  double inertia_g_cm2 = 10;      // of the rotor, and of all that turns with it
  double run_up_s = 0.25, run_down_s = 0.45;
};

// Noise of a tool that runs free: a point of its density over frequency. Between points it is a line in dB over the
// logarithm of frequency.
struct NoisePoint {
  double hz = 0, db_per_hz = 0;  // re full scale^2 / Hz
};

// Noise of the cut, as a band whose middle goes from soft to hard bone. Teeth, or strokes, modulate it.
struct Chips {
  double level_db = -200;  // RMS of the band at a chip flow of 1, re full scale
  double soft_hz = 900, hard_hz = 4500;
  double quality = 0.9;
  double depth = 0.6;     // of the modulation, 0 to 1
  double lopsided = 0.0;  // of strokes: how much louder one direction is, 0 to 1
};

// A row of the look-up table: what a material changes against free running (8.5.5, 8.6.3).
struct Material {
  double density_g_cm3 = 0;
  double load = 1;  // of ToolSound, at which the changes are reached
  SourceLevels_db change_db{};
  double noise_db = 0;
};

// A damped mode that is struck.
struct Mode {
  double hz = 0;
  double decay_s = 0;   // to 1/e of its amplitude
  double level_db = 0;  // amplitude after the reference blow, re full scale
};

// The plate of cortex under the tool (see plate_mode_hz), driven by the chips.
struct PlateParams {
  double radius_mm = 50;
  double quality = 12;
  double level_db = -200;  // RMS at a chip flow of 1, re full scale
};

// The blade of a saw as a beam that is held at one end (see beam_mode_hz), driven by the teeth.
struct BladeParams {
  double length_mm = 0, thickness_mm = 0;  // where the tool says nothing; 0: no blade
  double quality = 25;
  double level_db = -200;  // RMS of its first audible mode at a chip flow of 1
  double slope_db = -4;    // from one mode to the next
};

struct BlowParams {
  double impulse_N_s = 2.8;  // of the reference blow
  double contact_s = 0.0004;
  double rise = 0.4;        // by which seating raises all frequencies, loose to seated
  double click_db = -200;   // of the contact, amplitude at its begin
  double click_s = 0.0015;  // its decay
  std::vector<Mode> modes;  // loose
};

// Breakthrough: what gives way rings, and the lines stay loud for a moment.
struct Perforation {
  SourceLevels_db change_db{};
  double fade_s = 0.06;
  std::vector<Mode> burst;  // for a load of 1 that gives way
};

inline constexpr int kPresetTransientRate_hz = 22050;

struct ToolModel {
  std::string name, title;
  std::vector<std::string> tools;  // kinds, or names
  Drive drive = Drive::rotation;
  double rated_rpm = 1000;
  int teeth = 0;  // 0: those of the tool
  bool geared = false;
  sound::Gearbox gears;
  int segments = sound::kCommutatorSegments;
  Motor motor;
  std::vector<Line> lines;
  std::vector<NoisePoint> noise;  // frequencies rising
  Chips chips;
  Material cancellous{.density_g_cm3 = 0.3, .change_db = {}}, cortical{.density_g_cm3 = 1.9, .change_db = {}};
  Perforation perforation;
  PlateParams plate;
  BladeParams blade;
  BlowParams blow;
  double recorded_s = 0;                       // length of the recording that it was made of, 0: none
  std::vector<std::vector<float>> transients;  // its impacts, at kPresetTransientRate_hz
};

inline constexpr std::size_t kMostLines = 64, kMostNoisePoints = 16, kMostModes = 8, kMostTransients = 16;

// 8.6.3: a change of 1 dB is barely noticed, and 3 dB are the threshold for a change of a peak.
inline constexpr double kChangeThreshold_db = 3.0;
[[nodiscard]] constexpr double applied_change(double change_db) {
  return change_db > -kChangeThreshold_db && change_db < kChangeThreshold_db ? 0.0 : change_db;
}

}  // namespace osteon::audio
