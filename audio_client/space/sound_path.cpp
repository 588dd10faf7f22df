#include "audio_client/space/sound_path.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteon::audio {
namespace {

// Nearer than a quarter of the reference distance, a tool becomes no louder than by 12 dB.
constexpr double kLeastOfReference = 0.25;
// No place in a room, but an error of a state.
constexpr double kElsewhere_mm = 1e5;
// Turns by less keep their filter: 0.2 degrees, a fifth of what listeners tell apart straight ahead.
constexpr double kSameDirection = 0.0035;

// out[i] = sum of filter[k] newest[i - k]. The taps of 32 frames are summed together, so that vectors hold them.
void convolve(const float* newest, const EarFilter& filter, Block& out) noexcept {
  using Frames = Eigen::Array<float, 32, 1>;
  for (int first = 0; first < kBlockFrames; first += 32) {
    Frames sum = Frames::Zero();
    for (int k = 0; k < kEarTaps; ++k)
      sum += filter[static_cast<std::size_t>(k)] * Eigen::Map<const Frames>(newest + first - k);
    Eigen::Map<Frames>(out.data() + first) = sum;
  }
}

void add_ramped(const Block& block, float from, float to, Block& heard) noexcept {
  const float step = (to - from) / kBlockFrames;
  for (std::size_t i = 0; i < block.size(); ++i) heard[i] += (from + step * static_cast<float>(i + 1)) * block[i];
}

}  // namespace

void SoundPath::prepare(const Space& space, double rate_hz) noexcept {
  *this = SoundPath{};
  space_ = space;
  rate_hz_ = rate_hz;
}

void SoundPath::start(const Vec3& position_mm) noexcept {
  line_.clear();
  left_ = right_ = Ear{};
  aim(position_mm);
  followed_mm_ = position_mm_ = target_mm_;
  begun_ = false;
  silent_frames_ = kLongest;
}

void SoundPath::aim(const Vec3& position_mm) noexcept {
  if ((position_mm.array().abs() < kElsewhere_mm).all()) target_mm_ = position_mm;  // not for NaN either
}

SoundPath::Place SoundPath::place() const noexcept {
  const Vec3 offset_mm =
      space_.pose_bone_head.rotation.conjugate() * (position_mm_ - space_.pose_bone_head.position_mm);
  const double apart_mm = offset_mm.norm();
  const double least_mm = kLeastOfReference * reference_mm(space_.listening);
  Place here;
  if (apart_mm > 1e-6) here.towards = offset_mm / apart_mm;
  here.distance_mm = std::clamp(apart_mm, least_mm, kFarthest_mm);
  here.aside = offset_mm.y() / std::max(apart_mm, least_mm);
  return here;
}

double SoundPath::advance() noexcept {
  const double block_s = kBlockFrames / rate_hz_;
  const double share = space_.smoothing_s > 0 ? 1.0 - std::exp(-block_s / space_.smoothing_s) : 1.0;
  const double before_mm = place().distance_mm;
  followed_mm_ += share * (target_mm_ - followed_mm_);
  position_mm_ += share * (followed_mm_ - position_mm_);
  return begun_ ? (place().distance_mm - before_mm) / block_s : 0.0;
}

// What arrives now left the source when it was elsewhere: D = d(t - D) / c, so D = d / (c + d') for a steady motion.
// The pitch is then that of Doppler, c / (c + d'), with d' below 0 while the source comes nearer.
double SoundPath::delay_frames(double distance_mm, double receding_mm_per_s, double later_s) const noexcept {
  const double speed = std::max(kSoundSpeed_mm_per_s + receding_mm_per_s, 0.5 * kSoundSpeed_mm_per_s);
  return std::clamp((distance_mm / speed + later_s) * rate_hz_, DelayLine::kLeast, DelayLine::kMost);
}

void SoundPath::add_to(const Block& source, StereoBlock& heard) noexcept {
  if (space_.listening == Listening::mono) {
    for (std::size_t i = 0; i < source.size(); ++i) {
      heard.left[i] += source[i];
      heard.right[i] += source[i];
    }
    return;
  }
  const bool silent = std::ranges::all_of(source, [](float x) { return x == 0.0F; });
  silent_frames_ = silent ? std::min(kLongest, silent_frames_ + kBlockFrames) : 0;
  line_.push(source);
  const double receding_mm_per_s = advance();
  const Place here = place();
  if (space_.listening == Listening::headphones)
    add_by_ears(here, receding_mm_per_s, heard);
  else
    add_panned(here, receding_mm_per_s, heard);
  begun_ = true;
}

// Constant power: the squares of both gains sum to twice that of the distance, as from the middle.
void SoundPath::add_panned(const Place& here, double receding_mm_per_s, StereoBlock& heard) noexcept {
  const double angle = 0.25 * std::numbers::pi * (1.0 + here.aside);
  const double level = std::numbers::sqrt2 * reference_mm(space_.listening) / here.distance_mm;
  const double delay = delay_frames(here.distance_mm, receding_mm_per_s, 0.0);
  const auto to_left = static_cast<float>(level * std::sin(angle)),
             to_right = static_cast<float>(level * std::cos(angle));
  if (!begun_) {
    left_.delay = delay;
    left_.gain = to_left;
    right_.gain = to_right;
  }
  Block delayed;
  line_.read(left_.delay, delay, delayed);
  add_ramped(delayed, left_.gain, to_left, heard.left);
  add_ramped(delayed, right_.gain, to_right, heard.right);
  left_.delay = delay;
  left_.gain = to_left;
  right_.gain = to_right;
}

void SoundPath::add_by_ears(const Place& here, double receding_mm_per_s, StereoBlock& heard) noexcept {
  const bool turned = !begun_ || (here.towards - filters_towards_).norm() > kSameDirection;
  if (turned) {
    space_.hrtf->towards(here.towards, next_filters_);
    filters_towards_ = here.towards;
    if (!begun_) filters_ = next_filters_;
  }
  const auto gain = static_cast<float>(reference_mm(space_.listening) / here.distance_mm);
  const auto hear = [&](Ear& ear, const EarResponse& old, const EarResponse& now, Block& out) {
    const double delay = delay_frames(here.distance_mm, receding_mm_per_s, now.delay_s);
    if (!begun_) {
      ear.delay = delay;
      ear.gain = gain;
    }
    Block delayed, filtered;
    line_.read(ear.delay, delay, delayed);
    std::copy(ear.delayed.end() - kEarTaps, ear.delayed.end(), ear.delayed.begin());
    float* newest = ear.delayed.data() + kEarTaps;
    const float step = (gain - ear.gain) / kBlockFrames;
    for (std::size_t i = 0; i < delayed.size(); ++i)
      newest[i] = (ear.gain + step * static_cast<float>(i + 1)) * delayed[i];
    convolve(newest, now.filter, filtered);
    if (!turned) {
      add_ramped(filtered, 1.0F, 1.0F, out);
    } else {
      add_ramped(filtered, 0.0F, 1.0F, out);
      convolve(newest, old.filter, filtered);
      add_ramped(filtered, 1.0F, 0.0F, out);
    }
    ear.delay = delay;
    ear.gain = gain;
  };
  const EarPair& now = turned ? next_filters_ : filters_;
  hear(left_, filters_.left, now.left, heard.left);
  hear(right_, filters_.right, now.right, heard.right);
  if (turned) std::swap(filters_, next_filters_);
}

}  // namespace osteon::audio
