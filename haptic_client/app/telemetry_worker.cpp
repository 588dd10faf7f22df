#include "haptic_client/app/telemetry_worker.hpp"

#include <algorithm>
#include <cstdio>
#include <thread>

#include "common/runtime/log.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;

constexpr auto kTelemetryPause = 4ms;  // pause between two rounds
constexpr auto kLagEvery = 200ms;      // between two looks at the connection's delay
constexpr auto kItemAgain = 2s;        // after an item was denied

}  // namespace

TelemetryWorker::TelemetryWorker(const ClientRoom& room, const Session& session, bool status, SessionLog& log,
                                 Recorder& recorder, WorkerExchange& exchange, ClientEnd& end)
    : room_(room),
      session_(session),
      status_(status),
      device_holds_n_(session.device().limits().continuous_n),
      log_(log),
      recorder_(recorder),
      exchange_(exchange),
      end_(end) {
  for (const ToolModel& model : session_.plan().tools) tool_names_.push_back(model.tool.name);
  if (tool_names_.empty()) tool_names_.emplace_back("none");
}

void TelemetryWorker::run() {
  auto next_status = Clock::now() + 1s;
  TickRow row;
  while (true) {
    const bool finishing = finishing_;  // read before the rows: those pushed up to here must still be taken
    const bool any = pass_rows(row);
    if (exchange_.realtime_refused.exchange(false))
      log::warn("the haptic loop has no real-time priority", {{"remedy", "see osteon-haptic check"}});
    send(any, row);
    if (Clock::now() >= lag_asked_ + kLagEvery) {
      lag_asked_ = Clock::now();
      exchange_.line_lag_s = 1e-3 * room_.port.fast_path().round_trip_ms;
    }
    set_items();
    if (finishing) break;
    if (status_ && any && Clock::now() >= next_status) {
      next_status += 1s;
      print_status(row);
    }
    std::this_thread::sleep_for(kTelemetryPause);
  }
}

TelemetryOutcome TelemetryWorker::outcome() const {
  TelemetryOutcome outcome = outcome_;
  outcome.outside_range = ranges_.uses();
  return outcome;
}

bool TelemetryWorker::pass_rows(TickRow& row) {
  bool any = false;
  while (exchange_.rows.try_pop(row)) {
    any = true;
    log_.write(row, tool_name(row));
    note_range(row);
    note_restrictions(row);
    recorder_.push(row);
  }
  return any;
}

void TelemetryWorker::send(bool any, const TickRow& row) {
  if (any && !end_.lost()) room_.port.send(state_of(row));
  if (exchange_.mount_loads.refresh() && !end_.lost()) room_.port.send(exchange_.mount_loads.value());
}

void TelemetryWorker::set_items() {
  for (; items_set_ < exchange_.items_left && !end_.lost() && Clock::now() >= items_from_; ++items_set_) {
    const PlacedItem& left = session_.left()[items_set_];
    SceneItem item;
    item.tool = session_.plan().steps[left.step].item.hash();
    item.pose_bone_item = left.pose_bone_item;
    item.turns = left.turns;
    const Result<std::uint32_t> set = room_.port.set_item(item);
    if (!set && set.error().code == ErrorCode::denied) {  // a stopped person places nothing until the stop is over
      log::warn("an item cannot be placed yet", {{"because", set.error().message}});
      items_from_ = Clock::now() + kItemAgain;
      return;
    }
    if (!set) end_.give_up(set.error());
  }
}

void TelemetryWorker::note_range(const TickRow& row) {
  if (row.report.cutting.out_of_range == 0 && !(row.report.events & kOnMetal)) return;
  const ToolModel& model = session_.plan().tools[static_cast<std::size_t>(row.report.tool)];
  const std::string outside = ranges_.note(model, row.report), metal = metal_.note(model, row.report);
  if (!outside.empty()) log::warn("force law outside its range", {{"tool", model.tool.name}, {"because", outside}});
  if (!metal.empty()) log::warn("metal", {{"because", metal}});
}

