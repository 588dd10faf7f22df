// Rows: what a room has decided, in one order. They are all that a journal keeps and all that a replay needs: applied
// to a room as it began, they make the same room again, without judging anything a second time.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/digest.hpp"
#include "common/field/cut.hpp"
#include "common/field/rejection.hpp"
#include "common/field/restrictions.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/scene_item.hpp"
#include "common/volume/cut_history.hpp"

namespace osteon {

// What a client may do in a room: only a surgeon's cuts are taken.
enum class MemberKind : std::uint8_t { surgeon, watcher };

struct JoinEntry {
  AuthorId author;  // given here, never again
  MemberKind kind = MemberKind::watcher;
  std::uint32_t person = 0;  // a pseudonym: who it is, is written elsewhere and can be forgotten; 0: unnamed
  Digest secret{};           // SHA-256 of what proves that a later connection is the same author's
  Role role = Role::none;    // none: in a room from before there were roles, or of the server itself
};
struct CutEntry {
  Cut cut;
};
// It has a place in the order, so that its author hears of it in order and never twice.
struct RejectionEntry {
  AuthorId author;
  std::uint64_t author_seq = 0;
  Digest bytes{};  // of the cut: cut_digest()
  Rejection reason = Rejection::none;
};
// One piece of a split, or debris.
struct SplitPiece {
  BodyId body;     // of debris null
  CoordBox reach;  // samples of level 0 that its bone is in
  Mask left;       // min(R, left) leaves the piece of its parent
};
struct SplitEntry {
  BodyId parent;
  Mask taken;  // min(R, taken) takes the pieces from their parent
  std::vector<SplitPiece> pieces;
};
struct UndoEntry {
  std::vector<RoomSeq> places;  // tombstones from now on, oldest first: what was asked for and what fell with it
};
struct RedoEntry {
  std::vector<RoomSeq> undos;   // that are undone themselves, newest first
  std::vector<RoomSeq> places;  // what comes again, oldest first
};
struct RemoveBodyEntry {
  BodyId body;
};
struct ItemEntry {
  std::uint32_t item = 0;
  std::optional<SceneItem> set;  // nothing: taken out
};
struct ToolEntry {
  Tool tool;
};
// A place in the order that a person wants to find again.
struct MarkEntry {
  std::string label;
};

// What holds for a hand from now on. Who stops a hand or frees it, takes its tool or gives it back, ends its lease.
struct SuperviseEntry {
  AuthorId subject;
  Restrictions supervision;
};
// An annotation as it is from now on.
struct AnnotationEntry {
  std::uint32_t id = 0;
  std::optional<Annotation> drawn;  // nothing: wiped off
};
struct WordsEntry {
  AuthorId to;  // null: to all
  std::string words;
};

struct LogEntry {
  RoomSeq place;
  std::chrono::nanoseconds at{};  // since the room was made, by the clock of the server that decided
  AuthorId author;                // who asked for it; null: the room itself
  std::variant<JoinEntry, CutEntry, RejectionEntry, SplitEntry, UndoEntry, RedoEntry, RemoveBodyEntry, ItemEntry, ToolEntry, MarkEntry,
               SuperviseEntry, AnnotationEntry, WordsEntry>
      what;
};

// Names a cut's bytes: every field, in the order of the protocol.
[[nodiscard]] Digest cut_digest(const Cut& cut);

}  // namespace osteon
