#include "haptic_client/app/replica_worker.hpp"

#include <optional>
#include <utility>
#include <variant>

#include "common/field/rejection.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/memory_reserve.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kLongestPause = 2ms;  // longest pause between two rounds
constexpr auto kStopPatience = 2s;   // for the room's decisions after a stop was requested

}  // namespace

ReplicaWorker::ReplicaWorker(const ClientRoom& room, Session& session, JoinCheck check, WorkerExchange& exchange,
                             ClientEnd& end, const StopSignal& stop)
    : room_(room),
      loop_(session.loop()),
      check_(std::move(check)),
      exchange_(exchange),
      end_(end),
      stop_(stop),
      replica_(room.bone, BodyId{}, room.tools),
      lease_epoch_(room.lease_epoch) {
  outcome_.removed_mm3.resize(session.plan().steps.size());
}

void ReplicaWorker::run() {
  RoomQueue::Batch batch;
  MemoryReserve reserve(kCutReserve);
  std::optional<Clock::time_point> waiting_since;
  while (true) {
    queue_.take(batch, kLongestPause);
    const bool any_received = !batch.messages.empty();
    // Read before the cuts: what was closed up to here must still be taken.
    const bool finishing = finishing_;
    take_own_cuts();
    for (const RoomMessage& message : batch.messages) std::visit([this](const auto& one) { take(one); }, message);
    batch.messages.clear();
    for (const std::string& name : batch.tools) make_partner_solid(name);
    batch.tools.clear();
    replica_.settle();
    watch_room(any_received);
    build_patch();
    if (any_received || replica_.unconfirmed() > 0) reserve.refill();
    if (!finishing) continue;
    if (!waiting_since) waiting_since = Clock::now();
    const bool settled = replica_.unconfirmed() == 0 && unsent_.empty();
    const auto patience = stop_.requested() ? kStopPatience : kConfirmPatience;
    if (settled || end_.lost() || Clock::now() - *waiting_since >= patience) break;
  }
  outcome_.unconfirmed = replica_.drop_unconfirmed();
  note_removed(outcome_.removed_mm3.size());
  queue_.close();
}

ReplicaOutcome ReplicaWorker::outcome() const {
  ReplicaOutcome outcome = outcome_;
  // Otherwise some of the leaves do not belong to any bone that the room ever had.
  if (joined_ && !changing_) outcome.field_hash = replica_.hash();
  outcome.room_seq = replica_.room_seq();
  outcome.removed_total_mm3 = replica_.removed_mm3();
  outcome.rejected += replica_.rejected();
  outcome.cuts = cut_log_.rows();
  outcome.patch_p50_us = patch_times_.percentile_us(50);
  outcome.patch_p99_us = patch_times_.percentile_us(99);
  return outcome;
}

void ReplicaWorker::take_own_cuts() {
  CutPiece piece;
  while (loop_.take_piece(piece)) {
    const Cut cut = cut_of(piece, loop_.tool(piece.tool), room_.author, lease_epoch_);
    unsent_.push_back(cut);
    cut_log_.closed(piece.author_seq, exchange_.tick_times.of(static_cast<std::uint64_t>(piece.closed_tick)));
    // Sent before it is felt, because the room's answer takes longest.
    send_waiting();
    replica_.add_own(cut);
  }
  send_waiting();
}

void ReplicaWorker::send_waiting() {
  while (!unsent_.empty() && room_.port.send(unsent_.front())) unsent_.pop_front();
}

void ReplicaWorker::take(const FieldLeaf& leaf) {
  if (interrupted_)
    renewed_.push_back(leaf);
  else
    replica_.restore(leaf);
}

void ReplicaWorker::take(const Interrupted& interrupted) {
  // Contact continues with the present bone. The received leaves replace it all at once, so that no bone is missing in
  // between.
  if (joined_ && !interrupted_)
    log::warn("the connection to the server is interrupted", {{"reason", interrupted.why.message}});
  interrupted_ = joined_;
  renewed_.clear();
  // Before joining, the received bone may have been restored since: begin anew.
  if (!joined_) replica_ = Replica(room_.bone, BodyId{}, room_.tools);
}

