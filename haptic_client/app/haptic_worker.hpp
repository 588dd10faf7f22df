// The 1 kHz thread of the haptic client. It runs the session's ticks under what the room and instructors permit, moves
// the bone on its mount, and hands a row of each tick to the telemetry thread.
#pragma once
#include <array>
#include <chrono>
#include <optional>

#include "common/runtime/stop_signal.hpp"
#include "common/runtime/watchdog.hpp"
#include "haptic_client/app/client_end.hpp"
#include "haptic_client/app/client_outcome.hpp"
#include "haptic_client/app/worker_exchange.hpp"
#include "haptic_client/contact/cortex_probe.hpp"
#include "haptic_client/rendering/felt_mount.hpp"

namespace osteon::haptic {

class HapticWorker {
 public:
  // `bone_centre_mm`: of the bone's bounds, which its mount turns about. All references must outlive this.
  HapticWorker(Session& session, const Vec3& bone_centre_mm, WorkerExchange& exchange, const ClientEnd& end,
               const StopSignal& stop);

  // The thread's function. [haptic] Returns when the session is done, or half a second after the client's end or a
  // stop, when spindle and force have run down. It never allocates, locks, logs or waits, except for its own sleep.
  void run();
  // After run(), any thread.
  [[nodiscard]] HapticOutcome outcome() const;

 private:
  void tick(int periods, std::int64_t woke_ns);
  // Applies an instructor's restrictions and guidance, and shows the loop others' tools.
  void supervise();
  // Moves the bone on its mount under the load of the last tick.
  void move_bone();
  void probe_cortex();
  void fill_row(const SessionTick& now, bool idle, std::int64_t woke_ns);
  // [watchdog] Reports at most every five seconds.
  void report_stall();

  Session& session_;
  WorkerExchange& exchange_;
  const ClientEnd& end_;
  const StopSignal& stop_;
  FeltMount mount_;
  TickRow row_;
  LoopReport last_;
  CortexProbe cortex_;
  std::array<PartnerTool, Partners::kMost> felt_partners_;
  const EntrySite* site_ = nullptr;
  bool taken_up_ = false;
  int over_ticks_ = 0;  // since the client's end or a stop
  HapticOutcome outcome_;
  std::optional<std::chrono::steady_clock::time_point> stall_reported_at_;  // watchdog
  Watchdog watchdog_;                                                       // last: its thread uses the other members
};

}  // namespace osteon::haptic
