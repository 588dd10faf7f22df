#include "server/room/room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/field/kernel.hpp"
#include "common/surface/block_source.hpp"
#include "common/volume/metal.hpp"

namespace osteon {
namespace {

double norm(const QuantisedPose& knot) {
  double sum = 0;
  for (const std::int16_t value : knot.rotation) sum += static_cast<double>(value) * value;
  return std::sqrt(sum) / 32767.0;
}

// Rounding to steps of 1/32767 moves the norm by less than 1e-4.
constexpr double kUnitTolerance = 0.01;

// The bound on swept voxels may be exceeded by what it allows in this time, because cuts arrive in bursts after a
// network delay.
constexpr double kBurst_s = 3.0;

constexpr double kEvenOut = 8.0;

double seconds(std::chrono::nanoseconds time) { return std::chrono::duration<double>(time).count(); }

Digest begun(const Case& bone, const ToolBox& tools) {
  Hasher hasher;
  hasher.text("osteon-room-1");
  hasher.bytes(std::as_bytes(std::span(bone.hash().bytes)));
  hasher.number(bone.pitch_mm());
  hasher.integer(kKernelVersion);
  const auto entries = tools.entries();
  hasher.integer(entries.size());
  for (const ToolBox::Entry* entry : entries) hasher.bytes(std::as_bytes(std::span(entry->hash.bytes)));
  return hasher.finish();
}

}  // namespace

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
  hasher.integer(cut.path_us);
  return hasher.finish();
}

Room::Room(Case bone, CutLimits limits, std::shared_ptr<ToolBox> tools)
    : bone_(std::move(bone)), limits_(limits), tools_(std::move(tools)), genesis_(begun(bone_, *tools_)) {
  bodies_.emplace(BodyId{0},
                  Body{CutField(bone_, BodyId{0}, tools_), {}, SurfaceBlocks(BodyId{0}), bone_.bounds_samples()});
}

LogEntry Room::next_entry(AuthorId by, decltype(LogEntry::what) what) {
  return {RoomSeq{room_seq_.value + 1}, now_, by, std::move(what)};
}

RoomEvent Room::decide(AuthorId by, decltype(LogEntry::what) what) {
  LogEntry entry = next_entry(by, std::move(what));
  RoomEvent event = apply(entry);
  entries_.push_back(std::move(entry));
  return event;
}

RoomEvent Room::admit(MemberKind kind, std::uint32_t person, const Digest& secret, Role role) {
  const AuthorId author{authors_ + 1};
  const People::Supervised before = people_.supervised(people_.newest_hand(person));
  RoomEvent event = decide(author, JoinEntry{author, kind, person, secret, role});
  if (kind == MemberKind::surgeon && secret != Digest{} && before.supervision != Restrictions{})
    event.further.push_back(decide(before.by, SuperviseEntry{author, before.supervision}));
  return event;
}

AuthorId Room::join(MemberKind kind, std::uint32_t person, const Digest& secret, Role role) {
  return admit(kind, person, secret, role).author;
}

bool Room::knows(AuthorId author) const { return author && author.value <= authors_; }

bool Room::proves(AuthorId author, const Digest& secret) const {
  const auto given = secrets_.find(author);
  return given != secrets_.end() && secret != Digest{} && given->second == secret;
}

std::uint64_t Room::lease_epoch(AuthorId holder) const {
  const auto surgeon = surgeons_.find(holder);
  return surgeon == surgeons_.end() ? 0 : surgeon->second.epoch;
}

std::uint64_t Room::decided(AuthorId author) const {
  const auto surgeon = surgeons_.find(author);
  return surgeon == surgeons_.end() ? 0 : surgeon->second.decided.size();
}

std::vector<RoomSeq> Room::decided_seqs(AuthorId author, std::size_t most) const {
  std::vector<RoomSeq> seqs;
  const auto surgeon = surgeons_.find(author);
  if (surgeon == surgeons_.end()) return seqs;
  const std::vector<Decided>& all = surgeon->second.decided;
  for (std::size_t i = all.size() - std::min(all.size(), most); i < all.size(); ++i)
    seqs.push_back(all[i].rejection == Rejection::none ? all[i].room_seq : RoomSeq{});
  return seqs;
}

Result<Outcome> Room::submit(const Cut& cut, std::shared_ptr<const std::string> encoded) {
  const auto refuse = [&](std::string why) -> Result<Outcome> {
    ++counts_.refused;
    return failure(ErrorCode::invalid_input, std::move(why));
  };
  const auto surgeon = surgeons_.find(cut.author);
  if (surgeon == surgeons_.end())
    return refuse("cut.author " + std::to_string(cut.author.value) + " has not joined this room to cut");
  const std::vector<Decided>& all = surgeon->second.decided;
  const std::uint64_t next = all.size() + 1;
  if (cut.author_seq == 0 || cut.author_seq > next)
    return refuse("cut.author_seq is " + std::to_string(cut.author_seq) + " where " + std::to_string(next) +
                  " comes next");

  // A decision is final, so a cut may be sent again if its answer was lost.
  if (cut.author_seq < next) {
    const Decided& known = all[cut.author_seq - 1];
    if (known.bytes != cut_digest(cut))
      return refuse("cut.author_seq " + std::to_string(cut.author_seq) + " was used before for another cut");
    ++counts_.repeated;
    return Outcome{known.room_seq, known.rejection, true, surgeon->second.epoch, {}};
  }

  const Rejection rejection = judge(cut);
  RoomEvent event = rejection == Rejection::none
                        ? decide(cut.author, CutEntry{cut, std::move(encoded)})
                        : decide(cut.author, RejectionEntry{cut.author, cut.author_seq, cut_digest(cut), rejection});
  return Outcome{event.room_seq, rejection, false, surgeon->second.epoch, std::move(event.cut)};
}

