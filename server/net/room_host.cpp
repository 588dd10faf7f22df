#include "server/net/room_host.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>
#include <thread>
#include <utility>
#include <variant>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/runtime/periodic.hpp"
#include "common/wire/convert.hpp"
#include "server/net/host_parts.hpp"
#include "server/net/job_thread.hpp"
#include "server/net/mesh_room.hpp"
#include "server/net/piece_watch.hpp"
#include "server/net/room_rows.hpp"
#include "server/net/state_board.hpp"

namespace osteon {
namespace {

using Clock = RoomHost::Clock;

Error only_to_be_watched() {
  return {ErrorCode::unavailable, "this room shows what happened in another: it can be watched, with osteon-viewer, and not changed"};
}

}  // namespace

// Leaves copied at once. Between two batches the room goes on cutting.
constexpr std::size_t kLeafBatch = 64;

// Rows that happen again in one tick at most: so the surface and the health of a fast playback are told as they go.
constexpr int kRowsPlayedPerTick = 256;
// Who watches a playback is no row of it, so their numbers must not be those of the room that is shown.
constexpr std::uint64_t kFirstWatcherOfPlayback = 1ull << 40;

// Lock order: copy_mutex, then room_mutex, then sessions_mutex or that of the surface or the board, then a stream's own, then that of the jobs.
// queue_mutex, pieces_mutex, stats_mutex and that of the figures are never held with another.
struct RoomHost::Impl {
  Impl(Room r, HostRates rates, Detail detail, RoomKeeper* k, std::optional<Playback> p)
      : keeper(k), room(std::move(r)),
        rates_(rates),
        room_began(Clock::now() - std::chrono::duration_cast<Clock::duration>(room.time())),
        mesh(room, room_mutex, {rates.mesh, rates.looks}, detail, [this] { return board.tool_tips_mm(); }),
        committer(k ? [k](std::span<const RoomRow> rows) { return k->write(rows); } : Committer::Write{},
                  [this](const Error& why) { close_room(why); }, !driven()) {
    authors = room.authors();
    if (p) player.emplace(std::move(*p), room.time());
  }

  [[nodiscard]] bool driven() const { return rates_.tick.count() == 0; }
  // Of a playback they are among its rows.
  [[nodiscard]] bool looks_for_pieces() const { return rates_.pieces.count() > 0 && !player; }
  void run_ticks();
  // Whether anything was decided.
  bool tick(std::chrono::nanoseconds now, bool last);
  bool play(std::chrono::nanoseconds now);
  void run_pieces();
  void decide(QueuedCut& queued);
  void decide(QueuedEvent& queued);
  void later(Committer::Tell tell) { tells.push_back(std::move(tell)); }  // [tick] when what was decided is durable
  [[nodiscard]] MessageParts rows_of(const RoomEvent& event);
  [[nodiscard]] std::uint32_t number_of(const Digest& tool);
  void tell_kept(std::chrono::nanoseconds now);
  void note_changed(Clock::time_point arrived) {
    if (!driven()) mesh.changed(arrived);
  }
  void close_room(const Error& why);
  [[nodiscard]] std::optional<Error> closed() const;
  void end_sessions(const std::string& why, bool to_return = false);
  void show_scene();
  void read_leaves(std::vector<FieldLeaf>& leaves);

  // All bodies at one place of the order, copied while the room went on.
  struct BoneCopy {
    RoomSeq room_seq;
    RoomCounts counts;
    std::map<BodyId, CutField> bodies;
    std::vector<SceneItem> items;
  };
  enum class Bodies { that_exist, all };
  BoneCopy copy_bone(Bodies which = Bodies::that_exist);
  void ask_for_split(Separation found);

  RoomKeeper* const keeper;  // null: nothing is kept
  std::optional<Player> player;           // of a playback, from the beginning; used by the tick thread alone
  std::atomic<std::uint64_t> next_watcher{kFirstWatcherOfPlayback};  // of a playback
  Room room;
  std::shared_mutex room_mutex;
  std::optional<std::vector<Cut>> meanwhile;  // under room_mutex: cuts applied since copy_bone() began to copy
  const HostRates rates_;
  const Clock::time_point room_began;     // the room's time 0, as if it had never been closed
  std::atomic<std::uint64_t> room_seq{0}, authors{0};
  std::atomic<bool> stopping{false};

