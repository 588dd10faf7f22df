// Runs on the sound card's thread: takes the scenes that have come, computes them ahead to now, renders and records
// them, and notes when each was first used.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include "audio_client/output/audio_output.hpp"
#include "audio_client/output/volume_ramp.hpp"
#include "audio_client/output/wav_recorder.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "audio_client/synth/state_extrapolator.hpp"
#include "common/runtime/spsc_queue.hpp"
#include "common/runtime/tick_stats.hpp"
#include "common/runtime/triple_buffer.hpp"

namespace osteon::audio {

// A state that has reached the buffers for the first time. Steady clock.
struct Sounded {
  std::uint64_t author = 0;
  std::uint64_t state_seq = 0;
  std::int64_t received_ns = 0;
  std::int64_t rendered_ns = 0;  // start of the render() call that first used it
};

class SoundEngine final : public SoundSource {
 public:
  static constexpr std::size_t kWave_frames = 512;
  using Wave = std::array<float, kWave_frames>;

  using Clock = std::int64_t (*)() noexcept;  // ns
  [[nodiscard]] static std::int64_t steady_ns() noexcept;
  // `now_ns`: the clock of the scenes' arrival. Tests may have one of their own.
  explicit SoundEngine(const SynthParams& params, Clock now_ns = &steady_ns);
  // Records from now on, at full volume; call it before the output starts. The recorder must outlive the engine's last
  // render().
  void record_to(WavRecorder& recorder) noexcept { recorder_ = &recorder; }

  // Moves the listener; call it before the output starts.
  void listen(const Space& space) noexcept { synth_.listen(space); }

  // One thread only. While nobody renders, the queue becomes full and the buffer keeps the newest scene. It gets each
  // scene first, so that nothing older is read after a newer one.
  void deliver(const SoundScene& scene) noexcept {
    scenes_.store(scene);
    arrivals_.try_push(scene);
  }
  void render(std::span<float> left, std::span<float> right) noexcept override;       // [audio]
  bool next_sounded(Sounded& sounded) noexcept { return sounded_.try_pop(sounded); }  // one thread only
  // The listener's volume from now on, a factor of the amplitude, 0 to 1. The sound follows without a click.
  void set_volume(double factor) noexcept { volume_.store(factor, std::memory_order_relaxed); }

  // What was played last, oldest first, as the listener hears it: the mean of both channels. One thread only.
  [[nodiscard]] const Wave& wave() noexcept {
    waves_.refresh();
    return waves_.value();
  }
  // The largest amplitude that the listener heard, and the longest work of one render(), since the last call.
  [[nodiscard]] float take_level() noexcept { return level_.exchange(0, std::memory_order_relaxed); }
  [[nodiscard]] std::chrono::nanoseconds take_longest_work() noexcept {
    return std::chrono::nanoseconds(longest_ns_.exchange(0, std::memory_order_relaxed));
  }
  [[nodiscard]] std::size_t buffer_frames() const noexcept { return buffer_frames_.load(std::memory_order_relaxed); }

  // Time from the start of render() to the frame that first carries the new scene, without the output's own latency. It
  // has the way of the sound to the usual listener.
  [[nodiscard]] std::chrono::nanoseconds latency() const noexcept;
  [[nodiscard]] bool silent() const noexcept { return silent_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_.load(std::memory_order_relaxed); }
  // When the first frame was rendered, steady clock; 0 before. A recording begins with that frame.
  [[nodiscard]] std::int64_t first_frame_ns() const noexcept { return first_frame_ns_.load(std::memory_order_relaxed); }
  // The largest amplitude, at full volume, of a channel: 0 left, 1 right; and of both.
  [[nodiscard]] float peak(std::size_t channel) const noexcept {
    return peaks_[channel].load(std::memory_order_relaxed);
  }
  [[nodiscard]] float peak() const noexcept { return std::max(peak(0), peak(1)); }
  // Duration of the work of one render(). Call only after the output was stopped.
  [[nodiscard]] const DurationHistogram& work() const noexcept { return work_; }

 private:
  void take_scenes(std::int64_t now_ns) noexcept;
  void note_sounded(const SoundScene& scene, std::int64_t start_ns) noexcept;
  void note_played(std::span<const float> left, std::span<const float> right) noexcept;

  Clock now_ns_;
  double rate_hz_;
  DrillSynth synth_;
  WavRecorder* recorder_ = nullptr;
  SpscQueue<SoundScene, 16> arrivals_;
  TripleBuffer<SoundScene> scenes_;
  StateExtrapolator states_;  // [audio]
  SpscQueue<Sounded, 1024> sounded_;
  SoundScene last_;  // what was noted last, to note each state once
  std::atomic<std::uint64_t> frames_{0};
  std::atomic<std::int64_t> first_frame_ns_{0};
  std::array<std::atomic<float>, 2> peaks_{};
  std::atomic<bool> silent_{true};
  DurationHistogram work_;
  VolumeRamp ramp_;
  std::atomic<double> volume_{1};
  Wave played_{};  // [audio] in the order of time
  TripleBuffer<Wave> waves_;
  std::atomic<float> level_{0};
  std::atomic<std::int64_t> longest_ns_{0};
  std::atomic<std::size_t> buffer_frames_{0};
};

}  // namespace osteon::audio
