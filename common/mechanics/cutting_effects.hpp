// Effects that a surgeon expects of real tools: bluntness, clogged flutes, the grab at breakthrough, a saw that binds,
// a broach driven by blows. They are small state machines, stepped by what the tool did in a tick. What adds up over
// many ticks does not depend on their length. All [haptic]: no allocation, clock or random number.
//
// Effects that resist (bluntness, clogging, binding, blows) change the law that the proxy solves. The grab pulls
// actively. It belongs to the port of the motor's forces, which bounds it and stops it with the pedal.
#pragma once
#include <cstdint>

#include "common/mechanics/broaching.hpp"
#include "common/mechanics/feed_law.hpp"
#include "common/mechanics/spindle.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// An edge becomes blunt by the work of cutting: wear' = (blunt - wear) · power / work. So a blunt tool needs at most
// `blunt` times the force. A bicortical hole of 3.2 mm costs about 30 J, so a hundred of them make it a quarter blunt
// [A].
struct BluntnessParams {
  double blunt = 2.0;
  double work_j = 10'000.0;
};
class Bluntness {
 public:
  explicit Bluntness(double wear = 1.0) noexcept : wear_(wear) {}
  void step(const BluntnessParams& params, double torque_nmm, double rpm, double dt_s) noexcept;
  [[nodiscard]] double wear() const noexcept { return wear_; }

 private:
  double wear_;
};

// Flutes fill with chips by the bone drilled in one pass, and empty when the drill is drawn back. From `onset` on,
// chips increase the torque, and the thrust to a smaller degree [A]. Nobody clears a drill for a bicortical hole, or
// leaves it in for ten diameters of cortical bone.
//
// Irrigation keeps drills from clogging (Lee 2018). We found no rate. Here water removes chips at a rate proportional
// to their level: level' = filling - level / rinse_s [A]. So at a steady filling rate r the level tends to r * rinse_s.
// The model lets water reach all flutes. Real water hardly gets into a deep hole.
struct CloggingParams {
  double capacity_diameters = 10.0;  // depth in cortical bone until they are full; softer bone gives fewer chips
  double cleared_diameters = 1.5;    // distance of withdrawal until full flutes are empty
  double onset = 0.5;                // level up to which chips leave freely
  double torque_gain = 5.0;          // relative increase of torque with full flutes
  double thrust_gain = 0.5;
  double rinse_s = 4.0;  // after so long, irrigation leaves 1/e of the chips [A]
};
class FluteClogging {
 public:
  // `cut_mm`: advance into bone. `back_mm`: withdrawal. Both in this tick and not negative. `engaged`: fraction of the
  // point that cut bone of that density.
  void step(const CloggingParams& params, double diameter_mm, double cut_mm, double engaged, double density_g_cm3,
            double back_mm) noexcept;
  // The same under irrigation.
  void step_rinsed(const CloggingParams& params, double diameter_mm, double cut_mm, double engaged,
                   double density_g_cm3, double back_mm, double dt_s) noexcept;
  [[nodiscard]] double level() const noexcept { return level_; }  // 0 empty, 1 full
  [[nodiscard]] double torque_factor(const CloggingParams& p) const noexcept { return 1.0 + p.torque_gain * packed(p); }
  [[nodiscard]] double thrust_factor(const CloggingParams& p) const noexcept { return 1.0 + p.thrust_gain * packed(p); }

 private:
  // Share of the flutes that a cut fills.
  [[nodiscard]] static double filling(const CloggingParams& params, double diameter_mm, double cut_mm, double engaged,
                                      double density_g_cm3) noexcept;
  [[nodiscard]] double packed(const CloggingParams& p) const noexcept {
    return level_ > p.onset ? (level_ - p.onset) / (1.0 - p.onset) : 0.0;
  }
  double level_ = 0;
};
[[nodiscard]] bool has_flutes(ToolKind kind) noexcept;

// When the point comes out on the far side, the lips catch the remaining rim and the flutes pull the drill forward. The
// pull is ratio · (the last whole thrust) · 4 e (1 - e) with the engaged fraction e, and the torque rises
// accordingly. It needs that the whole point was in bone before, so there is no pull on entry.
struct GrabParams {
  double whole = 0.9;        // fraction from which the point counts as whole
  double gone = 0.02;        // fraction below which it counts as out
  double ratio = 0.15;       // of the thrust [A]
  double torque_gain = 1.0;  // [A]
};
class BreakthroughGrab {
 public:
  void step(const GrabParams& params, double engaged, bool cutting, double cutting_n, bool drawn_back) noexcept;
  [[nodiscard]] bool grabbing() const noexcept { return phase_ == Phase::breaking; }
  [[nodiscard]] double pull_n(const GrabParams& params) const noexcept;  // along the feed, on the tool
  [[nodiscard]] double torque_factor(const GrabParams& params) const noexcept;

 private:
  enum class Phase : std::uint8_t { outside, whole, breaking };
  [[nodiscard]] double rim() const noexcept { return grabbing() ? 4.0 * engaged_ * (1.0 - engaged_) : 0.0; }
  Phase phase_ = Phase::outside;
  double engaged_ = 0, whole_n_ = 0;
};

