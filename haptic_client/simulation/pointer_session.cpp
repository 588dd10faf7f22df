#include "haptic_client/simulation/pointer_session.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace osteon::haptic {
namespace {

// The tip rests this far above the surface, so that a turning tool cuts nothing before the hand pushes.
constexpr double kRest_mm = 0.3;
// A tool that is closer to the bone goes out along its axis before it goes sideways.
constexpr double kClear_mm = 0.1;
constexpr double kHighest_mm = 60.0;  // the tip rests at most so high, as over a deep hole
constexpr double kAway_mm = 12.0;     // the tool's height above the bone while the pointer is elsewhere
// A pointer that goes farther than this at once has jumped. The hand then takes the tool off the bone and puts it down
// again at the new place. It never drags the tool through bone.
constexpr double kJump_mm = 6.0, kJump_rad = 0.8;
constexpr double kOverSpeed_mm_per_s = 250.0, kDownSpeed_mm_per_s = 120.0, kWithdraw_mm_per_s = 60.0;
constexpr double kAcross_mm_per_s = 120.0;  // of the hand while it pushes
constexpr double kTurn_rad_per_s = 3.0;
constexpr double kFine = 0.1;
constexpr double kReact_s = 0.6;  // as of the simulated surgeon
constexpr double kStuck_s = 3.0;

Vec3 limited(const Vec3& v, double most) {
  const double size = v.norm();
  return size > most ? Vec3(v * (most / size)) : v;
}

Eigen::Quaterniond turned_toward(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to, double most_rad) {
  const double angle = from.angularDistance(to);
  return angle > most_rad ? from.slerp(most_rad / angle, to).normalized() : to;
}

}  // namespace

Result<ReadyPlan> make_pointed_hand(const FreeHandOptions& first, const Case& bone, const std::vector<Tool>& tools) {
  const ToolFinder find = [&](std::string_view name) -> Result<Tool> {
    for (const Tool& tool : tools)
      if (tool.name == name) return tool;
    return find_tool(name);
  };
  Result<ReadyPlan> ready = make_free_hand(first, bone, find);
  if (!ready) return ready;
  for (const Tool& tool : tools) {
    if (tool.name == first.tool || !check_held(tool)) continue;
    Result<ToolModel> model = ToolModel::make(tool, bone.pitch_mm(), 1.0, "", ToolPoints::later);
    if (!model) return tl::unexpected(model.error());
    model->spindle.full_rpm = std::max(1.0, tool.spindle_rpm);
    ready->tools.push_back(std::move(*model));
  }
  return ready;
}

LoopParams pointer_loop(const DeviceLimits& limits, const ForceScaling& scaling, double dt_s) {
  LoopParams params = loop_params(limits, scaling);
  params.dt_s = dt_s;
  return params;
}

Pose pointer_start(const ReadyPlan& plan) {
  const ReadyStep& step = plan.steps[0];
  return {step.site.entry_mm - step.stand_off_mm * step.site.axis, pose_along(Vec3::Zero(), step.site.axis).rotation};
}

void WantedTool::want(int tool) {
  const MutexLock lock(mutex_);
  wanted_ = tool;
  changed_.notify_one();
}

std::optional<int> WantedTool::wait() {
  MutexLock lock(mutex_);
  while (open_ && !wanted_) changed_.wait(lock);
  return open_ ? std::exchange(wanted_, std::nullopt) : std::nullopt;
}

void WantedTool::open() {
  const MutexLock lock(mutex_);
  open_ = true;
}

void WantedTool::close() {
  const MutexLock lock(mutex_);
  open_ = false;
  changed_.notify_one();
}

PointerSession::PointerSession(ReadyPlan plan, PointerExchange& exchange, const SimulatedDeviceParams& device,
                               const ForceScaling& scaling, double dt_s)
    : plan_(std::move(plan)),
      exchange_(exchange),
      device_(device),
      loop_(pointer_loop(device.limits, scaling, dt_s), plan_.tools),
      worn_(plan_.tools.size()) {
  near_.make_room(kMostContactPoints);
  // Until the pointer first meets the bone, the tool waits above it, as a free hand's does. Others see it there.
  const Pose start = pointer_start(plan_);
  hand_.target_mm = start.position_mm;
  hand_.axis = plan_.steps[0].site.axis;
  rotation_ = start.rotation;
  WorkspaceMapping mapping;
  mapping.align(Eigen::Quaterniond::Identity(), 1.0, hand_.target_mm, hand_.target_mm);
  loop_.take_up(held_, {hand_.target_mm, rotation_}, mapping);
  exchange_.wanted.open();
  maker_ = std::thread([this] {
    while (const std::optional<int> tool = exchange_.wanted.wait()) loop_.prepare(*tool);
  });
}

