#include "server/net/room_host.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>
#include <thread>
#include <utility>
#include <variant>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/runtime/periodic.hpp"
#include "common/wire/convert.hpp"
#include "server/net/host_parts.hpp"
#include "server/net/lookers.hpp"
#include "server/net/piece_watch.hpp"
#include "server/net/room_rows.hpp"

namespace osteon {
namespace {

using Clock = RoomHost::Clock;
constexpr Coord kFirstCoord{INT32_MIN, INT32_MIN, INT32_MIN};  // before every block of a level

}  // namespace

// Leaves copied at once. Between two batches the room goes on cutting.
constexpr std::size_t kLeafBatch = 64;

// Lock order: room_mutex, then sessions_mutex or mesh_mutex or cutting_mutex, then a stream's own, then jobs_mutex.
// queue_mutex, mesh_wake_mutex, pieces_mutex and stats_mutex are never held with another.
struct RoomHost::Impl {
  Impl(Room r, HostRates rates, Detail detail)
      : room(std::move(r)),
        rates_(rates),
        near(detail == Detail::near || (detail == Detail::automatic && room.bone_blocks().size() > kMostFullBlocks)) {}

  void make_whole_surface(const std::function<void(double)>& progress);
  void run_ticks();
  void run_mesh();
  void run_jobs();
  void run_pieces();
  void decide(QueuedCut& queued);
  void decide(QueuedEvent& queued);
  void publish(const RoomEvent& event);
  void show_scene();
  void publish_states();
  void make_stale_blocks(bool due);
  void follow_looks();
  void wake_mesh();
  void session_over(AuthorId author);
  void read_leaves(std::vector<FieldLeaf>& leaves);

  // All bodies at one place of the order, copied while the room went on.
  struct BoneCopy {
    RoomSeq room_seq;
    RoomCounts counts;
    std::map<BodyId, CutField> bodies;
    std::vector<SceneItem> items;
  };
  BoneCopy copy_bone();
  void ask_for_split(Separation found);

  Room room;
  std::shared_mutex room_mutex;
  std::optional<std::vector<Cut>> meanwhile;  // under room_mutex: cuts applied since copy_bone() began to copy
  const HostRates rates_;
  const bool near;                       // in full only near viewers and tools
  std::atomic<std::uint64_t> room_seq{0}, authors{0};
  std::atomic<std::size_t> stale{0};
  std::atomic<bool> stopping{false};

  std::mutex queue_mutex;
  std::vector<Queued> queue;
  bool queue_closed = false;  // the last tick has taken what was queued

  mutable std::mutex sessions_mutex;
  Audience<SessionSink> sessions;
  std::set<AuthorId> open_authors;

  mutable std::mutex cutting_mutex;
  Audience<CuttingSink> cutting_streams;
  std::map<AuthorId, ShownState> states;
  Bytes shown;               // the newest message, for those who come later
  bool states_changed = false;
  std::vector<v1::SceneItem> items;
  std::vector<BodyId> bodies;

  mutable std::mutex mesh_mutex;
  Audience<MeshSink> mesh_streams;
  BlockStore store;
  MeshUpdate surface;        // every block with a surface, as it travels
  Lookers lookers;
  Clock::time_point next_look{};  // of the mesh thread

  std::mutex mesh_wake_mutex;
  std::condition_variable mesh_wake;
  std::vector<Clock::time_point> unmeshed;  // arrivals of cuts whose blocks are not made yet
  bool mesh_due = false, mesh_end = false;

  std::mutex pieces_mutex;
  std::condition_variable pieces_wake;
  bool pieces_due = true, pieces_end = false;
  std::uint64_t looks_begun = 0, looks_done = 0;  // under pieces_mutex
  bool look_wanted = false;                       // someone waits for the next one
  PieceWatch pieces{room, room_mutex, [this](std::vector<FieldLeaf>& leaves) { read_leaves(leaves); }};  // of the piece thread

  std::mutex jobs_mutex;
  std::condition_variable jobs_wake;
  std::deque<std::function<void()>> jobs;
  bool jobs_end = false;

  mutable std::mutex stats_mutex;
  TickStats stats;
  DurationHistogram mesh_update;
  RoomCounts counts;

  std::optional<std::string> ended;  // under sessions, cutting and mesh mutex: why new streams end at once
  std::optional<BoneStatus> last_status;  // of the job thread