  std::mutex numbers_mutex;  // never held with another that is taken within
  std::map<Digest, std::uint32_t> tool_numbers;

  std::mutex queue_mutex;
  std::vector<Queued> queue;
  bool queue_closed = false;  // the last tick has taken what was queued

  mutable std::mutex sessions_mutex;
  Audience<SessionSink> sessions;
  std::map<AuthorId, SessionSink*> open_authors;

  StateBoard board;
  MeshRoom mesh;

  std::mutex pieces_mutex;
  std::condition_variable pieces_wake;
  bool pieces_due = true, pieces_end = false;
  std::uint64_t looks_begun = 0, looks_done = 0;  // under pieces_mutex
  bool look_wanted = false;                       // someone waits for the next one
  PieceWatch pieces{room, room_mutex, [this](std::vector<FieldLeaf>& leaves) { read_leaves(leaves); }};  // of the piece thread

  JobThread jobs;

  mutable std::mutex stats_mutex;
  TickStats stats;
  RoomCounts counts;
  CutFigures figures;

  std::optional<std::string> ended;       // under sessions_mutex: why new sessions end at once
  bool may_return = false;                // under sessions_mutex: so that they come again
  Bytes redial;                           // under sessions_mutex: what sessions are told when the process is to stop
  std::mutex copy_mutex;                  // held while the bone is copied: of a stopped host by whoever asks
  std::optional<BoneStatus> last_status;  // under copy_mutex
  std::vector<Queued> batch;              // of the tick thread
  std::vector<Committer::Tell> tells;     // of the tick thread
  std::chrono::nanoseconds next_kept{};   // of the tick thread: when it is next said how much is kept
  Committer committer;                    // the last member with a thread: it tells the others

  std::thread tick_thread, piece_thread;
};

bool RoomHost::Impl::tick(std::chrono::nanoseconds now, bool last) {
  {
    const std::lock_guard lock(queue_mutex);
    std::swap(batch, queue);
    queue_closed = last;
  }
  if (!player) room.set_time(now);
  for (Queued& queued : batch) std::visit([this](auto& one) { decide(one); }, queued);
  const bool decided = player ? play(now) : !batch.empty();
  batch.clear();
  committer.commit(room.take_rows(), std::exchange(tells, {}));
  board.publish(RoomSeq{room_seq});
  return decided;
}

// Whether anything happened.
bool RoomHost::Impl::play(std::chrono::nanoseconds now) {
  int played = 0;
  for (; played < kRowsPlayedPerTick; ++played) {
    const std::optional<RoomRow> row = player->take(now);
    if (!row) break;
    const CutRow* cut = std::get_if<CutRow>(&row->what);
    {
      const std::unique_lock lock(room_mutex);
      if (const Result<void> happened = room.replay(*row); !happened) {
        log::error("playback ended", {{"place", row->place.value}, {"reason", happened.error().message}});
        player->stop();
        break;
      }
      room_seq = room.room_seq().value;
      if (meanwhile && cut) meanwhile->push_back(cut->cut);
    }
    if (!cut)
      show_scene();
    else if (std::optional<CuttingState> state = player->see(cut->cut, *room.tools(), now))
      board.offer(std::move(*state));
  }
  for (CuttingState& state : player->at_rest(now)) board.offer(std::move(state));
  if (played > 0) note_changed(Clock::now());
  return played > 0;
}

void RoomHost::Impl::run_ticks() {
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
      const std::lock_guard lock(pieces_mutex);
      pieces_due = true;
      pieces_wake.notify_one();
    }
    if (decided) reserve.refill();
    timer.done(own);
    figures.publish(last);
    // Others read a copy, so that a tick never waits for a reader of its figures; only the last one makes sure.
    std::unique_lock lock(stats_mutex, std::try_to_lock);
    if (!lock && last) lock.lock();
    if (!lock) continue;
    stats = own;
    counts = room.counts();  // which no other thread changes
  }
}

