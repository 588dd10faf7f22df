// The room: it owns the bone and the scene. It puts cuts and all other events in one order, judges them and applies
// them.
// It depends only on its input: it has no clock, thread, log, file or network. So a test can run it on virtual time.
// Its decisions are log entries (log_entry.hpp). Applied in order to a room as it began, they make the same room again.
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
#include "server/room/cut_limits.hpp"
#include "server/room/log_entry.hpp"
#include "server/room/people.hpp"
#include "server/room/room_event.hpp"
#include "server/room/separation.hpp"

namespace osteon {

// Changed leaves of one body, for the fragment detector.
struct BodyLeaves {
  BodyId body;
  int level = 0;
  std::vector<Coord> origins;
};

struct RoomCounts {
  std::uint64_t committed = 0;
  std::uint64_t rejected = 0;
  std::uint64_t repeated = 0;
  std::uint64_t refused = 0;  // violations that got no sequence number
};

inline constexpr std::size_t kMostItems = 256, kMostTools = 1024, kMostBodies = 64, kMostLabelBytes = 256,
                             kMostMarks = 4096;

// Every body holds every cut, and so do bodies that were removed. All bodies share the lattice and frame of the case. A
// piece is a copy with everything else removed, and every cut is applied to every body. So the server, the replicas and
// the undo of a split need not know which body a tool meets.
// Not synchronised: either one thread calls the changing functions, or several threads call the const ones.
class Room {
 public:
  explicit Room(Case bone, CutLimits limits = {}, std::shared_ptr<ToolBox> tools = builtin_tool_box());
  // Continues from a saved state; the saved part cannot be undone. Errors: unsupported (another case or kernel), exists
  // (one of its tools has the name of a different tool in the box), invalid_input (the file contradicts itself).
  static Result<Room> resume(Case bone, const SavedFields& saved, CutLimits limits = {},
                             std::shared_ptr<ToolBox> tools = builtin_tool_box());

  // The time of the decisions from now on, measured since the room was made. It never decreases.
  void set_time(std::chrono::nanoseconds now) { now_ = std::max(now_, now); }
  [[nodiscard]] std::chrono::nanoseconds time() const { return now_; }

  // Makes a new author, the event's `author`, with a number that is never reused. The restrictions of the person's
  // newest author then hold for the new one too, by a log entry of their own (RoomEvent::further). This does not happen
  // when the server itself joins, which has no secret.
  RoomEvent admit(MemberKind kind, std::uint32_t person = 0, const Digest& secret = {}, Role role = Role::none);
  AuthorId join(MemberKind kind, std::uint32_t person = 0, const Digest& secret = {}, Role role = Role::none);
  [[nodiscard]] bool knows(AuthorId author) const;
  [[nodiscard]] std::uint64_t authors() const { return authors_; }  // number of authors that have joined
  [[nodiscard]] bool may_cut(AuthorId author) const { return surgeons_.contains(author); }
  // Rises for everyone when bone comes back (undo, redo), and for the author of a rejection. Then cuts that were
  // predicted on bone that no longer exists in that form are void. A room accepts cuts of the present epoch only. 0: no
  // such surgeon.
  [[nodiscard]] std::uint64_t lease_epoch(AuthorId holder) const;
  // Whether `secret` is the digest of the secret that the author was given.
  [[nodiscard]] bool proves(AuthorId author, const Digest& secret) const;
  // Newest author_seq that was decided.
  [[nodiscard]] std::uint64_t decided(AuthorId author) const;
  // Sequence numbers of the author's newest decided cuts, at most `most`; the last is that of decided(). Null:
  // rejected.
  [[nodiscard]] std::vector<RoomSeq> decided_seqs(AuthorId author, std::size_t most) const;
  // Rises with every undo and redo that changes the bone. What was computed from the bone before then is out of date.
  [[nodiscard]] std::uint64_t bone_epoch() const { return bone_epoch_; }

  // Gives the cut its sequence number and applies it to every body. Error invalid_input, without a sequence number: the
  // author may not cut, author_seq has a gap, or author_seq was decided with other bytes. `encoded`: see CutEntry.
  Result<Outcome> submit(const Cut& cut, std::shared_ptr<const std::string> encoded = {});