PointerSession::~PointerSession() {
  exchange_.wanted.close();
  maker_.join();
}

void PointerSession::enter(PointerPhase phase) noexcept {
  phase_ = phase;
  react_s_ = 0.0;
}

void PointerSession::read_pointer() noexcept {
  const std::uint64_t before = command_.number;
  if (exchange_.commands.refresh()) command_ = exchange_.commands.value();
  ticks_since_message_ = command_.number != before ? 0 : std::min(ticks_since_message_ + 1, kSilentTicks + 1);
  command_.tool = std::clamp(command_.tool, 0, static_cast<int>(plan_.tools.size()) - 1);
  if (!command_.push) released_ = true;
  take_wear_and_law();
}

void PointerSession::take_wear_and_law() noexcept {
  const auto tool = static_cast<std::size_t>(command_.tool);
  // The window repeats its message, and that must not sharpen the tool.
  if (command_.wear > 0.0 && command_.wear != worn_[tool]) {
    loop_.set_wear(command_.tool, command_.wear);
    worn_[tool] = command_.wear;
  }
  loop_.set_law(command_.tool, command_.law ? *command_.law : *plan_.tools[tool].law);
}

Vec3 PointerSession::lifted(double height_mm) const noexcept { return command_.target_mm - height_mm * axis(); }

void PointerSession::take_up(SurgeonOrder& order) noexcept {
  // The tool comes from where the pointer wants it to point from, not from where it pointed before.
  rotation_ = command_.rotation;
  const Vec3 tip_mm = lifted(kAway_mm);
  // The pointer's frame is the bone's. Only the length of the hand's ways is scaled, as for other devices.
  const double stiff_enough =
      device_.limits().stiffness_n_per_mm / (loop_.params().force_scale * loop_.params().stiffness_n_per_mm);
  WorkspaceMapping mapping;
  mapping.align(Eigen::Quaterniond::Identity(), std::min(1.0, stiff_enough), tip_mm, tip_mm);
  const Pose pose{tip_mm, rotation_};
  held_ = command_.tool;
  height_mm_ = kAway_mm;
  loop_.take_up(held_, pose, mapping);
  const HandParams physical = expert_hand();
  const HandParams hand = scaled(physical, loop_.params().scale_of(physical.push_n), mapping.scale());
  across_n_per_mm_ = hand.lateral_n_per_mm;
  device_.take(hand, mapping.pose_device_tool(pose).position_mm);
  hand_ = {HandMode::carry, tip_mm, axis()};
  order.take_up = taken_up_ = true;
}

bool PointerSession::carry(const Vec3& to_mm, double speed_mm_per_s, double dt_s) noexcept {
  hand_.mode = HandMode::carry;
  const Vec3 way = to_mm - hand_.target_mm;
  hand_.target_mm += limited(way, speed_mm_per_s * dt_s);
  hand_.axis = axis();
  return way.norm() <= speed_mm_per_s * dt_s;
}

std::optional<double> PointerSession::clear_mm(const Patch& patch) noexcept {
  if (patch.version == 0) return std::nullopt;
  const ToolModel& model = loop_.tool(held_);
  ContactQuery query;
  query.pose_bone_tool = {hand_.target_mm, rotation_};
  query.groups = model.contact.groups();
  query.lift_mm = model.inset;
  evaluate_contact(patch, model.contact, query, near_);
  if (!near_.covered) return std::nullopt;
  return *std::min_element(near_.nearest_mm.begin(), near_.nearest_mm.begin() + query.groups);
}

bool PointerSession::come_to_rest(const Patch& patch, double speed_mm_per_s, double dt_s) noexcept {
  const std::optional<double> clear = clear_mm(patch);
  if (!clear) return false;
  // A distance changes by no more than the way, so a tool that goes down by what it has left does not touch. A tilted
  // tool gets there in some ticks.
  const double down_mm = std::clamp(*clear - kRest_mm, -kOverSpeed_mm_per_s * dt_s, kDownSpeed_mm_per_s * dt_s);
  if (*clear < kClear_mm) {
    height_mm_ = (command_.target_mm - hand_.target_mm).dot(axis());
    if (height_mm_ < kHighest_mm) carry(hand_.target_mm + down_mm * axis(), kOverSpeed_mm_per_s, dt_s);
    return false;
  }
  height_mm_ = std::clamp(height_mm_ - down_mm, kRest_mm, kHighest_mm);
  constexpr double kSettled_mm = 0.02;
  const bool there = carry(lifted(height_mm_), speed_mm_per_s, dt_s);
  return there && (height_mm_ == kRest_mm || down_mm < kSettled_mm);
}

