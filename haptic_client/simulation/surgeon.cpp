#include "haptic_client/simulation/surgeon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {
namespace {

constexpr double kStandOff_mm = 12.0;  // where a tool is taken up, above the surface
constexpr double kNear_mm = 1.5;       // from here the surface is approached slowly
constexpr double kCarrySpeed_mm_per_s = 25.0;
constexpr double kSeekSpeed_mm_per_s = 4.0;
constexpr double kBeyondGone_mm = 1.0;    // search distance past the far side where the bone is already gone
constexpr double kCorticalDensity = 1.1;  // g/cm³; denser bone counts as cortex in the means
constexpr double kBurrTilt_rad = 30.0 * std::numbers::pi / 180.0;  // the pole of a burr does not cut
constexpr double kPass_mm = 0.6;                                   // depth of a burr's pass
// After some of its time constants, B/K of 0.04 to 0.07 s, a hand has reached its target.
constexpr double kFollows_s = 0.25;
constexpr double kLastDwell_s = 1.0;  // and at the end the hand presses on until bone hardly yields any more
constexpr double kGrown_mm = 0.01;    // a tip that gets deeper by less than this in such a time is at its depth
constexpr double kEnough = 0.9;       // share of the wanted depth with which a window counts as done

double depth_mm(const ReadyStep& step, const Vec3& tip_mm) { return (tip_mm - step.site.entry_mm).dot(step.site.axis); }

std::string at_step(std::size_t index) { return "step " + std::to_string(index + 1) + ": "; }

Result<EntrySite> find_site(const Case& bone, const PlanEntry& entry, const EntrySite* last) {
  if (entry.toward) return find_site_toward(bone, *entry.toward);
  if (entry.point_mm && entry.axis) return find_site_at(bone, *entry.point_mm, *entry.axis);
  if (entry.beside_last_mm) {
    if (!last)
      return failure(ErrorCode::invalid_input, "entry.beside_last_mm needs a step before it; give entry.toward");
    return find_site_beside(bone, *last, (*entry.beside_last_mm)[0], (*entry.beside_last_mm)[1]);
  }
  return failure(
      ErrorCode::invalid_input,
      "entry is missing; give {\"toward\": [x, y, z]}, or {\"point_mm\": [...]} with \"axis\" or \"target_mm\"");
}

// From the tip to where the hand holds the tool: a hand that strays also tilts it.
constexpr double kTremorArm_mm = 80.0;

// A slow drift and the 9 Hz of a trembling hand, together at most 1 in size.
struct Stray {
  double u = 0, v = 0;
};
Stray stray(double time_s, double phase) {
  const auto wave = [&](double shift) {
    return 0.6 * std::sin(2.0 * std::numbers::pi * 0.7 * time_s + shift) +
           0.4 * std::sin(2.0 * std::numbers::pi * 9.0 * time_s + 2.0 * shift);
  };
  return {wave(phase + 0.8) / std::numbers::sqrt2, wave(phase + 2.5) / std::numbers::sqrt2};
}

// How far a rig goes: through the bone, or until the tool is at its depth, however far the coupling extends on the way.
double feed_end_mm(const ReadyStep& step) {
  constexpr double kMostStretch_mm = 15.0;
  return step.plan.to_mm > 0.0 ? step.plan.to_mm + kMostStretch_mm : step.site.thickness_mm + step.plan.beyond_mm;
}

// The time that a phase may take. Motion by its own clock gets twice its time and a margin. A phase that waits for bone
// or spindle gets as long as any bone could need.
double most_s(const ReadyStep& step, SurgeonPhase phase) {
  constexpr double kMargin_s = 10.0, kMostPush_s = 60.0;
  switch (phase) {
    case SurgeonPhase::seek:
      return kMargin_s + 2.0 * step.site.thickness_mm / kSeekSpeed_mm_per_s;
    case SurgeonPhase::push:
      return kMostPush_s;
    case SurgeonPhase::feed:
      return kMargin_s + 2.0 * feed_end_mm(step) / step.plan.feed_mm_per_s;
    case SurgeonPhase::sweep: {
      constexpr double kMostDwell_s = 3.0;
      const double dwells = step.dwells ? static_cast<double>(step.sweep_mm.size() / step.line_places) : 1.0;
      return kMargin_s + 2.0 * step.sweep_length_mm / step.plan.sweep_mm_per_s + kMostDwell_s * dwells;
    }
    default:
      return kMargin_s;
  }
}

// Back and forth over the window, pass below pass, following the imported surface.
void plan_sweep(const Case& bone, const Tool& tool, ReadyStep& step) {
  const EntrySite& site = step.site;
  const double radius = 0.5 * tool.diameter_mm;
  // Tilted about v, so that the flank cuts; the sphere stays in place.
  const Eigen::Quaterniond upright = pose_along(Vec3::Zero(), site.axis).rotation;
  step.rotation = (Eigen::Quaterniond(Eigen::AngleAxisd(kBurrTilt_rad, site.across_v)) * upright).normalized();
  const Vec3 tip_from_centre = radius * (step.rotation * Vec3::UnitZ());

  const double half_u = std::max(0.0, 0.5 * step.plan.window_u_mm - radius),
               half_v = std::max(0.0, 0.5 * step.plan.window_v_mm - radius);
  const int passes = std::max(1, static_cast<int>(std::ceil(step.plan.depth_mm / kPass_mm)));
  const int lines = 1 + static_cast<int>(std::ceil(2.0 * half_v / (0.4 * tool.diameter_mm)));
  const int places = 1 + static_cast<int>(std::ceil(2.0 * half_u));
  step.line_places = static_cast<std::size_t>(places);
  step.dwells = 2.0 * half_u < kFollows_s * step.plan.sweep_mm_per_s;
  const auto surface_height = [&](double u, double v) {
    const Vec3 from = site.entry_mm + u * site.across_u + v * site.across_v - 10.0 * site.axis;
    const double distance = distance_to_bone_mm(bone, from, site.axis, 20.0);
    return distance < 0.0 ? 0.0 : distance - 10.0;
  };
  bool forth = true;
  for (int pass = 1; pass <= passes; ++pass) {
    const double depth = step.plan.depth_mm * pass / passes;
    for (int line = 0; line < lines; ++line) {
      const double across = lines > 1 ? half_v * (2.0 * line / (lines - 1) - 1.0) : 0.0;
      const double v = pass % 2 ? across : -across;
      for (int place = 0; place < places; ++place) {
        const double along = places > 1 ? half_u * (2.0 * place / (places - 1) - 1.0) : 0.0;
        const double u = forth ? along : -along;
        const Vec3 centre =
            site.entry_mm + u * site.across_u + v * site.across_v + (surface_height(u, v) + depth - radius) * site.axis;
        const Vec3 tip = centre + tip_from_centre;
        if (!step.sweep_mm.empty()) step.sweep_length_mm += (tip - step.sweep_mm.back()).norm();
        step.sweep_mm.push_back(tip);
      }
      forth = !forth;
    }
  }
}

std::string sentence(const Tool& tool, std::string_view why) {
  return "tool \"" + tool.name + "\" " + std::string(why);
}

bool is_guide(ToolKind kind) {
  return kind == ToolKind::drill_sleeve || kind == ToolKind::distal_block || kind == ToolKind::four_in_one_block;
}

// Whether the tool fits this action.
Result<void> suits(const Tool& tool, Action action) {
  if (action == Action::place && !is_guide(tool.kind))
    return failure(ErrorCode::invalid_input,
                   sentence(tool, "is not a guide; choose a drill sleeve or a cutting block"));
  // Saws plunge: they go along their axis too.
  const bool plunges = feeds_along_axis(tool.kind) || feeding(tool.kind) == Feeding::in_plane;
  if (action == Action::drill && (!plunges || tool.kind == ToolKind::screw))
    return failure(ErrorCode::invalid_input,
                   sentence(tool, "cannot do this action; choose a drill, reamer, pin, broach or saw"));
  if (action == Action::screw && tool.kind != ToolKind::screw)
    return failure(ErrorCode::invalid_input, sentence(tool, "is not a screw; choose one"));
  const bool burr =
      tool.kind == ToolKind::round_burr || tool.kind == ToolKind::barrel_burr || tool.kind == ToolKind::contoured_burr;
  if (action == Action::burr && !burr)
    return failure(ErrorCode::invalid_input, sentence(tool, "cannot do this action; choose a burr"));
  return {};
}

// Places a guide with its face on the bone at a site, its z axis into the bone, x and y along the site's.
PlacedGuide stand(const Tool& guide, const EntrySite& site, std::uint32_t id) {
  Eigen::Matrix3d axes;
  axes << site.across_u, site.across_v, site.axis;
  return placed_guide(id, guide, {site.entry_mm, Eigen::Quaterniond(axes).normalized()});
}

// The first hole of the guide that accepts the tool.
const GuideBore* hole_for(const PlacedGuide& guide, const Tool& tool) {
  const std::size_t bores = guide.shape.bores.size(), holes = bores + guide.shape.pin_holes.size();
  for (std::size_t i = 0; i < holes; ++i)
    if (fits(guide.shape, i, tool)) return i < bores ? &guide.shape.bores[i] : &guide.shape.pin_holes[i - bores];
  return nullptr;
}

// Where a tool that goes through the guide meets the bone.
Result<EntrySite> find_site_through(const Case& bone, const std::vector<PlacedGuide>& guides, const Tool& tool,
                                    double& length_mm) {
  if (guides.empty()) return failure(ErrorCode::invalid_input, "\"guide\" needs a step before it that places a guide");
  const GuideBore* hole = hole_for(guides.back(), tool);
  if (!hole)
    return failure(ErrorCode::invalid_input,
                   sentence(tool, "does not go through the guide placed last; choose one that fits its hole"));
  length_mm = hole->length_mm;
  const Pose& pose = guides.back().pose_bone_guide;
  return find_site_at(bone, pose.point(hole->entry_mm + hole->length_mm * hole->direction),
                      pose.direction(hole->direction));
}

// Prepares one step with its site. `last`: the site of the step before, or null.
Result<ReadyStep> make_ready(const PlanStep& plan, const Case& bone, const ToolFinder& find, const EntrySite* last,
                             ReadyPlan& ready) {
  ReadyStep step;
  step.plan = plan;
  if (plan.action == Action::wait) return step;
  const Result<Tool> tool = find(plan.tool);
  if (!tool) return tl::unexpected(tool.error());
  if (const Result<void> suited = suits(*tool, plan.action); !suited) return tl::unexpected(suited.error());
  double guide_length_mm = 0.0;
  const Result<EntrySite> site = plan.through_guide ? find_site_through(bone, ready.guides, *tool, guide_length_mm)
                                                    : find_site(bone, plan.entry, last);
  if (!site) return tl::unexpected(site.error());
  step.site = *site;
  step.stand_off_mm = kStandOff_mm + guide_length_mm;
  if (plan.action == Action::place) {
    step.guide = static_cast<int>(ready.guides.size());
    ready.guides.push_back(stand(*tool, step.site, static_cast<std::uint32_t>(ready.guides.size() + 1)));
    step.item = *tool;
    return step;
  }
  step.spindle_rpm = plan.spindle_rpm > 0.0 ? plan.spindle_rpm : tool->spindle_rpm;
  step.tool = static_cast<int>(ready.tools.size());
  Result<ToolModel> model = ToolModel::make(*tool, bone.pitch_mm(), plan.wear, plan.law);
  if (!model) return tl::unexpected(model.error());
  ready.tools.push_back(std::move(*model));
  ready.tools.back().spindle.full_rpm = std::max(1.0, step.spindle_rpm);
  if (plan.action == Action::burr) {
    plan_sweep(bone, *tool, step);
    return step;
  }
  step.rotation = pose_along(Vec3::Zero(), step.site.axis).rotation;
  step.item = *tool;
  if (plan.action == Action::drill && plan.entry.target_mm && plan.to_mm == 0.0) {
    step.plan.to_mm = (*plan.entry.target_mm - step.site.entry_mm).dot(step.site.axis);
    if (!(step.plan.to_mm > 0.0))
      return failure(ErrorCode::invalid_input, "entry.target_mm lies before the bone; choose a point within it");
  }
  if (plan.action == Action::screw) {
    // A driver turns it and follows the thread, one pitch per turn, until the head is on the bone.
    step.plan.leave = true;
    step.plan.hand = HandKind::rig;
    step.plan.feed_mm_per_s = tool->thread_pitch_mm * step.spindle_rpm / 60.0;
    step.plan.to_mm = tool->cutting_length_mm;
  }
  if (step.plan.leave && tool->kind != ToolKind::pin && tool->kind != ToolKind::screw)
    return failure(ErrorCode::invalid_input, sentence(*tool, "cannot be left in the bone; choose a pin"));
  const double deepest_mm = step.plan.to_mm > 0.0        ? step.plan.to_mm
                            : plan.hand == HandKind::rig ? step.site.thickness_mm + plan.beyond_mm
                                                         : 0.0;
  if (deepest_mm + guide_length_mm > tool->reach_mm())
    return failure(ErrorCode::invalid_input,
                   plan.entry.target_mm && plan.to_mm == 0.0
                       ? "entry.target_mm is deeper than the tool is long; choose a nearer one"
                   : plan.to_mm > 0.0 ? "to_mm is deeper than the tool is long; choose a smaller one"
                                      : "the bone is thicker here than the drill is long; choose another entry");
  return step;
}

}  // namespace