void RoomHost::Impl::decide(QueuedCut& queued) {
  if (closed() || player) return later([sink = queued.sink](const Result<void>&) { sink->decided(); });
  const Clock::time_point taken = Clock::now();
  Result<Outcome> outcome = [&] {
    const std::unique_lock lock(room_mutex);
    Result<Outcome> decision = room.submit(queued.cut);
    room_seq = room.room_seq().value;
    if (meanwhile && decision && decision->committed() && !decision->repeated) meanwhile->push_back(queued.cut);
    return decision;
  }();
  if (!outcome)
    return later([sink = queued.sink, why = outcome.error()](const Result<void>&) {
      sink->refuse(why);
      sink->decided();
    });
  if (!outcome->report.changed_leaves.empty()) note_changed(queued.arrived);
  const Clock::time_point done = Clock::now();
  const bool newly = outcome->committed() && !outcome->repeated;
  if (newly) figures.committed(queued.arrived, taken, done);
  if (!outcome->committed() && !outcome->repeated) figures.rejected(outcome->rejection);
  const Bytes row = outcome->committed() ? cut_row(outcome->room_seq, queued.cut)
                                         : rejection_row(outcome->room_seq, queued.cut.author_seq, outcome->lease_epoch,
                                                         outcome->rejection);
  tell_kept(room.time());
  wire::SessionRow fast{.room_seq = outcome->room_seq, .kind = wire::SessionRowKind::committed};
  if (outcome->committed()) {
    fast.cut = queued.cut;
  } else {
    fast.kind = wire::SessionRowKind::rejected;
    fast.author_seq = queued.cut.author_seq;
    fast.reason = static_cast<std::uint32_t>(outcome->rejection);
    fast.lease_epoch = outcome->lease_epoch;
  }
  later([this, sink = queued.sink, row, fast = std::move(fast), place = outcome->room_seq, repeated = outcome->repeated,
         to_all = outcome->committed(), newly, done](const Result<void>& durable) {
    const Clock::time_point kept = Clock::now();
    if (durable) {
      const std::lock_guard lock(sessions_mutex);
      // The author may have come back on another stream meanwhile.
      const auto author = open_authors.find(sink->author());
      if (!repeated && to_all)
        sessions.each([&](SessionSink& one) { one.offer(place, row, fast); });
      else if (author != open_authors.end())
        repeated ? author->second->answer(row) : author->second->offer(place, row, fast);
    }
    if (durable && newly) figures.told(done, kept, Clock::now());
    sink->decided();
  });
}

void RoomHost::Impl::decide(QueuedEvent& queued) {
  Result<RoomEvent> event = [&]() -> Result<RoomEvent> {
    if (const std::optional<Error> why = closed()) return tl::unexpected(*why);
    if (player) return tl::unexpected(only_to_be_watched());
    const std::unique_lock lock(room_mutex);
    Result<RoomEvent> decision = queued.change(room);
    room_seq = room.room_seq().value;
    return decision;
  }();
  MessageParts rows;
  if (event && event->room_seq) {
    rows = rows_of(*event);
    event->leaves.clear();
    if (event->scene || event->bone) show_scene();
    if (event->bone) note_changed(queued.arrived);
  }
  later([this, rows = std::move(rows), event = std::move(event), answer = std::move(queued.answer)](const Result<void>& durable) {
    if (!durable) return answer(tl::unexpected(durable.error()));
    {
      const std::lock_guard lock(sessions_mutex);
      if (event && event->tool && event->room_seq) {
        const std::uint32_t number = number_of(event->tool->hash);
        sessions.each([&](SessionSink& sink) { sink.know_tool(number, event->tool->hash); });
      }
      for (const Bytes& row : rows)
        sessions.each([&](SessionSink& sink) {
          sink.offer(event->room_seq, row, {.room_seq = event->room_seq, .kind = wire::SessionRowKind::streamed});
        });
    }
    answer(event);
  });
}

// [tick] Every second, what a client may hold the room to.
void RoomHost::Impl::tell_kept(std::chrono::nanoseconds now) {
  if (!keeper || now < next_kept) return;
  next_kept = now + std::chrono::seconds(1);
  later([this](const Result<void>& durable) {
    if (!durable) return;
    const Bytes row = kept_row(keeper->head());
    const std::lock_guard lock(sessions_mutex);
    sessions.each([&](SessionSink& sink) { sink.answer(row); });
  });
}

// [any thread] Tools are numbered as they come to be told, the same for all sessions.
std::uint32_t RoomHost::Impl::number_of(const Digest& tool) {
  const std::lock_guard lock(numbers_mutex);
  return tool_numbers.emplace(tool, static_cast<std::uint32_t>(tool_numbers.size() + 1)).first->second;
}

