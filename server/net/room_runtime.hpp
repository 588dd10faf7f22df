// Runs a room: one thread that commits events at 120 Hz, one that makes mesh blocks at 30 Hz, one that looks for pieces
// that have come apart, one for slow requests.
// Free of gRPC: streams are seen as subscribers.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/core/result.hpp"
#include "common/mechanics/compliant_mount.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/runtime/tick_stats.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/wire/cut_run.hpp"
#include "server/net/committer.hpp"
#include "server/net/cut_figures.hpp"
#include "server/net/mesh_publisher.hpp"
#include "server/net/playback.hpp"
#include "server/net/presence.hpp"
#include "server/net/room_store.hpp"
#include "server/net/send_queue.hpp"
#include "server/net/state_publisher.hpp"
#include "server/net/subscriber.hpp"
#include "server/room/room.hpp"

namespace osteon {

class SessionSubscriber : public Subscriber {
 public:
  [[nodiscard]] virtual AuthorId author() const = 0;
  // Of the leaves; entries come from here on. `before`: whole SessionResponses that go before the leaves, `complete` the
  // one that ends them.
  virtual void begin(RoomSeq contained, MessageParts before, Bytes complete) = 0;
  // Once, after begin() and perhaps after entries. Those apply to these leaves: what one of them contains already is no
  // change when its entry is applied again.
  virtual void set_leaves(std::vector<FieldLeaf> leaves) = 0;
  virtual void offer(RoomSeq place, const Bytes& entry) = 0;  // a whole SessionResponse
  // The same, with what goes in few bytes of it.
  virtual void offer(RoomSeq place, const Bytes& entry, const wire::SessionEntry& /*fast*/) { offer(place, entry); }
  // [thread of the tools' states] All tools' newest states. True: some of it is owed, and wants to be told again soon.
  virtual bool show_partners(const std::vector<CuttingState>& /*states*/) { return false; }
  // Whether it pushes the bone on its mount and is pushed by it: whoever is not takes nothing of what others put into
  // it.
  [[nodiscard]] virtual bool feels_bone() const { return true; }
  // [tick] Where the bone stands on its mount, to this one.
  virtual void show_bone(const MountPose& /*seen*/) {}
  // What holds for the hand from the beginning, as an entry that has no number: after begin().
  virtual void hold(const wire::SessionEntry& /*supervised*/) {}
  // A tool's number in few bytes: after begin() for those of the room, and before the entry that adds another.
  virtual void know_tool(std::uint32_t /*number*/, const Digest& /*tool*/) {}
  virtual void answer(const Bytes& entry) = 0;  // the same, outside the room's order
  virtual void refuse(const Error& why) = 0;  // a breach of the protocol: the stream ends
  // Another stream of its author was opened. That may be one that was given up and came late, so the author may come
  // again.
  virtual void replaced(const std::string& why) { end(why); }
  virtual void decided() = 0;  // one queued cut has left the queue
};

struct RuntimeRates {
  // Zero: driven. The runtime has no thread and no surface; its owner calls tick(), and slow requests are answered at
  // once.
  std::chrono::nanoseconds tick{1'000'000'000 / 120};
  std::chrono::nanoseconds mesh{1'000'000'000 / 30};
  std::chrono::nanoseconds looks{
      250'000'000};  // at most so often the surface follows the looks of viewers and the tools
  std::chrono::nanoseconds pieces{1'000'000'000 /
                                  8};  // at most so often is looked for what has come apart; zero: never
  bool mount =
      false;  // the bone stands on one, about its middle, and whoever has a session pushes it; not in a playback
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
  std::size_t waiting_entries = 0;     // decided and not yet kept
  DurationHistogram commit;         // of the journal's transactions
  std::size_t furthest_behind = 0;  // entries or blocks that wait for the slowest reader
  std::size_t blocks = 0;
  std::size_t surface_bytes = 0;  // of the newest blocks: what a viewer that joins is sent
};

// The bone at one place of the room's order.
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

  // Makes the whole surface, then starts the threads. `progress` hears fractions from one thread at a time.
  // `store` makes entries durable before any hand hears of them, and outlives the runtime; without it nothing is kept.
  // `playback`: entries after those of `room` happen at their times; whoever joins may watch and nothing else.
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

  // [owner of a driven runtime] Decides what is queued, keeps it, and tells of it. `now`: since any start, never falls.
  // `keep` false: that is left to a later tick, as by a slow disk.
  void tick(std::chrono::nanoseconds now, bool keep = true);

  // Runs `job` on the thread for slow requests, in order; it may call the functions below. Of a stopped runtime: at
  // once.
  void run_slowly(std::function<void()> job);
  // `answer` is called when it is durable, on the committing thread. Error unavailable: the room has stopped or keeps
  // nothing any more.
  void join(MemberKind kind, const std::string& name, const Digest& secret, Role role,
            std::function<void(const Result<AuthorId>&)> answer);
  // The same; waits, so not on the tick or the committing thread, nor of a driven runtime.
  [[nodiscard]] Result<AuthorId> join(MemberKind kind, const std::string& name = {}, const Digest& secret = {},
                                      Role role = Role::none);
  // What somebody who comes back was told is safe. It counts whoever says it: after a loss the author's number may be
  // another's, or nobody's. Errors: those of RoomStore::check_witness; unavailable (nobody keeps the room).
  [[nodiscard]] Result<void> check_kept(const Witness& kept);
  // Whether an earlier connection may go on. `kept`: what it was told is safe, if anything. Errors: first those of
  // check_kept; invalid_input (not the secret of which the author has the digest); denied (`role` is given, and the
  // author joined with another).
  [[nodiscard]] Result<void> resume(AuthorId author, const Digest& secret, const std::optional<Witness>& kept,
                                    std::optional<Role> role = {});
  [[nodiscard]] BoneStatus bone_status();
  // [thread for slow requests] All bodies' leaves, those that were taken away too, at one place of the order.
  struct Leaves {
    RoomSeq place;
    std::vector<FieldLeaf> leaves;
  };
  [[nodiscard]] Leaves leaves_now();
  void find_pieces();  // waits until what was cut so far is looked through, and its pieces are bodies
  [[nodiscard]] SavedFields saved_fields();  // of all bodies, at its room_seq
  // The subscriber hears every entry after those of its leaves. With the digest of the author's secret it takes the place of an
  // earlier session of his. Error: invalid_input (the author may not cut, or has an open session).
  [[nodiscard]] Result<void> open_session(const std::shared_ptr<SessionSubscriber>& subscriber, const Digest& secret = {});
  // From where its author looks at first; without a look it is sent the bone in full.
  void watch_mesh(MeshSubscriber& subscriber, const std::optional<ViewFrustum>& look = std::nullopt);
  // The newest of each viewer counts, until its last mesh stream ends. Of one without such a stream: nothing.
  void look(AuthorId viewer, const ViewFrustum& from);
  [[nodiscard]] bool draws_near() const;  // what Detail has come to mean here
  void watch_cutting(StateSubscriber& subscriber);
  // Whoever watches it, says how far they have heard, or asks who is there.
  [[nodiscard]] Presence& people();
  // Afterwards the subscriber hears nothing more. Unknown subscribers are none of its business.
  void leave(SessionSubscriber& subscriber);
  void leave(MeshSubscriber& subscriber);
  void leave(StateSubscriber& subscriber);

  // Queued until the next tick. The subscriber, kept alive until then, hears the outcome.
  void queue_cut(std::shared_ptr<SessionSubscriber> subscriber, Cut cut, Clock::time_point arrived);
  void offer_state(CuttingState state);                    // newest of its author wins
  void push_bone(AuthorId author, const MountLoad& push);  // likewise; of no effect where there is no mount
  // Queued until the next tick too, behind the cuts that came before. `answer` is called there and must return at once;
  // by then every session has been told. Error unavailable: the room has stopped.
  void queue_event(std::function<Result<RoomEvent>(Room&)> change,
                   std::function<void(const Result<RoomEvent>&)> answer);

  [[nodiscard]] bool stopped() const;  // takes no more, also where its store's journal does not
  // The process is about to stop: sessions, also those that are opened from now on, are told to come again after that
  // time, and go on until they have.
  void ask_to_redial(std::chrono::milliseconds after, const std::string& why);
  // As end_streams(), but so that sessions come again by themselves.
  void send_away(const std::string& why);
  void end_streams(const std::string& why);                 // those open now and those that come later
  void stop();                                              // joins the threads; what is queued is decided before
  [[nodiscard]] std::vector<FieldLeaf> all_leaves() const;  // Room::all_leaves(), of one that has stopped

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
