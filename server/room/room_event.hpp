// What a room says of an event that it has decided.
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

// A decided cut: its place in the room's order and whether it was applied there.
struct Outcome {
  RoomSeq room_seq;
  Rejection rejection = Rejection::none;
  bool repeated = false;          // decided before: this is its first outcome
  std::uint64_t lease_epoch = 0;  // of its author from now on
  CutReport report;               // of an applied cut, of all bodies together
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

// A decided event that is not a cut, with what every holder of the bone must take over.
struct RoomEvent {
  RoomSeq room_seq;
  EventKind kind = EventKind::cut;
  AuthorId author;                // null: the room itself
  bool bone = false;              // bodies or leaves changed
  bool scene = false;             // items changed
  std::vector<BodyId> bodies;     // that exist from now on
  std::vector<FieldLeaf> leaves;  // changed ones as they are now, and all of a body that is new
  std::uint64_t lease_epoch =
      0;  // of every lease that was granted before, from now on; 0: as they were; supervise: of the subject's
  const ToolBox::Entry* tool = nullptr;  // one that was added
  std::uint32_t item = 0;                // one that was set or taken out
  std::optional<Placed> set;             // as it stands now, where it was set
  std::vector<RoomSeq> places;           // undo, redo: of the events taken back or done again, oldest first
  CutReport cut;                         // of all bodies together
  std::string mark;                      // its label
  std::variant<std::monostate, SuperviseEntry, AnnotationEntry, WordsEntry> people;  // what was decided, drawn or said
  std::vector<RoomEvent> further;  // decided with it, each at a place of its own after it
};

}  // namespace osteon
