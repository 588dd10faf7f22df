// The window's connection to a room. Whatever waits for the network runs on a thread of its own, so that the window
// never waits.
#pragma once
#include <QObject>
#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "viewer_client/net/room_subscription.hpp"
#include "viewer_client/scene/drawn_plan.hpp"
#include "viewer_client/scene/render_queue.hpp"
#include "viewer_client/scene/supervision_client.hpp"

namespace osteon {

class PeopleClient;

// [GUI thread], except for what runs inside.
class RoomLink : public QObject {
 public:
  struct Events {                   // all in the GUI thread
    std::function<void()> arrived;  // something waits in queue(); once until queue().take()
    std::function<void(const WatchedRoom&)> joined;
    std::function<void(const Error&)> ended;  // the room cannot be joined, or has refused the window for good
  };
  // A request to the room. It may wait; it runs on the link's own thread, one after the other.
  using Request = std::function<Result<RoomAnswer>(RoomSubscription&)>;
  using Answered = std::function<void(const Result<RoomAnswer>&)>;

  RoomLink(const RoomSubscriptionOptions& options, Events events);
  ~RoomLink() override;

  // `answered` runs in the GUI thread. Before the room is joined, it gets the error unavailable.
  void ask(Request request, Answered answered);
  // Changes what this window's user has drawn for all. The answer is the number of the new state, 0 if there is none.
  void draw(const DrawnPlan::Change& change, std::function<void(const Result<std::uint32_t>&)> answered);
  // What all people of the room have drawn, as far as the server says.
  [[nodiscard]] std::vector<Annotation> annotations() const;
  // The window's view; returns at once.
  void look(const ViewFrustum& from);
  // Asks the server something without an effect, unless the answer to the last time is still to come.
  void ping();
  [[nodiscard]] std::optional<double> round_trip_ms() const { return round_trip_ms_; }  // of the newest answer
  [[nodiscard]] RenderQueue& queue() { return queue_; }
  // Everybody in the room, as far as the server says. Empty until it does.
  [[nodiscard]] std::vector<PersonSeen> people() const;
  // The latest shots of everybody's C-arm, and who of the people this window is (null: not known yet).
  [[nodiscard]] std::vector<ShotRun> shots() const;
  [[nodiscard]] AuthorId self() const;
  [[nodiscard]] bool joined() const { return subscription_ != nullptr; }
  [[nodiscard]] bool interrupted() const { return subscription_ && subscription_->interrupted(); }
  [[nodiscard]] std::optional<Error> failure_seen() const;

 private:
  void work(const RoomSubscriptionOptions& options);
  // Runs it in the GUI thread, unless this object is gone by then.
  void in_gui(std::function<void()> call);

  Events events_;
  RenderQueue queue_;
  // Made by the own thread; the GUI thread has it from then on. Its functions may be called by both.
  std::unique_ptr<RoomSubscription> subscription_;

  PeopleClient* people_ = nullptr;  // the own thread's, which ends in the destructor
  std::optional<double> round_trip_ms_;
  bool pinging_ = false;

  std::atomic<bool> stop_ = false;
  Mutex mutex_{LockRank::leaf};
  CondVar changed_;
  std::deque<std::function<void(RoomSubscription&)>> jobs_ OSTEON_GUARDED_BY(mutex_);
  std::thread thread_;  // last: it uses the other members
};

}  // namespace osteon
