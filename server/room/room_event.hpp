// What a room reports of an event that it has decided.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/field/cut.hpp"
#include "common/field/rejection.hpp"
#include "common/tools/placing.hpp"
#include "common/tools/tool_box.hpp"
#include "common/volume/cut_field.hpp"
#include "server/room/log_entry.hpp"

namespace osteon {

// A decided cut: its sequence number in the room, and whether it was applied.
struct Outcome {
  RoomSeq room_seq;
  Rejection rejection = Rejection::none;
  bool repeated = false;          // decided before; this is the first outcome
  std::uint64_t lease_epoch = 0;  // of its author, from now on
  CutReport report;               // of an applied cut, over all bodies
  [[nodiscard]] bool committed() const { return rejection == Rejection::none; }
};

enum class EventKind : std::uint8_t {
  cut,
  split,
  undo,
  redo,
  remove_body,
  scene,
  tool,
  join,
  mark,
  supervise,
  annotation,
  words
};

// A decided event that is not a cut, with everything that the holder of a replica must apply.
struct RoomEvent {
  RoomSeq room_seq;
  EventKind kind = EventKind::cut;
  AuthorId author;                // null: the room itself
  bool bone = false;              // bodies, or leaves (blocks of the field), changed
  bool scene = false;             // items changed
  std::vector<BodyId> bodies;     // those that exist from now on
  std::vector<FieldLeaf> leaves;  // changed leaves in their new state, and all leaves of a new body
  // New epoch of every lease that was granted before; 0: unchanged. For supervise: epoch of the subject's lease.
  std::uint64_t lease_epoch = 0;
  const ToolBox::Entry* tool = nullptr;  // the tool that was added
  std::uint32_t item = 0;                // the item that was set or removed
  std::optional<Placed> set;             // its new state, if it was set
  std::vector<RoomSeq> seqs;  // undo, redo: sequence numbers of the events taken back or done again, oldest first
  CutReport cut;              // over all bodies
  std::string mark;           // its label
  std::variant<std::monostate, SuperviseEntry, AnnotationEntry, WordsEntry> people;  // what was decided, drawn or said
  std::vector<RoomEvent> further;  // follow-ups decided with it, each with a sequence number of its own after it
};

}  // namespace osteon
