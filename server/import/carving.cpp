#include "server/import/carving.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "common/field/kernel.hpp"
#include "common/surface/block_source.hpp"
#include "common/volume/metal.hpp"
#include "common/volume/settled.hpp"

namespace osteon::import {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kTurn_rad = 5.0 * std::numbers::pi / 180.0;  // of one cut

double milliseconds_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + std::lround(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

std::vector<Cut> cuts_of(const CarveStep& step, const Digest& tool, int level, double cut_mm) {
  Cut cut;
  cut.tool = tool;
  cut.level = level;
  cut.spindle_rpm = static_cast<std::uint32_t>(step.tool.spindle_rpm);
  std::vector<Cut> cuts;
  if (step.path.size() == 1) {
    cut.path = {quantise(step.path.front())};
    cuts.push_back(cut);
  }
  QuantisedPose last = quantise(step.path.front());
  for (std::size_t i = 1; i < step.path.size(); ++i) {
    const Pose &from = step.path[i - 1], &to = step.path[i];
    const double way = (to.position_mm - from.position_mm).norm(), turn = from.rotation.angularDistance(to.rotation);
    const int parts = std::max(1, static_cast<int>(std::ceil(std::max(way / cut_mm, turn / kTurn_rad) - 1e-9)));
    for (int part = 1; part <= parts; ++part) {
      const double t = static_cast<double>(part) / parts;
      const QuantisedPose next =
          quantise({from.position_mm + t * (to.position_mm - from.position_mm), from.rotation.slerp(t, to.rotation)});
      cut.path = {last, next};
      cuts.push_back(cut);
      last = next;
    }
  }
  return cuts;
}

Carving::Carving(Case bone, double cut_mm)
    : cut_mm_(cut_mm),
      tools_(builtin_tool_box()),
      bodies_([&] {
        std::vector<CutField> only;
        only.emplace_back(std::move(bone), BodyId{0}, tools_);
        return only;
      }()),
      surface_(BodyId{0}) {
  finders_.emplace_back(bodies_.front());
}

Carving::~Carving() = default;

Result<StepReport> Carving::run(const CarveStep& step, const KeepGoing& keep_going) {
  StepReport report;
  settled_ = false;
  if (finders_.empty())
    for (const CutField& body : bodies_) finders_.emplace_back(body);
  const ToolBox::Entry& tool = tools_->add(step.tool);
  report.tool = step.tool.name;
  report.level = std::min(step.level.value_or(step.tool.cut_level), finest_level(bodies_.front().bone().pitch_mm()));
  const std::size_t bodies = bodies_.size();
  const double before_mm3 = removed_mm3(bodies);
  const std::vector<Cut> cuts = cuts_of(step, tool.hash, report.level, cut_mm_);
  std::vector<double> cut_ms, frame_ms;
  std::vector<std::set<Coord>> changed(bodies);  // leaves of each body
  std::vector<const CutField*> fields;
  for (const CutField& body : bodies_) fields.push_back(&body);
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    if (!keep_going(static_cast<double>(i) / static_cast<double>(cuts.size()))) return stopped_while("carving");
    const auto begin = Clock::now();
    const bool metal = meets_metal(cuts[i], tool.body, fields);
    report.metal_refused += metal;
    std::vector<Coord> of_bone, reached;
    for (std::size_t b = 0; b < bodies && !metal; ++b) {
      CutReport done = bodies_[b].apply(cuts[i]);
      report.visited += done.visited;
      report.computed += done.computed;
      report.modified += done.modified;
      changed[b].insert(done.changed_leaves.begin(), done.changed_leaves.end());
      if (b > 0) continue;
      of_bone = std::move(done.changed_leaves);
      reached = std::move(done.reached_leaves);
    }
    cut_ms.push_back(milliseconds_since(begin));
    if (!reached.empty()) history_.add(RoomSeq{++events_}, cuts[i], reached);
    mesh_changes(report.level, of_bone, i + 1 == cuts.size(), frame_ms);
  }
  report.cuts = static_cast<int>(cuts.size()) - report.metal_refused;
  cuts_ += static_cast<std::uint64_t>(report.cuts);
  report.removed_mm3 = removed_mm3(bodies) - before_mm3;
  report.cut_ms_median = quantile(cut_ms, 0.5);
  report.cut_ms_p99 = quantile(cut_ms, 0.99);
  report.cut_ms_most = quantile(cut_ms, 1.0);
  report.frame_ms_median = quantile(frame_ms, 0.5);
  report.frame_ms_most = quantile(frame_ms, 1.0);

  const auto begin = Clock::now();
  for (std::size_t b = 0; b < bodies; ++b) {
    if (changed[b].empty()) continue;
    finders_[b].touch(bodies_[b], report.level, {changed[b].begin(), changed[b].end()});
    part(b, report);
  }
  report.fragment_ms = milliseconds_since(begin);
  report.field_mb = field_mb();
  return report;
}

// The largest part stays the body that it was. Each piece becomes a body of its own, and debris vanishes.
void Carving::part(std::size_t body, StepReport& report) {
  for (const Fragment& fragment : finders_[body].take_fragments(bodies_[body])) {
    if (fragment.debris()) {
      ++report.debris;
    } else {
      ++report.pieces;
      report.pieces_mm3 += fragment.volume_mm3;
      bodies_.push_back(piece_of(bodies_[body], fragment, BodyId{static_cast<std::uint32_t>(bodies_.size())}));
      finders_.emplace_back(bodies_.back());
    }
    if (body == 0) note_taken(fragment.taken);
    std::map<int, std::vector<Coord>> leaves;
    for (const FieldLeaf& mask : fragment.taken)
      if (bodies_[body].merge(mask)) leaves[mask.level].push_back(mask.origin);
    for (const auto& [level, origins] : leaves) {
      finders_[body].touch(bodies_[body], level, origins);
      if (body != 0) continue;
      for (const BlockKey& key : surface_.touch(level, origins)) stale_.push_back(key);
    }
  }
}

void Carving::note_taken(std::vector<FieldLeaf> mask) {
  taken_.push_back(RoomSeq{++events_});
  history_.add_mask(taken_.back(), std::move(mask));
}

// Returns to body 0 everything that separated from it, so that it is the bone with only the cuts. Then separates it
// again.
void Carving::settle() {
  if (std::exchange(settled_, true) || taken_.empty()) return;
  const auto touch = [&](int level, const std::vector<Coord>& origins) {
    for (const BlockKey& key : surface_.touch(level, origins)) stale_.push_back(key);
  };
  for (const LevelLeaves& changed : history_.undo(bodies_.front(), std::exchange(taken_, {})))
    touch(changed.level, changed.origins);
  Settled settled = osteon::settle(std::move(bodies_.front()));
  for (std::vector<FieldLeaf>& mask : settled.taken) {
    for (const FieldLeaf& leaf : mask) touch(leaf.level, {leaf.origin});
    note_taken(std::move(mask));
  }
  bodies_ = std::move(settled.bodies);
  finders_.clear();
}

double Carving::removed_mm3(std::size_t bodies) const {
  double sum = 0;
  for (std::size_t b = 0; b < bodies; ++b) sum += bodies_[b].removed_mm3();
  return sum;
}

// The same work that a server does for its viewers after a frame's cuts: gathers the changed blocks and meshes them.
void Carving::mesh_changes(int level, const std::vector<Coord>& leaves, bool last, std::vector<double>& frame_ms) {
  for (const BlockKey& key : surface_.touch(level, leaves)) stale_.push_back(key);
  if (++unmeshed_cuts_ < kCutsPerFrame && !last) return;
  unmeshed_cuts_ = 0;
  std::ranges::sort(stale_);
  stale_.erase(std::unique(stale_.begin(), stale_.end()), stale_.end());
  const CutField& field = bodies_.front();
  const auto begin = Clock::now();
  BlockSamples gathered;
  for (const BlockKey& key : stale_) {
    gather_block(field, surface_, key, field.bone().pitch_mm(), gathered);
    if (gathered.covered != kWhollyCovered) (void)encode_block(gathered);
  }
  if (!stale_.empty()) frame_ms.push_back(milliseconds_since(begin));
  stale_.clear();
}

double Carving::field_mb() const {
  std::size_t leaves = 0;
  for (const CutField& body : bodies_) leaves += body.leaf_places().size();
  return static_cast<double>(leaves) * kLeafVoxels * sizeof(float) / 1e6;
}

const CutField& Carving::field(std::size_t body) {
  settle();
  return bodies_[body];
}

std::size_t Carving::bodies() {
  settle();
  return bodies_.size();
}

SavedFields Carving::fields() {
  settle();
  SavedFields out;
  const Case& bone = bodies_.front().bone();
  out.case_hash = bone.hash();
  out.kernel_version = kKernelVersion;
  out.room_seq = RoomSeq{cuts_};
  out.pitch_mm = bone.pitch_mm();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    out.bodies.push_back(BodyId{static_cast<std::uint32_t>(b)});
    std::vector<FieldLeaf> leaves = bodies_[b].leaves();
    std::erase_if(leaves, [&](const FieldLeaf& leaf) {
      const auto band = static_cast<std::int16_t>(band_quanta(level_pitch_mm(out.pitch_mm, leaf.level)));
      return std::ranges::all_of(leaf.values, [&](std::int16_t v) { return v >= band; });
    });
    std::ranges::move(leaves, std::back_inserter(out.leaves));
  }
  return out;
}