// A blade that is pressed sideways in its kerf presses on the wall, and friction drags. From jam_n on it stops until
// the pressure has fallen to `release` of that. A blade turned beyond its play is not treated here, because the walls
// of the kerf stop it. Kerfs do not close by themselves here.
struct BindingParams {
  double friction = 0.3;  // [A]
  double jam_n = 30.0;    // [A]
  double release = 0.5;   // [A]
};
class SawBinding {
 public:
  // `pressure_n`: of the plate on the walls.
  void step(const BindingParams& params, double pressure_n) noexcept;
  [[nodiscard]] bool jammed() const noexcept { return jammed_; }
  [[nodiscard]] double drag_n(const BindingParams& params) const noexcept { return params.friction * pressure_n_; }

 private:
  double pressure_n_ = 0;
  bool jammed_ = false;
};

// Blows at the rate of the handpiece or mallet, the first at once. Each drives the broach over `contact_s` by the
// advance of broaching.hpp. A blow that would drive it less than `seated_mm` does not move it: it is seated.
struct BlowParams {
  BroachingParams law;
  double contact_s = 5e-3;  // [A]
};
class BroachDrive {
 public:
  // `held_n`: push of the user's hand. A loosely held broach bounces and advances less, in proportion. `gone_mm`: its
  // motion since the last step. If the hand does not follow a blow while it lasts, that part is lost. Returns the
  // largest advance until the next step, mm.
  double step(const BlowParams& params, double blows_per_minute, double engaged_area_mm2, double density_g_cm3,
              double held_n, double gone_mm, double dt_s) noexcept;
  [[nodiscard]] bool seated() const noexcept { return seated_; }
  // Of the bone that the next blow meets, as when the broach was held last; 0 before that, and once it is drawn back.
  [[nodiscard]] double seating() const noexcept { return seating_; }
  [[nodiscard]] int blows() const noexcept { return blows_; }
  [[nodiscard]] double impulse_n_s() const noexcept { return impulse_n_s_; }  // of the newest blow; 0 before the first
  // Forgets all but the blows, which are counted on: whoever counts by their number misses none.
  void take_up() noexcept;

 private:
  double until_blow_s_ = 0, lasts_s_ = 0, left_mm_ = 0, speed_mm_per_s_ = 0;
  double seating_ = 0, drawn_mm_ = 0, impulse_n_s_ = 0;
  int blows_ = 0;
  bool seated_ = false, striking_ = false;
};

// The motor of a tool of this kind, by the power of such handpieces [A]. Drills have that of the drill of 1000 rpm;
// burs, saws and reamers four times that. Constant power: torque and droop follow from the tool's speed.
[[nodiscard]] SpindleParams motor_of(const Tool& tool) noexcept;

// What the tool did in a tick.
struct EffectMoment {
  double spindle_rpm = 0;
  double engaged = 0;
  double engaged_area_mm2 = 0;
  double density_g_cm3 = 0;
  bool cutting = false;
  double cutting_n = 0;   // of the tool on the bone, along the feed
  double torque_nmm = 0;  // as felt, see CuttingEffects::torque_nmm()
  double advance_mm = 0;  // along the feed, negative when drawn back
  double push_n = 0;      // of the user's hand along the feed
  double kerf_pressure_n = 0;
  bool irrigation = false;  // the other hand rinses the tool
};

// All effects for one tool. Order in a tick: felt() and torque_nmm() for the proxy, then step().
class CuttingEffects {
 public:
  explicit CuttingEffects(const Tool& tool, double wear = 1.0) noexcept;

  // For LawInputs::wear.
  [[nodiscard]] double wear() const noexcept { return bluntness_.wear(); }
  // From now on the tool is as blunt as that. Cutting blunts it further.
  void set_wear(double wear) noexcept { bluntness_ = Bluntness(wear); }
  // The law after clogging, binding and blows.
  [[nodiscard]] FeedLaw felt(const FeedLaw& law) const noexcept;
  [[nodiscard]] double torque_nmm(double law_torque_nmm) const noexcept;
  void step(const EffectMoment& moment, double dt_s) noexcept;
  // Called when the hand takes the tool up: resets all effects but wear.
  void take_up() noexcept;
  // The pull of the grab at breakthrough, on the tool along the feed. Not bounded by what the user feels.
  [[nodiscard]] double pull_n() const noexcept { return drills_ ? grab_.pull_n(grab_params) : 0.0; }

  [[nodiscard]] const FluteClogging& clogging() const noexcept { return clogging_; }  // empty without flutes
  [[nodiscard]] const BreakthroughGrab& grab() const noexcept { return grab_; }
  [[nodiscard]] const SawBinding& binding() const noexcept { return binding_; }
  [[nodiscard]] const BroachDrive& drive() const noexcept { return drive_; }

  BluntnessParams bluntness_params;
  CloggingParams clogging_params;
  GrabParams grab_params;
  BindingParams binding_params;
  BlowParams blow_params;

 private:
  bool flutes_, drills_, saws_, broaches_;
  double diameter_mm_, stroke_mm_;
  Bluntness bluntness_;
  FluteClogging clogging_;
  BreakthroughGrab grab_;
  SawBinding binding_;
  BroachDrive drive_;
  double may_go_mm_per_s_ = 0;  // broach: speed limit in the next tick
};

}  // namespace osteon