// [tick] What every session hears of an event that is not a cut. Only this thread changes the room.
MessageParts RoomHost::Impl::rows_of(const RoomEvent& event) {
  MessageParts rows;
  if (event.tool) rows.push_back(tool_row(event.room_seq, event.tool->tool, number_of(event.tool->hash)));
  if (event.bone) rows = change_rows(event);
  if (event.scene) rows.push_back(scene_row(event.room_seq, room.items()));
  if (event.kind == EventKind::join || event.kind == EventKind::mark) rows.push_back(noted_row(event.room_seq, event.mark));
  return rows;
}

// [committing thread] What was decided since the last transaction will not survive: nobody may build on it.
void RoomHost::Impl::close_room(const Error& why) {
  const std::string sentence = "the room takes no more cuts: " + why.message;
  log::error("journal failed", {{"reason", why.message}});
  end_sessions(sentence);
}

std::optional<Error> RoomHost::Impl::closed() const {
  std::optional<Error> why = committer.failure();
  if (why) *why = {ErrorCode::unavailable, "the room takes no more cuts: " + why->message};
  return why;
}

void RoomHost::Impl::end_sessions(const std::string& why, bool to_return) {
  const std::lock_guard lock(sessions_mutex);
  ended = why;
  may_return = to_return;
  sessions.each([&](SessionSink& sink) { to_return ? sink.replaced(why) : sink.end(why); });
}

// What viewers draw beside the surface.
void RoomHost::Impl::show_scene() { board.show(room.items(), room.bodies()); }

RoomHost::RoomHost(Room room, HostRates rates, const std::function<void(double)>& progress, Detail detail,
                   RoomKeeper* keeper, std::optional<Playback> playback)
    : impl_(std::make_unique<Impl>(std::move(room), rates, detail, keeper, std::move(playback))) {
  if (!impl_->driven()) impl_->mesh.make_whole_surface(progress);
  impl_->room_seq = impl_->room.room_seq().value;
  impl_->show_scene();
  if (impl_->driven()) return;
  impl_->tick_thread = std::thread([this] { impl_->run_ticks(); });
  impl_->mesh.start();
  impl_->piece_thread = std::thread([this] { impl_->run_pieces(); });
  impl_->jobs.start();
}

RoomHost::~RoomHost() { stop(); }

const Case& RoomHost::bone() const { return impl_->room.bone(); }
RoomSeq RoomHost::room_seq() const { return RoomSeq{impl_->room_seq}; }
std::uint64_t RoomHost::lease_epoch(AuthorId holder) const {
  const std::shared_lock lock(impl_->room_mutex);
  return impl_->room.lease_epoch(holder);
}
const ToolBox& RoomHost::tools() const { return *impl_->room.tools(); }
std::vector<SceneItem> RoomHost::items() const {
  const std::shared_lock lock(impl_->room_mutex);
  return impl_->room.items();
}
std::vector<std::pair<RoomSeq, std::string>> RoomHost::marks() const {
  const std::shared_lock lock(impl_->room_mutex);
  return impl_->room.marks();
}
bool RoomHost::knows(AuthorId author) const {
  if (impl_->player && author.value >= kFirstWatcherOfPlayback) return author.value < impl_->next_watcher;
  return author && author.value <= impl_->authors;
}

HostHealth RoomHost::health() const {
  HostHealth health;
  health.room_seq = room_seq();
  const auto look = [&](const StreamSink& sink) { health.furthest_behind = std::max(health.furthest_behind, sink.waiting()); };
  {
    const std::lock_guard lock(impl_->sessions_mutex);
    health.sessions = impl_->sessions.size();
    impl_->sessions.each(look);
  }
  const MeshHealth mesh = impl_->mesh.health();
  health.mesh_update = mesh.update;
  health.mesh_streams = mesh.streams;
  health.blocks = mesh.blocks;
  health.surface_bytes = mesh.surface_bytes;
  health.furthest_behind = std::max(health.furthest_behind, mesh.furthest_behind);
  health.cutting_streams = impl_->board.streams();
  health.waiting_rows = impl_->committer.waiting();
  health.commit = impl_->committer.commit_times();
  {
    const std::shared_lock lock(impl_->room_mutex);
    health.stale_blocks = impl_->room.stale_blocks();
  }
  {
    const std::lock_guard lock(impl_->queue_mutex);
    health.queued_cuts = impl_->queue.size();
  }
  health.stages = impl_->figures.stages();
  health.rejections = impl_->figures.rejections();
  health.serving = !stopped();
  const std::lock_guard lock(impl_->stats_mutex);
  health.tick = impl_->stats;
  health.counts = impl_->counts;
  return health;
}

