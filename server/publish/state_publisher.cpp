#include "server/publish/state_publisher.hpp"

#include <algorithm>
#include <memory>
#include <ranges>
#include <utility>

#include "common/wire/convert.hpp"

namespace osteon {
namespace {

Bytes tools_message(RoomSeq room_seq, const auto& states) {
  v1::WatchCuttingResponse response;
  response.set_room_seq(room_seq.value);
  for (const CuttingState& state : states) *response.add_states() = wire::to_wire(state);
  return serialised(response);
}

}  // namespace

StatePublisher::StatePublisher() : thread_([this] { run(); }) {}

void StatePublisher::stop() {
  {
    const MutexLock lock(states_mutex_);
    end_ = true;
    wake_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void StatePublisher::watch(StateSubscriber& subscriber) {
  const MutexLock lock(streams_mutex_);
  Stream& stream = streams_.emplace_back(Stream{&subscriber, Pace(subscriber.apart(), streams_.size())});
  MutexLock states_lock(states_mutex_);
  const ShownNow shown = newest_;
  const std::uint64_t number = number_;
  states_lock.unlock();
  if (number > 0) enqueue(stream, number, shown, Clock::now());
  if (ended_) subscriber.end(*ended_);
}

void StatePublisher::leave(StateSubscriber& subscriber) {
  const MutexLock lock(streams_mutex_);
  std::erase_if(streams_, [&](const Stream& stream) { return stream.subscriber == &subscriber; });
}

void StatePublisher::end_streams(const std::string& why) {
  const MutexLock lock(streams_mutex_);
  ended_ = why;
  for (const Stream& stream : streams_) stream.subscriber->end(why);
}

std::size_t StatePublisher::streams() const {
  const MutexLock lock(streams_mutex_);
  return streams_.size();
}

void StatePublisher::set_session_sender(SendToSessions sender) {
  const MutexLock lock(states_mutex_);
  send_to_sessions_ = std::move(sender);
}

// A client whose fast path has just begun sends one state by both ways, and a datagram may arrive late.
void StatePublisher::update(CuttingState state) {
  const MutexLock lock(states_mutex_);
  const auto shown = states_.find(state.author);
  if (shown != states_.end() && !shown->second.over && state.state_seq <= shown->second.state.state_seq) return;
  states_[state.author] = {std::move(state)};
  changed_ = true;
}

// The tool of an ended session is shown idle, so that readers do not go on sounding and drawing its last moment.
void StatePublisher::session_over(AuthorId author) {
  const MutexLock lock(states_mutex_);
  const auto shown = states_.find(author);
  if (shown == states_.end()) return;
  CuttingState& state = shown->second.state;
  ++state.state_seq;
  state.phase = CuttingPhase::idle;
  state.spindle_rpm = state.feed_mm_per_s = state.density_g_cm3 = state.engaged_fraction = state.torque_Nmm = 0;
  state.cortex_mm = 0;
  state.force_physical_N = Vec3::Zero();
  state.force_hand_N = state.device_holds_N = 0;
  state.on_metal = state.irrigation = state.suction = false;
  shown->second.over = true;
  changed_ = true;
}

void StatePublisher::show(const std::vector<SceneItem>& items, const std::vector<BodyId>& bodies) {
  v1::WatchCuttingResponse scene;
  for (const SceneItem& item : items) *scene.add_items() = wire::to_wire(item);
  for (const BodyId body : bodies) scene.add_bodies(body.value);
  const MutexLock lock(states_mutex_);
  scene_ = serialised(scene);
  changed_ = true;
}

std::vector<CuttingState> StatePublisher::states() const {
  std::vector<CuttingState> states;
  for (const auto& [author, shown] : states_) states.push_back(shown.state);
  return states;
}

void StatePublisher::set_newest(ShownNow message) {
  newest_ = std::move(message);
  ++number_;
  due_ = true;
}

void StatePublisher::publish_soon(RoomSeq room_seq) {
  const MutexLock lock(states_mutex_);
  room_seq_ = std::max(room_seq_, room_seq);
  if (!changed_ || soon_ || soon_left_ == 0) return;
  --soon_left_;
  soon_ = true;
  wake_.notify_one();
}

// Serialises without the lock, for which the tick would wait.
void StatePublisher::make_message_soon() {
  MutexLock lock(states_mutex_);
  if (!std::exchange(soon_, false) || !std::exchange(changed_, false)) return;
  const std::vector<CuttingState> shown = states();
  const RoomSeq room_seq = room_seq_;
  const Bytes scene = scene_;
  const std::uint64_t number = number_;
  lock.unlock();
  ShownNow message{tools_message(room_seq, shown), scene};
  lock.lock();
  // A message that the tick has made meanwhile has these states, or newer ones.
  if (number_ == number) set_newest(std::move(message));
}

void StatePublisher::publish(RoomSeq room_seq) {
  const MutexLock lock(states_mutex_);
  room_seq_ = std::max(room_seq_, room_seq);
  soon_left_ = kSoonPerTick;
  for (auto& [author, shown] : states_) shown.ticks_over += shown.over ? 1 : 0;
  if (std::erase_if(states_, [](const auto& entry) { return entry.second.ticks_over > kShowIdleTicks; }) > 0)
    changed_ = true;
  if (std::exchange(changed_, false))
    set_newest({tools_message(room_seq_, states_ | std::views::values | std::views::transform(&Shown::state)), scene_});
  due_ = due_ || owed_;
  if (due_) wake_.notify_one();
}

void StatePublisher::run() {
  MutexLock lock(states_mutex_);
  while (true) {
    while (!due_ && !soon_ && !end_) wake_.wait(lock);
    if (!due_ && !soon_) return;
    lock.unlock();
    make_message_soon();
    send(Clock::now());
    lock.lock();
    if (!send_to_sessions_) continue;
    const SendToSessions send = send_to_sessions_;
    const std::vector<CuttingState> shown = states();
    lock.unlock();
    const bool owed = send(shown);
    lock.lock();
    owed_ |= owed;
  }
}

// If sending to everyone takes longer than a tick, the next round sends the newest state and skips those between.
void StatePublisher::send(Clock::time_point now) {
  const MutexLock lock(streams_mutex_);
  MutexLock states_lock(states_mutex_);
  const ShownNow shown = newest_;
  const std::uint64_t number = number_;
  due_ = false;
  states_lock.unlock();
  bool owed = false;
  for (Stream& stream : streams_) {
    if (stream.enqueued == number) continue;
    if (stream.pace.due(now))
      enqueue(stream, number, shown, now);
    else
      owed = true;
  }
  states_lock.lock();
  owed_ = owed;
}

void StatePublisher::enqueue(Stream& stream, std::uint64_t number, const ShownNow& shown, Clock::time_point now) {
  stream.enqueued = number;
  stream.pace.done(now);
  stream.subscriber->enqueue(shown);
}

std::vector<Vec3> StatePublisher::tool_tips_mm() const {
  const MutexLock lock(states_mutex_);
  std::vector<Vec3> tips_mm;
  for (const auto& [author, shown] : states_)
    if (!shown.over) tips_mm.push_back(shown.state.pose_bone_tool.position_mm);
  return tips_mm;
}

}  // namespace osteon
