// Publishes the surface of a room's bone to viewers. One thread makes the blocks that events have changed and enqueues
// them to every open stream. Viewers take turns, so that no message waits behind those to all other viewers.
#pragma once
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/mutex.hpp"
#include "common/runtime/tick_stats.hpp"
#include "common/surface/view_frustum.hpp"
#include "server/publish/send_queue.hpp"
#include "server/publish/subscriber.hpp"
#include "server/publish/view_interest.hpp"
#include "server/room/room.hpp"

namespace osteon {

class MeshSubscriber : public Subscriber {
 public:
  [[nodiscard]] virtual AuthorId author() const { return {}; }
  virtual void begin(MeshUpdate whole_surface) = 0;
  virtual void enqueue(const MeshUpdate& update) = 0;
  virtual void send() {}  // sends what is in its queue: it is this stream's turn
};

// How much of the bone is drawn: all of it in full, or in full only what viewers look at and tools work on.
// `automatic`: near for a bone of more than kMostFullBlocks blocks, full otherwise.
enum class Detail : std::uint8_t { automatic, full, near };
inline constexpr std::size_t kMostFullBlocks = 4000;

struct MeshRates {
  std::chrono::nanoseconds mesh;   // least time between two messages to a viewer
  std::chrono::nanoseconds looks;  // least time between two updates of the surface for the views and tools
};

struct MeshHealth {
  DurationHistogram update;  // from a cut's arrival until its blocks' payloads were ready
  std::size_t streams = 0;
  std::size_t blocks = 0;
  std::size_t surface_bytes = 0;    // of the newest blocks: what a new viewer is sent
  std::size_t furthest_behind = 0;  // blocks that wait for the slowest reader
};

class MeshPublisher {
 public:
  using Clock = std::chrono::steady_clock;
  using ToolTips = std::function<std::vector<Vec3>()>;  // where tools are, mm
  // Up to this number of viewers, the surface is updated at the mesh rate. With more viewers, it is updated up to
  // Pace::kTurns times between two messages to one viewer.
  static constexpr std::size_t kTurnViewers = 16;

  MeshPublisher(Room& room, SharedMutex& room_mutex, MeshRates rates, Detail detail, ToolTips tool_tips_mm);
  ~MeshPublisher() { stop(); }
  MeshPublisher(const MeshPublisher&) = delete;
  MeshPublisher& operator=(const MeshPublisher&) = delete;

  // Call it before start(), when nobody else uses the room. Uses all processors. `progress` gets fractions from one
  // thread at a time.
  void make_whole_surface(const std::function<void(double)>& progress);
  void start();
  void stop();  // makes what is due, then joins the thread
  // [mesh thread; any other before start() and after stop()] Makes the stale blocks and enqueues them. If none is stale
  // and `due`, enqueues the room's sequence number alone. Then sends to the streams whose turn it is.
  void update(bool due);

  void changed(Clock::time_point arrived);  // a cut or event that arrived at that time has made blocks stale
  void wake();                              // there are events to publish

  // `look`: the author's first view. Without one, the subscriber is sent the whole bone in full.
  void watch(MeshSubscriber& subscriber, const std::optional<ViewFrustum>& look);
  void leave(MeshSubscriber& subscriber);
  // The newest view of each viewer counts until its last stream ends. Ignored for a viewer without a stream.
  void look(AuthorId viewer, const ViewFrustum& from);
  void end_streams(const std::string& why);  // those open now and those opened later

  [[nodiscard]] bool draws_near() const { return near_; }  // what Detail means here
  [[nodiscard]] MeshHealth health() const;
  [[nodiscard]] Digest surface_hash() const;  // of the newest blocks

 private:
  struct Stream {
    MeshSubscriber* subscriber;
    Pace pace;
    bool owed = false;  // its queue has something that was not sent yet
  };
  void run();
  void follow_looks(Clock::time_point now);
  void make_stale_blocks(bool due);
  void send_owed(Clock::time_point now);

  Room& room_;
  SharedMutex& room_mutex_;
  const MeshRates rates_;
  const bool near_;  // draws in full only near viewers and tools
  const ToolTips tool_tips_mm_;

  mutable Mutex surface_mutex_{LockRank::surface};
  std::vector<Stream> streams_ OSTEON_GUARDED_BY(surface_mutex_);
  BlockStore store_ OSTEON_GUARDED_BY(surface_mutex_);
  MeshUpdate surface_ OSTEON_GUARDED_BY(surface_mutex_);  // every block with a surface, serialised
  std::optional<std::string> ended_ OSTEON_GUARDED_BY(surface_mutex_);
  ViewInterest view_interest_;     // has a lock of its own
  Clock::time_point next_look_{};  // used by the mesh thread, as is the next
  bool owed_ = false;              // something is owed to some stream
  int turns_ = 1;

  Mutex wake_mutex_{LockRank::leaf};
  CondVar wake_;
  // Arrivals of events whose blocks are not made yet.
  std::vector<Clock::time_point> unmeshed_ OSTEON_GUARDED_BY(wake_mutex_);
  bool due_ OSTEON_GUARDED_BY(wake_mutex_) = false, end_ OSTEON_GUARDED_BY(wake_mutex_) = false;
  bool fresh_ OSTEON_GUARDED_BY(wake_mutex_) = false;  // woken since it was last set to false

  mutable Mutex stats_mutex_{LockRank::leaf};
  DurationHistogram update_ OSTEON_GUARDED_BY(stats_mutex_);

  std::thread thread_;
};

}  // namespace osteon