  // The other events. Errors, without a sequence number: invalid_input (an author who has not joined; an unknown body,
  // item, tool or event), unavailable (nothing to undo or redo, or the bone has changed since).
  Result<RoomEvent> add_tool(AuthorId by, const Tool& tool);  // sequence number 0 if it is known already
  // Takes back these events, or the newest `count` events of one author or (null) of all; a trainee only takes back
  // their own. With a cut, every later split of a body that the cut had reached is undone too. With a split, what was
  // done to its piece as such is undone. Later cuts stay in the bone.
  Result<RoomEvent> undo(AuthorId by, std::span<const RoomSeq> seqs);
  Result<RoomEvent> undo_last(AuthorId by, std::size_t count, AuthorId of);
  Result<RoomEvent> undo_to(AuthorId by, RoomSeq mark);         // all events after it
  Result<RoomEvent> redo_last(AuthorId by, std::size_t count);  // the newest undo events that still hold
  // Takes back everything since then, by the room's time. Takes back everything if nothing is older.
  Result<RoomEvent> undo_since(AuthorId by, std::chrono::nanoseconds since);
  Result<RoomEvent> mark(AuthorId by, std::string label);  // of 1 to kMostLabelBytes bytes
  Result<RoomEvent> remove_body(AuthorId by, BodyId body);
  // Follows the rules of common/tools/scene.hpp, which also decide whether the item is seated. id 0: a new item.
  Result<RoomEvent> set_item(AuthorId by, SceneItem item, const Placing& placing = {});
  Result<RoomEvent> remove_item(AuthorId by, std::uint32_t item);  // not a guide that pins fix
  // Fragments that a FragmentFinder has found in `parent`. `seen`: bone_epoch() when the search began.
  Result<RoomEvent> split(BodyId parent, std::vector<Fragment> fragments, std::uint64_t seen) {
    return split({parent, std::move(fragments), seen});
  }
  Result<RoomEvent> split(Separation found);
  // What people decide about each other, draw and say: room_people.cpp. A trainee can take back and redo only their own
  // events. Errors as above, and denied: the author's role or restrictions do not allow it.
  Result<RoomEvent> supervise(AuthorId by, AuthorId subject, Restrictions supervision);
  Result<RoomEvent> annotate(AuthorId by, Annotation drawn);          // id 0: a new one; an author has one pointer
  Result<RoomEvent> wipe_off(AuthorId by, std::uint32_t annotation);  // an own one; an instructor may erase anyone's
  Result<RoomEvent> say(AuthorId by, AuthorId to, std::string words);
  [[nodiscard]] const People& people() const { return people_; }
  [[nodiscard]] BodyId next_body() const { return BodyId{last_body_ + 1}; }

  // Decisions since the last call, in order. They go to the journal before anyone is notified.
  [[nodiscard]] std::vector<LogEntry> take_entries() { return std::exchange(entries_, {}); }
  // Applies the next log entry of a room that began as this one did. It judges nothing, and take_entries() does not
  // return the entry again. `fields` leave: cuts are recorded but not evaluated, until set_fields() brings their
  // result.
  // Error invalid_input: the entry is not the next one, or cannot follow the present state.
  enum class Fields : bool { evaluate, leave };
  Result<void> replay(const LogEntry& entry, Fields fields = Fields::evaluate);
  // Sets the leaves of all bodies at room_seq(), as all_leaves() returned them; bodies that were removed are included.
  Result<void> set_fields(std::span<const FieldLeaf> leaves);
  [[nodiscard]] std::vector<FieldLeaf> all_leaves() const;
  // Identifies the start of the room: case, pitch, kernel version, tools.
  [[nodiscard]] const Digest& genesis() const { return genesis_; }
  // Identifies the whole state. Rooms of the same hash continue identically.
  [[nodiscard]] Digest room_hash() const;
  [[nodiscard]] std::vector<std::pair<RoomSeq, std::string>> marks() const;

  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] const RoomCounts& counts() const { return counts_; }
  // It never changes, so any thread may call this while another changes the room.
  [[nodiscard]] const Case& bone() const { return bone_; }
  [[nodiscard]] const std::shared_ptr<ToolBox>& tools() const { return tools_; }
  [[nodiscard]] std::vector<BodyId> bodies() const;                                    // those that exist, in order
  [[nodiscard]] const CutField* find_field(BodyId body) const;                         // null: no such body
  [[nodiscard]] std::vector<BodyId> all_bodies() const;                                // removed ones included
  [[nodiscard]] const CutField* any_field(BodyId body) const;                          // of one of all_bodies()
  [[nodiscard]] const CutField& field() const { return bodies_.at(BodyId{0}).field; }  // of the case's bone
  [[nodiscard]] Digest field_hash() const;                                             // of all bodies
  [[nodiscard]] std::vector<SceneItem> items() const;
  // Number of events that changed the bone in another way than by cutting.
  [[nodiscard]] std::uint64_t bone_changes() const { return bone_changes_; }
  // Leaves that changed since the last call, each once, however many cuts reached it.
  [[nodiscard]] std::vector<BodyLeaves> take_changes();

  // Blocks whose payload became stale since the last call, each once.
  [[nodiscard]] std::vector<BlockKey> take_stale_blocks();
  [[nodiscard]] std::size_t stale_blocks() const { return stale_.size(); }
  // Every block in which a body may have a surface before any later cut.
  [[nodiscard]] std::vector<BlockKey> bone_blocks() const;
  // From now on meshes all bodies for these focuses; none: everything at full resolution. Affected blocks become stale.
  void focus(std::vector<Focus> focuses);
  // Copies what make_block() needs. Only this call, not make_block(), must not run at the same time as submit(). The
  // body must exist.
  [[nodiscard]] BlockSamples gather_block(const BlockKey& key) const;

