#include "haptic_client/simulation/free_hand.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace osteon::haptic {
namespace {

constexpr double kHandStandOff_mm = 10.0;
constexpr double kMostDepth_mm = 60.0, kRoom_mm = 15.0;  // depth and room that the handle must reach without the clutch

// Limits for a device without force: those of one that is strong enough for the drilling of bone.
DeviceLimits shown(DeviceLimits limits) {
  if (limits.peak_n > 0.0) return limits;
  limits.peak_n = 60.0;
  limits.continuous_n = 30.0;
  limits.stiffness_n_per_mm = 60.0;
  return limits;
}

// The view along `toward` with the patient's head up, or the patient's front up when looking along the body. x right, y
// up, z to the user.
Eigen::Quaterniond view_along(const Vec3& toward) {
  Eigen::Matrix3d view;
  view.col(2) = -toward;
  const Vec3 up = std::abs(toward.z()) < 0.9 ? Vec3(Vec3::UnitZ()) : Vec3(-Vec3::UnitY());
  view.col(1) = (up - up.dot(toward) * toward).normalized();
  view.col(0) = view.col(1).cross(view.col(2));
  return Eigen::Quaterniond(view).normalized();
}

constexpr double kFarthest = 1e5;  // mm; no bone is so far away

bool read_numbers(std::string_view text, Vec3& v) {
  for (int i = 0; i < 3; ++i) {
    const std::size_t comma = text.find(',');
    if ((comma == std::string_view::npos) != (i == 2)) return false;
    const std::string_view one = text.substr(0, comma);
    const auto [end, wrong] = std::from_chars(one.data(), one.data() + one.size(), v[i]);
    if (wrong != std::errc{} || end != one.data() + one.size() || !(std::abs(v[i]) <= kFarthest)) return false;
    if (comma != std::string_view::npos) text.remove_prefix(comma + 1);
  }
  return true;
}

}  // namespace

Result<Vec3> read_view(std::string_view text) {
  // LPS: x to the patient's left, y to the back, z to the head.
  struct Named {
    std::string_view name;
    double x, y, z;
  };
  constexpr std::array<Named, 6> kViews{{{"front", 0, 1, 0},
                                         {"back", 0, -1, 0},
                                         {"left", -1, 0, 0},
                                         {"right", 1, 0, 0},
                                         {"top", 0, 0, -1},
                                         {"bottom", 0, 0, 1}}};
  for (const Named& view : kViews)
    if (view.name == text) return Vec3(view.x, view.y, view.z);
  Vec3 v;
  if (!read_numbers(text, v) || v.norm() < 1e-6)
    return failure(
        ErrorCode::invalid_input,
        "--view must be front, back, left, right, top, bottom, or a direction x,y,z, not \"" + std::string(text) + '"');
  return v.normalized().eval();
}

Result<Vec3> read_point(std::string_view text, std::string_view option) {
  Vec3 v;
  if (!read_numbers(text, v))
    return failure(ErrorCode::invalid_input,
                   std::string(option) + " must be a point x,y,z in millimetres, not \"" + std::string(text) + '"');
  return v;
}

Result<void> check_held(const Tool& tool) {
  if (tool.cuts()) return {};
  return failure(ErrorCode::invalid_input,
                 "the tool \"" + tool.name +
                     "\" takes no bone; take one that does (drill, bur, saw, reamer, broach, pin, "
                     "screw) and set guides and trial implants in the viewer or with a plan");
}

