#include "tests/perf/classifier/drilled_layers.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/check.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/sound/random.hpp"

namespace osteon::test {
namespace {

constexpr double kTick_s = 1e-3;
constexpr double kState_s = 1.0 / 120.0;
constexpr double kAfterBreak_s = 0.12;  // in which a drill and its hand swing back
constexpr double kContact = 0.1;        // share of the point
constexpr double kBreaks = 0.5;
constexpr double kTouch_mm = 0.01;  // of the tip in bone: deep enough to have an area
constexpr double kApproach_mm = 2.0, kApproach_mm_per_s = 4.0, kBeyond_mm = 5.0;

// Shares of the point's projected area.
struct Engaged {
  double cortical = 0, cancellous = 0;
  [[nodiscard]] double all() const { return cortical + cancellous; }
};

class Hand {
 public:
  explicit Hand(const Drilling& d) : d_(d) {
    const auto found = find_tool(d.tool);
    OSTEON_CHECK(found.has_value());
    tool_ = *found;
    law_tool_ = law_tool(tool_);
    law_ = &default_law(tool_);
    radius_mm_ = 0.5 * tool_.diameter_mm;
    height_mm_ = radius_mm_ / std::tan(0.5 * tool_.point_angle_rad);
    spindle_.full_rpm = d.rpm;
  }

  DrilledLayers run() {
    rest(d_.rest_s, 0);
    rest(d_.free_s, d_.rpm);
    while (tip_mm_ < thickness_mm() + kBeyond_mm && out_.truth.size() < kMostTicks) tick(d_.rpm, true);
    rest(d_.free_s, d_.rpm);
    rest(d_.rest_s + 0.5, 0);
    return std::move(out_);
  }

 private:
  static constexpr std::size_t kMostTicks = 60'000;

  [[nodiscard]] double thickness_mm() const { return d_.shell.near_mm + d_.shell.between_mm + d_.shell.far_mm; }

  void rest(double seconds, double command_rpm) {
    for (double at = 0; at < seconds; at += kTick_s) tick(command_rpm, false);
  }

  // Share of the point's projected area between two depths of the bone. A cone at `from` behind its tip has the radius
  // from / height of the whole.
  [[nodiscard]] double share(double from_mm, double to_mm) const {
    const auto inside = [&](double depth_mm) {
      const double part = std::clamp((tip_mm_ - depth_mm) / height_mm_, 0.0, 1.0);
      return part * part;
    };
    return inside(from_mm) - inside(to_mm);
  }
  [[nodiscard]] Engaged engaged() const {
    const Shell& s = d_.shell;
    const double middle = s.near_mm + s.between_mm, end = thickness_mm();
    return {share(0, s.near_mm) + share(middle, end), share(s.near_mm, middle)};
  }

  void tick(double command_rpm, bool feeding) {
    const Engaged now = engaged();
    const bool broken = tip_mm_ > thickness_mm();
    CuttingState state;
    if (feeding) state = now.all() > 1e-6 ? cut(now, broken) : approach();
    if (feeding && now.all() <= 1e-6 && broken) tip_mm_ += plunge() * kTick_s;
    spindle_state_.step(spindle_, command_rpm, state.torque_Nmm, kTick_s);
    note(state, now, broken, feeding);
  }

  CuttingState approach() {
    if (tip_mm_ < kTouch_mm) tip_mm_ += kApproach_mm_per_s * kTick_s;
    return {};
  }
  // Beyond the bone the hand stops the drill evenly.
  [[nodiscard]] double plunge() const {
    const double left = std::clamp((thickness_mm() + kBeyond_mm - tip_mm_) / kBeyond_mm, 0.05, 1.0);
    return d_.plunge_mm_per_s * left;
  }