Result<ReadyPlan> make_ready(const std::vector<PlanStep>& plan, const Case& bone, const ToolFinder& find) {
  ReadyPlan ready;
  const EntrySite* last = nullptr;
  ready.steps.reserve(plan.size());  // `last` points into it
  for (std::size_t i = 0; i < plan.size(); ++i) {
    Result<ReadyStep> step = make_ready(plan[i], bone, find, last, ready);
    if (!step) return failure(step.error().code, at_step(i) + step.error().message);
    ready.steps.push_back(std::move(*step));
    if (plan[i].action != Action::wait) last = &ready.steps.back().site;
  }
  return ready;
}

double ReadyStep::asked_mm() const {
  if (plan.to_mm > 0.0) return plan.to_mm;
  double deepest_mm = sweep_mm.empty() ? site.thickness_mm : 0.0;
  for (const Vec3& tip_mm : sweep_mm) deepest_mm = std::max(deepest_mm, depth_mm(*this, tip_mm));
  return deepest_mm;
}

Digest plan_digest(const ReadyPlan& plan) {
  Hasher hasher;
  for (const ReadyStep& step : plan.steps) {
    const PlanStep& p = step.plan;
    for (const auto word : {static_cast<int>(p.action), static_cast<int>(p.hand), int{p.through_guide}, int{p.leave}})
      hasher.integer(static_cast<std::uint64_t>(word));
    hasher.text(p.tool);
    hasher.text(p.law);
    const Digest tool = step.plan.action == Action::place ? step.item.hash()
                        : step.takes_tool()               ? plan.tools[static_cast<std::size_t>(step.tool)].tool.hash()
                                                          : Digest{};
    hasher.bytes(std::as_bytes(std::span(tool.bytes)));
    for (const double value : {step.spindle_rpm, p.push_n, p.hand_stiffness_n_per_mm, p.hand_damping_n_s_per_mm,
                               p.feed_mm_per_s, p.beyond_mm, p.to_mm, p.window_u_mm, p.window_v_mm, p.depth_mm,
                               p.sweep_mm_per_s, p.wear, p.tremor_mm, p.seconds})
      hasher.number(value);
    // Plans without these values keep their digest.
    if (p.hand_across_n_per_mm > 0.0) hasher.text("across"), hasher.number(p.hand_across_n_per_mm);
    if (p.irrigation) hasher.text("irrigation");
    if (p.suction) hasher.text("suction");
    for (const Vec3& v : {step.site.entry_mm, step.site.axis})
      for (const double value : v) hasher.number(value);
  }
  return hasher.finish();
}

