// What a haptic client sends to its room. RoomSession implements it; tests do too.
#pragma once
#include <cstdint>

#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"

namespace osteon {

// State of the fast path.
struct FastPathHealth {
  bool offered = false, alive = false;
  double round_trip_ms = 0, loss = 0;  // loss: from client to server
  std::uint64_t packets_sent = 0, bytes_sent = 0, packets_received = 0, bytes_received = 0;
};

// Any thread except the haptic and audio ones: these functions may lock and allocate.
class RoomPort {
 public:
  virtual ~RoomPort() = default;
  // Sends cuts in the order of the calls. Returns false, and does not take the cut, when too many are undecided or the
  // session is lost.
  [[nodiscard]] virtual bool send(const Cut& cut) = 0;
  // Newest wins: a waiting state is replaced. Waiting cuts are sent first.
  virtual void send(const CuttingState& state) = 0;
  // Newest wins; has no effect in a room without a mount.
  virtual void send(const MountLoad& push) = 0;
  // Sets an item of the room's scene, id 0 for a new one, and returns its id. Waits for the answer. Errors:
  // invalid_input, denied (the hand is stopped, or its tool taken), unavailable.
  [[nodiscard]] virtual Result<std::uint32_t> set_item(const SceneItem& item) = 0;
  [[nodiscard]] virtual FastPathHealth fast_path() const = 0;
};

}  // namespace osteon