  // The feed at which the law resists with the hand's push, within what the hand and the tool allow.
  CuttingState cut(const Engaged& now, bool broken) {
    LawInputs in;
    in.spindle_rpm = std::max(spindle_state_.rpm, 100.0);
    in.engaged = now.all();
    in.density_g_cm3 =
        (now.cortical * d_.shell.cortical_g_cm3 + now.cancellous * d_.shell.cancellous_g_cm3) / now.all();
    const FeedLaw law = law_->feed_law(law_tool_, in);
    const double most = broken ? d_.plunge_mm_per_s : d_.most_feed_mm_per_s;
    const double feed = std::min(feed_at_mm_per_s(law, d_.push_n), most);
    tip_mm_ += feed * kTick_s;
    CuttingState state;
    state.phase = CuttingPhase::cutting;
    state.feed_mm_per_s = feed;
    state.density_g_cm3 = in.density_g_cm3;
    state.engaged_fraction = in.engaged;
    state.force_physical_N = {0, 0, resistance_n(law, feed)};
    state.torque_Nmm = law_->torque_nmm(law_tool_, in, state.force_physical_N.z());
    return state;
  }

  void note(CuttingState& state, const Engaged& now, bool broken, bool feeding) {
    out_.truth.push_back(truth(now, broken, feeding));
    const double time_s = kTick_s * static_cast<double>(out_.truth.size() - 1);
    if (time_s + 0.5 * kTick_s < kState_s * static_cast<double>(out_.states.size())) return;
    state.author = AuthorId{1};
    state.state_seq = out_.states.size() + 1;
    state.tool_name = d_.tool;
    state.time_ns = std::llround(1e9 * time_s);
    state.spindle_rpm = spindle_state_.rpm;
    state.pose_bone_tool = pose_along({0, 0, -tip_mm_}, -Vec3::UnitZ());
    if (state.phase != CuttingPhase::cutting) state.phase = state.spindle_rpm > 0 ? CuttingPhase::free : state.phase;
    const Shell& s = d_.shell;
    if (now.cortical > 0) state.cortex_mm = tip_mm_ < s.near_mm + s.between_mm ? s.near_mm : s.far_mm;
    out_.states.push_back(state);
  }

  SoundClass truth(const Engaged& now, bool broken, bool feeding) {
    if (feeding && broken && now.all() > 0) last_in_bone_s_ = kTick_s * static_cast<double>(out_.truth.size());
    const double since_s = kTick_s * static_cast<double>(out_.truth.size()) - last_in_bone_s_;
    if (spindle_state_.rpm < 0.5 * d_.rpm) return SoundClass::silent;
    if (broken && now.all() < kBreaks && since_s < kAfterBreak_s) return SoundClass::perforation;
    if (now.all() < kContact) return SoundClass::free;
    return now.cortical >= now.cancellous ? SoundClass::cortical : SoundClass::cancellous;
  }

  Drilling d_;
  Tool tool_;
  LawTool law_tool_;
  const ForceLaw* law_ = nullptr;
  double radius_mm_ = 0, height_mm_ = 0;
  double tip_mm_ = -kApproach_mm;
  double last_in_bone_s_ = -1;
  SpindleParams spindle_;
  Spindle spindle_state_;
  DrilledLayers out_;
};

}  // namespace

std::string_view name(SoundClass one) {
  constexpr std::array<std::string_view, kSoundClasses> kNames = {"silent", "free", "cortical", "cancellous",
                                                                  "perforation"};
  return kNames[static_cast<std::size_t>(one)];
}

Drilling varied(const Drilling& usual, std::uint64_t seed) {
  sound::Random random(seed);
  const auto between = [&](double low, double high) { return low + (high - low) * random.unit(); };
  Drilling d = usual;
  d.shell.near_mm = between(2.0, 4.0);
  d.shell.between_mm = between(8.0, 16.0);
  d.shell.far_mm = between(2.0, 4.0);
  d.shell.cortical_g_cm3 = between(1.8, 2.0);
  d.shell.cancellous_g_cm3 = between(0.25, 0.40);
  d.push_n = usual.push_n * between(0.9, 1.1);
  d.most_feed_mm_per_s = usual.most_feed_mm_per_s * between(0.8, 1.1);
  d.plunge_mm_per_s = usual.plunge_mm_per_s * between(0.8, 1.2);
  d.rest_s = between(0.5, 1.0);
  d.free_s = between(0.8, 1.6);
  return d;
}

DrilledLayers drill(const Drilling& drilling) { return Hand(drilling).run(); }

}  // namespace osteon::test