std::string heading() {
  return " step  tool                 level   cuts  removed mm3       visited      computed      modified   cut ms "
         "median/p99/max     frame ms  pieces  fields MB\n";
}

std::string line(std::size_t number, const StepReport& r) {
  char text[320];
  std::snprintf(text, sizeof text,
                "%5zu  %-20s %5d %6d %12.2f %13lld %13lld %13lld %8.3f/%6.3f/%6.3f %6.2f/%6.2f  %3d+%-3d %9.1f\n",
                number, r.tool.c_str(), r.level, r.cuts, r.removed_mm3, static_cast<long long>(r.visited),
                static_cast<long long>(r.computed), static_cast<long long>(r.modified), r.cut_ms_median, r.cut_ms_p99,
                r.cut_ms_most, r.frame_ms_median, r.frame_ms_most, r.pieces, r.debris, r.field_mb);
  if (r.metal_refused == 0) return text;
  return text + ("       metal refused " + std::to_string(r.metal_refused) + " more cuts\n");
}

std::string to_json(const std::vector<StepReport>& steps, const SavedFields& fields) {
  nlohmann::json list = nlohmann::json::array();
  for (const StepReport& r : steps)
    list.push_back({{"tool", r.tool},
                    {"level", r.level},
                    {"cuts", r.cuts},
                    {"removed_mm3", r.removed_mm3},
                    {"visited", r.visited},
                    {"computed", r.computed},
                    {"modified", r.modified},
                    {"cut_ms", {{"median", r.cut_ms_median}, {"p99", r.cut_ms_p99}, {"max", r.cut_ms_most}}},
                    {"frame_ms", {{"median", r.frame_ms_median}, {"max", r.frame_ms_most}}},
                    {"fragment_ms", r.fragment_ms},
                    {"pieces", r.pieces},
                    {"pieces_mm3", r.pieces_mm3},
                    {"debris", r.debris},
                    {"field_mb", r.field_mb},
                    {"metal_refused", r.metal_refused}});
  const nlohmann::json report{{"case", to_hex(fields.case_hash)},
                              {"field_hash", to_hex(field_hash(fields.leaves, fields.pitch_mm))},
                              {"bodies", fields.bodies.size()},
                              {"steps", list}};
  return report.dump(2) + "\n";
}

}  // namespace osteon::import
