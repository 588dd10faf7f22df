// The room: owns the bone and the scene, puts cuts and all other events in one order, judges them, applies them. A
// function of what it was given: no clock, thread, log, file or network, so a test runs it on virtual time. What it
// decides are entries (log_entry.hpp): applied to a room as it began, in order, they make the same room again.
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
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
#include "server/room/cut_energy.hpp"
#include "server/room/people.hpp"
#include "server/room/room_event.hpp"
#include "server/room/log_entry.hpp"
#include "server/room/separation.hpp"

namespace osteon {

// Bounds on a cut, checked before any of it is evaluated.
struct CutLimits {
  int path_knots = 64;
  double beyond_bone_mm = 60.0;  // how far outside the bone's box a tool's tip may be
  double swept_mm = 25.0;        // way of the cutting part in one cut, its turning included
  std::uint32_t spindle_rpm = 120000;
  // Bounds over time, of one author; none where zero. Time is what set_time() says.
  std::chrono::nanoseconds time_slack{};  // tool time that may be claimed beyond what passed since joining
  double swept_voxels_per_s = 0;          // of the cut's level: what the kernel is asked to look at
  double power_w = 0;                     // that a motor gives: bounds the energy of a cut beside that of a blow
  double blow_j = 20.0;
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

inline constexpr std::size_t kMostItems = 256, kMostTools = 1024, kMostBodies = 64, kMostLabelBytes = 256,
                             kMostMarks = 4096;

// Every body holds every cut, those that were taken away too: all bodies share the case's lattice and frame, a piece
// has all but itself taken away, and a cut is applied to each of them, so the server, every replica and the undo of a
// split need no notion of which body a tool meets. Not synchronised: one thread calls the changing functions, or
// several the const ones.
class Room {
 public:
  explicit Room(Case bone, CutLimits limits = {}, std::shared_ptr<ToolBox> tools = builtin_tool_box());
  // Goes on from what was saved; that cannot be undone. Errors: unsupported (of another case or kernel), exists (one of
  // its tools has the name of another that is in the box), invalid_input (a file that contradicts itself).
  static Result<Room> resume(Case bone, const SavedFields& saved, CutLimits limits = {},
                             std::shared_ptr<ToolBox> tools = builtin_tool_box());

  // The time of what is decided from now on, since the room was made; never falls.
  void set_time(std::chrono::nanoseconds now) { now_ = std::max(now_, now); }
  [[nodiscard]] std::chrono::nanoseconds time() const { return now_; }

  // A new identity, never given twice: the event's author. What holds for the person's newest hand holds for the new
  // one, by an entry of its own (RoomEvent::further), unless the server itself joins, which has no secret.
  RoomEvent admit(MemberKind kind, std::uint32_t person = 0, const Digest& secret = {}, Role role = Role::none);
  AuthorId join(MemberKind kind, std::uint32_t person = 0, const Digest& secret = {}, Role role = Role::none);
  [[nodiscard]] bool knows(AuthorId author) const;
  [[nodiscard]] std::uint64_t authors() const { return authors_; }  // so many have joined
  [[nodiscard]] bool may_cut(AuthorId author) const { return surgeons_.contains(author); }
  // Rises when bone comes back (undo, redo), for everyone, and with a rejection for its author: what was cut on the
  // sight of what is not there is void. Cuts are taken under the present one only. 0: no such surgeon.
  [[nodiscard]] std::uint64_t lease_epoch(AuthorId holder) const;
  // The secret that the author was given is the one of which this is the digest.
  [[nodiscard]] bool proves(AuthorId author, const Digest& secret) const;
  // Newest author_seq that was decided.
  [[nodiscard]] std::uint64_t decided(AuthorId author) const;
  // Places of the author's newest decided cuts, at most so many, the last that of decided(); null: it was rejected.
  [[nodiscard]] std::vector<RoomSeq> decided_places(AuthorId author, std::size_t most) const;
  // Rises with every undo and redo that changes the bone: what was seen of it before is of another bone.
  [[nodiscard]] std::uint64_t bone_epoch() const { return bone_epoch_; }

