#include "audio_client/synth/drill_synth.hpp"

#include <algorithm>

#include "common/core/check.hpp"

namespace osteon::audio {

void DrillSynth::prepare(const SynthParams& params) {
  OSTEON_CHECK(params.rate_hz > 0);
  params_ = params;
  for (int kind = 0; kind < kHandpieceKinds; ++kind) {
    handpieces_[static_cast<std::size_t>(kind)] = make_handpiece(static_cast<HandpieceKind>(kind));
  }
  reset();
}

void DrillSynth::reset() noexcept {
  voices_.fill(Voice{});
  suction_.prepare(params_.suction, params_.rate_hz, params_.seed);
  limiter_.reset();
  block_.fill(0.0F);
  used_ = kBlockFrames;
  tail_blocks_ = 0;
}

void DrillSynth::aim(const SoundScene& scene) noexcept {
  std::array<bool, kVoices> aimed{};
  const auto tools = std::span(scene.tools).first(static_cast<std::size_t>(scene.count));
  suction_.aim(std::ranges::any_of(tools, &ToolSound::suction));
  for (int t = 0; t < scene.count; ++t) {
    const ToolSound& tool = scene.tools[static_cast<std::size_t>(t)];
    const auto same = std::find_if(voices_.begin(), voices_.end(), [&](const Voice& v) {
      return v.sounding() && v.author() == tool.author && v.kind() == tool.handpiece;
    });
    if (same != voices_.end()) {
      same->aim(tool);
      aimed[static_cast<std::size_t>(same - voices_.begin())] = true;
      continue;
    }
    if (tool.rpm == 0) continue;  // at rest: no sound
    const auto free = std::find_if(voices_.begin(), voices_.end(), [](const Voice& v) { return !v.sounding(); });
    if (free == voices_.end()) continue;
    free->start(handpieces_[static_cast<std::size_t>(tool.handpiece)], params_.voice, params_.rate_hz, tool,
                params_.seed + tool.author);
    aimed[static_cast<std::size_t>(free - voices_.begin())] = true;
  }
  for (std::size_t v = 0; v < voices_.size(); ++v) {
    if (voices_[v].sounding() && !aimed[v]) voices_[v].release();
  }
}

void DrillSynth::process(std::span<float> frames) noexcept {
  while (!frames.empty()) {
    if (used_ == kBlockFrames) render_block();
    const std::size_t count = std::min(frames.size(), static_cast<std::size_t>(kBlockFrames - used_));
    std::copy_n(block_.begin() + used_, count, frames.begin());
    used_ += static_cast<int>(count);
    frames = frames.subspan(count);
  }
}

void DrillSynth::render_block() noexcept {
  block_.fill(0.0F);
  for (Voice& voice : voices_) {
    if (!voice.sounding()) continue;
    voice.add_to(block_);
    tail_blocks_ = 2;
  }
  if (suction_.sounding()) {
    suction_.add_to(block_);
    tail_blocks_ = 2;
  }
  limiter_.process(block_);
  tail_blocks_ = std::max(0, tail_blocks_ - 1);
  used_ = 0;
}

bool DrillSynth::silent() const noexcept {
  return tail_blocks_ == 0 && !suction_.sounding() &&
         std::none_of(voices_.begin(), voices_.end(), [](const Voice& v) { return v.sounding(); });
}

}  // namespace osteon::audio
