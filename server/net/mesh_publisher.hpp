// The surface of a room's bone as viewers hold it: one thread makes the blocks that events have changed and offers them
// to every open stream. Viewers take turns, so that no message waits behind those to all the others.
#pragma once
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/core/digest.hpp"
#include "common/runtime/tick_stats.hpp"
#include "common/surface/view_frustum.hpp"
#include "server/net/send_queue.hpp"
#include "server/net/subscriber.hpp"
#include "server/net/view_interest.hpp"
#include "server/room/room.hpp"

namespace osteon {

class MeshSubscriber : public Subscriber {
 public:
  [[nodiscard]] virtual AuthorId author() const { return {}; }
  virtual void begin(MeshUpdate whole_surface) = 0;
  virtual void offer(const MeshUpdate& update) = 0;
  virtual void send() {}  // what it was offered: this stream's turn has come
};

// How much of the bone is drawn: all of it in full, or in full only what viewers look at and tools work on.
// `automatic`: near for a bone of more than kMostFullBlocks blocks, full otherwise.
enum class Detail : std::uint8_t { automatic, full, near };
inline constexpr std::size_t kMostFullBlocks = 4000;

struct MeshRates {
  std::chrono::nanoseconds mesh;   // between two messages to a viewer
  std::chrono::nanoseconds looks;  // at most so often the surface follows the looks of viewers and the tools
};

struct MeshHealth {
  DurationHistogram update;  // from a cut's arrival until its blocks' payloads were ready
  std::size_t streams = 0;
  std::size_t blocks = 0;
  std::size_t surface_bytes = 0;    // of the newest blocks: what a viewer that joins is sent
  std::size_t furthest_behind = 0;  // blocks that wait for the slowest reader
};

// Lock order: the room's, then the surface's, then a stream's own. The others are never held with another.
class MeshPublisher {
 public:
  using Clock = std::chrono::steady_clock;
  using ToolTips = std::function<std::vector<Vec3>()>;  // where tools are, mm
  // The surface is brought up to date at the mesh rate for so many viewers; for more of them in up to Pace::kTurns
  // turns between two messages to one.
  static constexpr std::size_t kTurnViewers = 16;

  MeshPublisher(Room& room, std::shared_mutex& room_mutex, MeshRates rates, Detail detail, ToolTips tool_tips_mm);
  ~MeshPublisher() { stop(); }
  MeshPublisher(const MeshPublisher&) = delete;
  MeshPublisher& operator=(const MeshPublisher&) = delete;

  // Before start(), on all processors: nobody else uses the room. `progress` hears fractions from one thread at a time.
  void make_whole_surface(const std::function<void(double)>& progress);
  void start();
  void stop();  // makes what is due, then joins the thread
  // [mesh thread; any other before start() and after stop()] Makes the stale blocks and offers them; where none is
  // stale and `due`, the room's place alone. Then sends to those whose turn it is.
  void update(bool due);

  void changed(Clock::time_point arrived);  // a cut or event that arrived then has made blocks stale
  void wake();                              // there are events to tell of

  // From where its author looks at first; without a look it is sent the bone in full.
  void watch(MeshSubscriber& subscriber, const std::optional<ViewFrustum>& look);
  void leave(MeshSubscriber& subscriber);
  // The newest of each viewer counts, until its last stream ends. Of one without a stream: nothing.
  void look(AuthorId viewer, const ViewFrustum& from);
  void end_streams(const std::string& why);  // those open now and those that come later

  [[nodiscard]] bool draws_near() const { return near_; }  // what Detail has come to mean here
  [[nodiscard]] MeshHealth health() const;
  [[nodiscard]] Digest surface_hash() const;  // of the newest blocks

 private:
  struct Stream {
    MeshSubscriber* subscriber;
    Pace pace;
    bool owed = false;  // it was offered something that it was not sent
  };
  void run();
  void follow_looks(Clock::time_point now);
  void make_stale_blocks(bool due);
  void send_owed(Clock::time_point now);

  Room& room_;
  std::shared_mutex& room_mutex_;
  const MeshRates rates_;
  const bool near_;  // in full only near viewers and tools
  const ToolTips tool_tips_mm_;

  mutable std::mutex surface_mutex_;
  std::vector<Stream> streams_;
  BlockStore store_;
  MeshUpdate surface_;  // every block with a surface, as it travels
  std::optional<std::string> ended_;
  ViewInterest view_interest_;     // has a lock of its own
  Clock::time_point next_look_{};  // of the mesh thread, as is the next
  bool owed_ = false;              // to some stream
  int turns_ = 1;

  std::mutex wake_mutex_;
  std::condition_variable wake_;
  std::vector<Clock::time_point> unmeshed_;  // arrivals of events whose blocks are not made yet
  bool due_ = false, end_ = false;
  bool fresh_ = false;  // woken since it was set to false

  mutable std::mutex stats_mutex_;
  DurationHistogram update_;

  std::thread thread_;
};

}  // namespace osteon