  // Gives the cut its place and applies it to every body. Error invalid_input, without a place in the order: an author
  // that may not cut, a gap in author_seq, or a number that was decided with other bytes.
  Result<Outcome> submit(const Cut& cut);

  // The other events. Errors, without a place in the order: invalid_input (an author who has not joined, an unknown
  // body, item, tool or place), unavailable (nothing to undo or redo, or the bone has changed meanwhile).
  Result<RoomEvent> add_tool(AuthorId by, const Tool& tool);  // place 0 when it is known already
  // Takes back these events, or the newest `count` of one author or (null) of all, of a trainee their own. With a cut
  // falls every later split of a body that it had reached, and what was done to the piece as such; cuts made since stay
  // in the bone.
  Result<RoomEvent> undo(AuthorId by, std::span<const RoomSeq> places);
  Result<RoomEvent> undo_last(AuthorId by, std::size_t count, AuthorId of);
  Result<RoomEvent> undo_to(AuthorId by, RoomSeq mark);         // all that came after it
  Result<RoomEvent> redo_last(AuthorId by, std::size_t count);  // the newest undo events that still stand
  // All that was done since then, by the room's time; all of it, where nothing is older.
  Result<RoomEvent> undo_since(AuthorId by, std::chrono::nanoseconds since);
  Result<RoomEvent> mark(AuthorId by, std::string label);  // of 1 to kMostLabelBytes bytes
  Result<RoomEvent> remove_body(AuthorId by, BodyId body);
  // By the rules of common/tools/scene.hpp, which also say whether it is seated. id 0: a new one.
  Result<RoomEvent> set_item(AuthorId by, SceneItem item, const Placing& placing = {});
  Result<RoomEvent> remove_item(AuthorId by, std::uint32_t item);  // not a guide that pins fix
  // What a FragmentFinder has found in `parent`; `seen`: the bone_epoch() when it looked.
  Result<RoomEvent> split(BodyId parent, std::vector<Fragment> fragments, std::uint64_t seen) {
    return split({parent, std::move(fragments), seen});
  }
  Result<RoomEvent> split(Separation found);
  // What people decide about each other, draw and say: room_people.cpp. A trainee takes back and does again what is
  // their own; errors as above, and denied where the author's role, or what was decided about their hand, does not
  // allow it.
  Result<RoomEvent> supervise(AuthorId by, AuthorId subject, Restrictions supervision);
  Result<RoomEvent> annotate(AuthorId by, Annotation drawn);          // id 0: a new one; an author has one pointer
  Result<RoomEvent> wipe_off(AuthorId by, std::uint32_t annotation);  // an own one, or anyone's for an instructor
  Result<RoomEvent> say(AuthorId by, AuthorId to, std::string words);
  [[nodiscard]] const People& people() const { return people_; }
  [[nodiscard]] BodyId next_body() const { return BodyId{last_body_ + 1}; }

