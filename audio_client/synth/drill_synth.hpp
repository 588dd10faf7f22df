// The sound of all tools in the room, for both ears: a pure function of its scenes and its seed.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "audio_client/space/block.hpp"
#include "audio_client/space/sound_path.hpp"
#include "audio_client/synth/handpiece.hpp"
#include "audio_client/synth/limiter.hpp"
#include "audio_client/synth/sound_scene.hpp"
#include "audio_client/synth/suction_sound.hpp"
#include "audio_client/synth/voice.hpp"

namespace osteon::audio {

struct SynthParams {
  double rate_hz = 48000;
  std::uint64_t seed = 1;
  VoiceParams voice;
  SuctionParams suction;
  Space space{};
  std::vector<ToolModel> presets;  // the user's; they go before those that come with Osteon
};

class DrillSynth {
 public:
  // A change of scene becomes audible this many frames later, because the limiter looks ahead. Then it is still under
  // way to the listener, except in mono.
  static constexpr int kLatency_frames = kBlockFrames;

  void prepare(const SynthParams& params);   // may allocate; silences
  void reset() noexcept;                     // [audio] silent at once, as after prepare
  void listen(const Space& space) noexcept;  // from another place from now on; silent at once

  // [audio] Takes effect with the next block. A tool that is not in the scene runs down and falls silent.
  void aim(const SoundScene& scene) noexcept;
  // [audio] Fills both channels, of equal sizes, with samples in -1 to 1; exactly zero when no tool sounds.
  void process(std::span<float> left, std::span<float> right) noexcept;
  // [audio] The mean of both channels. In mono they are equal.
  void process(std::span<float> mono) noexcept;

  [[nodiscard]] const Space& space() const noexcept { return params_.space; }
  [[nodiscard]] bool silent() const noexcept;  // no tool sounds, and none will before a new scene

 private:
  // When a tool is exchanged, the old one runs down while the new one sounds. So there are more voices than tools.
  static constexpr int kVoices = 2 * kMaxTools;

  struct Piece {
    std::string tool;
    Handpiece handpiece;
  };

  void render_block() noexcept;
  void aim_suction(std::span<const ToolSound> tools) noexcept;
  [[nodiscard]] const Handpiece& handpiece_of(const ToolSound& tool) const noexcept;
  // Nothing of this voice is on its way to the listener.
  [[nodiscard]] bool quiet(std::size_t voice) const noexcept {
    return !voices_[voice].sounding() && !paths_[voice].ringing();
  }
  // Where a source of its own may start.
  [[nodiscard]] bool vacant(std::size_t voice) const noexcept { return quiet(voice) && !voices_[voice].waits(); }

  SynthParams params_;
  std::vector<Piece> pieces_;                       // of all known tools, by name; voices point into it
  std::array<Handpiece, kHandpieceKinds> unknown_;  // of other tools
  std::array<Voice, kVoices> voices_;
  std::array<SoundPath, kVoices> paths_;  // of each voice to the listener
  SuctionSound suction_;                  // one for all suckers of the room, heard from the first of them
  SoundPath suction_path_;
  Limiter limiter_;
  StereoBlock block_;
  int used_ = kBlockFrames;  // frames of the block that were already returned
  int tail_blocks_ = 0;      // blocks until the limiter has returned the last sounding block
};

}  // namespace osteon::audio