void RoomHost::tick(std::chrono::nanoseconds now, bool keep) {
  OSTEON_CHECK(impl_->driven());
  impl_->tick(now, false);
  if (keep) impl_->committer.drain();
  (void)impl_->room.take_changes();
  (void)impl_->room.take_stale_blocks();
}

// A driven host's jobs never start.
void RoomHost::run_slowly(std::function<void()> job) { impl_->jobs.run(std::move(job)); }

Result<void> RoomHost::resume(AuthorId author, const Digest& secret, const std::optional<JournalHead>& kept) {
  if (impl_->player) return tl::unexpected(only_to_be_watched());
  {
    const std::shared_lock lock(impl_->room_mutex);
    if (!impl_->room.proves(author, secret))
      return failure(ErrorCode::invalid_input, "author " + std::to_string(author.value) +
                                                   " of an earlier connection is not known here by that secret; join anew");
  }
  if (!kept || !impl_->keeper) return {};
  return impl_->keeper->check_witness(*kept);
}

void RoomHost::join(MemberKind kind, const std::string& name, const Digest& secret,
                    std::function<void(const Result<AuthorId>&)> answer) {
  if (impl_->player) {
    if (kind == MemberKind::watcher) return answer(AuthorId{impl_->next_watcher++});
    return answer(tl::unexpected(only_to_be_watched()));
  }
  std::uint32_t person = 0;
  if (impl_->keeper && !name.empty()) {
    const Result<std::uint32_t> known = impl_->keeper->person(name);
    if (!known) return answer(tl::unexpected(known.error()));
    person = *known;
  }
  queue_event(
      [=](Room& room) -> Result<RoomEvent> {
        RoomEvent event;
        event.kind = EventKind::join;
        event.author = room.join(kind, person, secret);
        event.room_seq = room.room_seq();
        return event;
      },
      [this, answer = std::move(answer)](const Result<RoomEvent>& event) {
        if (!event) return answer(tl::unexpected(event.error()));
        impl_->authors = std::max<std::uint64_t>(impl_->authors, event->author.value);
        answer(event->author);
      });
}

Result<AuthorId> RoomHost::join(MemberKind kind, const std::string& name, const Digest& secret) {
  std::promise<Result<AuthorId>> answer;
  join(kind, name, secret, [&](const Result<AuthorId>& author) { answer.set_value(author); });
  return answer.get_future().get();
}

Digest RoomHost::surface_hash() const { return impl_->mesh.surface_hash(); }

// In batches: a room that is much cut has many leaves, and a tick must not wait until all of them are copied. Those of a
// body that goes meanwhile stay without values.
void RoomHost::Impl::read_leaves(std::vector<FieldLeaf>& leaves) {
  for (std::size_t i = 0; i < leaves.size();) {
    const std::shared_lock lock(room_mutex);
    for (const std::size_t end = std::min(leaves.size(), i + kLeafBatch); i < end; ++i)
      if (const CutField* field = room.any_field(leaves[i].body)) field->read(leaves[i]);
  }
  std::erase_if(leaves, [](const FieldLeaf& leaf) { return leaf.values.empty(); });
}

