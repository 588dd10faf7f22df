// Tools as the sound takes them, and what the synthesis plays of them.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "audio_client/synth/drill_synth.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::test {

[[nodiscard]] audio::ToolSound free_tool();        // a drill of 3.2 mm at 1400 rpm
[[nodiscard]] audio::ToolSound cancellous_tool();  // the same in these materials, slowed by them
[[nodiscard]] audio::ToolSound cortical_tool();
// A tool of the box in cortical bone.
[[nodiscard]] audio::ToolSound cutting_tool(std::string_view name, double rpm);

class Player {
 public:
  explicit Player(std::uint64_t seed = 1, const audio::VoiceParams& voice = {},
                  std::vector<audio::ToolModel> presets = {});
  // Plays states of 1/120 s each.
  std::vector<float> play(const audio::ToolSound& tool, double seconds);
  // Plays on without another state.
  std::vector<float> unaimed(double seconds);
  [[nodiscard]] const audio::DrillSynth& synth() const { return synth_; }

 private:
  audio::DrillSynth synth_;
};

// A second of it, after it has run up.
[[nodiscard]] std::vector<float> steadily(const audio::ToolSound& tool);

inline constexpr audio::VoiceParams kLinesAlone{.noise = 0, .flutter = 0};

// Free, cancellous and cortical bone, through the far cortex, and free, as one sound.
inline constexpr double kPart_s = 1.5;             // cortical bone lasts for two of them
inline constexpr double kThrough_s = 4 * kPart_s;  // when the bone gives way
[[nodiscard]] std::vector<float> played_drilling();

[[nodiscard]] std::span<const float> sound_part(const std::vector<float>& samples, double from_s, double seconds);

}  // namespace osteon::test
