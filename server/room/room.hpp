// The room: owns the bone and the scene, puts cuts and all other events in one order, judges them, applies them. A
// function of what it was given: no clock, thread, log, file or network, so a test runs it on virtual time.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/surface/surface_blocks.hpp"
#include "common/tools/placing.hpp"
#include "common/tools/scene.hpp"
#include "common/tools/tool_box.hpp"
#include "common/volume/cut_field.hpp"
#include "common/volume/cut_history.hpp"
#include "common/volume/field_file.hpp"
#include "common/volume/fragments.hpp"
#include "server/room/block_store.hpp"

namespace osteon {

// What a client may do here: only a surgeon's cuts are taken.
enum class MemberKind : std::uint8_t { surgeon, watcher };

// Bounds on a cut, checked before any of it is evaluated.
struct CutLimits {
  int path_knots = 64;
  double beyond_bone_mm = 60.0;     // how far outside the bone's box a tool's tip may be
  double swept_mm = 25.0;           // way of the cutting part in one cut, its turning included
  std::uint32_t spindle_rpm = 120000;
};

enum class Rejection : std::uint8_t {
  none,
  body,       // no such body
  lease,      // made under a lease that is over
  tool,       // not a registered tool, or one that does not cut
  level,      // finer than the tool or the case allows
  path,       // no knots or too many
  rotation,   // a quaternion far from unit
  place,      // too far from the bone
  sweep,      // too long a way for one cut
  spindle,    // faster than any spindle
};
[[nodiscard]] std::string_view sentence(Rejection reason);

// A decided cut: its place in the room's order and whether it was applied there.
struct Outcome {
  RoomSeq room_seq;
  Rejection rejection = Rejection::none;
  bool repeated = false;   // decided before: this is its first outcome
  CutReport report;        // of an applied cut, of all bodies together
  [[nodiscard]] bool committed() const { return rejection == Rejection::none; }
};

enum class EventKind : std::uint8_t { cut, split, undo, redo, remove_body, scene, tool };

// A decided event that is not a cut, with what every holder of the bone must take over.
struct RoomEvent {
  RoomSeq room_seq;
  EventKind kind = EventKind::cut;
  AuthorId author;                        // null: the room itself
  bool bone = false;                      // bodies or leaves changed
  bool scene = false;                     // items changed
  std::vector<BodyId> bodies;             // that exist from now on
  std::vector<FieldLeaf> leaves;          // changed ones as they are now, and all of a body that is new
  std::uint64_t lease_epoch = 0;          // from now on
  const ToolBox::Entry* tool = nullptr;   // one that was added
  std::uint32_t item = 0;                 // one that was set or taken out
  std::optional<Placed> set;              // as it stands now, where it was set
  std::vector<RoomSeq> places;            // undo, redo: of the events taken back or done again, oldest first
};

// What has come apart from a body. `fields`: for each piece that is no debris, in order, the field that it will have, made
// beforehand because that takes long: from a copy of the parent in which nothing is missing but what take_changes() has
// yet to tell. Each of the body that the piece will be, next_body() and on; without it the room makes the field itself.
struct Separation {
  BodyId parent;
  std::vector<Fragment> fragments;
  std::uint64_t seen = 0;        // lease_epoch() when it was looked for
  std::vector<CutField> fields = {};
};

// Leaves of one body that changed, for whoever looks for pieces.
struct BodyLeaves {
  BodyId body;
  int level = 0;
  std::vector<Coord> origins;
};

struct RoomCounts {
  std::uint64_t committed = 0;
  std::uint64_t rejected = 0;
  std::uint64_t repeated = 0;
  std::uint64_t refused = 0;  // breaches that got no place in the order
};

inline constexpr std::size_t kMostItems = 256, kMostTools = 1024, kMostBodies = 64;

// Every body holds every cut, those that were taken away too: all bodies share the case's lattice and frame, a piece has
// all but itself taken away, and a cut is applied to each of them, so the server, every replica and the undo of a split need
// no notion of which body a tool meets. Not synchronised: one thread calls the changing functions, or several the const ones.
class Room {
 public:
  explicit Room(Case bone, CutLimits limits = {}, std::shared_ptr<ToolBox> tools = builtin_tool_box());
  // Goes on from what was saved; that cannot be undone. Errors: unsupported (of another case or kernel), exists (one of
  // its tools has the name of another that is in the box), invalid_input (a file that contradicts itself).
  static Result<Room> resume(Case bone, const SavedFields& saved, CutLimits limits = {},
                             std::shared_ptr<ToolBox> tools = builtin_tool_box());

