#include "audio_client/synth/voice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "audio_client/synth/resonances.hpp"
#include "common/sound/levels.hpp"

namespace osteon::audio {
namespace {

using sound::amplitude_of_db;

constexpr double kTurn = 2.0 * std::numbers::pi;

// Partials fade out below half of the sampling rate. So none ever folds back, and none switches off with a click.
constexpr double kFadeStart = 0.375, kFadeEnd = 0.4375;

constexpr double kSilentRpm = 1.0;
constexpr double kRecent_s = 0.15;
constexpr double kFlutter_s = 0.08;

// A layer gives way if less than this share of a load is left. Cancellous bone behind a cortex keeps more.
constexpr double kGivesWay = 0.3;
constexpr double kKnockLoad = 0.25;  // a smaller load gives way without a sound
// Then less than this share of the bone under the cutting part is left. [A]
constexpr double kThrough = 0.05;
// And the tip goes on along the tool's axis: so far, so fast, and so soon after a state had it in bone. A hand that
// pushes 30 N and weighs 1 kg goes 0.35 mm in 5 ms, and nobody can stop it within three states, 60 of them a second.
// An even feed is slower. [A]
constexpr double kFallsOn_mm = 0.35, kFallsOn_mm_per_s = 20.0, kFallsSoon_s = 0.05;
constexpr double kMostFall_mm = 100.0;  // a tool that is farther away was taken up elsewhere

// Each tooth breaks its own chips. Below this frequency that is a rattle; above, a tone that the partials make.
constexpr double kRattle_hz = 400.0;
constexpr double kMostBlow = 3.0;  // of the reference blow
constexpr double kLowestPlate_hz = 60.0;

double share(double seconds, double rate_hz) { return 1.0 - std::exp(-kBlockFrames / (seconds * rate_hz)); }

double audible(double hz, double rate_hz) {
  return std::clamp((kFadeEnd - hz / rate_hz) / (kFadeEnd - kFadeStart), 0.0, 1.0);
}

// The factor on white noise that gives a band with this RMS: a band-pass of two poles has the bandwidth pi f / (2 Q).
double band_gain(double rms, double hz, double quality, double rate_hz) {
  return rms / std::sqrt(kWhiteVariance * std::numbers::pi * hz / (quality * rate_hz));
}

// Strength at `hz` of a blow that lasts for `contact_s`, relative to one that lasts no time: the spectrum of half a
// sine.
double blow_strength(double hz, double contact_s) {
  const double x = hz * contact_s, below = 1.0 - 4.0 * x * x;
  return std::abs(below) < 1e-3 ? 0.25 * std::numbers::pi : std::abs(std::cos(std::numbers::pi * x) / below);
}

// Adds a sine from one phase and level on. Lanes of samples apart, so that the compiler takes several at once.
void add_sine(Block& block, double phase_turns, double step_turns, float from, float to) {
  constexpr std::size_t kLanes = 8;
  std::array<float, kLanes> re{}, im{}, amplitude{};
  const float step = (to - from) / kBlockFrames;
  for (std::size_t l = 0; l < kLanes; ++l) amplitude[l] = from + static_cast<float>(l) * step;
  const auto turn = static_cast<float>(kTurn * step_turns), begin = static_cast<float>(kTurn * phase_turns);
  float c = std::cos(turn), s = std::sin(turn);
  re[0] = std::cos(begin);
  im[0] = std::sin(begin);
  for (std::size_t l = 1; l < kLanes; ++l) {
    re[l] = re[l - 1] * c - im[l - 1] * s;
    im[l] = re[l - 1] * s + im[l - 1] * c;
  }
  for (std::size_t doubled = 1; doubled < kLanes; doubled *= 2) {
    const float square = c * c - s * s;
    s = 2.0F * c * s;
    c = square;
  }
  for (std::size_t at = 0; at < block.size(); at += kLanes)
    for (std::size_t l = 0; l < kLanes; ++l) {
      block[at + l] += amplitude[l] * im[l];
      amplitude[l] += static_cast<float>(kLanes) * step;
      const float next = re[l] * c - im[l] * s;
      im[l] = re[l] * s + im[l] * c;
      re[l] = next;
    }
}

}  // namespace

void Voice::start(const Handpiece& handpiece, const VoiceParams& params, double rate_hz, const ToolSound& tool,
                  std::uint64_t seed) noexcept {
  *this = Voice{};
  handpiece_ = &handpiece;
  params_ = params;
  rate_hz_ = rate_hz;
  noise_ = WhiteNoise(seed);
  // Random phases keep the crest factor low.
  for (double& offset : offset_) offset = 0.5 + 0.5 * noise_.next();
  air_ = handpiece.noise;
  motor_.start(handpiece.spindle, handpiece.model.motor.run_down_s);
  for (std::size_t m = 0; m < blade_filters_.size(); ++m)
    if (const double hz = handpiece.blade_hz[m]; hz > 0 && hz < kFadeStart * rate_hz) {
      const BladeParams& blade = handpiece.model.blade;
      blade_filters_[m].set(hz, rate_hz, blade.quality);
      // The first modes are too low to be radiated well.
      const double rms = amplitude_of_db(blade.slope_db * static_cast<double>(m)) * radiation(hz);
      blade_levels_[m] = static_cast<float>(band_gain(rms, hz, blade.quality, rate_hz));
    }
  target_.author = tool.author;
  target_.handpiece = tool.handpiece;
  blows_ = tool.blows;
  waits_ = handpiece.model.drive == Drive::blows;
  aim(tool);
}

void Voice::aim(const ToolSound& tool) noexcept {
  if (handpiece_->model.drive == Drive::blows) {
    if (tool.blows > blows_) blow(tool);
    blows_ = tool.blows;
    target_ = tool;
    target_.rpm = 0;  // blows in a minute are no speed
    return;
  }
  break_through(tool);
  target_ = tool;
  motor_.aim(tool.rpm, tool.torque_Nmm);
  if (tool.rpm > 0) sounding_ = true;
}

void Voice::release() noexcept {
  target_.rpm = target_.load = target_.load_ahead = target_.hardness = target_.chips = 0;
  motor_.aim(0, 0);
  waits_ = false;
}

// A layer gives way: bone and load are gone from a tool that goes on. A hand that eases off leaves the bone under the
// tool. A haptic loop that stalls, and a session that ends, say neither bone nor load, but the tip stays. A tool that
// is drawn back, or that leaves the bone sideways, does not go on along its axis. Only what a state has said counts:
// what is computed ahead may stay after all.
void Voice::break_through(const ToolSound& tool) noexcept {
  if (tool.bone_g_cm3 >= kThrough * recent_bone_g_cm3_) return follow_in_bone(tool);
  const double load = tool.load - tool.load_ahead;
  if (recent_load_ <= kKnockLoad || load >= kGivesWay * recent_load_) return;
  if (!tool.advancing && !fell_on(tool)) return;
  const double released = recent_load_ - load;
  const std::vector<Mode>& burst = handpiece_->model.perforation.burst;
  for (std::size_t m = 0; m < burst.size(); ++m)
    burst_.strike(m, burst[m].hz, burst[m].decay_s, released * amplitude_of_db(burst[m].level_db), rate_hz_);
  perforated_ = std::clamp(released, perforated_, 1.0);
  recent_load_ = load;
  recent_bone_g_cm3_ = tool.bone_g_cm3;
}

void Voice::follow_in_bone(const ToolSound& tool) noexcept {
  if (tool.bone_g_cm3 <= 0) return;
  bone_tip_mm_ = tool.stated_tip_mm;
  bone_ns_ = tool.stated_ns;
  since_bone_s_ = 0;
}

bool Voice::fell_on(const ToolSound& tool) const noexcept {
  // States that are late are not later in the hand.
  const bool timed = bone_ns_ > 0 && tool.stated_ns > 0;
  const double since_s = timed ? 1e-9 * static_cast<double>(tool.stated_ns - bone_ns_) : since_bone_s_;
  if (since_s < 0 || since_s > kFallsSoon_s) return false;
  const double on_mm = (tool.stated_tip_mm - bone_tip_mm_).dot(tool.feed_axis);
  return on_mm >= std::max(kFallsOn_mm, kFallsOn_mm_per_s * since_s) && on_mm < kMostFall_mm;  // not true of nan
}

void Voice::blow(const ToolSound& tool) noexcept {
  const BlowParams& params = handpiece_->model.blow;
  const double strength = std::clamp(tool.blow_impulse_N_s / params.impulse_N_s, 0.0, kMostBlow);
  // A contact whose stiffness grows in proportion to the seating: frequencies go with its root.
  const double stiffer = (1.0 + params.rise) * (1.0 + params.rise) - 1.0;
  const double rise = std::sqrt(1.0 + stiffer * std::clamp(tool.seated, 0.0, 1.0));
  for (std::size_t m = 0; m < params.modes.size(); ++m) {
    const Mode& mode = params.modes[m];
    const double hz = rise * mode.hz;
    modes_.strike(m, hz, mode.decay_s, strength * amplitude_of_db(mode.level_db) * blow_strength(hz, params.contact_s),
                  rate_hz_);
  }
  click_level_ = static_cast<float>(strength * amplitude_of_db(params.click_db));
  if (!handpiece_->clicks.empty()) click_ = (click_ + 1) % handpiece_->clicks.size();
  click_at_ = 0;
  sounding_ = true;
}

void Voice::add_to(Block& block) noexcept {
  advance_controls();
  add_partials(block);
  add_cut(block);
  burst_.add_to(block);
  add_modes(block);
  add_click(block);
  const bool driven = rpm_ > 0 || target_.rpm > 0 || motor_.stalled();
  sounding_ = driven || burst_.ringing() || modes_.ringing() || click_level_ > 0;
}

void Voice::advance_controls() noexcept {
  motor_.step(kBlockFrames / rate_hz_);
  const double k = share(params_.smoothing_s, rate_hz_);
  rpm_ += k * (motor_.rpm() - rpm_);
  if (motor_.rpm() < kSilentRpm && rpm_ < kSilentRpm) rpm_ = 0;
  load_ += k * (target_.load - load_);
  hardness_ += k * (target_.hardness - hardness_);
  chips_ += k * (target_.chips - chips_);
  if (target_.cortex_mm > 0)
    cortex_mm_ = cortex_mm_ > 0 ? cortex_mm_ + k * (target_.cortex_mm - cortex_mm_) : target_.cortex_mm;
  const double keeps = 1.0 - share(kRecent_s, rate_hz_);
  recent_load_ = std::max(target_.load - target_.load_ahead, keeps * recent_load_);
  recent_bone_g_cm3_ = std::max(target_.bone_g_cm3, keeps * recent_bone_g_cm3_);
  since_bone_s_ += kBlockFrames / rate_hz_;
  perforated_ *= 1.0 - share(handpiece_->model.perforation.fade_s, rate_hz_);
  gains_ = material_gains(handpiece_->model, load_, hardness_, perforated_);
}

void Voice::add_partials(Block& block) noexcept {
  const double speed = rpm_ / handpiece_->model.rated_rpm;
  const double spindle_hz = rpm_ / 60.0;
  const double from_turns = turns_;
  turns_ += spindle_hz * kBlockFrames / rate_hz_;
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
      level = partial.level * gains_.source[static_cast<std::size_t>(partial.source)] * speed * radiation(hz) /
              partial.rated_gain * audibility * (1.0 + flutter_scale * flutter_[i]);
    }
    const float from = level_[i], to = static_cast<float>(level);
    level_[i] = to;
    if (from == 0.0F && to == 0.0F) continue;
    const double phase = partial.ratio * from_turns + offset_[i];
    add_sine(block, phase - std::floor(phase), hz / rate_hz_, from, to);
  }
}

