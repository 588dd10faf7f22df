// Copies a room's bone while it is cut, and finds fragments.
#include <algorithm>
#include <iterator>
#include <memory>

#include "common/field/kernel.hpp"
#include "server/rooms/runtime_impl.hpp"

namespace osteon {
namespace {

using Clock = RoomRuntime::Clock;

// Number of leaves copied at once. The room goes on cutting between two batches.
constexpr std::size_t kLeafBatch = 64;

}  // namespace

Digest RoomRuntime::surface_hash() const { return impl_->mesh.surface_hash(); }

// In batches: a room with many cuts has many leaves, and a tick must not wait until all of them are copied. If a body
// disappears meanwhile, its leaves stay without values.
void RoomRuntime::Impl::read_leaves(std::vector<FieldLeaf>& leaves) {
  for (std::size_t i = 0; i < leaves.size();) {
    const ReaderLock lock(room_mutex);
    for (const std::size_t end = std::min(leaves.size(), i + kLeafBatch); i < end; ++i)
      if (const CutField* field = room.any_field(leaves[i].body)) field->read(leaves[i]);
  }
  std::erase_if(leaves, [](const FieldLeaf& leaf) { return leaf.values.empty(); });
}

RoomRuntime::Impl::BoneCopy RoomRuntime::Impl::copy_bone(Bodies which) {
  const auto bodies = [&] { return which == Bodies::all ? room.all_bodies() : room.bodies(); };
  const auto origins = [&] {
    std::vector<FieldLeaf> leaves;
    for (const BodyId body : bodies())
      std::ranges::move(room.any_field(body)->leaf_places(), std::back_inserter(leaves));
    return leaves;
  };
  for (int attempt = 0;; ++attempt) {
    BoneCopy copy;
    std::vector<FieldLeaf> leaves;
    std::vector<Cut> cuts;
    std::uint64_t changes = 0;
    {
      // Only this thread uses `cuts_during_copy`, and the tick thread, which holds the lock exclusively.
      const ReaderLock lock(room_mutex);
      changes = room.bone_changes();
      leaves = origins();
      cuts_during_copy.emplace();
    }
    read_leaves(leaves);
    {
      const ReaderLock lock(room_mutex);
      copy.room_seq = room.room_seq();
      copy.counts = room.counts();
      copy.items = room.items();
      cuts = std::move(*cuts_during_copy);
      cuts_during_copy.reset();
      // Bone came back or fell apart meanwhile, so the copy is of another bone. If this happens again and again, the
      // room is locked for the whole copy.
      if (changes != room.bone_changes()) {
        if (attempt < 3) continue;
        leaves = origins();
        for (FieldLeaf& leaf : leaves) room.any_field(leaf.body)->read(leaf);
        cuts.clear();
      }
      for (const BodyId body : bodies()) copy.bodies.emplace(body, CutField(room.bone(), body, room.tools()));
    }
    // A leaf may already contain some of the cuts made since copying began. Applying all of them again adds the missing
    // ones and changes nothing else. The copy is then the bone at room_seq.
    for (const FieldLeaf& leaf : leaves) copy.bodies.at(leaf.body).restore(leaf);
    for (const Cut& cut : cuts)
      for (auto& [id, field] : copy.bodies) field.apply(cut);
    return copy;
  }
}

BoneStatus RoomRuntime::bone_status() {
  const MutexLock copying(impl_->copy_mutex);
  {
    const ReaderLock lock(impl_->room_mutex);
    if (impl_->last_status && impl_->last_status->room_seq == impl_->room.room_seq()) return *impl_->last_status;
  }
  // Measured on a copy, so that the room can go on cutting.
  const Impl::BoneCopy copy = impl_->copy_bone();
  BoneStatus status;
  status.room_seq = copy.room_seq;
  status.counts = copy.counts;
  std::vector<FieldLeaf> leaves;
  for (const auto& [id, field] : copy.bodies) {
    status.bodies.push_back(id);
    // A body lacks what was cut and what is in the other bodies. So what belongs to other bodies must not count as
    // removed.
    status.removed_mm3 += field.removed_mm3() - (status.bodies.size() > 1 ? bone().volume_mm3() : 0.0);
    std::ranges::move(field.leaves(), std::back_inserter(leaves));
  }
  status.field_hash = field_hash(std::move(leaves), bone().pitch_mm());
  impl_->last_status = status;
  return status;
}

RoomRuntime::Leaves RoomRuntime::leaves_now() {
  const MutexLock copying(impl_->copy_mutex);
  const Impl::BoneCopy copy = impl_->copy_bone(Impl::Bodies::all);
  Leaves all{copy.room_seq, {}};
  for (const auto& [id, field] : copy.bodies) std::ranges::move(field.leaves(), std::back_inserter(all.leaves));
  return all;
}

SavedFields RoomRuntime::saved_fields() {
  const MutexLock copying(impl_->copy_mutex);
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

// [piece thread] Queues what it finds as an event like any other.
void RoomRuntime::Impl::run_pieces() {
  while (true) {
    {
      MutexLock lock(pieces_mutex);
      while (!pieces_due && !pieces_end) pieces_wake.wait(lock);
      if (pieces_end) return;
      pieces_due = look_wanted = false;
      ++looks_begun;
    }
    if (looks_for_pieces()) {
      for (Separation& found : pieces.look()) ask_for_split(std::move(found));
    } else {
      const WriterLock room_lock(room_mutex);
      (void)room.take_changes();  // nobody else does
    }
    MutexLock lock(pieces_mutex);
    looks_done = looks_begun;
    pieces_wake.notify_all();
    pieces_wake.wait_for(lock, rates_.pieces,
                         [&]() OSTEON_REQUIRES(pieces_mutex) { return pieces_end || look_wanted; });
  }
}

// Waits for the room's decision. Until then the room must not report its changes to anyone, see Separation.
void RoomRuntime::Impl::ask_for_split(Separation found) {
  const auto shared = std::make_shared<Separation>(std::move(found));  // shared by the queued event and this thread
  bool decided = false;
  {
    const MutexLock lock(queue_mutex);
    if (queue_closed) return pieces.lose(shared->parent);  // stop() searches once more, in the whole body
    queue.emplace_back(std::in_place_type<QueuedEvent>,
                       QueuedEvent{[shared](Room& r) { return r.split(std::move(*shared)); },
                                   [this, shared, &decided](const Result<RoomEvent>& split) {
                                     const MutexLock answered(pieces_mutex);
                                     if (!split && split.error().code == ErrorCode::unavailable) {
                                       pieces.lose(shared->parent);
                                       pieces_due = true;
                                     }
                                     decided = true;
                                     pieces_wake.notify_all();
                                   },
                                   Clock::now()});
  }
  MutexLock lock(pieces_mutex);
  while (!decided) pieces_wake.wait(lock);
}

void RoomRuntime::find_pieces() {
  MutexLock lock(impl_->pieces_mutex);
  // A search that has already begun may have missed the newest cuts.
  const std::uint64_t wanted = impl_->looks_begun + 1;
  impl_->pieces_due = impl_->look_wanted = true;
  impl_->pieces_wake.notify_all();
  while (impl_->looks_done < wanted && !impl_->pieces_end) impl_->pieces_wake.wait(lock);
}

}  // namespace osteon