  // A new identity, never given twice.
  AuthorId join(MemberKind kind);
  [[nodiscard]] bool knows(AuthorId author) const;
  [[nodiscard]] bool may_cut(AuthorId author) const { return surgeons_.contains(author); }
  // Rises with every undo and redo: what was cut on the sight of bone that has come back is void.
  [[nodiscard]] std::uint64_t lease_epoch() const { return lease_epoch_; }

  // Gives the cut its place and applies it to every body. Error invalid_input, without a place in the order: an author
  // that may not cut, a gap in author_seq, or a number that was decided with other bytes.
  Result<Outcome> submit(const Cut& cut);

  // The other events. Errors, without a place in the order: invalid_input (an author who has not joined, an unknown
  // body, item, tool or place), unavailable (nothing to undo or redo, or the bone has changed meanwhile).
  Result<RoomEvent> add_tool(AuthorId by, const Tool& tool);  // place 0 when it is known already
  // Takes back these events, or the newest `count` of one author or (null) of all. With a cut falls every later split of
  // a body that it had reached, and what was done to the piece as such; cuts made since stay in the bone.
  Result<RoomEvent> undo(AuthorId by, std::span<const RoomSeq> places);
  Result<RoomEvent> undo_last(AuthorId by, std::size_t count, AuthorId of);
  Result<RoomEvent> redo_last(AuthorId by, std::size_t count);  // the newest undo events that still stand
  Result<RoomEvent> remove_body(AuthorId by, BodyId body);
  // By the rules of common/tools/scene.hpp, which also say whether it is seated. id 0: a new one.
  Result<RoomEvent> set_item(AuthorId by, SceneItem item, const Placing& placing = {});
  Result<RoomEvent> remove_item(AuthorId by, std::uint32_t item);  // not a guide that pins fix
  // What a FragmentFinder has found in `parent`; `seen`: the lease_epoch() when it looked.
  Result<RoomEvent> split(BodyId parent, std::vector<Fragment> fragments, std::uint64_t seen) {
    return split({parent, std::move(fragments), seen});
  }
  Result<RoomEvent> split(Separation found);
  [[nodiscard]] BodyId next_body() const { return BodyId{last_body_ + 1}; }

  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] const RoomCounts& counts() const { return counts_; }
  // Never changes, so that any thread may ask beside the one that changes the room.
  [[nodiscard]] const Case& bone() const { return bone_; }
  [[nodiscard]] const std::shared_ptr<ToolBox>& tools() const { return tools_; }
  [[nodiscard]] std::vector<BodyId> bodies() const;  // that exist, in order
  [[nodiscard]] const CutField* find_field(BodyId body) const;  // null: no such body
  [[nodiscard]] const CutField& field() const { return bodies_.at(BodyId{0}).field; }  // of the case's bone
  [[nodiscard]] Digest field_hash() const;           // of all bodies
  [[nodiscard]] std::vector<SceneItem> items() const;
  // Events so far that changed the bone otherwise than by cutting.
  [[nodiscard]] std::uint64_t bone_changes() const { return bone_changes_; }
  // Leaves that changed since the last call.
  [[nodiscard]] std::vector<BodyLeaves> take_changes() { return std::exchange(changes_, {}); }
  [[nodiscard]] bool has_changes() const { return !changes_.empty(); }

