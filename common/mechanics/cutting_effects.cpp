#include "common/mechanics/cutting_effects.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/mechanics/bone_strength.hpp"
#include "common/mechanics/force_law.hpp"

namespace osteon {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kLoose_mm = 0.5;  // a broach that is drawn back so far sits no longer [A]

}  // namespace

void Bluntness::step(const BluntnessParams& params, double torque_nmm, double rpm, double dt_s) noexcept {
  const double work_j = 1e-3 * torque_nmm * rpm * kTurn / 60.0 * dt_s;
  if (!(work_j > 0.0) || wear_ >= params.blunt) return;
  wear_ = params.blunt - (params.blunt - wear_) * std::exp(-work_j / params.work_j);
}

void FluteClogging::step(const CloggingParams& params, double diameter_mm, double cut_mm, double engaged,
                         double density_g_cm3, double back_mm) noexcept {
  level_ += filling(params, diameter_mm, cut_mm, engaged, density_g_cm3);
  level_ -= back_mm / (params.cleared_diameters * diameter_mm);
  level_ = std::clamp(level_, 0.0, 1.0);
}

// Solves level' = f - level / rinse_s exactly for the tick's mean f, so that the length of the tick does not matter.
void FluteClogging::step_rinsed(const CloggingParams& params, double diameter_mm, double cut_mm, double engaged,
                                double density_g_cm3, double back_mm, double dt_s) noexcept {
  const double stays = std::exp(-dt_s / params.rinse_s);
  level_ *= stays;
  level_ += filling(params, diameter_mm, cut_mm, engaged, density_g_cm3) * (1.0 - stays) * params.rinse_s / dt_s;
  level_ -= back_mm / (params.cleared_diameters * diameter_mm);
  level_ = std::clamp(level_, 0.0, 1.0);
}

double FluteClogging::filling(const CloggingParams& params, double diameter_mm, double cut_mm, double engaged,
                              double density_g_cm3) noexcept {
  return engaged * density_g_cm3 / kCorticalDensity * cut_mm / (params.capacity_diameters * diameter_mm);
}

bool has_flutes(ToolKind kind) noexcept {
  return kind == ToolKind::drill || kind == ToolKind::end_drill || kind == ToolKind::cylinder_reamer;
}

void BreakthroughGrab::step(const GrabParams& params, double engaged, bool cutting, double cutting_n,
                            bool drawn_back) noexcept {
  engaged_ = engaged;
  if (drawn_back || engaged <= params.gone) {
    phase_ = Phase::outside;
  } else if (engaged >= params.whole) {
    if (cutting) {
      phase_ = Phase::whole;
      whole_n_ = cutting_n;
    }
  } else if (phase_ == Phase::whole) {
    phase_ = Phase::breaking;
  }
}

double BreakthroughGrab::pull_n(const GrabParams& params) const noexcept { return params.ratio * whole_n_ * rim(); }

double BreakthroughGrab::torque_factor(const GrabParams& params) const noexcept {
  return 1.0 + params.torque_gain * rim();
}

void SawBinding::step(const BindingParams& params, double pressure_n) noexcept {
  pressure_n_ = std::max(0.0, pressure_n);
  jammed_ = jammed_ ? pressure_n_ > params.release * params.jam_n : pressure_n_ >= params.jam_n;
}

double BroachDrive::step(const BlowParams& params, double blows_per_minute, double engaged_area_mm2,
                         double density_g_cm3, double held_n, double gone_mm, double dt_s) noexcept {
  // The motion of a step is known only in the next one, so a blow lasts one step longer.
  lasts_s_ -= dt_s;
  left_mm_ = lasts_s_ > -1.5 * dt_s ? std::max(0.0, left_mm_ - std::max(0.0, gone_mm)) : 0.0;
  const bool struck = blows_per_minute > 0.0 && held_n > 0.0;
  until_blow_s_ -= dt_s;
  if (!struck || !striking_) until_blow_s_ = std::max(0.0, until_blow_s_);  // missed blows are not made up for
  striking_ = struck;
  drawn_mm_ = held_n > 0.0 ? 0.0 : drawn_mm_ + std::max(0.0, -gone_mm);
  if (held_n > 0.0)
    seating_ = osteon::seating(params.law, engaged_area_mm2, GramsPerCm3{density_g_cm3});
  else if (drawn_mm_ > kLoose_mm)
    seating_ = 0.0;
  if (struck && until_blow_s_ <= 0.5 * dt_s) {
    until_blow_s_ += 60.0 / blows_per_minute;
    ++blows_;
    impulse_n_s_ = params.law.impulse_n_s;
    const double advance_mm = blow_advance_mm(params.law, engaged_area_mm2, GramsPerCm3{density_g_cm3});
    seated_ = !(advance_mm > 0.0);
    left_mm_ = advance_mm * std::min(1.0, held_n / params.law.hold_n);
    speed_mm_per_s_ = left_mm_ / params.contact_s;
    lasts_s_ = params.contact_s;
  }
  return std::min(left_mm_, speed_mm_per_s_ * dt_s);
}

