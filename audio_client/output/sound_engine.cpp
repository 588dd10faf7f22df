#include "audio_client/output/sound_engine.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace osteon::audio {
namespace {

void keep_largest(std::atomic<float>& most, std::span<const float> samples) noexcept {
  float largest = most.load(std::memory_order_relaxed);
  for (const float x : samples) largest = std::max(largest, std::abs(x));
  most.store(largest, std::memory_order_relaxed);
}

}  // namespace

// Read through the vDSO: no system call.
std::int64_t SoundEngine::steady_ns() noexcept { return std::chrono::steady_clock::now().time_since_epoch().count(); }

SoundEngine::SoundEngine(const SynthParams& params, Clock now_ns)
    : now_ns_(now_ns), rate_hz_(params.rate_hz), ramp_(params.rate_hz) {
  synth_.prepare(params);
}

void SoundEngine::render(std::span<float> left, std::span<float> right) noexcept {
  const std::int64_t start_ns = now_ns_();
  if (frames() == 0) first_frame_ns_.store(start_ns, std::memory_order_relaxed);
  take_scenes(start_ns);
  synth_.process(left, right);
  if (recorder_) recorder_->push(left, right);

  keep_largest(peaks_[0], left);
  keep_largest(peaks_[1], right);
  frames_.fetch_add(left.size(), std::memory_order_relaxed);
  silent_.store(synth_.silent(), std::memory_order_relaxed);
  ramp_.apply(left, right, volume_.load(std::memory_order_relaxed));
  note_played(left, right);
  const std::int64_t took_ns = now_ns_() - start_ns;
  work_.record(std::chrono::nanoseconds(took_ns));
  longest_ns_.store(std::max(longest_ns_.load(std::memory_order_relaxed), took_ns), std::memory_order_relaxed);
}

// A reader that takes a maximum in the middle of this may get it a second time, and loses none.
void SoundEngine::note_played(std::span<const float> left, std::span<const float> right) noexcept {
  const std::size_t count = std::min(left.size(), played_.size()), older = left.size() - count;
  std::copy(played_.begin() + static_cast<std::ptrdiff_t>(count), played_.end(), played_.begin());
  for (std::size_t i = 0; i < count; ++i)
    played_[played_.size() - count + i] = 0.5F * (left[older + i] + right[older + i]);
  waves_.store(played_);
  keep_largest(level_, left);
  keep_largest(level_, right);
  buffer_frames_.store(left.size(), std::memory_order_relaxed);
}

void SoundEngine::take_scenes(std::int64_t start_ns) noexcept {
  for (SoundScene scene; arrivals_.try_pop(scene);) states_.take(scene);
  const bool fresh = scenes_.refresh();
  if (fresh) states_.take(scenes_.value());
  if (fresh || states_.moves()) synth_.aim(states_.at(start_ns));
  if (fresh) note_sounded(scenes_.value(), start_ns);
}

void SoundEngine::note_sounded(const SoundScene& scene, std::int64_t start_ns) noexcept {
  for (int t = 0; t < scene.count; ++t) {
    const ToolSound& tool = scene.tools[static_cast<std::size_t>(t)];
    const auto known = last_.tools.begin() + last_.count;
    const bool old = std::any_of(last_.tools.begin(), known, [&](const ToolSound& seen) {
      return seen.author == tool.author && seen.state_seq == tool.state_seq;
    });
    // A full queue loses the note, not the sound.
    if (!old) sounded_.try_push({tool.author, tool.state_seq, scene.received_ns, start_ns});
  }
  last_ = scene;
}

std::chrono::nanoseconds SoundEngine::latency() const noexcept {
  const Listening way = synth_.space().listening;
  const double air_s = way == Listening::mono ? 0.0 : reference_mm(way) / kSoundSpeed_mm_per_s;
  return std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * (DrillSynth::kLatency_frames / rate_hz_ + air_s)));
}

}  // namespace osteon::audio