const char* given_up_words(SurgeonPhase phase) {
  switch (phase) {
    case SurgeonPhase::take_up:
      return "the bone around the tool was not known in time; look at the server's log";
    case SurgeonPhase::spin_up:
      return "the spindle did not come up to its speed";
    case SurgeonPhase::seek:
      return "the tool did not meet the bone; check whether something is in its way";
    case SurgeonPhase::push:
      return "the bone did not give way; press harder (\"push_n\"), or take another tool or a sharper one";
    case SurgeonPhase::feed:
      return "the tool did not reach the wanted depth; feed it more slowly (\"feed_mm_per_s\"), or take a device that "
             "shows more force";
    case SurgeonPhase::sweep:
      return "the bur did not reach the wanted depth; take a sharper one, or hold it more stiffly "
             "(\"hand_stiffness_n_per_mm\")";
    case SurgeonPhase::retract:
      return "the tool did not come out of the bone";
    case SurgeonPhase::lift:
      return "the spindle did not stop";
    default:
      return "the hand did not get there in time";
  }
}

const char* given_up_words(const StepResult& result) {
  const SurgeonPhase phase = result.gave_up.value_or(SurgeonPhase::done);
  const bool cuts = phase == SurgeonPhase::push || phase == SurgeonPhase::feed || phase == SurgeonPhase::sweep;
  if (cuts && result.on_metal_s > 0.0) return "the tool stands on metal, which it does not cut; choose a way beside it";
  return given_up_words(phase);
}