void PointerSession::begin_push() noexcept {
  pushed_from_mm_ = pointed_mm_ = command_.target_mm;
  hand_ = {HandMode::push, command_.target_mm, axis()};
  met_ = released_ = false;
  deepest_mm_ = 0.0;
  enter(PointerPhase::pushes);
}

// Only the part of the pointer's motion across the axis moves the hand, and not faster than a hand can.
void PointerSession::follow_across() noexcept {
  const Vec3 moved = command_.target_mm - pointed_mm_;
  pointed_mm_ = command_.target_mm;
  const Vec3 across = moved - moved.dot(hand_.axis) * hand_.axis;
  pushed_from_mm_ += (command_.fine ? kFine : 1.0) * across;
  const Vec3 way = pushed_from_mm_ - hand_.target_mm;
  hand_.target_mm += limited(way - way.dot(hand_.axis) * hand_.axis, kAcross_mm_per_s * loop_.params().dt_s);
}

// The tool was in bone, is half out of it, goes on, and the resistance is gone. In marrow the tool is still in bone, so
// the hand pushes on through it. A tool that rebounds goes back.
bool PointerSession::gave_way() noexcept {
  const double resists_n = -last_.coupling.force_n.dot(hand_.axis);
  const double depth_mm = (last_.pose_bone_proxy.position_mm - pushed_from_mm_).dot(hand_.axis);
  const bool deeper = depth_mm > deepest_mm_;
  deepest_mm_ = std::max(deepest_mm_, depth_mm);
  constexpr double kIn = 0.8, kOut = 0.5;
  // Where no patch is, the loop knows no bone: nothing has given way there.
  if (last_.events & kUncovered) return false;
  if (last_.cutting.engaged > kIn && resists_n > 0.5 * command_.push_n) met_ = true;
  return met_ && deeper && last_.cutting.engaged < kOut && resists_n < 0.5 * command_.push_n;
}

void PointerSession::act(const Patch& patch, double dt_s, SurgeonOrder& order) noexcept {
  // Until a tool is made, the hand holds the one that it has, off the bone.
  const bool there = command_.on_bone && !silent() && loop_.ready(command_.tool);
  if (!taken_up_) {
    if (there) take_up(order), enter(PointerPhase::over);
    return;
  }
  const bool held = there && command_.push && released_;
  const Vec3 tip_mm = last_.pose_bone_proxy.position_mm;
  const bool other_tool = command_.tool != held_;
  switch (phase_) {
    case PointerPhase::away:
    case PointerPhase::over:
    case PointerPhase::rests: {
      if (!there) {
        height_mm_ = kAway_mm;
        carry(lifted(height_mm_), kOverSpeed_mm_per_s, dt_s);
        enter(PointerPhase::away);
        break;
      }
      const double jump_mm = (lifted(height_mm_) - hand_.target_mm).norm();
      if (other_tool || rotation_.angularDistance(command_.rotation) > kJump_rad ||
          (jump_mm > kJump_mm && phase_ == PointerPhase::rests) || jump_mm > 2.0 * kAway_mm) {
        take_up(order);
        enter(PointerPhase::over);
        break;
      }
      rotation_ = turned_toward(rotation_, command_.rotation, kTurn_rad_per_s * dt_s);
      const double speed = phase_ == PointerPhase::rests ? kOverSpeed_mm_per_s : kDownSpeed_mm_per_s;
      const bool down = come_to_rest(patch, speed, dt_s);
      enter(down || phase_ == PointerPhase::rests ? PointerPhase::rests : PointerPhase::over);
      if (held && phase_ == PointerPhase::rests) begin_push();
      break;
    }
    case PointerPhase::pushes:
      follow_across();
      if (!there || !command_.push) {
        enter(PointerPhase::withdraws);
      } else if (gave_way()) {
        hand_.mode = HandMode::release;
        enter(PointerPhase::reacts);
      }
      break;
    case PointerPhase::reacts:
      react_s_ += dt_s;
      if (react_s_ > kReact_s && (!there || !command_.push)) enter(PointerPhase::withdraws);
      break;
    case PointerPhase::withdraws: {
      if (hand_.mode != HandMode::carry) hand_.target_mm = last_.pose_bone_device.position_mm;
      const Vec3 from_axis = hand_.target_mm - pushed_from_mm_;
      const double depth_mm = from_axis.dot(hand_.axis);
      const Vec3 out_mm = hand_.target_mm - std::max(0.0, depth_mm + kRest_mm) * hand_.axis;
      const bool out = carry(out_mm, kWithdraw_mm_per_s, dt_s);
      react_s_ += dt_s;
      // A tool that is stuck is let go, and taken up again off the bone.
      if (react_s_ > kStuck_s) taken_up_ = false, enter(PointerPhase::away);
      if (out && (tip_mm - pushed_from_mm_).dot(hand_.axis) < -kClear_mm) {
        height_mm_ = kRest_mm;
        enter(PointerPhase::rests);
      }
      break;
    }
  }
}

