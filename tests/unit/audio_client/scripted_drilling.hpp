// A drilling given as states, as the haptic client would send them at 120 Hz: free, cortical, cancellous, cortical,
// breakthrough, free, off. The numbers are those of the expert hand in the reference simulations.
#pragma once
#include <vector>

#include "audio_client/synth/drill_synth.hpp"
#include "common/mechanics/cutting_state.hpp"

namespace osteon::test {

inline constexpr double kRate_hz = 48000;
inline constexpr int kFramesPerState = 400;  // 120 Hz

[[nodiscard]] CuttingState idle_drill();
[[nodiscard]] CuttingState free_drill(double rpm);
[[nodiscard]] CuttingState cortical_drill(double rpm);
[[nodiscard]] CuttingState cancellous_drill(double rpm);

struct ScriptedPart {
  const char* name;
  double from_s, to_s;
};
struct ScriptedDrilling {
  std::vector<CuttingState> states;  // one for each 1/120 s
  std::vector<ScriptedPart> parts;
};
[[nodiscard]] ScriptedDrilling scripted_drilling();

// Plays the states one after another, kFramesPerState frames each.
[[nodiscard]] std::vector<float> play(audio::DrillSynth& synth, const std::vector<CuttingState>& states);
// Plays one state for a given time.
[[nodiscard]] std::vector<float> play(audio::DrillSynth& synth, const CuttingState& state, double seconds);

}  // namespace osteon::test