const char* name(Action action) {
  constexpr const char* kNames[] = {"drill", "burr", "wait", "place", "screw", "free_hand"};
  return kNames[static_cast<int>(action)];
}

const char* name(SurgeonPhase phase) {
  constexpr const char* kNames[] = {"take_up", "approach", "spin_up", "seek", "push", "feed",     "react",
                                    "sweep",   "retract",  "lift",    "wait", "done", "free_hand"};
  return kNames[static_cast<int>(phase)];
}

void LayerMeans::add(double force, double feed, double density) noexcept {
  ++ticks;
  const double w = 1.0 / static_cast<double>(ticks);
  force_n += w * (force - force_n);
  feed_mm_per_s += w * (feed - feed_mm_per_s);
  density_g_cm3 += w * (density - density_g_cm3);
}

Surgeon::Surgeon(ReadyPlan plan) : plan_(std::move(plan)), results_(plan_.steps.size()) {
  left_.reserve(plan_.steps.size());
  if (!plan_.steps.empty() && !plan_.steps[0].takes_tool()) phase_ = SurgeonPhase::wait;
}

HandParams Surgeon::hand_for(const PlanStep& plan) {
  HandParams hand = plan.hand == HandKind::novice ? novice_hand() : expert_hand();
  hand.push_n = plan.push_n;
  if (plan.hand_stiffness_n_per_mm > 0.0) hand.stiffness_n_per_mm = plan.hand_stiffness_n_per_mm;
  if (plan.hand_damping_n_s_per_mm > 0.0) hand.damping_n_s_per_mm = plan.hand_damping_n_s_per_mm;
  if (plan.hand_across_n_per_mm > 0.0) hand.lateral_n_per_mm = plan.hand_across_n_per_mm;
  return hand;
}

