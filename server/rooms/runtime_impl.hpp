// The implementation of RoomRuntime, for its own source files.
#pragma once
#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/mutex.hpp"
#include "server/publish/mesh_publisher.hpp"
#include "server/publish/presence.hpp"
#include "server/publish/session_messages.hpp"
#include "server/publish/state_publisher.hpp"
#include "server/rooms/bone_mount.hpp"
#include "server/rooms/fragment_detector.hpp"
#include "server/rooms/job_thread.hpp"
#include "server/rooms/room_runtime.hpp"
#include "server/rooms/runtime_parts.hpp"

namespace osteon {

[[nodiscard]] Error only_to_be_watched();

// Watchers of a playback are not among its entries, so their numbers must differ from those of the shown room.
inline constexpr std::uint64_t kFirstWatcherOfPlayback = 1ull << 40;

struct RoomRuntime::Impl {
  using Clock = RoomRuntime::Clock;

  Impl(Room r, RuntimeRates rates, Detail detail, RoomStore* k, std::optional<Playback> p)
      : store(k),
        room(std::move(r)),
        rates_(rates),
        room_began(Clock::now() - std::chrono::duration_cast<Clock::duration>(k ? reopened_time(room) : room.time())),
        people(room, names_of(k)),
        mesh(room, room_mutex, {rates.mesh, rates.looks}, detail, [this] { return board.tool_tips_mm(); }),
        committer(
            k ? [k](std::span<const LogEntry> entries) { return k->write(entries); } : Committer::Write{},
            [this](const Error& why) { close_room(why); }, !driven()) {
    authors = room.authors();
    if (rates_.mount && !p) mount.emplace(MountServerParams{.mount = mount_about(room.bone().bounds().centre_mm())});
    if (p) player.emplace(std::move(*p), room.time());
    board.set_session_sender([this](const std::vector<CuttingState>& states) { return send_partners(states); });
  }
  [[nodiscard]] static std::map<std::uint32_t, std::string> names_of(RoomStore* store);

  [[nodiscard]] bool driven() const { return rates_.tick.count() == 0; }
  // In a playback, splits are among the entries.
  [[nodiscard]] bool looks_for_pieces() const { return rates_.pieces.count() > 0 && !player; }
  void run_ticks();
  // Returns true if anything was decided.
  bool tick(std::chrono::nanoseconds now, bool last);
  bool play(std::chrono::nanoseconds now);
  void run_pieces();
  void decide(QueuedCut& queued);
  void decide(QueuedEvent& queued);
  // [tick] Calls `when_durable` when what was decided is durable.
  void later(Committer::WhenDurable when_durable) { callbacks.push_back(std::move(when_durable)); }
  [[nodiscard]] std::vector<SessionMessage> messages_of(const RoomEvent& event);
  // What some sessions get in place of the messages that the others get.
  struct Personal {
    AuthorId to;  // null: all
    std::optional<SessionMessage> message;
    [[nodiscard]] bool is_for(AuthorId author) const { return message && (!to || to == author); }
  };
  [[nodiscard]] Personal personal_message(const RoomEvent& event);
  // What everybody who holds the bone begins with.
  [[nodiscard]] SessionStart start_of_field() OSTEON_REQUIRES_SHARED(room_mutex);
  // The leaves of all bodies, without their values.
  [[nodiscard]] std::vector<FieldLeaf> places_of_leaves() const OSTEON_REQUIRES_SHARED(room_mutex);
  // Reads the leaves, and gives them to a receiver that has begun once all it began with is durable.
  template <class Receiver>
  void give_leaves(RoomRuntime& runtime, const std::shared_ptr<Receiver>& receiver, std::vector<FieldLeaf> leaves);
  // `held`: the author's restrictions, which `by` decided.
  [[nodiscard]] SessionStart start_of_session(AuthorId author, const People::Supervised& held, const Decider& by)
      OSTEON_REQUIRES_SHARED(room_mutex);
  // [tick] In a room without a store; 0: no name.
  [[nodiscard]] std::uint32_t person_of(const std::string& name) {
    return name.empty() ? 0 : persons.emplace(name, static_cast<std::uint32_t>(persons.size() + 1)).first->second;
  }
  // What sessions are sent for one event.
  struct EventMessages {
    std::vector<SessionMessage> messages;
    Personal personal;
  };
  // Returns true if any session still lacks some of the states.
  bool send_partners(const std::vector<CuttingState>& states);
  [[nodiscard]] std::uint32_t number_of(const Digest& tool);
  void publish_durable(std::chrono::nanoseconds now);
  void move_bone(std::chrono::nanoseconds now);  // [tick] on its mount
  void note_changed(Clock::time_point arrived) {
    if (!driven()) mesh.changed(arrived);
  }
  void close_room(const Error& why);
  [[nodiscard]] std::optional<Error> closed() const;
  void end_sessions(const std::string& why, bool to_return = false);
  // As the open streams were. False: they go on.
  bool ends(FieldSubscriber& reader) const OSTEON_REQUIRES(sessions_mutex);
  // The reader of its author that it replaces, or null. Error exhausted: there is no place for it.
  Result<FieldSubscriber*> place_for(const FieldSubscriber& reader, std::size_t leaf_bytes = 0) const
      OSTEON_REQUIRES(sessions_mutex);
  void show_scene();
  void read_leaves(std::vector<FieldLeaf>& leaves);