void Room::note_decided(AuthorId author, const Digest& bytes, RoomSeq seq, Rejection rejection) {
  surgeons_.at(author).decided.push_back({bytes, seq, rejection});
}

Rejection Room::judge(const Cut& cut) {
  if (!exists(cut.body)) return Rejection::body;
  const Surgeon& surgeon = surgeons_.at(cut.author);
  if (cut.lease_epoch != surgeon.epoch) return Rejection::lease;
  if (const Rejection word = breach(people_.supervised(cut.author).supervision, cut); word != Rejection::none)
    return word;
  if (const Rejection form = judge_form(cut); form != Rejection::none) return form;
  if (limits_.time_slack.count() > 0 &&
      surgeon.claimed + std::chrono::microseconds(cut.path_us) > now_ - surgeon.granted + limits_.time_slack)
    return Rejection::time;
  if (limits_.swept_voxels_per_s > 0 &&
      voxels_spent(surgeon) + swept_voxels(cut) > kBurst_s * limits_.swept_voxels_per_s)
    return Rejection::rate;
  std::vector<const CutField*> fields;
  for (const auto& [id, body] : bodies_)
    if (body.present) fields.push_back(&body.field);
  if (meets_metal(cut, tools_->find(cut.tool)->body, fields)) return Rejection::metal;
  return beyond_power(cut, fields) ? Rejection::power : Rejection::none;
}

bool Room::beyond_power(const Cut& cut, std::span<const CutField* const> fields) {
  if (limits_.power_w <= 0) return false;
  // Energy of the author's earlier cuts that the motor has not given yet. The tolerance evens out a few samples too
  // many or too few.
  const ToolBox::Entry& tool = *tools_->find(cut.tool);
  double& owed_j = owed_j_[cut.author];
  const double owed_after_j =
      std::max(0.0, owed_j - limits_.power_w * 1e-6 * cut.path_us) + energy_.least_j(cut, tool, fields);
  const double given_j = limits_.power_w * 1e-6 * cut.path_us;
  if (owed_after_j > limits_.blow_j + given_j + kEvenOut * energy_.resolution_j(tool)) return true;
  owed_j = owed_after_j;
  return false;
}

// The part of the judgement that depends on no other cut.
Rejection Room::judge_form(const Cut& cut) const {
  const ToolBox::Entry* entry = tools_->find(cut.tool);
  if (!entry || !entry->body.cuts()) return Rejection::tool;
  if (cut.level < 0 || cut.level > std::min(entry->tool.cut_level, finest_level(bone().pitch_mm())))
    return Rejection::level;
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
  return swept_mm(cut, *entry) > limits_.swept_mm ? Rejection::sweep : Rejection::none;
}

// No point of the cutting part moves further than the tip's path plus the arc of its far end.
double Room::swept_mm(const Cut& cut, const ToolBox::Entry& tool) const {
  double swept_mm = 0;
  for (std::size_t i = 1; i < cut.path.size(); ++i) {
    const Pose from = dequantise(cut.path[i - 1]), to = dequantise(cut.path[i]);
    swept_mm +=
        (to.position_mm - from.position_mm).norm() + from.rotation.angularDistance(to.rotation) * tool.body.reach_mm();
  }
  return swept_mm;
}

// Samples of the cut's level in the box of the cutting part, lengthened by its path and grown by the band. The kernel
// visits at least as many.
double Room::swept_voxels(const Cut& cut) const {
  const ToolBox::Entry& tool = *tools_->find(cut.tool);
  const double pitch_mm = level_pitch_mm(bone().pitch_mm(), cut.level);
  std::array<double, 3> edge_mm{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    edge_mm[axis] = (tool.body.highest[axis] - tool.body.lowest[axis]) * kQuantum_mm + 2 * kBandVoxels * pitch_mm;
  std::ranges::sort(edge_mm);
  return (edge_mm[0] + swept_mm(cut, tool)) * edge_mm[1] * edge_mm[2] / (pitch_mm * pitch_mm * pitch_mm);
}

double Room::voxels_spent(const Surgeon& surgeon) const {
  return std::max(0.0, surgeon.swept_voxels - seconds(now_ - surgeon.spent) * limits_.swept_voxels_per_s);
}

std::vector<BlockKey> Room::take_stale_blocks() {
  std::vector<BlockKey> keys(stale_.begin(), stale_.end());
  stale_.clear();
  return keys;
}

std::vector<BodyLeaves> Room::take_changes() {
  std::vector<BodyLeaves> leaves;
  for (const auto& [place, origins] : changes_)
    leaves.push_back({place.first, place.second, {origins.begin(), origins.end()}});
  changes_.clear();
  return leaves;
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
  // Cells reach one sample beyond the block, so a surface may lie in the block before the first sample.
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