RoomHost::Impl::BoneCopy RoomHost::Impl::copy_bone(Bodies which) {
  const auto bodies = [&] { return which == Bodies::all ? room.all_bodies() : room.bodies(); };
  const auto places = [&] {
    std::vector<FieldLeaf> leaves;
    for (const BodyId body : bodies()) std::ranges::move(room.any_field(body)->leaf_places(), std::back_inserter(leaves));
    return leaves;
  };
  for (int attempt = 0;; ++attempt) {
    BoneCopy copy;
    std::vector<FieldLeaf> leaves;
    std::vector<Cut> cuts;
    std::uint64_t changes = 0;
    {
      // Only this thread and, with the lock alone, the tick's use `meanwhile`.
      const std::shared_lock lock(room_mutex);
      changes = room.bone_changes();
      leaves = places();
      meanwhile.emplace();
    }
    read_leaves(leaves);
    {
      const std::shared_lock lock(room_mutex);
      copy.room_seq = room.room_seq();
      copy.counts = room.counts();
      copy.items = room.items();
      cuts = std::move(*meanwhile);
      meanwhile.reset();
      // Bone that came back or fell apart meanwhile: what was copied before is of another bone. A room in which that
      // happens all the time is held still.
      if (changes != room.bone_changes()) {
        if (attempt < 3) continue;
        leaves = places();
        for (FieldLeaf& leaf : leaves) room.any_field(leaf.body)->read(leaf);
        cuts.clear();
      }
      for (const BodyId body : bodies()) copy.bodies.emplace(body, CutField(room.bone(), body, room.tools()));
    }
    // Leaves that contain some of the cuts since their copying began get the others now, and those once more, which
    // changes nothing: the copy is the bone at room_seq.
    for (const FieldLeaf& leaf : leaves) copy.bodies.at(leaf.body).restore(leaf);
    for (const Cut& cut : cuts)
      for (auto& [id, field] : copy.bodies) field.apply(cut);
    return copy;
  }
}

BoneStatus RoomHost::bone_status() {
  const std::lock_guard copying(impl_->copy_mutex);
  {
    const std::shared_lock lock(impl_->room_mutex);
    if (impl_->last_status && impl_->last_status->room_seq == impl_->room.room_seq()) return *impl_->last_status;
  }
  // Measured on a copy, so that the room is not kept from cutting.
  const Impl::BoneCopy copy = impl_->copy_bone();
  BoneStatus status;
  status.room_seq = copy.room_seq;
  status.counts = copy.counts;
  std::vector<FieldLeaf> leaves;
  for (const auto& [id, field] : copy.bodies) {
    status.bodies.push_back(id);
    // A body lacks what was cut and what is in the others: a piece is there that the bone lacks.
    status.removed_mm3 += field.removed_mm3() - (status.bodies.size() > 1 ? bone().volume_mm3() : 0.0);
    std::ranges::move(field.leaves(), std::back_inserter(leaves));
  }
  status.field_hash = field_hash(std::move(leaves), bone().pitch_mm());
  impl_->last_status = status;
  return status;
}

RoomHost::Leaves RoomHost::leaves_now() {
  const std::lock_guard copying(impl_->copy_mutex);
  const Impl::BoneCopy copy = impl_->copy_bone(Impl::Bodies::all);
  Leaves all{copy.room_seq, {}};
  for (const auto& [id, field] : copy.bodies) std::ranges::move(field.leaves(), std::back_inserter(all.leaves));
  return all;
}

SavedFields RoomHost::saved_fields() {
  const std::lock_guard copying(impl_->copy_mutex);
  const Impl::BoneCopy copy = impl_->copy_bone();
  SavedFields saved;
  saved.case_hash = bone().hash();
  saved.kernel_version = kKernelVersion;
  saved.room_seq = copy.room_seq;
  saved.pitch_mm = bone().pitch_mm();
  saved.items = copy.items;
  const std::shared_ptr<ToolBox> built_in = builtin_tool_box();
  for (const ToolBox::Entry* entry : impl_->room.tools()->entries())
    if (!built_in->find(entry->hash)) saved.tools.push_back(entry->tool);
  for (const auto& [id, field] : copy.bodies) {
    saved.bodies.push_back(id);
    std::ranges::move(field.leaves(), std::back_inserter(saved.leaves));
  }
  return saved;
}

// [piece thread] What it finds is a queued event like any other.
void RoomHost::Impl::run_pieces() {
  while (true) {
    {
      std::unique_lock lock(pieces_mutex);
      pieces_wake.wait(lock, [&] { return pieces_due || pieces_end; });
      if (pieces_end) return;
      pieces_due = look_wanted = false;
      ++looks_begun;
    }
    if (looks_for_pieces()) {
      for (Separation& found : pieces.look()) ask_for_split(std::move(found));
    } else {
      const std::unique_lock room_lock(room_mutex);
      (void)room.take_changes();  // nobody else does
    }
    std::unique_lock lock(pieces_mutex);
    looks_done = looks_begun;
    pieces_wake.notify_all();
    pieces_wake.wait_for(lock, rates_.pieces, [&] { return pieces_end || look_wanted; });
  }
}

