#include "audio_client/synth/voice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteon::audio {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

// Partials fade out below half of the sampling rate. So none ever folds back, and none switches off with a click.
constexpr double kFadeStart = 0.375, kFadeEnd = 0.4375;

constexpr double kSilentRpm = 1.0;
constexpr double kRecentLoad_s = 0.15;
constexpr double kFlutter_s = 0.08;

// Chips against the drill: a share of the level of the partials at full load.
constexpr double kChipLevel = 0.045;

// Perforation is a short burst around 200 Hz (8.5.4); the second mode gives it a body.
struct KnockMode {
  double hz, decay_s, level;
};
constexpr std::array<KnockMode, 2> kKnock = {{{190.0, 0.035, 0.22}, {430.0, 0.018, 0.09}}};
constexpr double kKnockLoad = 0.25;  // a smaller load gives way without a sound

double share(double seconds, double rate_hz) { return 1.0 - std::exp(-kBlockFrames / (seconds * rate_hz)); }

double audible(double hz, double rate_hz) {
  return std::clamp((kFadeEnd - hz / rate_hz) / (kFadeEnd - kFadeStart), 0.0, 1.0);
}

}  // namespace

void Voice::start(const Handpiece& handpiece, const VoiceParams& params, double rate_hz, const ToolSound& tool,
                  std::uint64_t seed) noexcept {
  *this = Voice{};
  handpiece_ = &handpiece;
  params_ = params;
  rate_hz_ = rate_hz;
  sounding_ = true;
  noise_ = WhiteNoise(seed);
  // Random phases keep the crest factor low.
  for (std::size_t i = 0; i < kMaxPartials; ++i) phase_[i] = 0.5 + 0.5 * noise_.next();
  target_.author = tool.author;
  target_.handpiece = tool.handpiece;
  aim(tool);
}

void Voice::aim(const ToolSound& tool) noexcept {
  // A layer gives way: the load is gone from a tool that advances, or that advanced one state ago and is through. A
  // tool that is drawn back stops first and leaves without a knock.
  if ((tool.advancing || target_.advancing) && recent_load_ > kKnockLoad && tool.load < 0.5 * recent_load_) {
    const auto released = static_cast<float>(recent_load_ - tool.load);
    // Adding to the real part leaves the sounding imaginary part continuous.
    for (std::size_t m = 0; m < kKnock.size(); ++m) knock_re_[m] += released * static_cast<float>(kKnock[m].level);
    recent_load_ = tool.load;
  }
  target_ = tool;
  span_rpm_ = std::max(span_rpm_, tool.rpm);
}

void Voice::add_to(Block& block) noexcept {
  advance_controls();
  add_partials(block);
  add_noise(block);
  add_knock(block);
  if (rpm_ == 0 && target_.rpm == 0 && std::abs(knock_im_[0]) + std::abs(knock_re_[0]) < 1e-5F) sounding_ = false;
}

void Voice::advance_controls() noexcept {
  const double block_s = kBlockFrames / rate_hz_;
  const double up = span_rpm_ * block_s / params_.run_up_s, down = span_rpm_ * block_s / params_.run_down_s;
  slewed_rpm_ = std::clamp(target_.rpm, slewed_rpm_ - down, slewed_rpm_ + up);
  const double k = share(params_.smoothing_s, rate_hz_);
  rpm_ += k * (slewed_rpm_ - rpm_);
  if (slewed_rpm_ == 0 && rpm_ < kSilentRpm) rpm_ = 0;
  load_ += k * (target_.load - load_);
  hardness_ += k * (target_.hardness - hardness_);
  chips_ += k * (target_.chips - chips_);
  recent_load_ = std::max(target_.load, recent_load_ * (1.0 - share(kRecentLoad_s, rate_hz_)));

  // The same thrust is louder in hard bone, which breaks, than in soft bone, which yields.
  drive_ = load_ * (0.25 + 0.75 * hardness_);
  tone_drive_ = std::sqrt(std::max(0.0, drive_));
}

// 8.5.4: both gears and motor grow with the load. As the load falls, the motor falls faster. So free and cortical are
// dominated by the motor's line, and cancellous by the gears'.
double Voice::source_gain(Source source) const noexcept {
  switch (source) {
    case Source::shaft:
      return 1.0 + 2.0 * drive_;
    case Source::motor:
      return 1.0 + 4.5 * drive_;
    case Source::motor_mesh:
      return 1.0 + 4.0 * tone_drive_;
    case Source::output_mesh:
      return 1.0 + 3.5 * tone_drive_;
    case Source::tooth:
      return 4.0 * std::pow(drive_, 0.8);
  }
  return 0.0;
}