void BroachDrive::take_up() noexcept {
  BroachDrive fresh;
  fresh.blows_ = blows_;
  fresh.impulse_n_s_ = impulse_n_s_;
  *this = fresh;
}

SpindleParams motor_of(const Tool& tool) noexcept {
  SpindleParams motor;
  if (!(tool.spindle_rpm > 0.0)) return motor;
  const bool drives = tool.kind == ToolKind::drill || tool.kind == ToolKind::end_drill || tool.kind == ToolKind::pin ||
                      tool.kind == ToolKind::screw;
  const double ratio = tool.spindle_rpm / motor.full_rpm, power = drives ? 1.0 : 4.0;
  motor.droop_rpm_per_nmm *= ratio * ratio / power;
  motor.most_nmm *= power / ratio;
  motor.full_rpm = tool.spindle_rpm;
  return motor;
}

CuttingEffects::CuttingEffects(const Tool& tool, double wear) noexcept
    : flutes_(has_flutes(tool.kind)),
      drills_(tool.kind == ToolKind::drill || tool.kind == ToolKind::end_drill),
      saws_(tool.kind == ToolKind::oscillating_saw || tool.kind == ToolKind::reciprocating_saw),
      broaches_(tool.kind == ToolKind::broach),
      diameter_mm_(law_tool(tool).diameter_mm),
      stroke_mm_(law_tool(tool).stroke_mm),
      bluntness_(wear) {}

FeedLaw CuttingEffects::felt(const FeedLaw& law) const noexcept {
  FeedLaw out = law;
  if (flutes_) out = scaled(law, clogging_.thrust_factor(clogging_params));
  if (saws_) {
    out.offset_n += binding_.drag_n(binding_params);
    if (binding_.jammed()) out.max_feed_mm_per_s = 0.0;
  }
  // The blow does the work, not the user's hand.
  if (broaches_) out = {0.0, 0.0, 1.0, may_go_mm_per_s_, 0.0};
  return out;
}

double CuttingEffects::torque_nmm(double law_torque_nmm) const noexcept {
  double torque = law_torque_nmm;
  if (flutes_) torque *= clogging_.torque_factor(clogging_params);
  if (drills_) torque *= grab_.torque_factor(grab_params);
  if (saws_) torque += binding_.drag_n(binding_params) * stroke_mm_ / std::numbers::pi;
  return torque;
}

void CuttingEffects::take_up() noexcept {
  clogging_ = {};
  grab_ = {};
  binding_ = {};
  drive_.take_up();
  may_go_mm_per_s_ = 0.0;
}

void CuttingEffects::step(const EffectMoment& moment, double dt_s) noexcept {
  const double cut_mm = moment.cutting ? std::max(0.0, moment.advance_mm) : 0.0;
  const double back_mm = std::max(0.0, -moment.advance_mm);
  if (moment.cutting) bluntness_.step(bluntness_params, moment.torque_nmm, moment.spindle_rpm, dt_s);
  if (flutes_ && moment.irrigation)
    clogging_.step_rinsed(clogging_params, diameter_mm_, cut_mm, moment.engaged, moment.density_g_cm3, back_mm, dt_s);
  else if (flutes_)
    clogging_.step(clogging_params, diameter_mm_, cut_mm, moment.engaged, moment.density_g_cm3, back_mm);
  if (drills_) grab_.step(grab_params, moment.engaged, moment.cutting, moment.cutting_n, back_mm > 0.0);
  if (saws_) binding_.step(binding_params, moment.kerf_pressure_n);
  if (broaches_) {
    const double held_n = moment.engaged > 0.0 ? moment.push_n : 0.0;  // no blows in the air
    BlowParams blow = blow_params;
    blow.law.wear *= wear();
    const double may_go_mm = drive_.step(blow, moment.spindle_rpm, moment.engaged_area_mm2, moment.density_g_cm3,
                                         held_n, moment.advance_mm, dt_s);
    may_go_mm_per_s_ = may_go_mm / dt_s;
  }
}

}  // namespace osteon