WorkspaceMapping Surgeon::mapping_for(const ReadyStep& step, double workspace_radius_mm, double stiff_enough) {
  const EntrySite& site = step.site;
  // The view looks along the tool: the device's z comes out of the bone.
  Eigen::Matrix3d view;
  view.col(0) = site.across_u;
  view.col(2) = -site.axis;
  view.col(1) = view.col(2).cross(view.col(0));
  const double reach_mm = std::max(step.stand_off_mm, std::min(site.thickness_mm, 60.0) + 15.0);
  WorkspaceMapping mapping;
  const double scale = std::max(std::min(1.0, stiff_enough), reach_mm / workspace_radius_mm);
  mapping.align(Eigen::Quaterniond(view).normalized(), scale, Vec3::Zero(), site.entry_mm);
  return mapping;
}

void Surgeon::enter(SurgeonPhase phase) noexcept {
  phase_ = phase;
  in_phase_s_ = 0.0;
}

bool Surgeon::carry_to_depth(const ReadyStep& step, double to_mm, double speed_mm_per_s, double dt_s) noexcept {
  const double most = speed_mm_per_s * dt_s;
  target_depth_mm_ += std::clamp(to_mm - target_depth_mm_, -most, most);
  hand_.mode = step.plan.hand == HandKind::rig ? HandMode::rig : HandMode::carry;
  hand_.target_mm = step.site.entry_mm + target_depth_mm_ * step.site.axis;
  return std::abs(to_mm - target_depth_mm_) < 1e-9;
}

