#include "server/publish/mesh_publisher.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "server/publish/session_messages.hpp"

namespace osteon {
namespace {

constexpr Coord kFirstCoord{INT32_MIN, INT32_MIN, INT32_MIN};  // before every block of a level

}  // namespace

MeshPublisher::MeshPublisher(Room& room, SharedMutex& room_mutex, MeshRates rates, Detail detail, ToolTips tool_tips_mm)
    : room_(room),
      room_mutex_(room_mutex),
      rates_(rates),
      near_(detail == Detail::near || (detail == Detail::automatic && room.bone_blocks().size() > kMostFullBlocks)),
      tool_tips_mm_(std::move(tool_tips_mm)) {}

void MeshPublisher::make_whole_surface(const std::function<void(double)>& progress) {
  if (near_) room_.focus({focus_on_nothing()});
  std::vector<BlockKey> keys = room_.bone_blocks();
  for (const BlockKey& key : room_.take_stale_blocks()) keys.push_back(key);  // fine blocks of fields that were loaded
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<BlockPayload> payloads(keys.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&](bool reports) {
    for (std::size_t i = next++; i < keys.size(); i = next++) {
      payloads[i] = make_block(room_.gather_block(keys[i]));
      if (reports && progress) progress(static_cast<double>(i) / static_cast<double>(keys.size()));
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (unsigned i = 1; i < std::max(1u, std::thread::hardware_concurrency()); ++i) helpers.emplace_back(work, false);
    work(true);
  }
  const MutexLock lock(surface_mutex_);
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (const StoredBlock* block = store_.put(keys[i], std::move(payloads[i])))
      surface_.blocks[keys[i]] = block_message(keys[i], *block);
  surface_.room_seq = room_.room_seq();
  if (progress) progress(1.0);
}

void MeshPublisher::start() {
  thread_ = std::thread([this] { run(); });
}

void MeshPublisher::stop() {
  {
    const MutexLock lock(wake_mutex_);
    end_ = true;
    wake_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void MeshPublisher::run() {
  const auto about = rates_.mesh / (2 * Pace::kTurns);
  Clock::time_point next{};
  bool due = false;
  while (true) {
    {
      MutexLock lock(wake_mutex_);
      const auto called = [&]() OSTEON_REQUIRES(wake_mutex_) { return due_ || end_; };
      if (near_ && !owed_)  // tools move without waking this thread
        wake_.wait_for(lock, rates_.looks, called);
      else if (!owed_)
        while (!due_ && !end_) wake_.wait(lock);
      if (!due_ && end_) return;
      // The first of several cuts is shown at once, later ones at the mesh rate. The update waits for the tick near
      // that time, so that the cuts of that tick are sent at once.
      if (Clock::now() < next) {
        wake_.wait_until(lock, next - about, [&]() OSTEON_REQUIRES(wake_mutex_) { return end_; });
        fresh_ = false;
        wake_.wait_until(lock, next + about, [&]() OSTEON_REQUIRES(wake_mutex_) { return fresh_ || end_; });
      }
      due = std::exchange(due_, false);
    }
    next = Clock::now() + rates_.mesh / turns_;
    update(due);
  }
}

void MeshPublisher::changed(Clock::time_point arrived) {
  const MutexLock lock(wake_mutex_);
  unmeshed_.push_back(arrived);
}

void MeshPublisher::wake() {
  const MutexLock lock(wake_mutex_);
  due_ = fresh_ = true;
  wake_.notify_one();
}

// [mesh thread]
void MeshPublisher::follow_looks(Clock::time_point now) {
  if (!near_ || now < next_look_) return;
  next_look_ = now + rates_.looks;
  auto focuses = view_interest_.focuses(room_.bone().pitch_mm(), tool_tips_mm_());
  if (!focuses) return;
  const WriterLock lock(room_mutex_);
  room_.focus(std::move(*focuses));
}

void MeshPublisher::update(bool due) {
  const auto now = Clock::now();
  follow_looks(now);
  make_stale_blocks(due);
  send_owed(now);
}

void MeshPublisher::make_stale_blocks(bool due) {
  std::vector<BlockKey> keys;
  std::vector<BodyId> bodies_now;
  std::vector<Clock::time_point> arrivals;
  MeshUpdate update;
  {
    // Takes the arrivals first. A cut that comes between is then measured with the next blocks, never before its own
    // are made.
    const MutexLock lock(wake_mutex_);
    std::swap(arrivals, unmeshed_);
  }
  {
    const WriterLock lock(room_mutex_);
    keys = room_.take_stale_blocks();
    update.room_seq = room_.room_seq();
    bodies_now = room_.bodies();
  }
  if (!due && keys.empty()) return;

  // The room goes on between two blocks. A block that it changes meanwhile becomes stale and is made again.
  std::vector<BlockPayload> payloads;
  payloads.reserve(keys.size());
  for (const BlockKey& key : keys) {
    const std::optional<BlockSamples> samples = [&] {
      const ReaderLock lock(room_mutex_);
      return room_.find_field(key.body) ? std::optional(room_.gather_block(key)) : std::nullopt;
    }();
    payloads.push_back(samples ? make_block(*samples) : BlockPayload{});
  }

  {
    const MutexLock lock(surface_mutex_);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const StoredBlock* block = store_.put(keys[i], std::move(payloads[i]));
      if (!block) continue;
      const Bytes message = block_message(keys[i], *block);
      update.blocks[keys[i]] = message;
      if (block->payload.bytes.empty())
        surface_.blocks.erase(keys[i]);
      else
        surface_.blocks[keys[i]] = message;
    }
    // The blocks of bodies that no longer exist go too.
    std::vector<BlockKey> gone;
    for (auto block = surface_.blocks.begin(); block != surface_.blocks.end();) {
      const BodyId body = block->first.body;
      const auto next_body = surface_.blocks.lower_bound({BodyId{body.value + 1}, kCoarsestLevel, kFirstCoord});
      if (!std::ranges::binary_search(bodies_now, body))
        for (; block != next_body; ++block) gone.push_back(block->first);
      block = next_body;
    }
    for (const BlockKey& key : gone) {
      surface_.blocks.erase(key);
      if (const StoredBlock* block = store_.put(key, {})) update.blocks[key] = block_message(key, *block);
    }
    surface_.room_seq = update.room_seq;
    for (Stream& stream : streams_) {
      stream.subscriber->enqueue(update);
      stream.owed = true;
    }
    owed_ = !streams_.empty();
  }
  const auto ready = Clock::now();
  const MutexLock lock(stats_mutex_);
  for (const Clock::time_point arrived : arrivals) update_.record(ready - arrived);
}

void MeshPublisher::send_owed(Clock::time_point now) {
  if (!std::exchange(owed_, false)) return;
  const MutexLock lock(surface_mutex_);
  turns_ = std::min(Pace::kTurns, 1 + static_cast<int>(streams_.size() / kTurnViewers));
  for (Stream& stream : streams_) {
    if (!stream.owed) continue;
    if (!stream.pace.due(now)) {
      owed_ = true;
      continue;
    }
    stream.owed = false;
    stream.pace.done(now);
    stream.subscriber->send();
  }
}

void MeshPublisher::watch(MeshSubscriber& subscriber, const std::optional<ViewFrustum>& look) {
  {
    const MutexLock lock(surface_mutex_);
    streams_.push_back({&subscriber, Pace(rates_.mesh, streams_.size())});
    view_interest_.open(subscriber.author(), look);
    // Sends the blocks that exist. The finer blocks that this viewer's view needs follow.
    subscriber.begin(surface_);
    if (ended_) subscriber.end(*ended_);
  }
  wake();
}

void MeshPublisher::leave(MeshSubscriber& subscriber) {
  const MutexLock lock(surface_mutex_);
  if (std::erase_if(streams_, [&](const Stream& stream) { return stream.subscriber == &subscriber; }) > 0)
    view_interest_.close(subscriber.author());
}

void MeshPublisher::look(AuthorId viewer, const ViewFrustum& from) {
  if (view_interest_.look(viewer, from)) wake();
}

void MeshPublisher::end_streams(const std::string& why) {
  const MutexLock lock(surface_mutex_);
  ended_ = why;
  for (const Stream& stream : streams_) stream.subscriber->end(why);
}

MeshHealth MeshPublisher::health() const {
  MeshHealth health;
  {
    const MutexLock lock(surface_mutex_);
    health.streams = streams_.size();
    health.blocks = surface_.blocks.size();
    for (const auto& [key, message] : surface_.blocks) health.surface_bytes += message->size();
    for (const Stream& stream : streams_)
      health.furthest_behind = std::max(health.furthest_behind, stream.subscriber->waiting());
  }
  const MutexLock lock(stats_mutex_);
  health.update = update_;
  return health;
}

Digest MeshPublisher::surface_hash() const {
  const MutexLock lock(surface_mutex_);
  return store_.hash();
}

}  // namespace osteon