void ReplicaWorker::renew(const RoomAtJoin& room) {
  replica_.renew(room.contained, room.bodies, renewed_, room.decided_author_seq);
  outcome_.rejected += cut_log_.confirm(room, mono_ns());
  follow_lease(room.lease_epoch);
  changing_ = interrupted_ = false;
  renewed_ = {};
  ++outcome_.interruptions;
  log::info("the connection to the server is restored",
            {{"room_seq", room.contained.value}, {"unconfirmed_cuts", replica_.unconfirmed()}});
}

void ReplicaWorker::take(const RoomAtJoin& room) {
  if (interrupted_) return renew(room);
  replica_.change(room.contained, room.bodies, {});
  replica_.joined(room.contained);
  lease_epoch_ = room.lease_epoch;
  noted_mm3_ = replica_.removed_mm3();  // by others, before the first step
  if (const Result<void> fits = check_(replica_); !fits) return end_.give_up(fits.error());
  joined_ = true;
}

void ReplicaWorker::take(const BonePart& part) {
  replica_.change(part.seq, part.bodies, part.leaves);
  changing_ = !part.last;
  follow_lease(part.lease_epoch);
}

void ReplicaWorker::follow_lease(std::uint64_t epoch) {
  // Cuts on their way were based on other bone: the room will reject them.
  if (epoch <= lease_epoch_) return;
  lease_epoch_ = epoch;
  replica_.lease(epoch);
}

void ReplicaWorker::take(const HandSupervised& decided) {
  replica_.note(decided.seq);
  follow_lease(decided.lease_epoch);
  const std::string words = in_words(decided.supervision);
  // At the beginning of a connection without restrictions nothing is reported.
  if (words.empty() && !supervised_) return;
  supervised_ = !words.empty();
  const std::string what = words.empty() ? "free" : words, by = called(decided.by);
  log::info("an instructor changed the restrictions",
            {{"room_seq", decided.seq.value}, {"what", what}, {"by", by}, {"words", decided.supervision.words}});
  outcome_.decisions.push_back({mono_ns(), decided.seq.value, what, by});
  exchange_.restricted_by.store(words.empty() ? "" : by);
  if (!decided.supervision.words.empty())
    outcome_.words.push_back({mono_ns(), decided.seq.value, 0, decided.supervision.words});
}

void ReplicaWorker::take(const ChatReceived& said) {
  replica_.note(said.seq);
  log::info("words", {{"room_seq", said.seq.value}, {"from", said.from.value}, {"words", said.words}});
  outcome_.words.push_back({mono_ns(), said.seq.value, said.from.value, said.words});
}

void ReplicaWorker::make_partner_solid(const std::string& name) {
  // Others' tools are felt as solids, if the room's tools contain them.
  for (const ToolBox::Entry* entry : room_.tools->entries()) {
    if (entry->tool.name != name) continue;
    const SolidLattice* solid = solid_of(*entry).get();
    if (known_solids_.count == PartnerSolids::kMost) return;
    known_solids_.of[known_solids_.count++] = {std::hash<std::string>{}(name), solid};
    exchange_.partner_solids.store(known_solids_);
    return;
  }
}

const std::shared_ptr<const SolidLattice>& ReplicaWorker::solid_of(const ToolBox::Entry& entry) {
  std::shared_ptr<const SolidLattice>& solid = solids_[entry.hash];
  if (!solid) solid = std::make_shared<const SolidLattice>(entry.tool);
  return solid;
}

void ReplicaWorker::take(const SceneSet& scene) {
  replica_.note(scene.seq);
  std::vector<PlacedGuide>& guides = exchange_.guides.writable();
  guides.clear();
  for (const SceneItem& item : scene.items)
    if (const ToolBox::Entry* entry = room_.tools->find(item.tool))
      guides.push_back(placed_guide(item.id, entry->tool, item.pose_bone_item, solid_of(*entry)));
  exchange_.guides.publish();
}

