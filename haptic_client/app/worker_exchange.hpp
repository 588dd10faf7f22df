// What the threads of the haptic client exchange. A comment names the thread that writes a member and the one that
// reads it. None of it locks or waits, so the haptic thread may use all of it.
// session: the threads of RoomSession. haptic, replica, telemetry: HapticWorker, ReplicaWorker, TelemetryWorker.
#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/runtime/spsc_queue.hpp"
#include "common/runtime/tick_stats.hpp"
#include "common/runtime/triple_buffer.hpp"
#include "haptic_client/app/client_messages.hpp"
#include "haptic_client/app/record.hpp"
#include "haptic_client/contact/guiding.hpp"
#include "haptic_client/contact/patch.hpp"
#include "haptic_client/prediction/confirmation_monitor.hpp"

namespace osteon::haptic {

// Wake-up times of the newest ticks, by the number of the tick.
class TickTimes {
 public:
  void set(std::uint64_t tick, std::int64_t woke_ns) noexcept {
    times_[tick % kTicks].store(woke_ns, std::memory_order_relaxed);
  }
  [[nodiscard]] std::int64_t of(std::uint64_t tick) const noexcept {
    return times_[tick % kTicks].load(std::memory_order_relaxed);
  }

 private:
  static constexpr std::size_t kTicks = 8192;
  std::array<std::atomic<std::int64_t>, kTicks> times_{};
};

struct WorkerExchange {
  // The bone and what stands on it.
  TripleBuffer<Patch> patches;                    // replica → haptic
  TripleBuffer<std::vector<PlacedGuide>> guides;  // replica → haptic; all items of the room's scene
  TripleBuffer<MountUpdate> mount_updates;        // session → haptic
  TripleBuffer<MountLoad> mount_loads;            // haptic → telemetry

  // The tool in hand.
  TripleBuffer<ToolPlace> tool_place;         // haptic → replica
  TickTimes tick_times;                       // haptic → replica
  SpscQueue<TickRow, 2048> rows;              // haptic → telemetry
  TripleBuffer<TickStats> tick_stats;         // haptic → telemetry, once a second
  std::atomic<std::size_t> items_left{0};     // haptic → telemetry; by the plan, on the bone
  std::atomic<bool> realtime_refused{false};  // haptic → telemetry

  // Other persons and their tools.
  TripleBuffer<Partners> partners;                // session → haptic
  TripleBuffer<PartnerSolids> partner_solids;     // replica → haptic
  TripleBuffer<HapticRestrictions> restrictions;  // session → haptic
  std::atomic<std::uint64_t> stop_flag{0};        // session → haptic; packed(StopFlag) of the newest datagram
  TripleBuffer<std::string> restricted_by;        // replica → telemetry; as far as the room says it, else empty

  // The state of the room.
  std::atomic<RoomHealth> room_health{RoomHealth::follows};  // replica → haptic, telemetry
  std::atomic<std::size_t> unconfirmed{0};                   // replica → telemetry; own cuts
  // telemetry → haptic; age of a partner's state on arrival. Assumes that both connections have equal delay.
  std::atomic<double> line_lag_s{0};
};

}  // namespace osteon::haptic