Result<ReadyPlan> make_free_hand(const FreeHandOptions& options, const Case& bone, const ToolFinder& find) {
  const Result<Tool> tool = find(options.tool);
  if (!tool) return tl::unexpected(tool.error());
  if (const Result<void> held = check_held(*tool); !held) return tl::unexpected(held.error());
  const Vec3 toward = options.toward.normalized();
  const Result<EntrySite> site =
      options.at_mm ? find_site_at(bone, *options.at_mm, toward) : find_site_facing(bone, -toward);
  if (!site) return tl::unexpected(site.error());
  ReadyPlan ready;
  ReadyStep step;
  step.plan.action = Action::free_hand;
  step.plan.tool = options.tool;
  step.plan.wear = options.wear;
  step.site = *site;
  step.site.axis = toward;
  step.spindle_rpm = options.spindle_rpm > 0.0 ? options.spindle_rpm : tool->spindle_rpm;
  step.stand_off_mm = kHandStandOff_mm;
  step.rotation = view_along(toward);
  step.item = *tool;
  Result<ToolModel> model = ToolModel::make(*tool, bone.pitch_mm(), options.wear, options.law);
  if (!model) return tl::unexpected(model.error());
  ready.tools.push_back(std::move(*model));
  ready.tools.back().spindle.full_rpm = std::max(1.0, step.spindle_rpm);
  ready.steps.push_back(std::move(step));
  return ready;
}

FreeHandSession::FreeHandSession(ReadyPlan plan, HapticDevice& device, const ForceScaling& scaling)
    : plan_(std::move(plan)),
      device_(device),
      limits_(shown(device.limits())),
      loop_(loop_params(limits_, scaling), plan_.tools) {}

void FreeHandSession::take_up(const DeviceReading& reading, SurgeonOrder& order) noexcept {
  const ReadyStep& step = plan_.steps[0];
  const LoopParams& params = loop_.params();
  const Vec3 start_mm = step.site.entry_mm - step.stand_off_mm * step.site.axis;
  // Bone mm for each mm of the handle. It is one where the device can show the coupling's whole stiffness and reaches
  // far enough.
  const double stiff_enough = limits_.stiffness_n_per_mm / (params.force_scale * params.stiffness_n_per_mm);
  const double reach_mm = std::max(step.stand_off_mm, std::min(step.site.thickness_mm, kMostDepth_mm) + kRoom_mm);
  WorkspaceMapping mapping;
  mapping.align(step.rotation,
                std::max(std::min(1.0, stiff_enough), reach_mm / std::max(1.0, limits_.workspace_radius_mm)),
                reading.pose_device_tool.position_mm, start_mm);
  const Pose pose_bone_tool{start_mm, mapping.pose_bone_tool(reading.pose_device_tool).rotation};
  loop_.take_up(0, pose_bone_tool, mapping);
  order.take_up = taken_up_ = true;
  order.hand.target_mm = start_mm;
  order.rotation = pose_bone_tool.rotation;
}

SessionTick FreeHandSession::tick(const Patch& patch, RoomLink room, int periods,
                                  const std::vector<PlacedGuide>* room_guides) noexcept {
  SessionTick result;
  const DeviceReading reading = device_.read();
  if (const Pose* bone = device_.pose_rest_bone()) loop_.see_bone(*bone);
  const bool usable = reading.usable();
  // Before the device is calibrated the tool has no known position.
  if (!taken_up_ && usable) take_up(reading, result.order);
  result.order.phase = taken_up_ ? SurgeonPhase::free_hand : SurgeonPhase::wait;
  LoopInput input;
  input.pose_device_tool = reading.pose_device_tool;
  input.clutch = !usable || (reading.buttons & kClutchButton) != 0;
  input.spindle_rpm = usable && taken_up_ ? reading.spindle() * plan_.steps[0].spindle_rpm : 0.0;
  input.irrigation = usable && (reading.buttons & kIrrigation) != 0;
  input.device_ok = usable;
  input.device_warm = reading.status == DeviceStatus::warm;
  input.room = room;
  input.periods = periods;
  const std::span<const PlacedGuide> guides = room_guides ? std::span(*room_guides) : std::span<const PlacedGuide>();
  result.reading = reading;
  result.commanded_rpm = result.order.spindle_rpm = input.spindle_rpm;
  result.report = loop_.tick(input, patch, guides);
  device_.write({result.report.device.force_n, result.report.device.torque_nmm});
  results_[0].duration_s += loop_.params().dt_s;
  results_[0].completed = taken_up_;
  if (result.report.events & kOnMetal) results_[0].on_metal_s += loop_.params().dt_s;
  results_[0].peak_force_n = std::max(results_[0].peak_force_n, result.report.coupling.force_n.norm());
  return result;
}

}  // namespace osteon::haptic