SessionTick PointerSession::tick(const Patch& patch, RoomLink room, int periods,
                                 const std::vector<PlacedGuide>* room_guides) noexcept {
  const double dt_s = loop_.params().dt_s;
  SessionTick result;
  read_pointer();
  act(patch, dt_s, result.order);
  const bool works = phase_ >= PointerPhase::rests;
  // The speed that the pointer wants is of the tool that it wants.
  const double own_rpm = plan_.tools[static_cast<std::size_t>(held_)].tool.spindle_rpm;
  const double full_rpm = command_.tool == held_ && command_.spindle_rpm > 0.0 ? command_.spindle_rpm : own_rpm;
  const double rpm = works && !silent() ? command_.spindle * full_rpm : 0.0;
  const std::uint32_t other = silent() ? 0u : other_hand(command_.irrigation, command_.suction);
  if (taken_up_) {
    const WorkspaceMapping& mapping = loop_.mapping();
    HandCommand command = hand_;
    command.target_mm = mapping.pose_device_tool({hand_.target_mm, rotation_}).position_mm;
    device_.push_with(command_.push_n * loop_.params().scale_of(command_.push_n));
    // A hand that is stiffer across the axis than along it leaves the straight way, so a tilted tool would dip.
    const HandParams& hand = device_.hand().params();
    device_.hold_across(phase_ < PointerPhase::pushes ? hand.stiffness_n_per_mm : across_n_per_mm_);
    const std::uint32_t cuts = phase_ >= PointerPhase::pushes ? kHandCuts : 0u;
    device_.command(command, rotation_, (rpm > 0.0 ? kSpindlePedal : 0u) | other | cuts);
    device_.step(dt_s);
  }
  const DeviceReading reading = device_.read();
  LoopInput input;
  input.pose_device_tool = reading.pose_device_tool;
  input.clutch = !taken_up_;
  input.spindle_rpm = rpm;
  input.irrigation = (reading.buttons & kIrrigation) != 0;
  input.device_ok = taken_up_;
  input.room = room;
  input.periods = periods;
  // Only a hand that pushes, or draws the tool out, cuts. A tool that is moved fast over the bone may touch it.
  input.may_cut = phase_ >= PointerPhase::pushes;
  const std::span<const PlacedGuide> guides =
      room_guides ? std::span<const PlacedGuide>(*room_guides) : std::span<const PlacedGuide>();
  result.order.phase = taken_up_ ? SurgeonPhase::free_hand : SurgeonPhase::wait;
  result.order.hand = hand_;
  result.order.rotation = rotation_;
  result.reading = reading;
  result.commanded_rpm = result.order.spindle_rpm = rpm;
  result.empty_hand = command_.empty_hand;
  result.pointer_source = static_cast<std::uint8_t>(1 + static_cast<int>(command_.source));
  result.report = last_ = loop_.tick(input, patch, guides);
  device_.write({result.report.device.force_n, result.report.device.torque_nmm});

  StepResult& so_far = results_[0];
  so_far.duration_s += dt_s;
  so_far.completed = taken_up_;
  if (last_.events & kOnMetal) so_far.on_metal_s += dt_s;
  so_far.peak_force_n = std::max(so_far.peak_force_n, last_.coupling.force_n.norm());

  PointerState& state = exchange_.states.writable();
  state.pose_bone_tool = last_.pose_bone_proxy;
  state.force_hand_n = loop_.mapping().to_bone(last_.device.force_n);
  state.force_bone_n = last_.coupling.force_n;
  state.pushing = phase_ == PointerPhase::pushes;
  state.push_n = state.pushing ? command_.push_n : 0.0;
  state.depth_mm =
      phase_ >= PointerPhase::pushes ? (state.pose_bone_tool.position_mm - pushed_from_mm_).dot(hand_.axis) : 0.0;
  state.on_metal = (last_.events & kOnMetal) != 0;
  state.device_holds_n = device_.limits().continuous_n;
  // The device shows its peak for moments only. An instructor's lower limit is not the device's fault.
  state.saturated = last_.device.force_n.norm() > 0.999 * state.device_holds_n;
  state.tool = last_.tool;
  state.wear = last_.cutting.wear;
  state.law = last_.cutting.law;
  exchange_.states.publish();
  return result;
}

}  // namespace osteon::haptic