  std::thread tick_thread, mesh_thread, piece_thread, job_thread;
};

void RoomHost::Impl::make_whole_surface(const std::function<void(double)>& progress) {
  if (near) room.focus({focus_on_nothing()});
  std::vector<BlockKey> keys = room.bone_blocks();
  for (const BlockKey& key : room.take_stale_blocks()) keys.push_back(key);  // fine ones of fields that were loaded
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<BlockPayload> payloads(keys.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&](bool reports) {
    for (std::size_t i = next++; i < keys.size(); i = next++) {
      payloads[i] = make_block(room.gather_block(keys[i]));
      if (reports && progress) progress(static_cast<double>(i) / static_cast<double>(keys.size()));
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (unsigned i = 1; i < std::max(1u, std::thread::hardware_concurrency()); ++i) helpers.emplace_back(work, false);
    work(true);
  }
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (const StoredBlock* block = store.put(keys[i], std::move(payloads[i])))
      surface.blocks[keys[i]] = block_message(keys[i], *block);
  surface.room_seq = room.room_seq();
  room_seq = room.room_seq().value;
  show_scene();
  if (progress) progress(1.0);
}

void RoomHost::Impl::run_ticks() {
  PeriodicTimer timer(rates_.tick);
  TickStats own;
  MemoryReserve reserve(kCutReserve);
  std::vector<Queued> batch;
  bool last = false;
  while (!last) {
    timer.wait(own);
    last = stopping;
    {
      const std::lock_guard lock(queue_mutex);
      std::swap(batch, queue);
      queue_closed = last;
    }
    for (Queued& queued : batch) std::visit([this](auto& one) { decide(one); }, queued);
    const bool decided = !batch.empty();
    batch.clear();
    publish_states();
    if (decided) {
      {
        const std::lock_guard lock(mesh_wake_mutex);
        mesh_due = true;
        mesh_wake.notify_one();
      }
      const std::lock_guard lock(pieces_mutex);
      pieces_due = true;
      pieces_wake.notify_one();
    }
    if (decided) reserve.refill();
    timer.done(own);
    // Others read a copy, so that a tick never waits for a reader of its figures; only the last one makes sure.
    std::unique_lock lock(stats_mutex, std::try_to_lock);
    if (!lock && last) lock.lock();
    if (!lock) continue;
    stats = own;
    counts = room.counts();  // which no other thread changes
  }
}

void RoomHost::Impl::decide(QueuedCut& queued) {
  Result<Outcome> outcome = [&] {
    const std::unique_lock lock(room_mutex);
    Result<Outcome> decision = room.submit(queued.cut);
    room_seq = room.room_seq().value;
    stale = room.stale_blocks();
    if (meanwhile && decision && decision->committed() && !decision->repeated) meanwhile->push_back(queued.cut);
    return decision;
  }();
  if (!outcome) {
    queued.sink->refuse(outcome.error());
    queued.sink->decided();
    return;
  }

  // Published at once, before the next cut is looked at: nobody waits for a timer.
  v1::SessionResponse response;
  if (outcome->committed()) {
    v1::CommittedCut& row = *response.mutable_committed();
    row.set_room_seq(outcome->room_seq.value);
    *row.mutable_cut() = wire::to_wire(queued.cut);
  } else {
    v1::RejectedCut& row = *response.mutable_rejected();
    row.set_room_seq(outcome->room_seq.value);
    row.set_author_seq(queued.cut.author_seq);
    row.set_reason(std::string(sentence(outcome->rejection)));
  }
  const Bytes row = serialised(response);
  {
    const std::lock_guard lock(sessions_mutex);
    if (outcome->repeated)
      queued.sink->answer(row);
    else if (outcome->committed())
      sessions.each([&](SessionSink& sink) { sink.offer(outcome->room_seq, row); });
    else
      queued.sink->offer(outcome->room_seq, row);
  }
  queued.sink->decided();
  if (!outcome->report.changed_leaves.empty()) {
    const std::lock_guard lock(mesh_wake_mutex);
    unmeshed.push_back(queued.arrived);
  }
}

void RoomHost::Impl::decide(QueuedEvent& queued) {
  const Result<RoomEvent> event = [&] {
    const std::unique_lock lock(room_mutex);
    Result<RoomEvent> decision = queued.change(room);
    room_seq = room.room_seq().value;
    stale = room.stale_blocks();
    return decision;
  }();
  if (event && event->room_seq) publish(*event);
  queued.answer(event);
  if (!event || !event->bone) return;
  const std::lock_guard lock(mesh_wake_mutex);
  unmeshed.push_back(queued.arrived);
}

void RoomHost::Impl::publish(const RoomEvent& event) {
  MessageParts rows;
  if (event.tool) rows.push_back(tool_row(event.room_seq, event.tool->tool));
  if (event.bone) rows = change_rows(event);
  // Only this thread changes the room.
  if (event.scene) rows.push_back(scene_row(event.room_seq, room.items()));
  {
    const std::lock_guard lock(sessions_mutex);
    for (const Bytes& row : rows)
      sessions.each([&](SessionSink& sink) { sink.offer(event.room_seq, row); });
  }
  if (event.scene || event.bone) show_scene();
}

// What viewers draw beside the surface.
void RoomHost::Impl::show_scene() {
  const std::lock_guard lock(cutting_mutex);
  items.clear();
  for (const SceneItem& item : room.items()) items.push_back(wire::to_wire(item));
  bodies = room.bodies();
  states_changed = true;
}

void RoomHost::Impl::publish_states() {
  const std::lock_guard lock(cutting_mutex);
  for (auto& [author, entry] : states) entry.ticks_over += entry.over ? 1 : 0;
  if (std::erase_if(states, [](const auto& entry) { return entry.second.ticks_over > kShowIdleTicks; }) > 0)
    states_changed = true;
  if (!states_changed) return;
  states_changed = false;
  v1::WatchCuttingResponse response;
  response.set_room_seq(room_seq);
  for (const auto& [author, entry] : states) *response.add_states() = wire::to_wire(entry.state);
  for (const v1::SceneItem& item : items) *response.add_items() = item;
  for (const BodyId body : bodies) response.add_bodies(body.value);
  shown = serialised(response);
  cutting_streams.each([&](CuttingSink& sink) { sink.offer(shown); });
}

// A tool whose hand is gone stands still: readers must not go on sounding and drawing its last moment.
void RoomHost::Impl::session_over(AuthorId author) {
  const std::lock_guard lock(cutting_mutex);
  const auto entry = states.find(author);
  if (entry == states.end()) return;
  CuttingState& state = entry->second.state;
  ++state.state_seq;
  state.phase = CuttingPhase::idle;
  state.spindle_rpm = state.feed_mm_per_s = state.engaged_fraction = state.torque_Nmm = 0;
  state.force_physical_N = Vec3::Zero();
  entry->second.over = true;
  states_changed = true;
}

void RoomHost::Impl::run_mesh() {
  auto next = Clock::now();
  bool due = false;
  while (true) {
    {
      std::unique_lock lock(mesh_wake_mutex);
      if (near)  // tools move without anything else that wakes this thread
        mesh_wake.wait_for(lock, rates_.looks, [&] { return mesh_due || mesh_end; });
      else
        mesh_wake.wait(lock, [&] { return mesh_due || mesh_end; });
      if (!mesh_due && (mesh_end || !near)) return;
      // A first cut is shown at once, a row of cuts at the mesh rate.
      mesh_wake.wait_until(lock, next, [&] { return mesh_end; });
      due = std::exchange(mesh_due, false);
    }
    next = Clock::now() + rates_.mesh;
    make_stale_blocks(due);
  }
}

void RoomHost::Impl::wake_mesh() {
  const std::lock_guard lock(mesh_wake_mutex);
  mesh_due = true;
  mesh_wake.notify_one();
}

// [mesh thread]
void RoomHost::Impl::follow_looks() {
  if (!near || Clock::now() < next_look) return;
  next_look = Clock::now() + rates_.looks;
  std::vector<Vec3> tips_mm;
  {
    const std::lock_guard lock(cutting_mutex);
    for (const auto& [author, entry] : states)
      if (!entry.over) tips_mm.push_back(entry.state.pose_bone_tool.position_mm);
  }
  auto focuses = lookers.focuses(room.bone().pitch_mm(), tips_mm);
  if (!focuses) return;
  const std::unique_lock lock(room_mutex);
  room.focus(std::move(*focuses));
}

void RoomHost::Impl::make_stale_blocks(bool due) {
  follow_looks();
  std::vector<BlockKey> keys;
  std::vector<BodyId> bodies_now;
  std::vector<Clock::time_point> arrivals;
  MeshUpdate update;
  {
    // Arrivals first: a cut between the two is measured with the next blocks, never before its own are made.
    const std::lock_guard lock(mesh_wake_mutex);
    std::swap(arrivals, unmeshed);
  }
  {
    const std::unique_lock lock(room_mutex);
    keys = room.take_stale_blocks();
    stale = 0;
    update.room_seq = room.room_seq();
    bodies_now = room.bodies();
  }
  if (!due && keys.empty()) return;

  // The room goes on between two blocks; one that it changes meanwhile is stale again and made anew.
  std::vector<BlockPayload> payloads;
  payloads.reserve(keys.size());
  for (const BlockKey& key : keys) {
    const std::optional<BlockSamples> samples = [&] {
      const std::shared_lock lock(room_mutex);
      return room.find_field(key.body) ? std::optional(room.gather_block(key)) : std::nullopt;
    }();
    payloads.push_back(samples ? make_block(*samples) : BlockPayload{});
  }

  {
    const std::lock_guard lock(mesh_mutex);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const StoredBlock* block = store.put(keys[i], std::move(payloads[i]));
      if (!block) continue;
      const Bytes message = block_message(keys[i], *block);
      update.blocks[keys[i]] = message;
      if (block->payload.bytes.empty())
        surface.blocks.erase(keys[i]);
      else
        surface.blocks[keys[i]] = message;
    }
    // Bodies that are gone take their blocks along.
    std::vector<BlockKey> gone;
    for (auto block = surface.blocks.begin(); block != surface.blocks.end();) {
      const BodyId body = block->first.body;
      const auto next_body = surface.blocks.lower_bound({BodyId{body.value + 1}, kCoarsestLevel, kFirstCoord});
      if (!std::ranges::binary_search(bodies_now, body))
        for (; block != next_body; ++block) gone.push_back(block->first);
      block = next_body;
    }
    for (const BlockKey& key : gone) {
      surface.blocks.erase(key);
      if (const StoredBlock* block = store.put(key, {})) update.blocks[key] = block_message(key, *block);
    }
    surface.room_seq = update.room_seq;
    mesh_streams.each([&](MeshSink& sink) { sink.offer(update); });
  }
  const auto ready = Clock::now();
  const std::lock_guard lock(stats_mutex);
  for (const Clock::time_point arrived : arrivals) mesh_update.record(ready - arrived);
}

void RoomHost::Impl::run_jobs() {
  while (true) {
    std::function<void()> job;
    {
      std::unique_lock lock(jobs_mutex);
      jobs_wake.wait(lock, [&] { return !jobs.empty() || jobs_end; });
      if (jobs.empty()) return;
      job = std::move(jobs.front());
      jobs.pop_front();
    }
    job();
  }
}

RoomHost::RoomHost(Room room, HostRates rates, const std::function<void(double)>& progress, Detail detail)
    : impl_(std::make_unique<Impl>(std::move(room), rates, detail)) {
  impl_->make_whole_surface(progress);
  impl_->tick_thread = std::thread([this] { impl_->run_ticks(); });
  impl_->mesh_thread = std::thread([this] { impl_->run_mesh(); });
  impl_->piece_thread = std::thread([this] { impl_->run_pieces(); });
  impl_->job_thread = std::thread([this] { impl_->run_jobs(); });
}

RoomHost::~RoomHost() { stop(); }

const Case& RoomHost::bone() const { return impl_->room.bone(); }
RoomSeq RoomHost::room_seq() const { return RoomSeq{impl_->room_seq}; }
std::uint64_t RoomHost::lease_epoch() const {
  const std::shared_lock lock(impl_->room_mutex);
  return impl_->room.lease_epoch();
}
const ToolBox& RoomHost::tools() const { return *impl_->room.tools(); }
std::vector<SceneItem> RoomHost::items() const {
  const std::shared_lock lock(impl_->room_mutex);
  return impl_->room.items();
}
bool RoomHost::knows(AuthorId author) const { return author && author.value <= impl_->authors; }

HostHealth RoomHost::health() const {
  HostHealth health;
  health.room_seq = room_seq();
  const auto look = [&](const StreamSink& sink) { health.furthest_behind = std::max(health.furthest_behind, sink.waiting()); };
  {
    const std::lock_guard lock(impl_->sessions_mutex);
    health.sessions = impl_->sessions.size();
    impl_->sessions.each(look);
  }
  {
    const std::lock_guard lock(impl_->mesh_mutex);
    health.mesh_streams = impl_->mesh_streams.size();
    health.blocks = impl_->surface.blocks.size();
    for (const auto& [key, message] : impl_->surface.blocks) health.surface_bytes += message->size();
    impl_->mesh_streams.each(look);
  }
  {
    const std::lock_guard lock(impl_->cutting_mutex);
    health.cutting_streams = impl_->cutting_streams.size();
  }
  {
    const std::lock_guard lock(impl_->queue_mutex);
    health.queued_cuts = impl_->queue.size();
  }
  const std::lock_guard lock(impl_->stats_mutex);
  health.tick = impl_->stats;
  health.mesh_update = impl_->mesh_update;
  health.counts = impl_->counts;
  health.stale_blocks = impl_->stale;
  return health;
}

void RoomHost::run_slowly(std::function<void()> job) {
  const std::lock_guard lock(impl_->jobs_mutex);
  if (impl_->jobs_end) return;
  impl_->jobs.push_back(std::move(job));
  impl_->jobs_wake.notify_one();
}

AuthorId RoomHost::join(MemberKind kind) {
  const std::unique_lock lock(impl_->room_mutex);
  const AuthorId author = impl_->room.join(kind);
  impl_->authors = author.value;
  return author;
}

Digest RoomHost::surface_hash() const {
  const std::lock_guard lock(impl_->mesh_mutex);
  return impl_->store.hash();
}

// In batches: a room that is much cut has many leaves, and a tick must not wait until all of them are copied. Those of a
// body that goes meanwhile stay without values.
void RoomHost::Impl::read_leaves(std::vector<FieldLeaf>& leaves) {
  for (std::size_t i = 0; i < leaves.size();) {
    const std::shared_lock lock(room_mutex);
    for (const std::size_t end = std::min(leaves.size(), i + kLeafBatch); i < end; ++i)
      if (const CutField* field = room.find_field(leaves[i].body)) field->read(leaves[i]);
  }
  std::erase_if(leaves, [](const FieldLeaf& leaf) { return leaf.values.empty(); });
}

RoomHost::Impl::BoneCopy RoomHost::Impl::copy_bone() {
  const auto places = [&] {
    std::vector<FieldLeaf> leaves;
    for (const BodyId body : room.bodies()) std::ranges::move(room.find_field(body)->leaf_places(), std::back_inserter(leaves));
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
        for (FieldLeaf& leaf : leaves) room.find_field(leaf.body)->read(leaf);
        cuts.clear();
      }
      for (const BodyId body : room.bodies()) copy.bodies.emplace(body, CutField(room.bone(), body, room.tools()));
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

SavedFields RoomHost::saved_fields() {
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
    if (rates_.pieces.count() > 0) {
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

Result<void> RoomHost::open_session(const std::shared_ptr<SessionSink>& sink) {
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
    for (const ToolBox::Entry* entry : impl_->room.tools()->entries())
      before.push_back(tool_row(RoomSeq{}, entry->tool));
    before.push_back(scene_row(impl_->room.room_seq(), impl_->room.items()));
    v1::SessionResponse complete;
    complete.mutable_complete()->set_room_seq(impl_->room.room_seq().value);
    complete.mutable_complete()->set_lease_epoch(impl_->room.lease_epoch());
    for (const BodyId body : impl_->room.bodies()) complete.mutable_complete()->add_bodies(body.value);
    const std::lock_guard lock(impl_->sessions_mutex);
    if (!impl_->open_authors.insert(sink->author()).second)
      return failure(ErrorCode::invalid_input,
                     "open.author " + std::to_string(sink->author().value) + " has an open session; join again for another");
    impl_->sessions.add(*sink);
    sink->begin(impl_->room.room_seq(), std::move(before), serialised(complete));
    if (impl_->ended) sink->end(*impl_->ended);
  }
  impl_->read_leaves(leaves);
  sink->set_leaves(std::move(leaves));
  return {};
}

void RoomHost::watch_mesh(MeshSink& sink, const std::optional<Look>& look) {
  {
    const std::lock_guard lock(impl_->mesh_mutex);
    impl_->mesh_streams.add(sink);
    impl_->lookers.open(sink.author(), look);
    // What is there: the finer blocks that this viewer's look asks for follow.
    sink.begin(impl_->surface);
    if (impl_->ended) sink.end(*impl_->ended);
  }
  impl_->wake_mesh();
}

void RoomHost::look(AuthorId viewer, const Look& from) {
  if (impl_->lookers.look(viewer, from)) impl_->wake_mesh();
}

bool RoomHost::draws_near() const { return impl_->near; }

void RoomHost::watch_cutting(CuttingSink& sink) {
  const std::lock_guard lock(impl_->cutting_mutex);
  impl_->cutting_streams.add(sink);
  if (impl_->shown) sink.offer(impl_->shown);
  if (impl_->ended) sink.end(*impl_->ended);
}

void RoomHost::leave(SessionSink& sink) {
  bool was_open = false;
  {
    const std::lock_guard lock(impl_->sessions_mutex);
    const std::size_t before = impl_->sessions.size();
    impl_->sessions.remove(sink);
    was_open = impl_->sessions.size() < before;
    if (was_open) impl_->open_authors.erase(sink.author());
  }
  if (was_open) impl_->session_over(sink.author());
}

void RoomHost::leave(MeshSink& sink) {
  const std::lock_guard lock(impl_->mesh_mutex);
  const std::size_t before = impl_->mesh_streams.size();
  impl_->mesh_streams.remove(sink);
  if (impl_->mesh_streams.size() < before) impl_->lookers.close(sink.author());
}

void RoomHost::leave(CuttingSink& sink) {
  const std::lock_guard lock(impl_->cutting_mutex);
  impl_->cutting_streams.remove(sink);
}

void RoomHost::queue_cut(std::shared_ptr<SessionSink> sink, Cut cut, Clock::time_point arrived) {
  const std::lock_guard lock(impl_->queue_mutex);
  impl_->queue.emplace_back(std::in_place_type<QueuedCut>, QueuedCut{std::move(sink), std::move(cut), arrived});
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
  answer(failure(ErrorCode::unavailable, "the server stops"));
}

void RoomHost::offer_state(CuttingState state) {
  const std::lock_guard lock(impl_->cutting_mutex);
  ShownState& entry = impl_->states[state.author];
  entry = {std::move(state)};
  impl_->states_changed = true;
}

void RoomHost::end_streams(const std::string& why) {
  const std::scoped_lock lock(impl_->sessions_mutex, impl_->mesh_mutex, impl_->cutting_mutex);
  impl_->ended = why;
  impl_->sessions.each([&](SessionSink& sink) { sink.end(why); });
  impl_->mesh_streams.each([&](MeshSink& sink) { sink.end(why); });
  impl_->cutting_streams.each([&](CuttingSink& sink) { sink.end(why); });
}

void RoomHost::stop() {
  // The last tick may still make blocks due, so the mesh thread ends after it.
  impl_->stopping = true;
  if (impl_->tick_thread.joinable()) impl_->tick_thread.join();
  {
    const std::lock_guard lock(impl_->mesh_wake_mutex);
    impl_->mesh_end = true;
    impl_->mesh_wake.notify_all();
  }
  if (impl_->mesh_thread.joinable()) impl_->mesh_thread.join();
  {
    const std::lock_guard lock(impl_->pieces_mutex);
    impl_->pieces_end = true;
    impl_->pieces_wake.notify_all();
  }
  if (impl_->piece_thread.joinable()) {
    impl_->piece_thread.join();
    // What the last cuts separated, so that the bone is left, and saved, in its pieces.
    if (impl_->rates_.pieces.count() > 0)
      for (Separation& found : impl_->pieces.look()) (void)impl_->room.split(std::move(found));
    impl_->room_seq = impl_->room.room_seq().value;
    impl_->make_stale_blocks(false);
  }
  {
    const std::lock_guard lock(impl_->jobs_mutex);
    impl_->jobs_end = true;
    impl_->jobs_wake.notify_all();
  }
  if (impl_->job_thread.joinable()) impl_->job_thread.join();
}

}  // namespace osteon