  // Blocks whose payload the events since the last call have made stale, each once.
  [[nodiscard]] std::vector<BlockKey> take_stale_blocks();
  [[nodiscard]] std::size_t stale_blocks() const { return stale_.size(); }
  // Every block that the bodies may have a surface in before they are cut further.
  [[nodiscard]] std::vector<BlockKey> bone_blocks() const;
  // Draws all bodies for these focuses from now on; none: everything in full. What that changes is stale.
  void focus(std::vector<Focus> focuses);
  // Copies what make_block() needs, so that only this has to be kept from running beside submit(). Of a body that
  // exists.
  [[nodiscard]] BlockSamples gather_block(const BlockKey& key) const;

 private:
  struct Decided {
    Digest bytes;
    RoomSeq room_seq;
    Rejection rejection = Rejection::none;
  };
  struct Body {
    CutField field;
    CutHistory history;
    SurfaceBlocks surface;
    CoordBox reach;       // samples of level 0 that its bone was in when it came to be
    bool present = true;  // false: taken away
  };
  // One piece of a split, or debris.
  struct Piece {
    BodyId body;  // of debris null
    CoordBox reach;
    Mask left;
  };
  struct Event {
    EventKind kind = EventKind::cut;
    AuthorId author{};
    bool undone = false;
    BodyId body{};                      // split: its parent; remove_body
    Mask taken = {};                    // split
    std::vector<Piece> pieces = {};
    std::uint32_t item = 0;             // scene
    std::vector<RoomSeq> places = {};   // undo
  };
  // What an item was set to; nothing: taken out.
  struct ItemRow {
    RoomSeq place;
    std::optional<SceneItem> item;
  };

  [[nodiscard]] Rejection judge(const Cut& cut) const;
  [[nodiscard]] Result<void> check_member(AuthorId by) const;
  [[nodiscard]] bool exists(BodyId body) const;
  [[nodiscard]] std::vector<Standing> with_tools(const std::vector<SceneItem>& items) const;
  Result<void> know(const Tool& tool);
  [[nodiscard]] std::set<RoomSeq> with_what_falls_too(std::set<RoomSeq> places) const;
  RoomEvent begin_event(EventKind kind, AuthorId by, Event row);
  void finish_event(RoomEvent& event) const;  // says what exists after it
  void note_changed(BodyId body, const std::vector<LevelLeaves>& changed, RoomEvent* event);
  void add_body(BodyId id, CutField field, CutHistory history, const CoordBox& reach);
  void show_whole(BodyId body, RoomEvent& event);
  [[nodiscard]] std::set<BlockKey> focused(Body& body) const;  // what its focus makes stale
  [[nodiscard]] CutField made_piece(const Body& parent, const Piece& piece) const;
  void catch_up(const Body& parent, CutField& field) const;
  void cut_apart(RoomSeq place, Event& row, RoomEvent& event, std::vector<CutField> fields = {});
  void list_blocks(BodyId id, const Body& body, std::vector<BlockKey>& keys) const;
  RoomEvent take_back(AuthorId by, const std::set<RoomSeq>& falls);

  Case bone_;
  CutLimits limits_;
  std::shared_ptr<ToolBox> tools_;  // shared with the fields and, beyond the room, with those that list tools
  std::map<BodyId, Body> bodies_;
  std::uint32_t last_body_ = 0, last_item_ = 0;
  std::map<std::uint32_t, std::vector<ItemRow>> items_;  // rows in order
  std::map<RoomSeq, Event> events_;                      // committed ones, tombstones included
  std::vector<Focus> focuses_;
  std::set<BlockKey> stale_;
  std::vector<BodyLeaves> changes_;
  RoomSeq room_seq_;
  std::uint64_t authors_ = 0, lease_epoch_ = 1, bone_changes_ = 0;
  std::map<AuthorId, std::vector<Decided>> surgeons_;  // row author_seq − 1
  RoomCounts counts_;
};

}  // namespace osteon
