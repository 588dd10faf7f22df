#include "tests/unit/audio_client/played_tools.hpp"

#include <cmath>
#include <utility>

namespace osteon::test {
namespace {

audio::ToolSound sound_of(const CuttingState& state) {
  audio::ToolSound tool = audio::tool_sound(state);
  tool.torque_Nmm = state.torque_Nmm;
  tool.tool = "drill-3.2";
  return tool;
}

}  // namespace

audio::ToolSound free_tool() { return sound_of(free_drill(1400)); }
audio::ToolSound cancellous_tool() { return sound_of(cancellous_drill(1380)); }
audio::ToolSound cortical_tool() { return sound_of(cortical_drill(1345)); }

audio::ToolSound cutting_tool(std::string_view name, double rpm) {
  audio::ToolSound tool = cortical_tool();
  tool.tool = name;
  tool.rpm = rpm;
  tool.torque_Nmm = 0;
  return tool;
}

Player::Player(std::uint64_t seed, const audio::VoiceParams& voice, std::vector<audio::ToolModel> presets) {
  audio::SynthParams params;
  params.rate_hz = kRate_hz;
  params.seed = seed;
  params.voice = voice;
  params.presets = std::move(presets);
  synth_.prepare(params);
}

std::vector<float> Player::play(const audio::ToolSound& tool, double seconds) {
  std::vector<float> samples(static_cast<std::size_t>(std::lround(seconds * 120.0)) * kFramesPerState);
  audio::SoundScene scene;
  scene.count = 1;
  scene.tools[0] = tool;
  for (std::size_t at = 0; at < samples.size(); at += kFramesPerState) {
    synth_.aim(scene);
    synth_.process(std::span(samples).subspan(at, kFramesPerState));
  }
  return samples;
}

std::vector<float> Player::unaimed(double seconds) {
  std::vector<float> samples(static_cast<std::size_t>(seconds * kRate_hz));
  synth_.process(samples);
  return samples;
}

std::vector<float> steadily(const audio::ToolSound& tool) {
  Player player;
  static_cast<void>(player.play(tool, 0.75));
  return player.play(tool, 1.0);
}

std::vector<float> played_drilling() {
  Player player;
  std::vector<float> samples;
  const auto add = [&](const std::vector<float>& part) { samples.insert(samples.end(), part.begin(), part.end()); };
  add(player.play(free_tool(), kPart_s));
  add(player.play(cancellous_tool(), kPart_s));
  add(player.play(cortical_tool(), 2 * kPart_s));
  audio::ToolSound plunge = free_tool();  // the hand goes on, against nothing
  plunge.advancing = true;
  plunge.load = 0.02;
  add(player.play(plunge, 0.1));
  add(player.play(free_tool(), kPart_s));
  return samples;
}

std::span<const float> sound_part(const std::vector<float>& samples, double from_s, double seconds) {
  return std::span(samples).subspan(static_cast<std::size_t>(from_s * kRate_hz),
                                    static_cast<std::size_t>(seconds * kRate_hz));
}

}  // namespace osteon::test