// Levels and filters of the cut's noise for this block.
void Voice::tune_cut() noexcept {
  const ToolModel& model = handpiece_->model;
  const double flow = params_.noise * chips_ * std::min(1.0, std::sqrt(rpm_ / model.rated_rpm));
  // The chips of hard bone are smaller and stiffer, so their noise has a higher frequency.
  const double hz = std::lerp(model.chips.soft_hz, model.chips.hard_hz, std::min(1.0, hardness_));
  chip_filter_.set(hz, rate_hz_, model.chips.quality);
  chip_to_ =
      static_cast<float>(band_gain(flow * amplitude_of_db(model.chips.level_db), hz, model.chips.quality, rate_hz_));
  plate_to_ = 0;
  if (cortex_mm_ > 0 && target_.cortex_mm > 0) {
    const double plate_hz =
        std::clamp(plate_mode_hz(cortex_mm_, model.plate.radius_mm), kLowestPlate_hz, kFadeStart * rate_hz_);
    plate_filter_.set(plate_hz, rate_hz_, model.plate.quality);
    const double rms = flow * amplitude_of_db(model.plate.level_db);
    plate_to_ = static_cast<float>(band_gain(rms, plate_hz, model.plate.quality, rate_hz_));
  }
  blade_to_ = static_cast<float>(flow * amplitude_of_db(model.blade.level_db));
}

