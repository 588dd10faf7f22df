// Rows: what a room has decided, in one order. They are all that a journal keeps and all that a replay needs: applied to a
// room as it began, they make the same room again, without judging anything a second time.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/core/digest.hpp"
#include "common/field/cut.hpp"
#include "common/tools/scene_item.hpp"
#include "common/volume/cut_history.hpp"

namespace osteon {

// What a client may do in a room: only a surgeon's cuts are taken.
enum class MemberKind : std::uint8_t { surgeon, watcher };

// Why a cut was not taken. Kept in journals: numbers stay.
enum class Rejection : std::uint8_t {
  none = 0,
  body = 1,       // no such body
  lease = 2,      // made under a lease that is over
  tool = 3,       // not a registered tool, or one that does not cut
  level = 4,      // finer than the tool or the case allows
  path = 5,       // no knots or too many
  rotation = 6,   // a quaternion far from unit
  place = 7,      // too far from the bone
  sweep = 8,      // too long a way for one cut
  spindle = 9,    // faster than any spindle
  time = 10,      // more tool time than has passed since the lease was granted
  rate = 11,      // more volume swept than a room can evaluate
  power = 12,     // more bone than any motor can take in that time
};
inline constexpr int kRejections = 13;
[[nodiscard]] std::string_view sentence(Rejection reason);

struct JoinRow {
  AuthorId author;         // given here, never again
  MemberKind kind = MemberKind::watcher;
  std::uint32_t person = 0;  // a pseudonym: who it is, is written elsewhere and can be forgotten; 0: unnamed
  Digest secret{};         // SHA-256 of what proves that a later connection is the same author's
};
struct CutRow {
  Cut cut;
};
// It has a place in the order, so that its author hears of it in order and never twice.
struct RejectionRow {
  AuthorId author;
  std::uint64_t author_seq = 0;
  Digest bytes{};          // of the cut: cut_digest()
  Rejection reason = Rejection::none;
};
// One piece of a split, or debris.
struct SplitPiece {
  BodyId body;             // of debris null
  CoordBox reach;          // samples of level 0 that its bone is in
  Mask left;               // min(R, left) leaves the piece of its parent
};
struct SplitRow {
  BodyId parent;
  Mask taken;              // min(R, taken) takes the pieces from their parent
  std::vector<SplitPiece> pieces;
};
struct UndoRow {
  std::vector<RoomSeq> places;  // tombstones from now on, oldest first: what was asked for and what fell with it
};
struct RedoRow {
  std::vector<RoomSeq> undos;   // that are undone themselves, newest first
  std::vector<RoomSeq> places;  // what comes again, oldest first
};
struct RemoveBodyRow {
  BodyId body;
};
struct ItemRow {
  std::uint32_t item = 0;
  std::optional<SceneItem> set;  // nothing: taken out
};
struct ToolRow {
  Tool tool;
};
// A place in the order that a person wants to find again.
struct MarkRow {
  std::string label;
};

struct RoomRow {
  RoomSeq place;
  std::chrono::nanoseconds at{};  // since the room was made, by the clock of the server that decided
  AuthorId author;                // who asked for it; null: the room itself
  std::variant<JoinRow, CutRow, RejectionRow, SplitRow, UndoRow, RedoRow, RemoveBodyRow, ItemRow, ToolRow, MarkRow> what;
};

// Names a cut's bytes: every field, in the order of the protocol.
[[nodiscard]] Digest cut_digest(const Cut& cut);

}  // namespace osteon
