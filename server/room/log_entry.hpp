// Log entries: what a room has decided, in one order. A journal stores only them, and a replay needs only them. Applied
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

// What a client may do in a room. Only a surgeon's cuts are accepted.
enum class MemberKind : std::uint8_t { surgeon, watcher };

struct JoinEntry {
  AuthorId author;  // assigned here, never again
  MemberKind kind = MemberKind::watcher;
  std::uint32_t person = 0;  // pseudonym; the person's name is stored elsewhere and can be erased; 0: unnamed
  Digest secret{};           // SHA-256 of the secret by which a later connection proves that it is the same author's
  Role role = Role::none;    // none: the room is older than roles, or the server itself joined
};
struct CutEntry {
  Cut cut;
  // The cut as the log and clients get it, if it was encoded already (wire::encoded). Null: whoever needs it encodes.
  std::shared_ptr<const std::string> encoded{};
};
// It has a sequence number, so that its author receives it in order and only once.
struct RejectionEntry {
  AuthorId author;
  std::uint64_t author_seq = 0;
  Digest bytes{};  // of the cut: cut_digest()
  Rejection reason = Rejection::none;
};
// One piece of a split, or debris.
struct SplitPiece {
  BodyId body;     // null for debris
  CoordBox reach;  // samples of level 0 that contain its bone
  Mask left;       // min(R, left) leaves only this piece of its parent
};
struct SplitEntry {
  BodyId parent;
  Mask taken;  // min(R, taken) removes the pieces from their parent
  std::vector<SplitPiece> pieces;
};
struct UndoEntry {
  // tombstones from now on, oldest first: the events that were asked for and those that depend on them
  std::vector<RoomSeq> seqs;
};
struct RedoEntry {
  std::vector<RoomSeq> undos;  // undo events that are undone themselves, newest first
  std::vector<RoomSeq> seqs;   // events that take effect again, oldest first
};
struct RemoveBodyEntry {
  BodyId body;
};
struct ItemEntry {
  std::uint32_t item = 0;
  std::optional<SceneItem> set;  // nothing: removed
};
struct ToolEntry {
  Tool tool;
};
// An event that a person wants to find again.
struct MarkEntry {
  std::string label;
};

// Restrictions of an author from now on. The author's lease ends when the author is stopped or freed, or when its tool
// is taken or given back.
struct SuperviseEntry {
  AuthorId subject;
  Restrictions supervision;
};
// The new state of an annotation.
struct AnnotationEntry {
  std::uint32_t id = 0;
  std::optional<Annotation> drawn;  // nothing: erased
};
struct WordsEntry {
  AuthorId to;  // null: to all
  std::string words;
};

struct LogEntry {
  RoomSeq seq;
  std::chrono::nanoseconds at{};  // time since the room was made, by the clock of the server that decided
  AuthorId author;                // who asked for it; null: the room itself
  std::variant<JoinEntry, CutEntry, RejectionEntry, SplitEntry, UndoEntry, RedoEntry, RemoveBodyEntry, ItemEntry,
               ToolEntry, MarkEntry, SuperviseEntry, AnnotationEntry, WordsEntry>
      what;
};

// Identifies a cut's bytes: every field, in the order of the protocol.
[[nodiscard]] Digest cut_digest(const Cut& cut);

}  // namespace osteon
