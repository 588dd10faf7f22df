#include "haptic_client/app/cut_log.hpp"

#include <optional>

namespace osteon::haptic {

void CutLog::confirm(std::uint64_t author_seq, RoomSeq room_seq, std::int64_t at_ns) {
  if (author_seq == 0 || author_seq > rows_.size()) return;
  RecordedCut& row = rows_[author_seq - 1];
  row.room_seq = room_seq.value;
  row.confirmed_mono_ns = at_ns;
}

std::uint64_t CutLog::confirm(const RoomAtJoin& room, std::int64_t at_ns) {
  std::uint64_t rejected = 0;
  for (const RecordedCut& row : rows_) {
    const std::optional<RoomSeq> room_seq = room.seq_of(row.author_seq);
    if (row.confirmed_mono_ns != 0 || !room_seq) continue;
    confirm(row.author_seq, *room_seq, at_ns);
    if (!*room_seq) ++rejected;
  }
  return rejected;
}

}  // namespace osteon::haptic