void ReplicaWorker::take(const CutCommitted& committed) {
  const bool own = committed.cut.author == room_.author;
  if (own) cut_log_.confirm(committed.cut.author_seq, committed.seq, mono_ns());
  if (own) rejected_in_a_row_ = 0;
  replica_.commit(committed.seq, committed.cut, own);
}

void ReplicaWorker::take(const CutRejected& rejected) {
  cut_log_.confirm(rejected.author_seq, RoomSeq{}, mono_ns());
  const bool fell = replica_.reject(rejected.seq, rejected.author_seq);
  follow_lease(rejected.lease_epoch);
  switch (rejected.reason) {  // an instructor's decision that was on its way when this was cut
    case Rejection::frozen:
      return static_cast<void>(++outcome_.cuts_stopped);
    case Rejection::taken:
      return static_cast<void>(++outcome_.cuts_taken);
    case Rejection::zone:
    case Rejection::forbidden_tool:
      return static_cast<void>(++outcome_.cuts_elsewhere);
    default:
      break;
  }
  if (!fell) return;  // it was dropped by an undo, or with an earlier cut
  // An occasional rejected cut gives its bone back. A room that rejects all cuts makes further work pointless.
  constexpr int kMostInARow = 20;
  if (rejected_in_a_row_++ == 0)
    log::warn("cut rejected", {{"author_seq", rejected.author_seq}, {"reason", rejected.sentence}});
  if (rejected_in_a_row_ != kMostInARow) return;
  end_.give_up({ErrorCode::unsupported, "the server rejects every cut: " + rejected.sentence});
}

void ReplicaWorker::watch_room(bool any_received) {
  const double now_s = 1e-9 * static_cast<double>(mono_ns());
  const std::size_t unconfirmed = replica_.unconfirmed();
  // Without a connection everything that will be cut is unconfirmed.
  const bool silent = interrupted_ && unconfirmed == 0;
  const RoomHealth health = monitor_.update(now_s, any_received && !interrupted_, silent ? 1 : unconfirmed);
  exchange_.unconfirmed = unconfirmed;
  const RoomHealth before = exchange_.room_health.exchange(health);
  if (health == before) return;
  if (health == RoomHealth::follows)
    log::info("the server follows again");
  else
    log::warn("the spindle is held", {{"because", name(health)}, {"unconfirmed_cuts", unconfirmed}});
  if (health != RoomHealth::lost || end_.lost()) return;
  const std::string why = interrupted_
                              ? "the connection to the server was not restored; see whether osteon-server still runs "
                                "and can be reached"
                              : "the server has not answered " + std::to_string(unconfirmed) +
                                    " cuts; see whether it runs and can be reached";
  end_.give_up({ErrorCode::unavailable, why});
}

void ReplicaWorker::build_patch() {
  exchange_.tool_place.refresh();
  const ToolPlace& place = exchange_.tool_place.value();
  if (!place.taken_up) return;
  note_removed(place.step);
  const std::vector<ChangedLeaves> changes = replica_.take_changes();
  const double moved_mm = (place.pose_bone_tool.position_mm - built_at_.position_mm).norm();
  if (changes.empty() && moved_mm < 0.05 && place.tool == built_tool_) return;

  const auto began = Clock::now();
  for (const ChangedLeaves& change : changes) builder_.changed(room_.bone.pitch_mm(), change.level, change.origins);
  Patch& patch = exchange_.patches.writable();
  builder_.build(replica_.bodies(), loop_.tool(place.tool), place.pose_bone_tool, patch);
  patch.own_cuts = replica_.last_own();
  patch.room_seq = replica_.room_seq();
  exchange_.patches.publish();
  built_at_ = place.pose_bone_tool;
  built_tool_ = place.tool;
  ++outcome_.patches;
  patch_times_.record(Clock::now() - began);
}

void ReplicaWorker::note_removed(std::size_t step) {
  for (; noted_steps_ < step && noted_steps_ < outcome_.removed_mm3.size(); ++noted_steps_) {
    const double removed = replica_.removed_mm3();
    outcome_.removed_mm3[noted_steps_] = removed - noted_mm3_;
    noted_mm3_ = removed;
  }
}

}  // namespace osteon::haptic