  // What was decided since the last call, in order: for the journal, before anyone is told.
  [[nodiscard]] std::vector<LogEntry> take_entries() { return std::exchange(entries_, {}); }
  // The next entry of a room that began as this one did. Judges nothing; take_entries() does not give it again. `fields`
  // leave: cuts are noted but not evaluated, until set_fields() brings what they have made. Error invalid_input: not
  // the next entry, or one that cannot follow what is here.
  enum class Fields : bool { evaluate, leave };
  Result<void> replay(const LogEntry& entry, Fields fields = Fields::evaluate);
  // The leaves of all bodies, those that were taken away too, as they were at room_seq(): what all_leaves() gave.
  Result<void> set_fields(std::span<const FieldLeaf> leaves);
  [[nodiscard]] std::vector<FieldLeaf> all_leaves() const;
  // What began here: case, pitch, kernel version, tools.
  [[nodiscard]] const Digest& genesis() const { return genesis_; }
  // Names all of the room: rooms of one hash go on alike.
  [[nodiscard]] Digest room_hash() const;
  [[nodiscard]] std::vector<std::pair<RoomSeq, std::string>> marks() const;

  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] const RoomCounts& counts() const { return counts_; }
  // Never changes, so that any thread may ask beside the one that changes the room.
  [[nodiscard]] const Case& bone() const { return bone_; }
  [[nodiscard]] const std::shared_ptr<ToolBox>& tools() const { return tools_; }
  [[nodiscard]] std::vector<BodyId> bodies() const;                                    // that exist, in order
  [[nodiscard]] const CutField* find_field(BodyId body) const;                         // null: no such body
  [[nodiscard]] std::vector<BodyId> all_bodies() const;                                // those that were taken away too
  [[nodiscard]] const CutField* any_field(BodyId body) const;                          // of one of these
  [[nodiscard]] const CutField& field() const { return bodies_.at(BodyId{0}).field; }  // of the case's bone
  [[nodiscard]] Digest field_hash() const;                                             // of all bodies
  [[nodiscard]] std::vector<SceneItem> items() const;
  // Events so far that changed the bone otherwise than by cutting.
  [[nodiscard]] std::uint64_t bone_changes() const { return bone_changes_; }
  // Leaves that changed since the last call.
  [[nodiscard]] std::vector<BodyLeaves> take_changes() { return std::exchange(changes_, {}); }

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
  struct Surgeon {
    std::uint64_t epoch = 1;                        // of the lease
    std::chrono::nanoseconds granted{}, claimed{};  // when, and tool time of its cuts since
    double swept_voxels = 0;                        // spent of the bound, at `spent`
    std::chrono::nanoseconds spent{};
    std::vector<Decided> decided;  // entry author_seq − 1
  };
  struct Body {
    CutField field;
    CutHistory history;
    SurfaceBlocks surface;
    CoordBox reach;       // samples of level 0 that its bone was in when it came to be
    bool present = true;  // false: taken away
  };
  struct Event {
    EventKind kind = EventKind::cut;
    AuthorId author{};
    bool undone = false;
    BodyId body{};    // split: its parent; remove_body
    Mask taken = {};  // split
    std::vector<SplitPiece> pieces = {};
    std::uint32_t item = 0;                  // scene
    std::vector<RoomSeq> places = {};        // undo
    std::shared_ptr<const Cut> missed = {};  // cut: one that is in no body's history; never changed
    bool all_of_others = false;              // undo: nothing was left of what anybody but its author had done
    std::string label = {};                  // mark
    std::chrono::nanoseconds at{};
  };
  // What an item was set to; nothing: taken out.
  struct ItemState {
    RoomSeq place;
    std::optional<SceneItem> item;
  };

