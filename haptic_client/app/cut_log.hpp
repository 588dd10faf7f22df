// The room's decisions about a client's own cuts.
#pragma once
#include <cstdint>
#include <vector>

#include "common/core/id.hpp"
#include "haptic_client/app/record.hpp"
#include "haptic_client/net/room_messages.hpp"

namespace osteon::haptic {

// Not synchronised: one thread. Times are of the monotonic clock.
class CutLog {
 public:
  // Call in author_seq order, from 1 on.
  void closed(std::uint64_t author_seq, std::int64_t at_ns) { rows_.push_back({author_seq, 0, at_ns, 0}); }
  // `room_seq` null: the cut was rejected.
  void confirm(std::uint64_t author_seq, RoomSeq room_seq, std::int64_t at_ns);
  // After a reconnection: enters the cuts that the room decided during the interruption. Returns how many of them were
  // rejected. A room of an earlier version does not give a cut's sequence number. Then the cut stays as it is.
  std::uint64_t confirm(const RoomAtJoin& room, std::int64_t at_ns);
  [[nodiscard]] const std::vector<RecordedCut>& rows() const { return rows_; }

 private:
  std::vector<RecordedCut> rows_;
};

}  // namespace osteon::haptic