void Surgeon::observe(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept {
  StepResult& result = results_[step_];
  result.duration_s += dt_s;
  if (report.events & kOnMetal) result.on_metal_s += dt_s;
  const double force_n = std::max(0.0, -report.coupling.force_n.dot(step.site.axis));
  const double depth = depth_mm(step, report.pose_bone_proxy.position_mm);
  result.peak_force_n = std::max(result.peak_force_n, report.coupling.force_n.norm());
  result.deepest_mm = std::max(result.deepest_mm, depth);

  if (report.cutting.phase == CuttingPhase::cutting) {
    result.all.add(report.coupling.force_n.norm(), report.cutting.feed_mm_per_s, report.cutting.density_g_cm3);
    if (step.feeds() && report.cutting.engaged > 0.97 &&
        (phase_ == SurgeonPhase::push || phase_ == SurgeonPhase::feed)) {
      LayerMeans& layer = report.cutting.density_g_cm3 < kCorticalDensity ? result.medulla
                          : depth < 0.5 * step.site.thickness_mm          ? result.near_cortex
                                                                          : result.far_cortex;
      layer.add(force_n, report.cutting.feed_mm_per_s, report.cutting.density_g_cm3);
    }
  }
  if (!step.feeds()) return;
  // The cone has left the far surface where it was last engaged. From there on the tip only plunges.
  if (depth <= step.site.thickness_mm || phase_ == SurgeonPhase::retract) return;
  if (report.cutting.engaged > 0.0) {
    last_engaged_mm_ = depth;
  } else if (last_engaged_mm_ >= 0.0) {
    result.broke_through = true;
    result.plunge_mm = std::max(result.plunge_mm, depth - step.site.thickness_mm);
    result.after_exit_mm = std::max(result.after_exit_mm, depth - last_engaged_mm_);
  }
}

void Surgeon::drill(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept {
  const double force_n = -report.coupling.force_n.dot(step.site.axis);
  const double depth = depth_mm(step, report.pose_bone_proxy.position_mm);
  const bool rig = step.plan.hand == HandKind::rig;
  const double to_mm = step.plan.to_mm;
  switch (phase_) {
    case SurgeonPhase::seek:
      if (rig) {
        if (carry_to_depth(step, -0.3, kSeekSpeed_mm_per_s, dt_s)) enter(SurgeonPhase::feed);
      } else {
        carry_to_depth(step, step.site.thickness_mm + kBeyondGone_mm, kSeekSpeed_mm_per_s, dt_s);
        if (force_n > 0.3) enter(SurgeonPhase::push);
        // Nothing was met on the whole way: the hole exists already.
        else if (depth > (to_mm > 0.0 ? to_mm : step.site.thickness_mm))
          enter(SurgeonPhase::retract);
      }
      break;
    case SurgeonPhase::feed:
      // At its end the rig stays and presses on until the tool is at its depth or the time is over. On a device that
      // cannot show all the force, the tool may fall behind by any distance (slack).
      if (const bool at_end = carry_to_depth(step, feed_end_mm(step), step.plan.feed_mm_per_s, dt_s);
          to_mm > 0.0 ? depth >= to_mm : at_end)
        finish_feed(step, report);
      break;
    case SurgeonPhase::push:
      hand_.mode = HandMode::push;
      if (to_mm > 0.0 && depth >= to_mm) {
        target_depth_mm_ = depth;
        finish_feed(step, report);
        break;
      }
      // The lips are in the far cortex and the resistance is gone: the bone gives way.
      if (depth > step.site.thickness_mm && force_n < 0.5 * step.plan.push_n) {
        hand_.mode = HandMode::release;
        enter(SurgeonPhase::react);
      }
      break;
    case SurgeonPhase::react:
      if (in_phase_s_ > 0.6) {
        target_depth_mm_ = depth_mm(step, report.pose_bone_device.position_mm);
        enter(SurgeonPhase::retract);
      }
      break;
    default:
      break;
  }
}

void Surgeon::finish_feed(const ReadyStep& step, const LoopReport& report) noexcept {
  if (!step.plan.leave) {
    enter(SurgeonPhase::retract);
    return;
  }
  PlacedItem item{step_, report.pose_bone_proxy, 0.0};
  if (step.item.thread_pitch_mm > 0.0) {
    item.turns = depth_mm(step, report.pose_bone_proxy.position_mm) / step.item.thread_pitch_mm;
    item.pose_bone_item =
        item.pose_bone_item *
        Pose{Vec3::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(2.0 * std::numbers::pi * item.turns, Vec3::UnitZ()))};
  }
  left_.push_back(item);
  enter(SurgeonPhase::lift);
}

bool Surgeon::dwelt(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept {
  const double depth = depth_mm(step, report.pose_bone_proxy.position_mm);
  still_s_ += dt_s;
  if (depth > dwell_mm_ + kGrown_mm) {
    dwell_mm_ = depth;
    still_s_ = 0.0;
  }
  const bool last = knot_ == step.sweep_mm.size();
  return depth > depth_mm(step, hand_.target_mm) - kGrown_mm || still_s_ > (last ? kLastDwell_s : kFollows_s);
}

void Surgeon::burr(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept {
  if (phase_ == SurgeonPhase::seek) {
    hand_.target_mm = step.sweep_mm.front() - kNear_mm * step.site.axis;
    knot_ = 0;
    dwelling_ = false;
    enter(SurgeonPhase::sweep);
    return;
  }
  if (phase_ != SurgeonPhase::sweep) return;
  hand_.mode = step.plan.hand == HandKind::rig ? HandMode::rig : HandMode::carry;
  if (dwelling_) dwelling_ = !dwelt(step, report, dt_s);
  double left_mm = step.plan.sweep_mm_per_s * dt_s;
  while (!dwelling_ && left_mm > 0.0 && knot_ < step.sweep_mm.size()) {
    const Vec3 away = step.sweep_mm[knot_] - hand_.target_mm;
    const double distance = away.norm();
    if (distance <= left_mm) {
      hand_.target_mm = step.sweep_mm[knot_++];
      dwelling_ = knot_ == step.sweep_mm.size() || (step.dwells && knot_ % step.line_places == 0);
      dwell_mm_ = depth_mm(step, report.pose_bone_proxy.position_mm);
      still_s_ = 0.0;
    } else {
      hand_.target_mm += away * (left_mm / distance);
    }
    left_mm -= distance;
  }
  if (!dwelling_ && knot_ == step.sweep_mm.size()) {
    if (results_[step_].deepest_mm < kEnough * step.asked_mm()) results_[step_].gave_up = phase_;
    target_depth_mm_ = depth_mm(step, hand_.target_mm);
    enter(SurgeonPhase::retract);
  }
}

bool Surgeon::work(const ReadyStep& step, const LoopReport& report, double dt_s) noexcept {
  const bool drills = step.feeds();
  const double above_mm = drills ? -kNear_mm : depth_mm(step, step.sweep_mm.front()) - kNear_mm;
  const Vec3 beside = drills ? Vec3(Vec3::Zero()) : Vec3(step.sweep_mm.front() - step.site.entry_mm);
  switch (phase_) {
    case SurgeonPhase::approach:
      spindle_rpm_ = step.spindle_rpm;
      if (carry_to_depth(step, above_mm, kCarrySpeed_mm_per_s, dt_s)) enter(SurgeonPhase::spin_up);
      hand_.target_mm += beside - beside.dot(step.site.axis) * step.site.axis;
      break;
    case SurgeonPhase::spin_up:
      if (report.spindle_rpm > 0.97 * step.spindle_rpm && in_phase_s_ > 0.3) enter(SurgeonPhase::seek);
      break;
    case SurgeonPhase::retract: {
      const Vec3 lateral = hand_.target_mm - step.site.entry_mm -
                           (hand_.target_mm - step.site.entry_mm).dot(step.site.axis) * step.site.axis;
      if (carry_to_depth(step, -step.stand_off_mm, kCarrySpeed_mm_per_s, dt_s)) enter(SurgeonPhase::lift);
      hand_.target_mm += lateral;
      break;
    }
    case SurgeonPhase::lift:
      spindle_rpm_ = 0.0;
      return report.spindle_rpm < 1.0 && in_phase_s_ > 0.2;
    default:
      drills ? drill(step, report, dt_s) : burr(step, report, dt_s);
      break;
  }
  return false;
}

bool Surgeon::give_up(const ReadyStep& step, const LoopReport& report) noexcept {
  if (!results_[step_].gave_up) results_[step_].gave_up = phase_;
  if (phase_ == SurgeonPhase::lift) return true;
  if (phase_ == SurgeonPhase::retract) {
    enter(SurgeonPhase::lift);
    return false;
  }
  target_depth_mm_ = depth_mm(step, report.pose_bone_device.position_mm);
  enter(SurgeonPhase::retract);
  return false;
}

void Surgeon::tremble(const ReadyStep& step, SurgeonOrder& order) const noexcept {
  const EntrySite& site = step.site;
  const Stray place = stray(time_s_, 0.0), tilt = stray(time_s_, 1.3);
  order.hand.target_mm += step.plan.tremor_mm * (place.u * site.across_u + place.v * site.across_v);
  const Vec3 turn_rad = (step.plan.tremor_mm / kTremorArm_mm) * (tilt.u * site.across_u + tilt.v * site.across_v);
  const double angle_rad = turn_rad.norm();
  if (angle_rad > 0.0)
    order.rotation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, turn_rad / angle_rad)) * step.rotation).normalized();
}

