#include "server/room/room.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/surface/block_source.hpp"

namespace osteon {
namespace {

// Names a cut's bytes: every field, in the order of the protocol.
Digest cut_digest(const Cut& cut) {
  Hasher hasher;
  hasher.integer(cut.author.value);
  hasher.integer(cut.author_seq);
  hasher.integer(cut.lease_epoch);
  hasher.integer(cut.body.value);
  hasher.bytes(std::as_bytes(std::span(cut.tool.bytes)));
  const auto whole = [&](std::int64_t value) { hasher.integer(static_cast<std::uint64_t>(value)); };
  whole(cut.level);
  hasher.integer(cut.path.size());
  for (const QuantisedPose& knot : cut.path) {
    for (const std::int32_t value : knot.position) whole(value);
    for (const std::int16_t value : knot.rotation) whole(value);
  }
  hasher.integer(cut.spindle_rpm);
  return hasher.finish();
}

double norm(const QuantisedPose& knot) {
  double sum = 0;
  for (const std::int16_t value : knot.rotation) sum += static_cast<double>(value) * value;
  return std::sqrt(sum) / 32767.0;
}

// Rounding to steps of 1/32767 moves the norm by less than 1e-4.
constexpr double kUnitTolerance = 0.01;

}  // namespace

std::string_view sentence(Rejection reason) {
  switch (reason) {
    case Rejection::none: return "the cut was applied";
    case Rejection::body: return "the room has no such body";
    case Rejection::lease: return "the cut was made under a tool lease that is over";
    case Rejection::tool: return "the tool is not registered in the room, or does not cut";
    case Rejection::level: return "the level is finer than the tool or the case allows";
    case Rejection::path: return "the path has no knots or more than a cut may have";
    case Rejection::rotation: return "a rotation on the path is not a unit quaternion";
    case Rejection::place: return "the path leaves the surroundings of the bone";
    case Rejection::sweep: return "the path is longer than one cut may sweep";
    case Rejection::spindle: return "the spindle is faster than any tool turns";
  }
  return "the reason is unknown";
}

Room::Room(Case bone, CutLimits limits, std::shared_ptr<ToolBox> tools)
    : bone_(std::move(bone)), limits_(limits), tools_(std::move(tools)) {
  bodies_.emplace(BodyId{0}, Body{CutField(bone_, BodyId{0}, tools_), {}, SurfaceBlocks(BodyId{0}), bone_.bounds_samples()});
}

AuthorId Room::join(MemberKind kind) {
  const AuthorId author{++authors_};
  if (kind == MemberKind::surgeon) surgeons_[author];
  return author;
}

bool Room::knows(AuthorId author) const { return author && author.value <= authors_; }

Result<Outcome> Room::submit(const Cut& cut) {
  const auto refuse = [&](std::string why) -> Result<Outcome> {
    ++counts_.refused;
    return failure(ErrorCode::invalid_input, std::move(why));
  };
  const auto surgeon = surgeons_.find(cut.author);
  if (surgeon == surgeons_.end())
    return refuse("cut.author " + std::to_string(cut.author.value) + " has not joined this room to cut");
  std::vector<Decided>& rows = surgeon->second;
  const std::uint64_t next = rows.size() + 1;
  if (cut.author_seq == 0 || cut.author_seq > next)
    return refuse("cut.author_seq is " + std::to_string(cut.author_seq) + " where " + std::to_string(next) + " comes next");

  // What was decided stays decided, so a cut may be sent again after a lost answer.
  const Digest bytes = cut_digest(cut);
  if (cut.author_seq < next) {
    const Decided& row = rows[cut.author_seq - 1];
    if (row.bytes != bytes)
      return refuse("cut.author_seq " + std::to_string(cut.author_seq) + " was used before for another cut");
    ++counts_.repeated;
    return Outcome{row.room_seq, row.rejection, true, {}};
  }

  const Rejection rejection = judge(cut);
  room_seq_ = RoomSeq{room_seq_.value + 1};
  rows.push_back({bytes, room_seq_, rejection});
  if (rejection != Rejection::none) {
    ++counts_.rejected;
    return Outcome{room_seq_, rejection, false, {}};
  }
  ++counts_.committed;
  events_[room_seq_] = {.kind = EventKind::cut, .author = cut.author};
  CutReport report;
  report.level = cut.level;
  for (auto& [id, body] : bodies_) {
    CutReport part = body.field.apply(cut);
    if (!part.reached_leaves.empty()) body.history.add(room_seq_, cut, part.reached_leaves);
    if (!body.present) continue;  // nobody sees it, but it may come back
    report.visited += part.visited;
    report.computed += part.computed;
    report.modified += part.modified;
    report.changed_leaves.insert(report.changed_leaves.end(), part.changed_leaves.begin(), part.changed_leaves.end());
    if (!part.changed_leaves.empty()) note_changed(id, {{cut.level, std::move(part.changed_leaves)}}, nullptr);
  }
  return Outcome{room_seq_, Rejection::none, false, std::move(report)};
}

Rejection Room::judge(const Cut& cut) const {
  if (!exists(cut.body)) return Rejection::body;
  if (cut.lease_epoch != lease_epoch()) return Rejection::lease;
  const ToolBox::Entry* entry = tools_->find(cut.tool);
  if (!entry || !entry->body.cuts()) return Rejection::tool;
  if (cut.level < 0 || cut.level > std::min(entry->tool.cut_level, finest_level(bone().pitch_mm()))) return Rejection::level;
  if (cut.path.empty() || cut.path.size() > static_cast<std::size_t>(limits_.path_knots)) return Rejection::path;
  if (cut.spindle_rpm > limits_.spindle_rpm) return Rejection::spindle;

  const Box room = bone().bounds().grown(limits_.beyond_bone_mm);
  for (const QuantisedPose& knot : cut.path) {
    if (std::abs(norm(knot) - 1.0) > kUnitTolerance) return Rejection::rotation;
    for (int axis = 0; axis < 3; ++axis) {
      const double at_mm = knot.position[static_cast<std::size_t>(axis)] * kQuantum_mm;
      if (at_mm < room.min_mm[axis] || at_mm > room.max_mm[axis]) return Rejection::place;
    }
  }
  // No point of the cutting part goes further than its tip plus the arc of its far end.
  double swept_mm = 0;
  for (std::size_t i = 1; i < cut.path.size(); ++i) {
    const Pose from = dequantise(cut.path[i - 1]), to = dequantise(cut.path[i]);
    swept_mm += (to.position_mm - from.position_mm).norm() +
                from.rotation.angularDistance(to.rotation) * entry->body.reach_mm();
  }
  return swept_mm > limits_.swept_mm ? Rejection::sweep : Rejection::none;
}

std::vector<BlockKey> Room::take_stale_blocks() {
  std::vector<BlockKey> keys(stale_.begin(), stale_.end());
  stale_.clear();
  return keys;
}

std::vector<BlockKey> Room::bone_blocks() const {
  std::vector<BlockKey> keys;
  for (const auto& [id, body] : bodies_)
    if (body.present) list_blocks(id, body, keys);
  return keys;
}

void Room::list_blocks(BodyId id, const Body& body, std::vector<BlockKey>& keys) const {
  const CoordBox& samples = body.reach;
  if (samples.empty()) return;
  // Cells reach one sample beyond the block, so a surface may lie in the block below the first sample.
  const Coord first = shift_down(samples.min - Coord{1, 1, 1}, 4), last = shift_down(samples.max, 4);
  static_assert(kBlockCells == 1 << 4);
  for (int x = first.x; x <= last.x; ++x)
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z) {
        const BlockKey key{id, 0, {x, y, z}};
        if (bone().has_bone(block_samples(key))) keys.push_back(key);
      }
}

void Room::focus(std::vector<Focus> focuses) {
  focuses_ = std::move(focuses);
  for (auto& [id, body] : bodies_)
    if (body.present) stale_.merge(focused(body));
}

std::set<BlockKey> Room::focused(Body& body) const {
  const auto keys = body.surface.focus(focuses_, body.reach, bone().pitch_mm());
  return {keys.begin(), keys.end()};
}

BlockSamples Room::gather_block(const BlockKey& key) const {
  const Body& body = bodies_.at(key.body);
  BlockSamples out;
  osteon::gather_block(body.field, body.surface, key, bone().pitch_mm(), out);
  return out;
}

}  // namespace osteon
