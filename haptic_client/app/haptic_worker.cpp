#include "haptic_client/app/haptic_worker.hpp"

#include <span>

#include "common/runtime/log.hpp"
#include "common/runtime/periodic.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;

constexpr auto kTick = 1ms;
constexpr auto kSpin = 150us;  // before a tick of a real hand
constexpr int kPriority = 80;
constexpr auto kStall = 4ms;                // more than three periods: the force is zero by then
constexpr std::uint64_t kLiveTicks = 1000;  // between two statistics of the loop
constexpr int kRunDownTicks = 500;
constexpr std::uint64_t kProbeTicks = 8;  // between two looks for cortical bone: states go every 16

}  // namespace

HapticWorker::HapticWorker(Session& session, const Vec3& bone_centre_mm, WorkerExchange& exchange, const ClientEnd& end,
                           const StopSignal& stop)
    : session_(session),
      exchange_(exchange),
      end_(end),
      stop_(stop),
      mount_(mount_about(bone_centre_mm)),
      watchdog_(kStall, kPriority + 1, [this] { report_stall(); }) {
  session_.loop().feel_partners();
}

void HapticWorker::run() {
  outcome_.began_ns = mono_ns();
  outcome_.realtime = try_realtime(kPriority);
  exchange_.realtime_refused = !outcome_.realtime;
  // A simulated hand moves by whole periods, and nobody feels its force. So it does not occupy a core to be on time.
  PeriodicTimer timer(kTick, session_.simulated_time() ? std::chrono::nanoseconds{} : kSpin);
  while (!session_.done() && over_ticks_ < kRunDownTicks) {
    const int periods = timer.wait(outcome_.ticks);
    tick(periods, mono_ns(timer.woke()));
    timer.done(outcome_.ticks);
    watchdog_.beat();
    if (outcome_.ticks.work.count() % kLiveTicks == 0) exchange_.tick_stats.store(outcome_.ticks);
  }
  watchdog_.rest();
}

void HapticWorker::tick(int periods, std::int64_t woke_ns) {
  const bool over = end_.lost() || stop_.requested();
  if (over) ++over_ticks_;
  exchange_.patches.refresh();
  const bool follows = exchange_.room_health.load(std::memory_order_relaxed) == RoomHealth::follows;
  if (!follows) ++outcome_.held_for_room_ticks;
  exchange_.guides.refresh();
  supervise();
  const RoomLink room = over ? RoomLink::over : follows ? RoomLink::follows : RoomLink::held;
  move_bone();
  const int periods_of_hand = session_.simulated_time() ? 1 : periods;
  const SessionTick now = session_.tick(exchange_.patches.value(), room, periods_of_hand, &exchange_.guides.value());
  last_ = now.report;
  probe_cortex();
  exchange_.items_left.store(session_.left().size(), std::memory_order_release);

  exchange_.tick_times.set(now.report.state_seq, woke_ns);
  const bool idle = now.order.phase == SurgeonPhase::wait || now.order.phase == SurgeonPhase::done;
  taken_up_ |= !idle;
  exchange_.tool_place.writable() = {now.report.pose_bone_proxy, now.report.tool,
                                     static_cast<std::uint32_t>(now.order.step), taken_up_};
  exchange_.tool_place.publish();
  if (now.report.events & kUncovered && !idle && now.order.phase != SurgeonPhase::take_up) ++outcome_.uncovered_ticks;
  if (now.report.events & kCutsWaiting) ++outcome_.cuts_waiting_ticks;
  fill_row(now, idle, woke_ns);
  if (!exchange_.rows.try_push(row_)) ++outcome_.rows_dropped;
}

void HapticWorker::supervise() {
  HapticLoop& loop = session_.loop();
  if (exchange_.restrictions.refresh()) loop.supervise(exchange_.restrictions.value());
  loop.supervise(unpacked(exchange_.stop_flag.load(std::memory_order_relaxed)));
  exchange_.partners.refresh();
  const Partners& partners = exchange_.partners.value();
  loop.see_guide(guide_among(partners, loop.guard().now().guide));
  exchange_.partner_solids.refresh();
  const std::int64_t now_ns = mono_ns();
  const double line_s = exchange_.line_lag_s.load(std::memory_order_relaxed);
  std::size_t count = 0;
  for (const Partners::Partner& partner : partners.of)
    if (partner.author)
      felt_partners_[count++] = {partner.author.value, partner.pose_bone_tool,
                                 line_s + 1e-9 * static_cast<double>(now_ns - partner.received_ns),
                                 exchange_.partner_solids.value().find(partner.tool)};
  loop.see_partners(std::span(felt_partners_).first(count));
}

void HapticWorker::move_bone() {
  if (exchange_.mount_updates.refresh()) {
    const MountUpdate& update = exchange_.mount_updates.value();
    mount_.see(update.line, update.seen);
  }
  mount_.step(session_.loop(), last_);
  if (const std::optional<MountLoad> push = mount_.push()) exchange_.mount_loads.store(*push);
}

// After the force has gone to the device. It takes a few microseconds.
void HapticWorker::probe_cortex() {
  if (last_.state_seq % kProbeTicks != 0 || session_.plan().tools.empty()) return;
  const bool touching = last_.cutting.phase == CuttingPhase::cutting || last_.cutting.phase == CuttingPhase::rubbing;
  cortex_.step(session_.loop().tool(last_.tool), exchange_.patches.value(), last_.pose_bone_proxy, touching,
               -last_.coupling.force_n);
}

void HapticWorker::fill_row(const SessionTick& now, bool idle, std::int64_t woke_ns) {
  row_.mono_ns = woke_ns;
  row_.phase = now.order.phase;
  row_.step = static_cast<std::uint32_t>(now.order.step);
  row_.idle = idle;
  row_.report = now.report;
  if (!idle) site_ = &session_.plan().steps[now.order.step].site;
  if (site_) {
    row_.depth_mm = (now.report.pose_bone_proxy.position_mm - site_->entry_mm).dot(site_->axis);
    row_.device_depth_mm = (now.report.pose_bone_device.position_mm - site_->entry_mm).dot(site_->axis);
  }
  row_.cortex_mm = cortex_.thickness_mm();
  row_.force_rendered_n = now.report.device.force_n.norm();
  row_.reading = now.reading;
  row_.commanded_rpm = now.commanded_rpm;
  row_.empty_hand = now.empty_hand;
  row_.pointer_source = now.pointer_source;
  row_.rendered = {now.report.device.force_n, now.report.device.torque_nmm};
  row_.take_up = now.order.take_up;
  if (!row_.take_up) return;
  row_.taken_up_at = {now.order.hand.target_mm, now.order.rotation};
  row_.mapping = session_.loop().mapping();
}

HapticOutcome HapticWorker::outcome() const {
  HapticOutcome outcome = outcome_;
  outcome.stalls = watchdog_.stalls();
  outcome.longest_stall_ms = 1e-6 * static_cast<double>(watchdog_.longest().count());
  const MountFollower& shown = mount_.shown();
  outcome.mount = {mount_.there(),      mount_.most_mm(), mount_.most_rad(),  shown.put_in_mj(),
                   shown.released_mj(), shown.given_mj(), shown.granted_mj(), shown.low_pass_s()};
  return outcome;
}

void HapticWorker::report_stall() {
  const auto now = std::chrono::steady_clock::now();
  if (stall_reported_at_ && now - *stall_reported_at_ < 5s) return;
  stall_reported_at_ = now;
  log::warn("the haptic loop has stalled", {{"longer_than_ms", kStall.count()}, {"remedy", "see osteon-haptic check"}});
}

}  // namespace osteon::haptic