void Voice::add_cut(Block& block) noexcept {
  const ToolModel& model = handpiece_->model;
  const double speed = rpm_ / model.rated_rpm;
  const auto air_to = static_cast<float>(params_.noise * speed * gains_.noise);
  if (air_level_ > 0 || air_to > 0) air_.add_to(block, noise_, air_level_, air_to);
  air_level_ = air_to;
  tune_cut();
  if (chip_level_ + chip_to_ + plate_level_ + plate_to_ + blade_level_ + blade_to_ == 0) return;

  const bool strokes = model.drive == Drive::strokes;
  const double turns = rpm_ / 60.0 / rate_hz_ * (strokes ? 1.0 : handpiece_->teeth);
  const double rattles = strokes ? 1.0 : std::clamp(2.0 - turns * rate_hz_ / kRattle_hz, 0.0, 1.0);
  const auto depth = static_cast<float>(model.chips.depth * rattles),
             lopsided = static_cast<float>(model.chips.lopsided);
  const double end = turns_ * (strokes ? 1.0 : handpiece_->teeth) - kBlockFrames * turns, phase = end - std::floor(end);
  auto re = static_cast<float>(std::cos(kTurn * phase)), im = static_cast<float>(std::sin(kTurn * phase));
  const auto c = static_cast<float>(std::cos(kTurn * turns)), s = static_cast<float>(std::sin(kTurn * turns));
  const float chip_step = (chip_to_ - chip_level_) / kBlockFrames,
              plate_step = (plate_to_ - plate_level_) / kBlockFrames,
              blade_step = (blade_to_ - blade_level_) / kBlockFrames;
  for (float& x : block) {
    const float white = noise_.next();
    // Teeth that swing are fastest in the middle of a stroke. Teeth that turn cut one after the other.
    const float swing = strokes ? (1.0F - depth + depth * std::abs(re)) * (1.0F + lopsided * re) : 1.0F + depth * im;
    float sum = chip_level_ * chip_filter_.next(white) + plate_level_ * plate_filter_.next(white);
    if (strokes)
      for (std::size_t m = 0; m < blade_filters_.size(); ++m)
        sum += blade_level_ * blade_levels_[m] * blade_filters_[m].next(white);
    x += swing * sum;
    chip_level_ += chip_step;
    plate_level_ += plate_step;
    blade_level_ += blade_step;
    const float next = re * c - im * s;
    im = re * s + im * c;
    re = next;
  }
  chip_level_ = chip_to_;
  plate_level_ = plate_to_;
  blade_level_ = blade_to_;
}