  // All bodies at one sequence number, copied while the room went on.
  struct BoneCopy {
    RoomSeq room_seq;
    RoomCounts counts;
    std::map<BodyId, CutField> bodies;
    std::vector<SceneItem> items;
  };
  enum class Bodies { that_exist, all };
  BoneCopy copy_bone(Bodies which = Bodies::that_exist) OSTEON_REQUIRES(copy_mutex);
  void ask_for_split(Separation found);

  RoomStore* const store;        // null: nothing is stored
  std::optional<Player> player;  // of a playback, from the beginning; used by the tick thread alone
  std::atomic<std::uint64_t> next_watcher{kFirstWatcherOfPlayback};  // of a playback
  // The tick thread alone changes it, under room_mutex, and therefore reads it without. All others read it under
  // room_mutex. So clang cannot check it.
  Room room;
  SharedMutex room_mutex{LockRank::room};
  // Cuts applied since copy_bone() began. copy_bone() sets it under a shared lock, the tick thread under an exclusive
  // one. So clang cannot check it.
  std::optional<std::vector<Cut>> cuts_during_copy;
  const RuntimeRates rates_;
  const Clock::time_point room_began;  // time 0 of the room, as if it had hardly been closed
  std::atomic<std::uint64_t> room_seq{0}, authors{0};
  std::atomic<bool> stopping{false};

  Mutex numbers_mutex{LockRank::leaf};
  std::map<Digest, std::uint32_t> tool_numbers OSTEON_GUARDED_BY(numbers_mutex);

  Mutex queue_mutex{LockRank::leaf};
  std::vector<Queued> queue OSTEON_GUARDED_BY(queue_mutex);
  bool queue_closed OSTEON_GUARDED_BY(queue_mutex) = false;  // the last tick has taken what was queued

  mutable Mutex sessions_mutex{LockRank::sessions};
  Subscribers<SessionSubscriber> sessions OSTEON_GUARDED_BY(sessions_mutex);
  std::map<AuthorId, SessionSubscriber*> open_authors OSTEON_GUARDED_BY(sessions_mutex);
  Subscribers<FieldSubscriber> field_readers OSTEON_GUARDED_BY(sessions_mutex);

  std::optional<BoneMount> mount;  // from the beginning
  Presence people;
  StatePublisher board;
  MeshPublisher mesh;

  Mutex pieces_mutex{LockRank::leaf};
  CondVar pieces_wake;
  bool pieces_due OSTEON_GUARDED_BY(pieces_mutex) = true, pieces_end OSTEON_GUARDED_BY(pieces_mutex) = false;
  std::uint64_t looks_begun OSTEON_GUARDED_BY(pieces_mutex) = 0, looks_done OSTEON_GUARDED_BY(pieces_mutex) = 0;
  bool look_wanted OSTEON_GUARDED_BY(pieces_mutex) = false;  // somebody waits for the next search
  FragmentDetector pieces{room, room_mutex,
                          [this](std::vector<FieldLeaf>& leaves) { read_leaves(leaves); }};  // used by the piece thread

  JobThread jobs;

  mutable Mutex stats_mutex{LockRank::leaf};
  TickStats stats OSTEON_GUARDED_BY(stats_mutex);
  RoomCounts counts OSTEON_GUARDED_BY(stats_mutex);
  CutMetrics metrics;

  std::optional<std::string> ended OSTEON_GUARDED_BY(sessions_mutex);  // why new sessions end at once
  bool may_return OSTEON_GUARDED_BY(sessions_mutex) = false;           // they may come again
  // Sent to sessions when the process is about to stop.
  std::optional<SessionMessage> redial OSTEON_GUARDED_BY(sessions_mutex);
  Mutex copy_mutex{LockRank::bone_copy};  // held while the bone is copied; of a stopped runtime by every caller
  std::optional<BoneStatus> last_status OSTEON_GUARDED_BY(copy_mutex);
  std::map<std::string, std::uint32_t> persons;   // of the tick thread: numbers by name, if no journal gives them
  std::vector<Queued> batch;                      // of the tick thread
  std::vector<Committer::WhenDurable> callbacks;  // of the tick thread
  // Of the tick thread: sessions were informed that the journal is closed to entries.
  bool closing_reported = false;
  // Of the tick thread: when sessions are next informed how much is durable.
  std::chrono::nanoseconds next_durable{};
  Committer committer;  // the last member with a thread, since it calls the others

  std::thread tick_thread, piece_thread;
};

}  // namespace osteon