void Voice::add_partials(Block& block) noexcept {
  std::array<double, 5> gains;
  for (std::size_t s = 0; s < gains.size(); ++s) gains[s] = source_gain(static_cast<Source>(s));
  const double speed = rpm_ / handpiece_->rated_rpm;
  const double tilt = 0.4 * hardness_;  // hard bone is bright: the high partials become louder relative to the low ones
  const double spindle_hz = rpm_ / 60.0;
  const auto flutter_share = static_cast<float>(share(kFlutter_s, rate_hz_));
  // A one-pole filter leaves share / (2 - share) of the variance, 1/3, of the noise it smooths.
  const auto flutter_scale =
      static_cast<float>(params_.flutter * std::sqrt(3.0 * (2.0 - flutter_share) / flutter_share));

  const std::size_t count = handpiece_->partials.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Partial& partial = handpiece_->partials[i];
    flutter_[i] += flutter_share * (noise_.next() - flutter_[i]);
    const double hz = partial.ratio * spindle_hz;
    double level = 0;
    if (const double audibility = audible(hz, rate_hz_); audibility > 0 && hz > 0) {
      level = partial.level * gains[static_cast<std::size_t>(partial.source)] * speed * radiation(hz) * audibility *
              std::pow(std::max(hz, 100.0) / 2000.0, tilt) * (1.0 + flutter_scale * flutter_[i]);
    }
    const float from = level_[i], to = static_cast<float>(level);
    level_[i] = to;
    const double turns = hz / rate_hz_;
    const double phase = phase_[i];
    phase_[i] = std::fmod(phase + kBlockFrames * turns, 1.0);
    if (from == 0.0F && to == 0.0F) continue;

    const auto c = static_cast<float>(std::cos(kTurn * turns)), s = static_cast<float>(std::sin(kTurn * turns));
    auto re = static_cast<float>(std::cos(kTurn * phase)), im = static_cast<float>(std::sin(kTurn * phase));
    const float step = (to - from) / kBlockFrames;
    float amplitude = from;
    for (float& x : block) {
      x += amplitude * im;
      amplitude += step;
      const float next = re * c - im * s;
      im = re * s + im * c;
      re = next;
    }
  }
}

void Voice::add_noise(Block& block) noexcept {
  const double speed = rpm_ / handpiece_->rated_rpm;
  const auto chip_to = static_cast<float>(params_.noise * kChipLevel * chips_ * std::min(1.0, std::sqrt(speed)));
  const auto air_to = static_cast<float>(params_.noise * handpiece_->air_level * speed * (1.0 + 2.0 * drive_));
  if (chip_level_ == 0 && air_level_ == 0 && chip_to == 0 && air_to == 0) return;

  // The chips of hard bone are smaller and stiffer, so their noise has a higher frequency.
  chip_filter_.set(900.0 + 3600.0 * hardness_, rate_hz_, 0.9);
  air_filter_.set(3500.0, rate_hz_, 0.45);
  const double tooth_turns = rpm_ / 60.0 * handpiece_->teeth / rate_hz_;
  const float chip_step = (chip_to - chip_level_) / kBlockFrames, air_step = (air_to - air_level_) / kBlockFrames;
  // Each tooth breaks its own chips. Below 400 Hz this is a rattle; above, a tone that the partials make.
  const double rattle_hz = tooth_turns * rate_hz_;
  const auto depth = static_cast<float>(0.6 * std::clamp(2.0 - rattle_hz / 400.0, 0.0, 1.0));
  auto re = static_cast<float>(std::cos(kTurn * tooth_phase_)), im = static_cast<float>(std::sin(kTurn * tooth_phase_));
  const auto c = static_cast<float>(std::cos(kTurn * tooth_turns)),
             s = static_cast<float>(std::sin(kTurn * tooth_turns));
  for (float& x : block) {
    x += chip_level_ * (1.0F + depth * im) * chip_filter_.next(noise_.next());
    x += air_level_ * air_filter_.next(noise_.next());
    chip_level_ += chip_step;
    air_level_ += air_step;
    const float next = re * c - im * s;
    im = re * s + im * c;
    re = next;
  }
  chip_level_ = chip_to;
  air_level_ = air_to;
  tooth_phase_ = std::fmod(tooth_phase_ + kBlockFrames * tooth_turns, 1.0);
}

void Voice::add_knock(Block& block) noexcept {
  for (std::size_t m = 0; m < kKnock.size(); ++m) {
    float re = knock_re_[m], im = knock_im_[m];
    if (std::abs(re) + std::abs(im) < 1e-6F) continue;
    const double decay = std::exp(-1.0 / (kKnock[m].decay_s * rate_hz_));
    const double turn = kTurn * kKnock[m].hz / rate_hz_;
    const auto c = static_cast<float>(decay * std::cos(turn)), s = static_cast<float>(decay * std::sin(turn));
    for (float& x : block) {
      x += im;
      const float next = re * c - im * s;
      im = re * s + im * c;
      re = next;
    }
    knock_re_[m] = re;
    knock_im_[m] = im;
  }
}

}  // namespace osteon::audio