// Waits for the room's decision: until then the room must not tell anyone of its changes, see Separation.
void RoomHost::Impl::ask_for_split(Separation found) {
  const auto shared = std::make_shared<Separation>(std::move(found));  // by the queued event and by this thread
  bool decided = false;
  {
    const std::lock_guard lock(queue_mutex);
    if (queue_closed) return pieces.lose(shared->parent);  // stop() looks once more, at all of it
    queue.emplace_back(std::in_place_type<QueuedEvent>,
                       QueuedEvent{[shared](Room& r) { return r.split(std::move(*shared)); },
                                   [this, shared, &decided](const Result<RoomEvent>& split) {
                                     const std::lock_guard answered(pieces_mutex);
                                     if (!split && split.error().code == ErrorCode::unavailable) {
                                       pieces.lose(shared->parent);
                                       pieces_due = true;
                                     }
                                     decided = true;
                                     pieces_wake.notify_all();
                                   },
                                   Clock::now()});
  }
  std::unique_lock lock(pieces_mutex);
  pieces_wake.wait(lock, [&] { return decided; });
}

void RoomHost::find_pieces() {
  std::unique_lock lock(impl_->pieces_mutex);
  // One that has begun may have missed the newest cuts.
  const std::uint64_t wanted = impl_->looks_begun + 1;
  impl_->pieces_due = impl_->look_wanted = true;
  impl_->pieces_wake.notify_all();
  impl_->pieces_wake.wait(lock, [&] { return impl_->looks_done >= wanted || impl_->pieces_end; });
}

Result<void> RoomHost::open_session(const std::shared_ptr<SessionSink>& sink, const Digest& secret) {
  if (impl_->player) return tl::unexpected(only_to_be_watched());
  std::vector<FieldLeaf> leaves;
  MessageParts before;
  {
    // Held until the sink is listed: every row after `contained` is committed, and so offered, later.
    const std::shared_lock room_lock(impl_->room_mutex);
    if (!impl_->room.may_cut(sink->author()))
      return failure(ErrorCode::invalid_input, "open.author " + std::to_string(sink->author().value) +
                                                   " has not joined this room as a haptic client; call Join first");
    for (const BodyId body : impl_->room.bodies())
      std::ranges::move(impl_->room.find_field(body)->leaf_places(), std::back_inserter(leaves));
    const std::vector<const ToolBox::Entry*> tools = impl_->room.tools()->entries();
    for (const ToolBox::Entry* entry : tools) before.push_back(tool_row(RoomSeq{}, entry->tool, impl_->number_of(entry->hash)));
    before.push_back(scene_row(impl_->room.room_seq(), impl_->room.items()));
    v1::SessionResponse complete;
    complete.mutable_complete()->set_room_seq(impl_->room.room_seq().value);
    complete.mutable_complete()->set_lease_epoch(impl_->room.lease_epoch(sink->author()));
    complete.mutable_complete()->set_decided_author_seq(impl_->room.decided(sink->author()));
    for (const BodyId body : impl_->room.bodies()) complete.mutable_complete()->add_bodies(body.value);
    const std::lock_guard lock(impl_->sessions_mutex);
    SessionSink*& open = impl_->open_authors[sink->author()];
    if (open && !impl_->room.proves(sink->author(), secret))
      return failure(ErrorCode::invalid_input,
                     "open.author " + std::to_string(sink->author().value) + " has an open session; join again for another");
    if (open) {
      open->replaced("another connection of the same client has taken its place");
      impl_->sessions.remove(*open);
    }
    open = sink.get();
    impl_->sessions.add(*sink);
    sink->begin(impl_->room.room_seq(), std::move(before), serialised(complete));
    for (const ToolBox::Entry* entry : tools) sink->know_tool(impl_->number_of(entry->hash), entry->hash);
    if (impl_->redial) sink->answer(impl_->redial);
    if (impl_->ended) impl_->may_return ? sink->replaced(*impl_->ended) : sink->end(*impl_->ended);
  }
  impl_->read_leaves(leaves);
  if (!impl_->keeper) {
    sink->set_leaves(std::move(leaves));
    return {};
  }
  // They hold what may not be kept yet, and `complete` says that it is decided: nobody hears of it before it is kept.
  queue_event([](Room&) { return RoomEvent{}; },
              [sink, leaves = std::move(leaves)](const Result<RoomEvent>& kept) mutable {
                if (kept) sink->set_leaves(std::move(leaves));
              });
  return {};
}

