#include "audio_client/offline/offline_sound.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "audio_client/synth/sound_scene.hpp"
#include "audio_client/synth/state_extrapolator.hpp"

namespace osteon::audio {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
// As the live client has it: tools whose state was not received for so long run down, which takes at most as long.
constexpr std::int64_t kStale_ns = 2 * kSecond_ns;
constexpr int kBuffersPerReport = 64;
constexpr std::uint64_t kStatesPerReport = 8192;

// What the live client's reader and engine do, with the record's time instead of a clock.
class Player {
 public:
  Player(StateRecord& record, const SynthParams& params) : record_(record), rate_hz_(params.rate_hz) {
    synth_.prepare(params);
  }

  Result<void> begin() {
    auto first = record_.next();
    if (!first) return tl::unexpected(first.error());
    next_ = std::move(*first);
    if (!next_) return bad_input(record_.name() + " holds no state; record a session");
    start_ns_ = newest_ns_ = next_->time_ns;
    return {};
  }

  // False when the last tool has fallen silent.
  Result<bool> fill(std::span<float> left, std::span<float> right, OfflineSound& sound) {
    const std::int64_t now_ns = start_ns_ + std::llround(1e9 * static_cast<double>(sound.frames) / rate_hz_);
    auto fresh = take_until(now_ns, sound);
    if (!fresh) return tl::unexpected(fresh.error());
    if (*fresh || states_.moves()) synth_.aim(states_.at(now_ns));
    if (!*fresh && sounding_ && (!next_ || now_ns - newest_ns_ > kStale_ns)) {
      states_.take(SoundScene{});
      synth_.aim(SoundScene{});
      sounding_ = false;
    }
    if (!next_ && !*fresh && (synth_.silent() || now_ns - newest_ns_ > kStale_ns)) return false;
    synth_.process(left, right);
    sound.frames += left.size();
    for (const std::span<const float> side : {std::span<const float>(left), std::span<const float>(right)})
      for (const float x : side) sound.peak = std::max(sound.peak, std::abs(x));
    return true;
  }

 private:
  // Takes the states up to a time. False if there is no new one.
  Result<bool> take_until(std::int64_t now_ns, OfflineSound& sound) {
    bool fresh = false;
    while (next_ && next_->time_ns <= now_ns) {
      newest_ns_ = next_->time_ns;
      states_.take(sound_scene(std::span(&*next_, 1), newest_ns_));
      fresh = sounding_ = true;
      ++sound.states;
      auto more = record_.next();
      if (!more) return tl::unexpected(more.error());
      next_ = std::move(*more);
    }
    return fresh;
  }

  StateRecord& record_;
  double rate_hz_;
  DrillSynth synth_;
  StateExtrapolator states_;
  std::optional<CuttingState> next_;
  std::int64_t start_ns_ = 0, newest_ns_ = 0;
  bool sounding_ = false;  // a tool was aimed at, and not yet released
};

}  // namespace

Result<OfflineSound> render_states(StateRecord& record, const SynthParams& params, const TakeFrames& take,
                                   const KeepGoing& keep_going, std::optional<double> record_s) {
  OfflineSound sound;
  const auto done = [&] {
    if (!record_s) return record.done();
    const double sound_s = static_cast<double>(sound.frames) / params.rate_hz;
    return std::min(1.0, sound_s / (*record_s + kLongestTail_s));
  };
  Player player(record, params);
  if (auto begun = player.begin(); !begun) return tl::unexpected(begun.error());
  std::vector<float> left(OutputParams{}.frames), right(left.size());
  for (int count = 0;; ++count) {
    if (count % kBuffersPerReport == 0 && !keep_going(done())) return stopped_while("making the sound");
    const auto more = player.fill(left, right, sound);
    if (!more) return tl::unexpected(more.error());
    if (!*more) return sound;
    if (auto taken = take(left, right); !taken) return tl::unexpected(taken.error());
  }
}

Result<RecordedWork> survey(StateRecord& record, const KeepGoing& keep_going) {
  Vec3 all_mm = Vec3::Zero(), touching_mm = Vec3::Zero();
  std::uint64_t count = 0, touching = 0;
  std::int64_t first_ns = 0, last_ns = 0;
  for (;; ++count) {
    if (count % kStatesPerReport == 0 && !keep_going(record.done())) return stopped_while("reading the session");
    const auto state = record.next();
    if (!state) return tl::unexpected(state.error());
    if (!*state) break;
    last_ns = (*state)->time_ns;
    if (count == 0) first_ns = last_ns;
    const Vec3& tip_mm = (*state)->pose_bone_tool.position_mm;
    all_mm += tip_mm;
    if ((*state)->phase != CuttingPhase::cutting && (*state)->phase != CuttingPhase::rubbing) continue;
    touching_mm += tip_mm;
    ++touching;
  }
  if (count == 0) return bad_input(record.name() + " holds no state; record a session");
  RecordedWork work;
  work.middle_mm = touching > 0 ? touching_mm / static_cast<double>(touching) : all_mm / static_cast<double>(count);
  work.seconds = 1e-9 * static_cast<double>(last_ns - first_ns);
  return work;
}

}  // namespace osteon::audio
