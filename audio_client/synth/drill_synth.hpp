// The sound of all tools in the room as one mono signal: a pure function of the scenes it was given and of its seed.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "audio_client/synth/handpiece.hpp"
#include "audio_client/synth/limiter.hpp"
#include "audio_client/synth/sound_scene.hpp"
#include "audio_client/synth/voice.hpp"

namespace osteon::audio {

struct SynthParams {
  double rate_hz = 48000;
  std::uint64_t seed = 1;
  VoiceParams voice;
};

class DrillSynth {
 public:
  // A change of scene is heard this many frames later, because the limiter looks ahead.
  static constexpr int kLatency_frames = kBlockFrames;

  void prepare(const SynthParams& params);  // may allocate; silences
  void reset() noexcept;                    // [audio] silent at once, as after prepare

  // [audio] From the next block on. A tool that is not in the scene runs down and falls silent.
  void aim(const SoundScene& scene) noexcept;
  // [audio] Fills `frames` with samples in -1 to 1; exactly zero when no tool sounds.
  void process(std::span<float> frames) noexcept;

  [[nodiscard]] bool silent() const noexcept;  // no tool sounds, nor will without a new scene

 private:
  // A tool that was changed runs down beside the new one, so there are more voices than tools.
  static constexpr int kVoices = 2 * kMaxTools;

  void render_block() noexcept;

  SynthParams params_;
  std::array<Handpiece, kHandpieceKinds> handpieces_;
  std::array<Voice, kVoices> voices_;
  Limiter limiter_;
  Block block_{};
  int used_ = kBlockFrames;  // frames of the block already given out
  int tail_blocks_ = 0;      // until the limiter has given back the last sounding block
};

}  // namespace osteon::audio