 private:
  struct Decided {
    Digest bytes;
    RoomSeq room_seq;
    Rejection rejection = Rejection::none;
  };
  struct Surgeon {
    std::uint64_t epoch = 1;                        // of the lease
    std::chrono::nanoseconds granted{}, claimed{};  // when it was granted, and tool time of the cuts since
    double swept_voxels = 0;                        // used of the limit, at time `spent`
    std::chrono::nanoseconds spent{};
    std::vector<Decided> decided;  // entry author_seq − 1
  };
  struct Body {
    CutField field;
    CutHistory history;
    SurfaceBlocks surface;
    CoordBox reach;       // samples of level 0 that contained its bone when the body was made
    bool present = true;  // false: removed
  };
  struct Event {
    EventKind kind = EventKind::cut;
    AuthorId author{};
    bool undone = false;
    BodyId body{};    // split: its parent; remove_body
    Mask taken = {};  // split
    std::vector<SplitPiece> pieces = {};
    std::uint32_t item = 0;                  // scene
    std::vector<RoomSeq> seqs = {};          // undo
    std::shared_ptr<const Cut> missed = {};  // cut: set if it is in no body's history; never changes
    bool all_of_others = false;              // undo: it took back everything that people other than its author had done
    std::string label = {};                  // mark
    std::chrono::nanoseconds at{};
  };
  // State that an item was set to; nothing: removed.
  struct ItemState {
    RoomSeq seq;
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
  [[nodiscard]] std::set<RoomSeq> with_what_falls_too(std::set<RoomSeq> seqs) const;
  // Deciding makes a log entry with the next sequence number. Applying it is the same for a new entry and one of a
  // journal.
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
  // Whether the author may change the bone or scene in another way than by a cut: it has joined, is not stopped and has
  // its tool.
  [[nodiscard]] Result<void> may_change(AuthorId by) const;
  // Whether `by` may make these redone cuts now. Their authors must be allowed to make them too, unless `by` supervises
  // them.
  [[nodiscard]] Result<void> may_cut_again(AuthorId by, const std::set<RoomSeq>& seqs) const;
  // Depends on the author's role, not on the way in which the events were named.
  [[nodiscard]] Result<void> may_take_back(AuthorId by, const std::set<RoomSeq>& seqs) const;
  // Whether some of them are other people's, and nothing that others did remains without them. Splits belong to nobody.
  [[nodiscard]] bool takes_all_of_others(AuthorId by, const std::set<RoomSeq>& seqs) const;
  [[nodiscard]] Result<void> are_own(AuthorId by, const std::set<RoomSeq>& seqs) const;
  // `undos`: undo events.
  [[nodiscard]] Result<void> may_do_again(AuthorId by, const std::set<RoomSeq>& undos) const;
  void bone_came_back(RoomEvent& event);
  void grant(Surgeon& surgeon);
  Event& add_event(const LogEntry& entry, EventKind kind);
  void finish_event(RoomEvent& event) const;  // adds what exists after it
  void note_decided(AuthorId author, const Digest& bytes, RoomSeq seq, Rejection rejection);
  void note_changed(BodyId body, const std::vector<LevelLeaves>& changed, RoomEvent* event);
  void add_body(BodyId id, CutField field, CutHistory history, const CoordBox& reach);
  void show_whole(BodyId body, RoomEvent& event);
  [[nodiscard]] std::set<BlockKey> focused(Body& body) const;  // what its focus makes stale
  [[nodiscard]] CutField made_piece(const Body& parent, const SplitPiece& piece) const;
  void catch_up(const Body& parent, CutField& field) const;
  void cut_apart(RoomSeq seq, Event& entry, RoomEvent& event);
  void list_blocks(BodyId id, const Body& body, std::vector<BlockKey>& keys) const;
  [[nodiscard]] Result<void> know(const Tool& tool) const;
  [[nodiscard]] bool can_be_undone(RoomSeq seq) const;
  RoomEvent take_back(AuthorId by, std::set<RoomSeq> seqs);

  Case bone_;
  CutLimits limits_;
  std::shared_ptr<ToolBox> tools_;  // shared with the fields, and outside of the room with the lists of tools
  std::map<BodyId, Body> bodies_;
  std::uint32_t last_body_ = 0, last_item_ = 0;
  std::map<std::uint32_t, std::vector<ItemState>> items_;  // states in order
  std::map<RoomSeq, Event> events_;                        // committed events, tombstones included
  std::vector<Focus> focuses_;
  std::set<BlockKey> stale_;
  std::map<std::pair<BodyId, int>, std::set<Coord>> changes_;  // by body and level
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
  std::vector<CutField> ready_;  // while a split is applied: fields made beforehand for its pieces
};

}  // namespace osteon