SurgeonOrder Surgeon::act(const LoopReport& report, double dt_s) noexcept {
  SurgeonOrder order;
  if (done()) return order;
  const ReadyStep& step = plan_.steps[step_];
  in_phase_s_ += dt_s;
  order.step = step_;
  bool finished = false;

  time_s_ += dt_s;
  if (!step.takes_tool()) {
    phase_ = SurgeonPhase::wait;
    if (step.guide >= 0 && guides_placed_ <= static_cast<std::size_t>(step.guide)) {
      guides_placed_ = static_cast<std::size_t>(step.guide) + 1;
      left_.push_back({step_, plan_.guides[static_cast<std::size_t>(step.guide)].pose_bone_guide, 0.0});
    }
    results_[step_].duration_s = in_phase_s_;
    finished = in_phase_s_ >= step.plan.seconds;
  } else if (phase_ == SurgeonPhase::take_up) {
    if (in_phase_s_ <= 1.5 * dt_s) {
      // Above the first position of the tool, along the axis of the site.
      const Vec3 first = step.sweep_mm.empty() ? step.site.entry_mm : step.sweep_mm.front();
      hand_ = {HandMode::carry, first - step.stand_off_mm * step.site.axis, step.site.axis};
      target_depth_mm_ = depth_mm(step, hand_.target_mm);
      last_engaged_mm_ = -1.0;
      spindle_rpm_ = 0.0;
      order.take_up = true;
    } else if (!(report.events & kUncovered)) {
      enter(SurgeonPhase::approach);
    } else if (in_phase_s_ > most_s(step, phase_)) {
      results_[step_].gave_up = phase_;
      finished = true;
    }
  } else {
    observe(step, report, dt_s);
    finished = in_phase_s_ > most_s(step, phase_) ? give_up(step, report) : work(step, report, dt_s);
  }

  order.phase = phase_;
  order.hand = hand_;
  order.rotation = step.rotation;
  if (step.plan.tremor_mm > 0.0 && step.takes_tool()) tremble(step, order);
  order.spindle_rpm = spindle_rpm_;
  order.other_hand = other_hand(step.plan.irrigation, step.plan.suction);
  if (finished) {
    results_[step_].completed = !results_[step_].gave_up;
    ++step_;
    enter(SurgeonPhase::take_up);
  }
  return order;
}

}  // namespace osteon::haptic
