// The telemetry thread of the haptic client. It hands each tick's row to log and recorder, notes what restrictions do
// in the loop, sends cutting states and the loads on the mount to the room, places the plan's items in its scene, and
// prints a status line.
#pragma once
#include <atomic>
#include <chrono>
#include <cstddef>
#include <string>

#include "common/runtime/tick_stats.hpp"
#include "haptic_client/app/client_end.hpp"
#include "haptic_client/app/client_outcome.hpp"
#include "haptic_client/app/client_room.hpp"
#include "haptic_client/app/worker_exchange.hpp"

namespace osteon::haptic {

class TelemetryWorker {
 public:
  // `status`: print a line each second on standard output. All references must outlive this.
  TelemetryWorker(const ClientRoom& room, const Session& session, bool status, SessionLog& log, Recorder& recorder,
                  WorkerExchange& exchange, ClientEnd& end);

  // The thread's function. Returns after finish(), when all rows are handed on.
  void run();
  // The other workers are over: no more rows will come. Any thread.
  void finish() noexcept { finishing_ = true; }
  // After run(), any thread.
  [[nodiscard]] TelemetryOutcome outcome() const;

 private:
  using Clock = std::chrono::steady_clock;

  // Hands on all rows that wait. True if there was one; `row` is then the newest.
  bool pass_rows(TickRow& row);
  void note_range(const TickRow& row);
  // Notes the effects in the loop, tick by tick: the time of a stop is known to the millisecond.
  void note_restrictions(const TickRow& row);
  [[nodiscard]] CuttingState state_of(const TickRow& row) const;
  // Sends the newest state, and the load on the mount.
  void send(bool any, const TickRow& row);
  // Enters the items that the plan has left on the bone into the room's scene. Guides come back from there and guide
  // the tool.
  void set_items();
  void print_status(const TickRow& row);
  [[nodiscard]] const std::string& tool_name(const TickRow& row) const {
    return tool_names_[static_cast<std::size_t>(row.report.tool)];
  }

  const ClientRoom room_;
  const Session& session_;
  const bool status_;
  const double device_holds_n_;  // for long; 0: the device shows no force
  SessionLog& log_;
  Recorder& recorder_;
  WorkerExchange& exchange_;
  ClientEnd& end_;
  std::atomic<bool> finishing_{false};

  // [telemetry] The rest.
  std::vector<std::string> tool_names_;  // never changes
  RangeWatch ranges_;
  MetalWatch metal_;
  std::size_t items_set_ = 0;       // in the room's scene
  Clock::time_point items_from_{};  // earliest time of the next attempt
  Clock::time_point lag_asked_{};
  bool was_forbidden_ = false, was_led_ = false;
  double force_before_n_ = 0;
  TickStats last_ticks_;  // of the last status line
  TelemetryOutcome outcome_;
};

}  // namespace osteon::haptic