  [[nodiscard]] Rejection judge(const Cut& cut);
  [[nodiscard]] Rejection judge_form(const Cut& cut) const;
  [[nodiscard]] bool beyond_power(const Cut& cut, std::span<const CutField* const> fields);
  [[nodiscard]] double swept_mm(const Cut& cut, const ToolBox::Entry& tool) const;
  [[nodiscard]] double swept_voxels(const Cut& cut) const;
  [[nodiscard]] double voxels_spent(const Surgeon& surgeon) const;
  [[nodiscard]] Result<void> check_member(AuthorId by) const;
  [[nodiscard]] bool exists(BodyId body) const;
  [[nodiscard]] std::vector<Standing> with_tools(const std::vector<SceneItem>& items) const;
  [[nodiscard]] std::set<RoomSeq> with_what_falls_too(std::set<RoomSeq> places) const;
  // Deciding: an entry with the next place. Applying it is the same for one just decided and for one of a journal.
  LogEntry next_entry(AuthorId by, decltype(LogEntry::what) what);
  RoomEvent decide(AuthorId by, decltype(LogEntry::what) what);
  [[nodiscard]] Result<void> can_follow(const LogEntry& entry) const;
  RoomEvent apply(const LogEntry& entry);
  void apply(const LogEntry& entry, const JoinEntry& join, RoomEvent& event);
  void apply(const LogEntry& entry, const CutEntry& cut, RoomEvent& event);
  void apply(const LogEntry& entry, const RejectionEntry& rejection, RoomEvent& event);
  void apply(const LogEntry& entry, const SplitEntry& split, RoomEvent& event);
  void apply(const LogEntry& entry, const UndoEntry& undo, RoomEvent& event);
  void apply(const LogEntry& entry, const RedoEntry& redo, RoomEvent& event);
  void apply(const LogEntry& entry, const RemoveBodyEntry& removal, RoomEvent& event);
  void apply(const LogEntry& entry, const ItemEntry& item, RoomEvent& event);
  void apply(const LogEntry& entry, const ToolEntry& tool, RoomEvent& event);
  void apply(const LogEntry& entry, const MarkEntry& mark, RoomEvent& event);
  void apply(const LogEntry& entry, const SuperviseEntry& supervise, RoomEvent& event);
  void apply(const LogEntry& entry, const AnnotationEntry& annotation, RoomEvent& event);
  void apply(const LogEntry& entry, const WordsEntry& words, RoomEvent& event);
  // The bone or the scene, otherwise than by a cut: whoever has joined and is neither stopped nor without their tool.
  [[nodiscard]] Result<void> may_change(AuthorId by) const;
  // Whether cuts that come again are such as `by` may make now, and those whose they are, unless `by` supervises them.
  [[nodiscard]] Result<void> may_cut_again(AuthorId by, const std::set<RoomSeq>& places) const;
  // By their role; the same however the events are named.
  [[nodiscard]] Result<void> may_take_back(AuthorId by, const std::set<RoomSeq>& places) const;
  // Whether some of them are others', and nothing that others did stands without them. Splits are nobody's.
  [[nodiscard]] bool takes_all_of_others(AuthorId by, const std::set<RoomSeq>& places) const;
  [[nodiscard]] Result<void> are_own(AuthorId by, const std::set<RoomSeq>& places) const;
  // Undo events.
  [[nodiscard]] Result<void> may_do_again(AuthorId by, const std::set<RoomSeq>& undos) const;
  void bone_came_back(RoomEvent& event);
  void grant(Surgeon& surgeon);
  Event& add_event(const LogEntry& entry, EventKind kind);
  void finish_event(RoomEvent& event) const;  // says what exists after it
  void note_decided(AuthorId author, const Digest& bytes, RoomSeq place, Rejection rejection);
  void note_changed(BodyId body, const std::vector<LevelLeaves>& changed, RoomEvent* event);
  void add_body(BodyId id, CutField field, CutHistory history, const CoordBox& reach);
  void show_whole(BodyId body, RoomEvent& event);
  [[nodiscard]] std::set<BlockKey> focused(Body& body) const;  // what its focus makes stale
  [[nodiscard]] CutField made_piece(const Body& parent, const SplitPiece& piece) const;
  void catch_up(const Body& parent, CutField& field) const;
  void cut_apart(RoomSeq place, Event& entry, RoomEvent& event);
  void list_blocks(BodyId id, const Body& body, std::vector<BlockKey>& keys) const;
  [[nodiscard]] Result<void> know(const Tool& tool) const;
  [[nodiscard]] bool can_be_undone(RoomSeq place) const;
  RoomEvent take_back(AuthorId by, std::set<RoomSeq> places);

  Case bone_;
  CutLimits limits_;
  std::shared_ptr<ToolBox> tools_;  // shared with the fields and, beyond the room, with those that list tools
  std::map<BodyId, Body> bodies_;
  std::uint32_t last_body_ = 0, last_item_ = 0;
  std::map<std::uint32_t, std::vector<ItemState>> items_;  // entries in order
  std::map<RoomSeq, Event> events_;                        // committed ones, tombstones included
  std::vector<Focus> focuses_;
  std::set<BlockKey> stale_;
  std::vector<BodyLeaves> changes_;
  RoomSeq room_seq_;
  std::chrono::nanoseconds now_{};
  std::uint64_t authors_ = 0, bone_epoch_ = 1, bone_changes_ = 0;
  std::map<AuthorId, Digest> secrets_;
  std::map<AuthorId, Surgeon> surgeons_;
  People people_;
  RoomCounts counts_;
  Digest genesis_;
  std::vector<LogEntry> entries_;  // decided since take_entries()
  Fields fields_ = Fields::evaluate;
  CutEnergy energy_;
  std::map<AuthorId, double> owed_j_;
  std::vector<CutField> ready_;  // while a split is applied: fields that were made for its pieces
};

}  // namespace osteon
