// Runs a room on several threads. One commits events at 120 Hz, one makes mesh blocks at 30 Hz, one finds fragments,
// and one handles slow requests. Free of gRPC: streams are seen as subscribers.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/runtime/tick_stats.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/wire/cut_run.hpp"
#include "server/publish/mesh_publisher.hpp"
#include "server/publish/presence.hpp"
#include "server/publish/send_queue.hpp"
#include "server/publish/session_messages.hpp"
#include "server/publish/state_publisher.hpp"
#include "server/publish/subscriber.hpp"
#include "server/room/room.hpp"
#include "server/rooms/committer.hpp"
#include "server/rooms/cut_metrics.hpp"
#include "server/rooms/playback.hpp"
#include "server/storage/room_store.hpp"

namespace osteon {

class SessionSubscriber : public Subscriber {
 public:
  [[nodiscard]] virtual AuthorId author() const = 0;
  virtual void begin(SessionStart start) = 0;  // messages come after this call
  // Called once, after begin() and perhaps after messages. Events apply to these leaves; applying one again that a leaf
  // already contains changes nothing.
  virtual void set_leaves(std::vector<FieldLeaf> leaves) = 0;
  virtual void enqueue(const SessionMessage& message) = 0;  // of an event; in the room's order
  // [thread of the tools' states] The newest states of all tools. Returns true if some are still to be sent and it
  // wants to be called again soon.
  virtual bool show_partners(const std::vector<CuttingState>& /*states*/) { return false; }
  // Whether it feels the bone on its compliant mount and pushes it. If not, it receives nothing of the loads that
  // others apply.
  [[nodiscard]] virtual bool feels_bone() const { return true; }
  // [tick] The pose of the bone on its mount, for this subscriber.
  virtual void show_bone(const MountPose& /*seen*/) {}
  // Restrictions that hold for the person from the beginning, as an entry without a number. Called after begin().
  virtual void hold(const wire::SessionEntry& /*supervised*/) {}
  // A tool's number in short messages. Called after begin() for the room's tools, and before an entry that adds another
  // tool.
  virtual void know_tool(std::uint32_t /*number*/, const Digest& /*tool*/) {}
  virtual void answer(const SessionMessage& message) = 0;  // outside the room's order
  virtual void refuse(const Error& why) = 0;               // a violation of the protocol: the stream ends
  // Another stream of its author was opened. That stream may have been abandoned and arrived late, so the author may
  // come again.
  virtual void replaced(const std::string& why) { end(why); }
  virtual void decided() = 0;  // one queued cut has left the queue
};

// Whoever shows the inside of the bone. It only receives: the leaves, then every event.
class FieldSubscriber : public Subscriber {
 public:
  [[nodiscard]] virtual AuthorId author() const = 0;
  // As for sessions.
  virtual void begin(SessionStart start) = 0;
  virtual void set_leaves(std::vector<FieldLeaf> leaves) = 0;
  virtual void enqueue(const SessionMessage& message) = 0;
  // Another stream of its author was opened, or the process stops: the author may come again.
  virtual void replaced(const std::string& why) { end(why); }
  [[nodiscard]] virtual std::size_t leaf_bytes() const = 0;  // of its leaves that are not sent yet
};

struct RuntimeRates {
  // Zero: driven. The runtime has no thread and no surface. Its owner calls tick(), and slow requests are answered at
  // once.
  std::chrono::nanoseconds tick{1'000'000'000 / 120};
  std::chrono::nanoseconds mesh{1'000'000'000 / 30};
  // Least time between two updates of the surface for the views and tools.
  std::chrono::nanoseconds looks{250'000'000};
  // Least time between two searches for fragments; zero: never.
  std::chrono::nanoseconds pieces{1'000'000'000 / 8};
  // The bone stands on a compliant mount, about its middle, and everybody with a session can push it; not in a
  // playback.
  bool mount = false;
  // [A] Of leaves that are copied for readers of the field and not sent yet. One reader is always served.
  std::size_t most_leaf_bytes = std::size_t{1} << 30;
};

struct RuntimeHealth {
  TickStats tick;
  StageTimes stages;              // of cuts
  DurationHistogram mesh_update;  // from a cut's arrival until its blocks' payloads were ready
  RoomSeq room_seq;
  RoomCounts counts;
  RejectionCounts rejections{};  // of counts.rejected
  bool serving = false;          // takes cuts
  std::size_t sessions = 0, mesh_streams = 0, cutting_streams = 0;
  std::size_t queued_cuts = 0, stale_blocks = 0;
  std::size_t waiting_entries = 0;  // decided and not yet durable
  DurationHistogram commit;         // of the journal's transactions
  std::size_t furthest_behind = 0;  // entries or blocks that wait for the slowest reader
  std::size_t blocks = 0;
  std::size_t surface_bytes = 0;  // of the newest blocks: what a new viewer is sent
};

// The bone at one sequence number of the room.
struct BoneStatus {
  RoomSeq room_seq;
  Digest field_hash;  // of all bodies
  std::vector<BodyId> bodies;
  double removed_mm3 = 0;
  RoomCounts counts;
};

class RoomRuntime {
 public:
  using Clock = std::chrono::steady_clock;

  // Makes the whole surface, then starts the threads. `progress` gets fractions from one thread at a time. `store`
  // makes entries durable before they are sent to anybody. It outlives the runtime; without it nothing is stored.
  // `playback`: the entries after those of `room` are repeated at their times; everybody who joins may only watch.
  RoomRuntime(Room room, RuntimeRates rates, const std::function<void(double)>& progress,
              Detail detail = Detail::automatic, RoomStore* store = nullptr, std::optional<Playback> playback = {});
  ~RoomRuntime();
  RoomRuntime(const RoomRuntime&) = delete;
  RoomRuntime& operator=(const RoomRuntime&) = delete;

  [[nodiscard]] const Case& bone() const;
  [[nodiscard]] RoomSeq room_seq() const;
  [[nodiscard]] std::uint64_t lease_epoch(AuthorId holder) const;
  [[nodiscard]] bool knows(AuthorId author) const;
  [[nodiscard]] const ToolBox& tools() const;
  [[nodiscard]] std::vector<SceneItem> items() const;
  [[nodiscard]] std::vector<std::pair<RoomSeq, std::string>> marks() const;
  [[nodiscard]] RuntimeHealth health() const;
  [[nodiscard]] Digest surface_hash() const;  // of the newest blocks

  // [owner of a driven runtime] Decides what is queued, makes it durable and publishes it. `now`: time since any start;
  // never decreases. `keep` false: writing is left to a later tick, as with a slow disk.
  void tick(std::chrono::nanoseconds now, bool keep = true);

  // Runs `job` on the thread for slow requests, in order. The job may call the functions below. If the runtime has
  // stopped, the job runs at once.
  void run_slowly(std::function<void()> job);
  // `answer` is called when the join is durable, on the committing thread. Error unavailable: the room has stopped or
  // stores nothing any more.
  void join(MemberKind kind, const std::string& name, const Digest& secret, Role role,
            std::function<void(const Result<AuthorId>&)> answer);
  // The same, but waits. So it must not be called on the tick or the committing thread, nor of a driven runtime.
  [[nodiscard]] Result<AuthorId> join(MemberKind kind, const std::string& name = {}, const Digest& secret = {},
                                      Role role = Role::none);
  // Checks the witness that a returning client was sent. It counts whoever sends it: after a loss, the author number
  // may belong to another person or to nobody. Errors: those of RoomStore::check_witness; unavailable (the room has no
  // store).
  [[nodiscard]] Result<void> check_witness(const Witness& kept);
  // Checks whether an earlier connection may go on. `kept`: the witness that the client was sent, if any. Errors: first
  // those of check_witness; invalid_input (the secret does not match the author's digest); denied (`role` is given, and
  // the author joined with another).
  [[nodiscard]] Result<void> resume(AuthorId author, const Digest& secret, const std::optional<Witness>& kept,
                                    std::optional<Role> role = {});
  [[nodiscard]] BoneStatus bone_status();
  // [thread for slow requests] The leaves of all bodies at one sequence number, also of bodies that were taken away.
  struct Leaves {
    RoomSeq seq;
    std::vector<FieldLeaf> leaves;
  };
  [[nodiscard]] Leaves leaves_now();
  // Waits until everything cut so far has been searched, and its fragments are bodies.
  void find_pieces();
  [[nodiscard]] SavedFields saved_fields();  // of all bodies, at its room_seq
  // The subscriber gets every entry after those in its leaves. With the digest of the author's secret, it replaces an
  // earlier session of that author. Error: invalid_input (the author may not cut, or has an open session).
  [[nodiscard]] Result<void> open_session(const std::shared_ptr<SessionSubscriber>& subscriber,
                                          const Digest& secret = {});
  // Of a room. Each is sent a copy of all leaves at first.
  static constexpr std::size_t kMostFieldReaders = 32;
  // The reader gets every event after those in its leaves. It replaces an earlier reader of its author. If the streams
  // have ended, it is ended too, and nothing is copied. Errors: unavailable (a playback), exhausted (kMostFieldReaders
  // read already, or the leaves of others still wait).
  [[nodiscard]] Result<void> watch_field(const std::shared_ptr<FieldSubscriber>& reader);
  // `look`: the author's first view. Without one, the subscriber is sent the whole bone in full.
  void watch_mesh(MeshSubscriber& subscriber, const std::optional<ViewFrustum>& look = std::nullopt);
  // The newest view of each viewer counts until its last mesh stream ends. Ignored for a viewer without a mesh stream.
  void look(AuthorId viewer, const ViewFrustum& from);
  [[nodiscard]] bool draws_near() const;  // what Detail means here
  void watch_cutting(StateSubscriber& subscriber);
  // For people streams, acknowledgements, and questions about who is present.
  [[nodiscard]] Presence& people();
  // The subscriber gets nothing more after this. Unknown subscribers are ignored.
  void leave(SessionSubscriber& subscriber);
  void leave(FieldSubscriber& reader);
  void leave(MeshSubscriber& subscriber);
  void leave(StateSubscriber& subscriber);

  // Queued until the next tick. The subscriber is kept alive until then and gets the result.
  void queue_cut(std::shared_ptr<SessionSubscriber> subscriber, Cut cut, Clock::time_point arrived);
  void publish_state(CuttingState state);                  // newest of its author wins
  void push_bone(AuthorId author, const MountLoad& push);  // likewise; no effect without a mount
  // Queued until the next tick, behind the cuts that came before. `answer` is called there and must return at once. By
  // then the event was sent to every session. Error unavailable: the room has stopped.
  void queue_event(std::function<Result<RoomEvent>(Room&)> change,
                   std::function<void(const Result<RoomEvent>&)> answer);

  [[nodiscard]] bool stopped() const;  // takes no more cuts, also if its journal takes no more entries
  // The process is about to stop. Asks all sessions, also those opened later, to connect again after that time. They go
  // on until they do.
  void ask_to_redial(std::chrono::milliseconds after, const std::string& why);
  // As end_streams(), but sessions connect again by themselves.
  void send_away(const std::string& why);
  void end_streams(const std::string& why);                 // those open now and those opened later
  void stop();                                              // decides what is queued, then joins the threads
  [[nodiscard]] std::vector<FieldLeaf> all_leaves() const;  // Room::all_leaves(), of a stopped room

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
