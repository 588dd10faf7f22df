// Publishes what viewers and audio clients are shown beside the surface: the newest state of every tool, the scene, the
// bodies. Sends it on its own thread, so that the room's tick does not depend on the number of readers.
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "common/geometry/pose.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"
#include "server/publish/send_queue.hpp"
#include "server/publish/subscriber.hpp"

namespace osteon {

// A WatchCuttingResponse in two parts. Each part is a WatchCuttingResponse by itself.
struct ShownNow {
  Bytes tools;  // every tool's state, at the room's sequence number
  Bytes scene;  // items and bodies
};

class StateSubscriber : public Subscriber {
 public:
  virtual void enqueue(const ShownNow& now) = 0;  // the newest wins
  // The author of the stream; null: unknown.
  [[nodiscard]] virtual AuthorId author() const { return {}; }
  // Least average time between two messages that it wants.
  [[nodiscard]] virtual std::chrono::nanoseconds apart() const { return {}; }
};

class StatePublisher {
 public:
  using Clock = std::chrono::steady_clock;
  // A tool whose session has ended is shown idle for this many ticks, so that every reader sees it stop.
  static constexpr std::uint64_t kShowIdleTicks = 1200;
  // Messages between two ticks at most, beside the tick's own. States that come faster wait for the tick, so there are
  // at most three messages for each tick.
  static constexpr int kSoonPerTick = 2;

  StatePublisher();
  ~StatePublisher() { stop(); }
  StatePublisher(const StatePublisher&) = delete;
  StatePublisher& operator=(const StatePublisher&) = delete;
  void stop();  // sends what was published, then joins the thread

  // Enqueues the newest message at once, and later ones until the subscriber leaves or all streams end.
  void watch(StateSubscriber& subscriber);
  void leave(StateSubscriber& subscriber);
  void end_streams(const std::string& why);  // those open now and those opened later
  [[nodiscard]] std::size_t streams() const;

  // Sends the states to sessions, on the thread of the publisher. Returns true to be called again with the next tick.
  using SendToSessions = std::function<bool(const std::vector<CuttingState>&)>;
  void set_session_sender(SendToSessions sender);

  void update(CuttingState state);  // the newest of its author wins, in the order of state_seq
  void session_over(AuthorId author);
  void show(const std::vector<SceneItem>& items, const std::vector<BodyId>& bodies);
  // [tick] Enqueues what has changed since the newest message, and what is still owed to slower readers.
  void publish(RoomSeq room_seq);
  // [any thread] The publisher's thread enqueues what has changed, without waiting for the tick, up to kSoonPerTick
  // times between two ticks. Beyond that the next publish() does it.
  void publish_soon(RoomSeq room_seq);
  [[nodiscard]] std::vector<Vec3> tool_tips_mm() const;  // of the tools that somebody holds

 private:
  struct Shown {
    CuttingState state;
    bool over = false;
    std::uint64_t ticks_over = 0;
  };
  struct Stream {
    StateSubscriber* subscriber;
    Pace pace;
    std::uint64_t enqueued = 0;  // the newest message in its queue
  };
  void run();
  void make_message_soon();
  [[nodiscard]] std::vector<CuttingState> states() const OSTEON_REQUIRES(states_mutex_);
  void set_newest(ShownNow message) OSTEON_REQUIRES(states_mutex_);
  void send(Clock::time_point now);
  static void enqueue(Stream& stream, std::uint64_t number, const ShownNow& shown, Clock::time_point now);

  mutable Mutex streams_mutex_{LockRank::state_streams};
  std::vector<Stream> streams_ OSTEON_GUARDED_BY(streams_mutex_);
  std::optional<std::string> ended_ OSTEON_GUARDED_BY(streams_mutex_);

  mutable Mutex states_mutex_{LockRank::leaf};
  CondVar wake_;
  std::map<AuthorId, Shown> states_ OSTEON_GUARDED_BY(states_mutex_);
  Bytes scene_ OSTEON_GUARDED_BY(states_mutex_) = std::make_shared<const std::string>();
  ShownNow newest_ OSTEON_GUARDED_BY(states_mutex_);           // nothing before the first message
  std::uint64_t number_ OSTEON_GUARDED_BY(states_mutex_) = 0;  // of the newest message, from 1
  bool changed_ OSTEON_GUARDED_BY(states_mutex_) = false;      // since the newest message was made
  bool due_ OSTEON_GUARDED_BY(states_mutex_) = false;          // to be sent
  bool soon_ OSTEON_GUARDED_BY(states_mutex_) = false;         // a message is to be made before the tick
  int soon_left_ OSTEON_GUARDED_BY(states_mutex_) = kSoonPerTick;
  RoomSeq room_seq_ OSTEON_GUARDED_BY(states_mutex_);   // of the newest call
  bool owed_ OSTEON_GUARDED_BY(states_mutex_) = false;  // a reader lacks the newest message and wants it later
  SendToSessions send_to_sessions_ OSTEON_GUARDED_BY(states_mutex_);
  bool end_ OSTEON_GUARDED_BY(states_mutex_) = false;

  std::thread thread_;
};

}  // namespace osteon
