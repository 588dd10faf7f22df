#include "server/net/state_board.hpp"

#include <memory>
#include <utility>

#include "common/wire/convert.hpp"

namespace osteon {

void StateBoard::watch(CuttingSink& sink) {
  const std::lock_guard lock(mutex_);
  streams_.add(sink);
  if (newest_) sink.offer(newest_);
  if (ended_) sink.end(*ended_);
}

void StateBoard::leave(CuttingSink& sink) {
  const std::lock_guard lock(mutex_);
  streams_.remove(sink);
}

void StateBoard::end_streams(const std::string& why) {
  const std::lock_guard lock(mutex_);
  ended_ = why;
  streams_.each([&](CuttingSink& sink) { sink.end(why); });
}

std::size_t StateBoard::streams() const {
  const std::lock_guard lock(mutex_);
  return streams_.size();
}

void StateBoard::offer(CuttingState state) {
  const std::lock_guard lock(mutex_);
  Shown& shown = states_[state.author];
  shown = {std::move(state)};
  changed_ = true;
}

// A tool whose hand is gone stands still: readers must not go on sounding and drawing its last moment.
void StateBoard::session_over(AuthorId author) {
  const std::lock_guard lock(mutex_);
  const auto shown = states_.find(author);
  if (shown == states_.end()) return;
  CuttingState& state = shown->second.state;
  ++state.state_seq;
  state.phase = CuttingPhase::idle;
  state.spindle_rpm = state.feed_mm_per_s = state.engaged_fraction = state.torque_Nmm = 0;
  state.force_physical_N = Vec3::Zero();
  shown->second.over = true;
  changed_ = true;
}

void StateBoard::show(const std::vector<SceneItem>& items, const std::vector<BodyId>& bodies) {
  v1::WatchCuttingResponse scene;
  for (const SceneItem& item : items) *scene.add_items() = wire::to_wire(item);
  for (const BodyId body : bodies) scene.add_bodies(body.value);
  const std::lock_guard lock(mutex_);
  scene_ = scene.SerializeAsString();
  changed_ = true;
}

void StateBoard::publish(RoomSeq room_seq) {
  const std::lock_guard lock(mutex_);
  for (auto& [author, shown] : states_) shown.ticks_over += shown.over ? 1 : 0;
  if (std::erase_if(states_, [](const auto& entry) { return entry.second.ticks_over > kShowIdleTicks; }) > 0) changed_ = true;
  if (!std::exchange(changed_, false)) return;
  v1::WatchCuttingResponse response;
  response.set_room_seq(room_seq.value);
  for (const auto& [author, shown] : states_) *response.add_states() = wire::to_wire(shown.state);
  // Two messages of one kind behind each other are one message with the fields of both.
  newest_ = std::make_shared<const std::string>(response.SerializeAsString() + scene_);
  streams_.each([&](CuttingSink& sink) { sink.offer(newest_); });
}

std::vector<Vec3> StateBoard::tool_tips_mm() const {
  const std::lock_guard lock(mutex_);
  std::vector<Vec3> tips_mm;
  for (const auto& [author, shown] : states_)
    if (!shown.over) tips_mm.push_back(shown.state.pose_bone_tool.position_mm);
  return tips_mm;
}

}  // namespace osteon
