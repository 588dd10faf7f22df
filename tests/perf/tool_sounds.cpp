// Prints as JSON what 8.5.4 says of drilling, measured on the synthesised sound, and how fast the synthesis is.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <vector>

#include "audio_client/presets/preset_file.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/resample.hpp"
#include "common/sound/spectrum.hpp"
#include "common/sound/tones.hpp"
#include "common/sound/wavelet_packets.hpp"
#include "tests/unit/audio_client/played_tools.hpp"

namespace {

using namespace osteon;
using namespace osteon::test;

constexpr sound::Gearbox kGears;
constexpr double kCommutation = 3 * sound::kCommutatorSegments * kGears.motor();

// By how much the motor's line is above that of its gear.
double motor_lead_db(const audio::ToolSound& tool) {
  const std::vector<float> samples = steadily(tool);
  const double spindle_hz = tool.rpm / 60.0;
  return sound::tone_db(samples, kRate_hz, kCommutation * spindle_hz) -
         sound::tone_db(samples, kRate_hz, kGears.motor_mesh() * spindle_hz);
}

double low_db(const audio::ToolSound& tool) {
  return sound::band_db(sound::power_spectrum(steadily(tool), kRate_hz), 0, 400);
}

// The largest difference of a line's ratio from 5400/5500, under the load that slows the motor by it, in parts of one.
double shift_error() {
  Player player(1, kLinesAlone);
  static_cast<void>(player.play(free_tool(), 0.75));
  audio::ToolSound loaded = cortical_tool();
  loaded.rpm = 1400;
  loaded.torque_Nmm = 1400 * (100.0 / 5500.0) / 0.7;
  static_cast<void>(player.play(loaded, 1.0 / 120.0));
  static_cast<void>(player.unaimed(0.2));
  const std::vector<float> samples = player.unaimed(1.0);
  double worst = 0;
  for (const double order : {kGears.output_mesh(), kGears.motor_mesh(), kCommutation}) {
    const double free_hz = order * 1400 / 60.0;
    const double hz = sound::find_tone(samples, kRate_hz, 0.97 * free_hz, free_hz).hz;
    worst = std::max(worst, std::abs(hz / free_hz - 5400.0 / 5500.0));
  }
  return worst;
}

// The lowest part of the energy that the wavelet packets of level 1 have in A1, over the states.
double low_half(const std::vector<float>& samples) {
  double least = 1;
  for (const double from_s : {0.75, 2.0, 4.0, kThrough_s}) {
    const std::vector<float> low = sound::resampled(sound_part(samples, from_s, 0.5), kRate_hz, 22050);
    least = std::min(least, sound::energy_shares(sound::wavelet_packets(low, 22050, 1), 1)[0]);
  }
  return least;
}

double synthesis_speed() {
  Player player;
  static_cast<void>(player.play(cortical_tool(), 0.5));
  constexpr double kSeconds = 20;
  const std::clock_t begin = std::clock();
  static_cast<void>(player.play(cortical_tool(), kSeconds));
  return kSeconds * CLOCKS_PER_SEC / static_cast<double>(std::clock() - begin);
}

}  // namespace

int main() {
  const std::vector<float> samples = played_drilling();
  const double free_db = sound::rms_db(sound_part(samples, 0.75, 0.7)),
               cancellous_db = sound::rms_db(sound_part(samples, 2.0, 0.9)),
               cortical_db = sound::rms_db(sound_part(samples, 4.0, 1.9)),
               through_db = sound::rms_db(sound_part(samples, kThrough_s, 0.1));
  const sound::Spectrum burst = sound::power_spectrum(sound_part(samples, kThrough_s + 0.005, 0.085), kRate_hz, 4096);
  const nlohmann::json numbers = {
      {"cancellous", cancellous_db - free_db},
      {"cortical", cortical_db - cancellous_db},
      {"perforation", through_db - cortical_db},
      {"burst_off", std::abs(sound::strongest_peaks(burst, 1, 50.0).front().hz - 200.0)},
      {"motor_in_cortical", motor_lead_db(cortical_tool())},
      {"gear_in_cancellous", -motor_lead_db(cancellous_tool())},
      {"low_band",
       std::min(low_db(cancellous_tool()) - low_db(free_tool()), low_db(cortical_tool()) - low_db(cancellous_tool()))},
      {"low_half", low_half(samples)},
      {"shift_error", 100.0 * shift_error()},
      {"speed", synthesis_speed()},
  };
  std::printf("%s\n", numbers.dump(2).c_str());
  return 0;
}
