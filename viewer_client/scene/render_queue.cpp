#include "viewer_client/scene/render_queue.hpp"

#include <utility>

namespace osteon {

namespace {
// Arrivals are measurements for the log. If the render thread stalls for half a minute, the newest ones are kept.
constexpr std::size_t kMostArrivals = 1024;
}  // namespace

void RenderQueue::begin_stream() {
  const MutexLock lock(mutex_);
  next_.snapshot_begun = true;
  next_.snapshot_complete = false;
  next_.blocks.clear();
  next_.arrivals.clear();
}

void RenderQueue::put_mesh(RoomSeq room_seq, std::vector<ReceivedBlock> blocks, bool snapshot_complete,
                           std::uint32_t snapshot_blocks, std::int64_t received_mono_ns) {
  bool first = false;
  {
    const MutexLock lock(mutex_);
    for (ReceivedBlock& block : blocks) {
      auto [place, fresh] = next_.blocks.try_emplace(block.key);
      if (fresh || block.version > place->second.version) place->second = std::move(block);
    }
    next_.snapshot_complete = next_.snapshot_complete || snapshot_complete;
    if (snapshot_blocks != 0) next_.snapshot_blocks = snapshot_blocks;
    next_.room_seq = room_seq;
    next_.any_mesh = true;
    if (next_.arrivals.size() == kMostArrivals) next_.arrivals.erase(next_.arrivals.begin());
    next_.arrivals.push_back({room_seq, received_mono_ns});
    first = !std::exchange(waiting_, true);
  }
  announce(first);
}

void RenderQueue::put_tool(Tool tool) {
  const MutexLock lock(mutex_);
  next_.tools.push_back(std::move(tool));
}

void RenderQueue::put_plan(SurgicalPlan plan) {
  bool first = false;
  {
    const MutexLock lock(mutex_);
    next_.plan = std::make_shared<const SurgicalPlan>(std::move(plan));
    first = !std::exchange(waiting_, true);
  }
  announce(first);
}

void RenderQueue::put_density(DensityGrid density) {
  bool first = false;
  {
    const MutexLock lock(mutex_);
    next_.density = std::make_shared<const DensityGrid>(std::move(density));
    first = !std::exchange(waiting_, true);
  }
  announce(first);
}

void RenderQueue::put_plan_fault(std::string sentence) {
  bool first = false;
  {
    const MutexLock lock(mutex_);
    next_.plan_fault = std::move(sentence);
    first = !std::exchange(waiting_, true);
  }
  announce(first);
}

void RenderQueue::put_states(std::vector<CuttingState> states, std::vector<SceneItem> items,
                             std::vector<BodyId> bodies) {
  bool first = false;
  {
    const MutexLock lock(mutex_);
    next_.states = std::move(states);
    next_.items = std::move(items);
    next_.bodies = std::move(bodies);
    next_.any_states = true;
    first = !std::exchange(waiting_, true);
  }
  announce(first);
}

void RenderQueue::announce(bool first) {
  arrived_.notify_one();
  if (first && wake_) wake_();
}

Delivery RenderQueue::take() {
  const MutexLock lock(mutex_);
  waiting_ = false;
  return std::exchange(next_, Delivery{});
}

void RenderQueue::wait_for(std::chrono::milliseconds time) {
  MutexLock lock(mutex_);
  arrived_.wait_for(lock, time, [this]() OSTEON_REQUIRES(mutex_) { return waiting_; });
}

}  // namespace osteon