void TelemetryWorker::note_restrictions(const TickRow& row) {
  const LoopReport& r = row.report;
  const bool forbidden = (r.events & kForbidden) != 0, led = (r.events & kHandGuided) != 0;
  if (forbidden != was_forbidden_) outcome_.effects.push_back({row.mono_ns, 0, forbidden ? "may not cut" : "may cut"});
  if (led != was_led_) outcome_.effects.push_back({row.mono_ns, 0, led ? "is led" : "is no longer led"});
  was_forbidden_ = forbidden;
  was_led_ = led;
  outcome_.forbidden_ticks += forbidden;
  if (forbidden || led)
    outcome_.supervised_step_n = std::max(outcome_.supervised_step_n, row.force_rendered_n - force_before_n_);
  force_before_n_ = row.force_rendered_n;
  if (!led) return;
  outcome_.guide_mm = r.guidance.distance_mm;
  outcome_.guide_most_mm = std::max(outcome_.guide_most_mm, r.guidance.distance_mm);
}

CuttingState TelemetryWorker::state_of(const TickRow& row) const {
  const LoopReport& r = row.report;
  CuttingState state;
  state.author = room_.author;
  state.state_seq = r.state_seq;
  state.pose_bone_tool = r.pose_bone_proxy;
  state.pose_bone_device = r.pose_bone_device;
  if (!row.empty_hand) state.tool_name = tool_name(row);
  state.spindle_rpm = r.spindle_rpm;
  state.feed_mm_per_s = r.cutting.feed_mm_per_s;
  state.density_g_cm3 = r.cutting.density_g_cm3;
  state.engaged_fraction = r.cutting.engaged;
  state.force_physical_N = r.coupling.force_n;
  state.torque_Nmm = r.cutting.torque_nmm;
  state.depth_mm = row.depth_mm;
  state.phase = r.cutting.phase;
  state.on_metal = (r.events & kOnMetal) != 0;
  state.device_holds_N = device_holds_n_;
  state.force_hand_N = device_holds_n_ > 0.0 ? row.force_rendered_n : 0.0;
  state.flutes_full = r.cutting.flutes_full;
  state.time_ns = row.mono_ns;
  state.cortex_mm = row.cortex_mm;
  state.seated = r.cutting.seated;
  state.blows = r.cutting.blows;
  state.blow_impulse_N_s = r.cutting.blow_impulse_n_s;
  state.irrigation = (row.reading.buttons & kIrrigation) != 0;
  state.suction = (row.reading.buttons & kSuction) != 0;
  return state;
}

void TelemetryWorker::print_status(const TickRow& row) {
  const LoopReport& r = row.report;
  std::printf("%s %s: depth %.1f mm, force %.1f N, feed %.2f mm/s, %.0f rpm (%s)", tool_name(row).c_str(),
              name(row.phase), row.depth_mm, r.coupling.force_n.norm(), r.cutting.feed_mm_per_s, r.spindle_rpm,
              name(r.cutting.phase));
  if (r.cutting.out_of_range != 0)
    std::printf(", outside the range of its law: %s", out_of_range_words(r.cutting.out_of_range).c_str());
  const RoomHealth health = exchange_.room_health;
  if (r.events & kOnMetal) std::printf(", on metal, which it does not cut");
  exchange_.restricted_by.refresh();
  const std::string& by = exchange_.restricted_by.value();
  if (r.events & kForbidden) std::printf(", stopped by %s", by.empty() ? "an instructor" : by.c_str());
  if (r.events & kHandGuided) std::printf(", led, %.1f mm off", r.guidance.distance_mm);
  if (health != RoomHealth::follows)
    std::printf(", held: %s, %zu cuts unconfirmed", name(health), exchange_.unconfirmed.load());
  if (exchange_.tick_stats.refresh()) {
    const TickStats now = exchange_.tick_stats.value().since(last_ticks_);
    last_ticks_ = exchange_.tick_stats.value();
    std::printf(", loop %.0f us (99 of 100: %.0f), late %.0f us (%.0f), %llu missed", now.work.percentile_us(50),
                now.work.percentile_us(99), now.lateness.percentile_us(50), now.lateness.percentile_us(99),
                static_cast<unsigned long long>(now.missed));
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace osteon::haptic
