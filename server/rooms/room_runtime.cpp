#include "server/rooms/room_runtime.hpp"

#include <thread>
#include <utility>
#include <variant>

#include "common/core/check.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/runtime/periodic.hpp"
#include "server/rooms/runtime_impl.hpp"

namespace osteon {
namespace {

using Clock = RoomRuntime::Clock;

// Largest number of entries repeated in one tick. So the surface and the health of a fast playback are published while
// it goes on.
constexpr int kEntriesPlayedPerTick = 256;

}  // namespace

bool RoomRuntime::Impl::tick(std::chrono::nanoseconds now, bool last) {
  {
    const MutexLock lock(queue_mutex);
    std::swap(batch, queue);
    queue_closed = last;
  }
  if (!player) room.set_time(now);
  if (mount) move_bone(now);
  for (Queued& queued : batch) std::visit([this](auto& one) { decide(one); }, queued);
  const bool decided = player ? play(now) : !batch.empty();
  batch.clear();
  // A failed commit reports itself. A journal can also be closed by damage found at opening, by a witness, or by a name
  // or a checkpoint that could not be written.
  if (store && store->closed_to_entries() && !closing_reported) {
    closing_reported = true;
    later([this](const Result<void>&) {
      if (!committer.failure()) close_room(*store->closed_to_entries());
    });
  }
  committer.commit(room.take_entries(), std::exchange(callbacks, {}));
  board.publish(RoomSeq{room_seq});
  people.publish(RoomSeq{room_seq}, Clock::time_point(std::chrono::duration_cast<Clock::duration>(now)));
  return decided;
}

void RoomRuntime::Impl::move_bone(std::chrono::nanoseconds now) {
  if (!mount->step(now)) return;
  // A tick does not wait for clients that join, leave or are sent entries: the next pose will do as well.
  if (!sessions_mutex.try_lock()) return;
  const MutexLock lock(sessions_mutex, std::adopt_lock);
  sessions.each([this](SessionSubscriber& subscriber) { subscriber.show_bone(mount->seen(subscriber.author())); });
}

// Returns true if anything happened.
bool RoomRuntime::Impl::play(std::chrono::nanoseconds now) {
  int played = 0;
  for (; played < kEntriesPlayedPerTick; ++played) {
    const std::optional<LogEntry> entry = player->take(now);
    if (!entry) break;
    const CutEntry* cut = std::get_if<CutEntry>(&entry->what);
    {
      const WriterLock lock(room_mutex);
      if (const Result<void> happened = room.replay(*entry); !happened) {
        log::error("playback ended", {{"room_seq", entry->seq.value}, {"reason", happened.error().message}});
        player->stop();
        break;
      }
      room_seq = room.room_seq().value;
      if (cuts_during_copy && cut) cuts_during_copy->push_back(cut->cut);
    }
    if (!cut)
      show_scene();
    else if (std::optional<CuttingState> state = player->see(cut->cut, *room.tools(), now))
      board.update(std::move(*state));
  }
  for (CuttingState& state : player->at_rest(now)) board.update(std::move(state));
  if (played > 0) note_changed(Clock::now());
  return played > 0;
}

void RoomRuntime::Impl::run_ticks() {
  PeriodicTimer timer(rates_.tick);
  TickStats own;
  MemoryReserve reserve(kCutReserve);
  bool last = false;
  while (!last) {
    timer.wait(own);
    last = stopping;
    const bool decided = tick(Clock::now() - room_began, last);
    if (decided) {
      mesh.wake();
      const MutexLock lock(pieces_mutex);
      pieces_due = true;
      pieces_wake.notify_one();
    }
    if (decided) reserve.refill();
    timer.done(own);
    metrics.publish(last);
    // Others read a copy, so that a tick never waits for a reader of its metrics. Only the last tick waits, to be sure.
    if (last)
      stats_mutex.lock();
    else if (!stats_mutex.try_lock())
      continue;
    const MutexLock lock(stats_mutex, std::adopt_lock);
    stats = own;
    counts = room.counts();  // no other thread changes them
  }
}

// [committing thread] What was decided since the last transaction will be lost, so nobody may build on it.
void RoomRuntime::Impl::close_room(const Error& why) {
  const std::string sentence = "the room takes no more cuts: " + why.message;
  log::error("journal failed", {{"reason", why.message}});
  end_sessions(sentence);
}

std::optional<Error> RoomRuntime::Impl::closed() const {
  std::optional<Error> why = committer.failure();
  if (!why && store && store->closed_to_entries()) why = *store->closed_to_entries();
  if (why) *why = {ErrorCode::unavailable, "the room takes no more cuts: " + why->message};
  return why;
}

// What viewers draw beside the surface.
void RoomRuntime::Impl::show_scene() { board.show(room.items(), room.bodies()); }

RoomRuntime::RoomRuntime(Room room, RuntimeRates rates, const std::function<void(double)>& progress, Detail detail,
                         RoomStore* store, std::optional<Playback> playback)
    : impl_(std::make_unique<Impl>(std::move(room), rates, detail, store, std::move(playback))) {
  if (!impl_->driven()) impl_->mesh.make_whole_surface(progress);
  impl_->room_seq = impl_->room.room_seq().value;
  impl_->show_scene();
  if (impl_->driven()) return;
  impl_->tick_thread = std::thread([this] { impl_->run_ticks(); });
  impl_->mesh.start();
  impl_->piece_thread = std::thread([this] { impl_->run_pieces(); });
  impl_->jobs.start();
}

RoomRuntime::~RoomRuntime() { stop(); }

const Case& RoomRuntime::bone() const { return impl_->room.bone(); }
RoomSeq RoomRuntime::room_seq() const { return RoomSeq{impl_->room_seq}; }
std::uint64_t RoomRuntime::lease_epoch(AuthorId holder) const {
  const ReaderLock lock(impl_->room_mutex);
  return impl_->room.lease_epoch(holder);
}
const ToolBox& RoomRuntime::tools() const { return *impl_->room.tools(); }
std::vector<SceneItem> RoomRuntime::items() const {
  const ReaderLock lock(impl_->room_mutex);
  return impl_->room.items();
}
std::vector<std::pair<RoomSeq, std::string>> RoomRuntime::marks() const {
  const ReaderLock lock(impl_->room_mutex);
  return impl_->room.marks();
}
bool RoomRuntime::knows(AuthorId author) const {
  if (impl_->player && author.value >= kFirstWatcherOfPlayback) return author.value < impl_->next_watcher;
  return author && author.value <= impl_->authors;
}

RuntimeHealth RoomRuntime::health() const {
  RuntimeHealth health;
  health.room_seq = room_seq();
  const auto look = [&](const Subscriber& subscriber) {
    health.furthest_behind = std::max(health.furthest_behind, subscriber.waiting());
  };
  {
    const MutexLock lock(impl_->sessions_mutex);
    health.sessions = impl_->sessions.size();
    impl_->sessions.each(look);
    impl_->field_readers.each(look);
  }
  const MeshHealth mesh = impl_->mesh.health();
  health.mesh_update = mesh.update;
  health.mesh_streams = mesh.streams;
  health.blocks = mesh.blocks;
  health.surface_bytes = mesh.surface_bytes;
  health.furthest_behind = std::max(health.furthest_behind, mesh.furthest_behind);
  health.cutting_streams = impl_->board.streams();
  health.waiting_entries = impl_->committer.waiting();
  health.commit = impl_->committer.commit_times();
  {
    const ReaderLock lock(impl_->room_mutex);
    health.stale_blocks = impl_->room.stale_blocks();
  }
  {
    const MutexLock lock(impl_->queue_mutex);
    health.queued_cuts = impl_->queue.size();
  }
  health.stages = impl_->metrics.stages();
  health.rejections = impl_->metrics.rejections();
  health.serving = !stopped();
  const MutexLock lock(impl_->stats_mutex);
  health.tick = impl_->stats;
  health.counts = impl_->counts;
  return health;
}

void RoomRuntime::tick(std::chrono::nanoseconds now, bool keep) {
  OSTEON_CHECK(impl_->driven());
  impl_->tick(now, false);
  if (keep) impl_->committer.drain();
  (void)impl_->room.take_changes();
  (void)impl_->room.take_stale_blocks();
}

// The job thread of a driven runtime never starts, so its jobs run at once.
void RoomRuntime::run_slowly(std::function<void()> job) { impl_->jobs.run(std::move(job)); }

void RoomRuntime::queue_cut(std::shared_ptr<SessionSubscriber> subscriber, Cut cut, Clock::time_point arrived) {
  {
    const MutexLock lock(impl_->queue_mutex);
    if (!impl_->queue_closed) {
      impl_->queue.emplace_back(std::in_place_type<QueuedCut>,
                                QueuedCut{std::move(subscriber), std::move(cut), arrived});
      return;
    }
  }
  subscriber->decided();
}

void RoomRuntime::queue_event(std::function<Result<RoomEvent>(Room&)> change,
                              std::function<void(const Result<RoomEvent>&)> answer) {
  {
    const MutexLock lock(impl_->queue_mutex);
    if (!impl_->queue_closed) {
      impl_->queue.emplace_back(std::in_place_type<QueuedEvent>,
                                QueuedEvent{std::move(change), std::move(answer), Clock::now()});
      return;
    }
  }
  answer(failure(ErrorCode::unavailable, "the room is closed"));
}

bool RoomRuntime::stopped() const { return impl_->stopping || impl_->closed(); }

std::vector<FieldLeaf> RoomRuntime::all_leaves() const { return impl_->room.all_leaves(); }

void RoomRuntime::stop() {
  // The last tick may still make blocks due, so the mesh thread ends after it.
  impl_->stopping = true;
  if (impl_->tick_thread.joinable()) impl_->tick_thread.join();
  impl_->jobs.stop();
  impl_->board.stop();
  impl_->mesh.stop();
  {
    const MutexLock lock(impl_->pieces_mutex);
    impl_->pieces_end = true;
    impl_->pieces_wake.notify_all();
  }
  if (impl_->piece_thread.joinable()) {
    impl_->piece_thread.join();
    // Splits off what the last cuts separated, so that the bone ends, and is saved, with its fragments as bodies.
    if (impl_->looks_for_pieces())
      for (Separation& found : impl_->pieces.look()) {
        const WriterLock lock(impl_->room_mutex);
        (void)impl_->room.split(std::move(found));
      }
    impl_->room_seq = impl_->room.room_seq().value;
    impl_->mesh.update(false);
    impl_->committer.commit(impl_->room.take_entries(), {});
    impl_->committer.drain();
  }
}

}  // namespace osteon
