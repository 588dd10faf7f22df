// What viewers and audio clients are shown beside the surface: the newest state of every tool, the scene, the bodies. A
// thread of its own tells them, so that the room's tick never waits for how many there are.
#pragma once
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/id.hpp"
#include "common/geometry/pose.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"
#include "server/net/send_queue.hpp"
#include "server/net/subscriber.hpp"

namespace osteon {

// A WatchCuttingResponse in two parts, each of which is one by itself.
struct ShownNow {
  Bytes tools;  // every tool's state, at the room's place
  Bytes scene;  // items and bodies
};

class StateSubscriber : public Subscriber {
 public:
  virtual void offer(const ShownNow& now) = 0;  // newest wins
  // Whose stream it is; null: nobody knows.
  [[nodiscard]] virtual AuthorId author() const { return {}; }
  // It wants them no closer together, on average.
  [[nodiscard]] virtual std::chrono::nanoseconds apart() const { return {}; }
};

// Lock order: the room's, then that of the streams, then a stream's own or that of the states.
class StatePublisher {
 public:
  using Clock = std::chrono::steady_clock;
  // A tool whose session is over is shown idle for so many ticks, so that every reader sees it stop.
  static constexpr std::uint64_t kShowIdleTicks = 1200;

  StatePublisher();
  ~StatePublisher() { stop(); }
  StatePublisher(const StatePublisher&) = delete;
  StatePublisher& operator=(const StatePublisher&) = delete;
  void stop();  // tells what was published, then joins the thread

  // The subscriber is offered the newest message at once, and later ones until it leaves or all streams end.
  void watch(StateSubscriber& subscriber);
  void leave(StateSubscriber& subscriber);
  void end_streams(const std::string& why);  // those open now and those that come later
  [[nodiscard]] std::size_t streams() const;

  // Whoever holds a tool is told of the others' on the board's thread: true, and it is called again with the next tick.
  using TellHands = std::function<bool(const std::vector<CuttingState>&)>;
  void tell_hands(TellHands tell);

  void offer(CuttingState state);  // newest of its author wins
  void session_over(AuthorId author);
  void show(const std::vector<SceneItem>& items, const std::vector<BodyId>& bodies);
  // [tick] What changed since the last call is told from now on, and what is still owed to those who want it seldom.
  void publish(RoomSeq room_seq);
  [[nodiscard]] std::vector<Vec3> tool_tips_mm() const;  // of the tools in a hand

 private:
  struct Shown {
    CuttingState state;
    bool over = false;
    std::uint64_t ticks_over = 0;
  };
  struct Stream {
    StateSubscriber* subscriber;
    Pace pace;
    std::uint64_t told = 0;  // the newest message that it was offered
  };
  void run();
  void tell(Clock::time_point now);
  static void offer(Stream& stream, std::uint64_t number, const ShownNow& shown, Clock::time_point now);

  mutable std::mutex streams_mutex_;
  std::vector<Stream> streams_;
  std::optional<std::string> ended_;

  mutable std::mutex states_mutex_;
  std::condition_variable wake_;
  std::map<AuthorId, Shown> states_;
  Bytes scene_ = std::make_shared<const std::string>();
  ShownNow newest_;           // nothing before the first
  std::uint64_t number_ = 0;  // of the newest, from 1
  bool changed_ = false;      // since it was made
  bool due_ = false;          // to be told
  bool owed_ = false;         // someone lacks the newest, who wants it later
  TellHands tell_hands_;
  bool end_ = false;

  std::thread thread_;
};

}  // namespace osteon
