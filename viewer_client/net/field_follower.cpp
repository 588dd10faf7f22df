#include "viewer_client/net/field_follower.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "common/wire/convert.hpp"
#include "osteon/v1/field.pb.h"

namespace osteon {
namespace {

constexpr int kCutsBetweenWeighings = 64;
// Of a cut's tip and of leaves from the bone's box: as far as a server can be set to allow.
constexpr double kFarthest_mm = 1000.0;
// [A] Way of a tip in one cut; servers usually allow 25 mm. What is swept is computed, so it must have a bound.
constexpr double kLongestWay_mm = 200.0;

Error at_fault(const std::string& what) {
  return {ErrorCode::invalid_input, "the server sent an invalid message: " + what};
}

template <class Value>
Result<Value> checked(Result<Value> read) {
  if (read) return read;
  return tl::unexpected(at_fault(read.error().message));
}

Result<std::vector<BodyId>> bodies_of(const google::protobuf::RepeatedField<std::uint32_t>& ids) {
  if (ids.empty()) return tl::unexpected(at_fault("bodies is empty"));
  if (static_cast<std::size_t>(ids.size()) > FieldFollower::kMostBodies)
    return tl::unexpected(at_fault("bodies has " + std::to_string(ids.size()) + ", and at most " +
                                   std::to_string(FieldFollower::kMostBodies) + " are possible"));
  std::vector<BodyId> bodies;
  for (const std::uint32_t id : ids) bodies.push_back(BodyId{id});
  return bodies;
}

Result<void> all_of_bodies(const std::vector<FieldLeaf>& leaves, const std::vector<BodyId>& bodies) {
  const std::set<BodyId> there(bodies.begin(), bodies.end());
  const bool all = std::ranges::all_of(leaves, [&](const FieldLeaf& leaf) { return there.contains(leaf.body); });
  if (!all) return tl::unexpected(at_fault("leaf.body is not among bodies"));
  return {};
}

}  // namespace

FieldFollower::FieldFollower(const Case& bone, std::size_t most_bytes)
    : pitch_mm_(bone.pitch_mm()),
      near_(bone.bounds().grown(kFarthest_mm)),
      most_bytes_(most_bytes),
      bone_(bone, BodyId{}, tools_) {}

void FieldFollower::begin() {
  follows_ = false;
  newest_ = 0;
  waiting_ = {};
  waiting_bytes_ = 0;
  changing_.reset();
}

Result<void> FieldFollower::take(const v1::WatchFieldResponse& message) {
  if (!follows_ && message.index() != 0)
    return tl::unexpected(at_fault("an event came before the leaves were complete"));
  if (!follows_) return take_beginning(message);
  if (message.index() <= newest_) return {};  // taken before, or outside the order
  if (message.index() != newest_ + 1)
    return failure(ErrorCode::unavailable, "a message about the bone was lost on the way");
  newest_ = message.index();
  return take_event(message);
}

Result<void> FieldFollower::take_beginning(const v1::WatchFieldResponse& message) {
  switch (message.message_case()) {
    case v1::WatchFieldResponse::kTool:
      return take(message.tool());
    case v1::WatchFieldResponse::kLeaf:
      return keep_waiting(message.leaf());
    case v1::WatchFieldResponse::kComplete:
      return take(message.complete());
    default:
      return tl::unexpected(at_fault("only tools and leaves come before complete"));
  }
}

Result<void> FieldFollower::take_event(const v1::WatchFieldResponse& message) {
  if (changing_ && !message.has_change()) return tl::unexpected(at_fault("the last part of a change is missing"));
  const auto noted = [&](std::uint64_t seq) -> Result<void> {
    bone_.note(RoomSeq{seq});
    return {};
  };
  switch (message.message_case()) {
    case v1::WatchFieldResponse::kCommitted:
      return take(message.committed());
    case v1::WatchFieldResponse::kChange:
      return take(message.change());
    case v1::WatchFieldResponse::kTool:
      if (Result<void> known = take(message.tool()); !known) return known;
      return noted(message.tool().room_seq());
    case v1::WatchFieldResponse::kNoted:
      return noted(message.noted().room_seq());
    default:
      return failure(ErrorCode::unsupported,
                     "the server sends an event that this viewer does not know; install a newer Osteon here");
  }
}

Result<void> FieldFollower::take(const v1::FieldComplete& complete) {
  const Result<std::vector<BodyId>> bodies = bodies_of(complete.bodies());
  if (!bodies) return tl::unexpected(bodies.error());
  if (Result<void> fit = all_of_bodies(waiting_, *bodies); !fit) return fit;
  bone_.renew(RoomSeq{complete.room_seq()}, *bodies, waiting_, 0);
  bone_.settle();
  waiting_ = {};
  waiting_bytes_ = 0;
  whole_ = follows_ = true;
  note_changes();
  return weigh();
}

Result<void> FieldFollower::take(const v1::CommittedCut& committed) {
  const Result<Cut> cut = checked(wire::from_wire(committed.cut()));
  if (!cut) return tl::unexpected(cut.error());
  const ToolBox::Entry* tool = tools_->find(cut->tool);
  if (!tool || !tool->body.cuts()) return tl::unexpected(at_fault("committed.cut names a tool that was not sent"));
  double way_mm = 0.0;
  Vec3 before_mm = dequantise(cut->path.front()).position_mm;
  for (const QuantisedPose& pose : cut->path) {
    const Vec3 tip_mm = dequantise(pose).position_mm;
    way_mm += (tip_mm - before_mm).norm();
    before_mm = tip_mm;
    if (!is_near(tip_mm)) return tl::unexpected(at_fault("committed.cut is far from the bone"));
  }
  if (way_mm > kLongestWay_mm)
    return failure(ErrorCode::exhausted,
                   "a cut is longer than the 200 mm that this viewer computes; set limits.swept_mm "
                   "of the server to 200 or less");
  if (RoomSeq{committed.room_seq()} <= bone_.room_seq())
    return tl::unexpected(at_fault("committed.room_seq is not newer than the event before"));
  bone_.commit(RoomSeq{committed.room_seq()}, *cut, false);
  note_changes();
  return ++cuts_unweighed_ < kCutsBetweenWeighings ? Result<void>{} : weigh();
}

Result<void> FieldFollower::take(const v1::BoneChange& change) {
  const RoomSeq seq{change.room_seq()};
  if (changing_ ? seq != *changing_ : seq <= bone_.room_seq())
    return tl::unexpected(at_fault("change.room_seq is not that of the next event"));
  changing_ = seq;
  for (const v1::FieldLeaf& sent : change.leaves())
    if (Result<void> kept = keep_waiting(sent); !kept) return kept;
  if (!change.last()) return {};
  const Result<std::vector<BodyId>> bodies = bodies_of(change.bodies());
  if (!bodies) return tl::unexpected(bodies.error());
  if (Result<void> fit = all_of_bodies(waiting_, *bodies); !fit) return fit;
  bone_.change(seq, *bodies, waiting_);
  bone_.settle();
  waiting_ = {};
  waiting_bytes_ = 0;
  changing_.reset();
  note_changes();
  return weigh();
}

Result<void> FieldFollower::take(const v1::ToolAdded& added) {
  const Result<Tool> tool = checked(wire::from_wire(added.tool()));
  if (!tool) return tl::unexpected(tool.error());
  if (tools_->find(tool->hash())) return {};
  tools_->add(*tool);
  tool_bytes_ += added.ByteSizeLong();
  return check_bytes();
}

bool FieldFollower::is_near(const Vec3& at_mm) const {
  return (at_mm.array() >= near_.min_mm.array()).all() && (at_mm.array() <= near_.max_mm.array()).all();
}

Result<void> FieldFollower::keep_waiting(const v1::FieldLeaf& sent) {
  Result<FieldLeaf> leaf = checked(wire::from_wire(sent));
  if (!leaf) return tl::unexpected(leaf.error());
  if (!is_near(position_mm(leaf->origin, level_pitch_mm(pitch_mm_, leaf->level))))
    return tl::unexpected(at_fault("leaf.origin is far from the bone"));
  waiting_bytes_ += sizeof(FieldLeaf) + leaf->values.size() * sizeof(leaf->values[0]);
  waiting_.push_back(std::move(*leaf));
  return check_bytes();
}

Result<void> FieldFollower::weigh() {
  cuts_unweighed_ = 0;
  field_bytes_ = 0;
  for (const CutField* body : bone_.bodies()) field_bytes_ += 2 * body->memory_bytes();  // committed and predicted
  return check_bytes();
}

Result<void> FieldFollower::check_bytes() const {
  if (bytes() <= most_bytes_) return {};
  constexpr std::size_t kMiB = 1024 * 1024;
  return failure(ErrorCode::exhausted, "the inside of the bone needs more than the " +
                                           std::to_string(most_bytes_ / kMiB) +
                                           " MiB that this viewer has for it; undo cuts, or use a coarser case");
}

void FieldFollower::note_changes() {
  for (const ChangedLeaves& change : bone_.take_changes())
    if (!all_changed_)
      for (const Coord& origin : change.origins) changed_.insert({change.level, origin});
  if (changed_.size() <= kMostChanged) return;
  all_changed_ = true;
  changed_.clear();
}

FieldChanges FieldFollower::take_changes() {
  FieldChanges changes{.all = std::exchange(all_changed_, false)};
  std::map<int, std::vector<Coord>> levels;
  for (const auto& [level, origin] : std::exchange(changed_, {})) levels[level].push_back(origin);
  for (auto& [level, origins] : levels) changes.leaves.push_back({level, std::move(origins)});
  return changes;
}

}  // namespace osteon
