#include "viewer_client/desktop/room_link.hpp"

#include <QCoreApplication>
#include <QMetaObject>
#include <chrono>
#include <utility>

#include "viewer_client/net/people_client.hpp"

namespace osteon {

RoomLink::RoomLink(const RoomSubscriptionOptions& options, Events events) : events_(std::move(events)) {
  queue_.set_wake([this] { in_gui(events_.arrived); });
  thread_ = std::thread([this, options] { work(options); });
}

RoomLink::~RoomLink() {
  stop_ = true;
  // A request whose answer does not come would hold the thread for seconds.
  if (subscription_) subscription_->end();
  changed_.notify_all();
  thread_.join();
  // A subscription that was made just now may still wait in an event for the GUI thread. Its threads write into the
  // queue, so it ends before the queue does.
  QCoreApplication::removePostedEvents(this);
}

void RoomLink::in_gui(std::function<void()> call) {
  QMetaObject::invokeMethod(this, std::move(call), Qt::QueuedConnection);
}

void RoomLink::work(const RoomSubscriptionOptions& options) {
  auto started = RoomSubscription::start(options, queue_, [this] { return stop_.load(); });
  if (!started) {
    in_gui([this, error = started.error()] { events_.ended(error); });
    return;
  }
  RoomSubscription& subscription = **started;
  // std::function copies, so the pointer travels in something that can be copied.
  auto made = std::make_shared<std::unique_ptr<RoomSubscription>>(std::move(*started));
  in_gui([this, made] {
    subscription_ = std::move(*made);
    events_.joined(subscription_->room());
  });
  // If the server sends nothing about its people, the window shows the room all the same.
  PeopleClientOptions people_options{.address = options.address, .patience = options.patience};
  people_options.window = [&subscription] { return subscription.joined(); };
  const auto people = PeopleClient::start(people_options, [this] { return stop_.load(); });
  if (people) in_gui([this, client = people->get()] { people_ = client; });
  using namespace std::chrono_literals;
  while (!stop_) {
    std::function<void(RoomSubscription&)> job;
    {
      MutexLock lock(mutex_);
      // Wakes now and then, so that a stop between the check and the wait is seen.
      changed_.wait_for(lock, 200ms, [this]() OSTEON_REQUIRES(mutex_) { return !jobs_.empty() || stop_; });
      if (jobs_.empty() || stop_) continue;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job(subscription);
  }
  // If the GUI thread never ran the call above, `made` still has the subscription. It outlives every job here.
}

std::vector<PersonSeen> RoomLink::people() const {
  return people_ != nullptr ? people_->people() : std::vector<PersonSeen>();
}

std::vector<ShotRun> RoomLink::shots() const { return people_ != nullptr ? people_->shots() : std::vector<ShotRun>(); }

AuthorId RoomLink::self() const { return people_ != nullptr ? people_->self() : AuthorId{}; }

std::vector<Annotation> RoomLink::annotations() const {
  return people_ != nullptr ? people_->annotations() : std::vector<Annotation>();
}

void RoomLink::draw(const DrawnPlan::Change& change, std::function<void(const Result<std::uint32_t>&)> answered) {
  if (people_ == nullptr) return answered(failure(ErrorCode::unavailable, "there is no room yet"));
  {
    const MutexLock lock(mutex_);
    jobs_.push_back([this, people = people_, change, answered = std::move(answered)](RoomSubscription& room) {
      const PlanRequests requests{[&room](const Annotation& drawn) { return room.draw(drawn); },
                                  [&room](std::uint32_t id) { return room.wipe_off(id); }};
      const Result<std::uint32_t> answer = carry_out(change, people->annotations(), people->self(), requests);
      in_gui([answered, answer] { answered(answer); });
    });
  }
  changed_.notify_all();
}

void RoomLink::ask(Request request, Answered answered) {
  if (!joined()) return answered(failure(ErrorCode::unavailable, "there is no room yet"));
  {
    const MutexLock lock(mutex_);
    jobs_.push_back([this, request = std::move(request), answered = std::move(answered)](RoomSubscription& room) {
      const Result<RoomAnswer> answer = request(room);
      in_gui([answered, answer] { answered(answer); });
    });
  }
  changed_.notify_all();
}

void RoomLink::look(const ViewFrustum& from) {
  if (subscription_) subscription_->look(from);
}

// The time is that of the request alone, without its wait for others before it.
void RoomLink::ping() {
  if (!joined() || interrupted() || pinging_) return;
  pinging_ = true;
  const auto took_ms = std::make_shared<double>(0.0);  // of the own thread, then of the GUI thread
  ask(
      [took_ms](RoomSubscription& room) {
        const auto start = std::chrono::steady_clock::now();
        Result<RoomAnswer> answer = room.ping();
        *took_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        return answer;
      },
      [this, took_ms](const Result<RoomAnswer>& answer) {
        pinging_ = false;
        round_trip_ms_ = answer ? std::optional(*took_ms) : std::nullopt;
      });
}

std::optional<Error> RoomLink::failure_seen() const {
  return subscription_ ? subscription_->failure_seen() : std::nullopt;
}

}  // namespace osteon