// A recorded blow has its modes in it. They fade in as it fades out.
void Voice::add_modes(Block& block) noexcept {
  if (click_level_ == 0 || handpiece_->clicks.empty()) {
    modes_.add_to(block);
    return;
  }
  const std::span<const float> weight = std::span(handpiece_->click_weights[click_]).subspan(click_at_);
  Block ringing{};
  modes_.add_to(ringing);
  for (std::size_t i = 0; i < block.size(); ++i) block[i] += (i < weight.size() ? 1.0F - weight[i] : 1.0F) * ringing[i];
}

void Voice::add_click(Block& block) noexcept {
  if (click_level_ == 0) return;
  if (!handpiece_->clicks.empty()) {
    const std::span<const float> click = handpiece_->clicks[click_];
    const std::size_t count = std::min(block.size(), click.size() - click_at_);
    for (std::size_t i = 0; i < count; ++i) block[i] += click_level_ * click[click_at_ + i];
    click_at_ += count;
    if (click_at_ == click.size()) click_level_ = 0;
    return;
  }
  const auto shrink = static_cast<float>(std::exp(-1.0 / (handpiece_->model.blow.click_s * rate_hz_)));
  const auto noise = static_cast<float>(params_.noise);
  for (float& x : block) {
    x += noise * click_level_ * noise_.next();
    click_level_ *= shrink;
  }
  if (click_level_ < 1e-5F) click_level_ = 0;
}

}  // namespace osteon::audio