void RoomHost::watch_mesh(MeshSink& sink, const std::optional<Look>& look) { impl_->mesh.watch(sink, look); }
void RoomHost::look(AuthorId viewer, const Look& from) { impl_->mesh.look(viewer, from); }
bool RoomHost::draws_near() const { return impl_->mesh.draws_near(); }
void RoomHost::watch_cutting(CuttingSink& sink) { impl_->board.watch(sink); }
void RoomHost::leave(MeshSink& sink) { impl_->mesh.leave(sink); }
void RoomHost::leave(CuttingSink& sink) { impl_->board.leave(sink); }
void RoomHost::offer_state(CuttingState state) { impl_->board.offer(std::move(state)); }

void RoomHost::leave(SessionSink& sink) {
  bool was_open = false;
  {
    const std::lock_guard lock(impl_->sessions_mutex);
    was_open = impl_->sessions.remove(sink);
    if (was_open) impl_->open_authors.erase(sink.author());
  }
  if (was_open) impl_->board.session_over(sink.author());
}

void RoomHost::queue_cut(std::shared_ptr<SessionSink> sink, Cut cut, Clock::time_point arrived) {
  {
    const std::lock_guard lock(impl_->queue_mutex);
    if (!impl_->queue_closed) {
      impl_->queue.emplace_back(std::in_place_type<QueuedCut>, QueuedCut{std::move(sink), std::move(cut), arrived});
      return;
    }
  }
  sink->decided();
}

void RoomHost::queue_event(std::function<Result<RoomEvent>(Room&)> change,
                           std::function<void(const Result<RoomEvent>&)> answer) {
  {
    const std::lock_guard lock(impl_->queue_mutex);
    if (!impl_->queue_closed) {
      impl_->queue.emplace_back(std::in_place_type<QueuedEvent>, QueuedEvent{std::move(change), std::move(answer), Clock::now()});
      return;
    }
  }
  answer(failure(ErrorCode::unavailable, "the room is closed"));
}

bool RoomHost::stopped() const { return impl_->stopping || impl_->committer.failure(); }

void RoomHost::ask_to_redial(std::chrono::milliseconds after, const std::string& why) {
  const std::lock_guard lock(impl_->sessions_mutex);
  impl_->redial = redial_row(after, why);
  impl_->sessions.each([&](SessionSink& sink) { sink.answer(impl_->redial); });
}

void RoomHost::send_away(const std::string& why) {
  impl_->end_sessions(why, true);
  impl_->mesh.end_streams(why);
  impl_->board.end_streams(why);
}

void RoomHost::end_streams(const std::string& why) {
  impl_->end_sessions(why);
  impl_->mesh.end_streams(why);
  impl_->board.end_streams(why);
}

std::vector<FieldLeaf> RoomHost::all_leaves() const { return impl_->room.all_leaves(); }

void RoomHost::stop() {
  // The last tick may still make blocks due, so the mesh thread ends after it.
  impl_->stopping = true;
  if (impl_->tick_thread.joinable()) impl_->tick_thread.join();
  impl_->jobs.stop();
  impl_->board.stop();
  impl_->mesh.stop();
  {
    const std::lock_guard lock(impl_->pieces_mutex);
    impl_->pieces_end = true;
    impl_->pieces_wake.notify_all();
  }
  if (impl_->piece_thread.joinable()) {
    impl_->piece_thread.join();
    // What the last cuts separated, so that the bone is left, and saved, in its pieces.
    if (impl_->looks_for_pieces())
      for (Separation& found : impl_->pieces.look()) {
        const std::unique_lock lock(impl_->room_mutex);
        (void)impl_->room.split(std::move(found));
      }
    impl_->room_seq = impl_->room.room_seq().value;
    impl_->mesh.update(false);
    impl_->committer.commit(impl_->room.take_rows(), {});
    impl_->committer.drain();
  }
}

}  // namespace osteon
