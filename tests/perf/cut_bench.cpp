// Cost of one cut of a haptic client (8 ms of tool path) at a pitch of 0.125 mm, compared with the plain way to compute
// it. Also the cost of a cut with each tool at its own level, and the memory that its field takes.
#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;  // so a cut at level 2 has 0.125 mm
constexpr double kCutSeconds = 0.008;
using Clock = std::chrono::steady_clock;

double us_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

Tool tool_at_finest(const char* name) {
  auto tool = find_tool(name);
  OSTEON_CHECK(tool.has_value());
  OSTEON_CHECK(tool->cut_level == 2);
  return *tool;
}

// A burr half in bone that moves sideways, and a drill that goes in.
Cut burr_cut(const Vec3& at = Vec3::Zero()) {
  return straight_cut(tool_at_finest("burr-round-3.2"), at + Vec3(0, 0, -1.6), at + Vec3(15 * kCutSeconds, 0, -1.6),
                      {0, 0, -1});
}
Cut drill_cut(const Vec3& at = Vec3::Zero()) {
  return straight_cut(tool_at_finest("drill-3.5"), at + Vec3(0, 0, -6), at + Vec3(0, 0, -6 - 1 * kCutSeconds),
                      {0, 0, -1});
}

const Case& bone() {
  static const Case block = plain_block(60, 16, kPitch_mm);
  return block;
}

class Threads {
 public:
  explicit Threads(std::int64_t count)
      : limit_(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count)) {}

 private:
  tbb::global_control limit_;
};

void count_samples(benchmark::State& state, double visited, double computed, double modified) {
  state.counters["visited"] = visited;
  state.counters["computed"] = computed;
  state.counters["modified"] = modified;
}

// The same cut again and again, after a first one that removed bone. Every distance is evaluated, and nothing changes.
void hot(benchmark::State& state, const Cut& cut) {
  const Threads threads(state.range(0));
  CutField field(bone(), BodyId{});
  const CutReport first = field.apply(cut);
  for (auto _ : state) benchmark::DoNotOptimize(field.apply(cut).visited);
  count_samples(state, static_cast<double>(first.visited), static_cast<double>(first.computed),
                static_cast<double>(first.modified));
}

struct Times {
  std::vector<double> us;
  void report(benchmark::State& state, const std::string& prefix = "") {
    std::ranges::sort(us);
    const auto at = [&](double part) {
      return us[std::min(us.size() - 1, static_cast<std::size_t>(part * static_cast<double>(us.size())))];
    };
    state.counters[prefix + "median_us"] = at(0.5);
    state.counters[prefix + "min_us"] = us.front();
    state.counters[prefix + "max_us"] = us.back();
    state.counters[prefix + "p99_us"] = at(0.99);
    state.counters[prefix + "cuts"] = static_cast<double>(us.size());
  }
};

// Simulates other work of the process. Reads and writes every line of 96 MiB, three times the largest cache, so that
// code, tools, bone and cut field all come from memory again.
void flush_caches() {
  static std::vector<std::uint64_t> memory(std::size_t{12} << 20);
  for (std::size_t i = 0; i < memory.size(); i += 8) memory[i] += i;
  benchmark::ClobberMemory();
}

// Wide enough for many independent cuts.
const Case& wide_bone() {
  static const Case block = plain_block(120, 16, kPitch_mm);
  return block;
}

// Number of pages that the system gave to this process for the first time.
long new_pages() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

// Source of the memory for what cuts add. `reserved`: a reserve that is refilled between cuts, as in the server and the
// haptic client. `given`: from the system, page by page, during the cut.
enum class Heap { reserved, given };

// Each cut is made in untouched bone, and the caches hold other work. A 3.5 mm drill with its band reaches 2.3 mm to
// each side and a leaf is 1 mm wide, so positions 7 mm apart share no leaf: every leaf that a cut changes is new.
void cold(benchmark::State& state, Cut (*cut_at)(const Vec3&), Heap heap) {
  constexpr int kPlaces = 200, kRow = 15;
  constexpr double kApart_mm = 8.0, kScatter_mm = 0.5;  // at least 7 mm, at any position relative to the leaves' faces
  const Threads threads(state.range(0));
  std::vector<Cut> cuts;
  Random random(5);
  for (int i = 0; i < kPlaces; ++i) {
    Vec3 scatter = random.in_cube(kScatter_mm);
    scatter.z() *= 0.25;
    cuts.push_back(cut_at(Vec3((i % kRow - 7) * kApart_mm, (i / kRow - 7) * kApart_mm, 0.0) + scatter));
  }
  Times times;
  CutReport report;
  std::int64_t leaves = 0;
  long pages = 0;
  for (auto _ : state) {
    const Case& bone = wide_bone();
    // Kept alive, so that no pass gets memory that another one gave back.
    static std::vector<std::unique_ptr<CutField>> fields;
    CutField& field = *fields.emplace_back(std::make_unique<CutField>(bone, BodyId{}));
    std::optional<MemoryReserve> reserve;
    if (heap == Heap::reserved) reserve.emplace(kCutReserve);
    double sum = 0.0;
    std::set<Coord> reached;
    for (const Cut& cut : cuts) {
      if (reserve) reserve->refill();
      flush_caches();
      const long had = new_pages();
      const auto start = Clock::now();
      report = field.apply(cut);
      const double us = us_since(start);
      pages += new_pages() - had;
      sum += us;
      times.us.push_back(us);
      for (const Coord& leaf : report.reached_leaves) OSTEON_CHECK(reached.insert(leaf).second);
      leaves += static_cast<std::int64_t>(report.changed_leaves.size());
    }
    state.SetIterationTime(sum / kPlaces * 1e-6);
  }
  const auto count = static_cast<double>(times.us.size());
  times.report(state);
  count_samples(state, static_cast<double>(report.visited), static_cast<double>(report.computed),
                static_cast<double>(report.modified));
  state.counters["new_leaves"] = static_cast<double>(leaves) / count;
  state.counters["new_pages"] = static_cast<double>(pages) / count;
}

// The plain way (Niu 2008, §5.4): visits the voxels of the World Bounding Block, here of the swept tool and grown by
// the band. Rejects those outside the Local Bounding Block. Computes the tool's distance for the others, and writes the
// lower of it and the voxel's value by an accessor. For balls, and for turned bodies that move along their axis.
class PlainCut {
 public:
  explicit PlainCut(const Cut& cut) : body_(body_of(cut)) {
    pitch_ = level_pitch_mm(kPitch_mm, cut.level);
    band_ = static_cast<double>(band_mm(pitch_));
    const Pose from = dequantise(cut.path.front()), to = dequantise(cut.path.back());
    const Pose to_tool = from.inverse();
    turn_ = to_tool.rotation.toRotationMatrix();
    shift_ = to_tool.position_mm;
    motion_ = turn_ * (to.position_mm - from.position_mm);
    radius_ = body_.radius * kQuantum_mm;
    Box local, world;
    for (const Vec3& shift : {Vec3(Vec3::Zero()), motion_}) {
      local.include(Vec3(body_.lowest[0], body_.lowest[1], body_.lowest[2]) * kQuantum_mm + shift);
      local.include(Vec3(body_.highest[0], body_.highest[1], body_.highest[2]) * kQuantum_mm + shift);
    }
    const double bottom = local.min_mm.z();
    for (int corner = 0; corner < 8; ++corner)
      world.include(
          from.point({(corner & 1 ? local.max_mm : local.min_mm).x(), (corner & 2 ? local.max_mm : local.min_mm).y(),
                      (corner & 4 ? local.max_mm : local.min_mm).z()}));
    box_ = covering_samples(world.grown(band_), pitch_);
    local_ = local.grown(band_);
    // The outline's edges, as in the tool's implicit function. When a drill goes in, its back stays where it was.
    const double lowest_z = body_.lowest[2] * kQuantum_mm;
    for (std::size_t i = 0; i < body_.profile.size(); ++i) {
      const ProfileCorner &a = body_.profile[i], &b = body_.profile[(i + 1) % body_.profile.size()];
      if (a.r == 0 && b.r == 0) continue;
      const double r0 = a.r * kQuantum_mm, r1 = b.r * kQuantum_mm;
      const auto along = [&](const ProfileCorner& c) {
        const double z = c.z * kQuantum_mm;
        return z == lowest_z ? bottom : z + std::max(0.0, motion_.z());
      };
      const double s0 = along(a), s1 = along(b), length = std::hypot(r1 - r0, s1 - s0);
      edges_.push_back({r0, s0, (r1 - r0) / length, (s1 - s0) / length, length});
    }
  }

  struct Count {
    std::int64_t visited = 0, computed = 0, modified = 0;
  };

  Count apply(openvdb::FloatGrid::Accessor& accessor) const {
    return body_.kind == CutKind::ball ? walk(accessor, [this](const Vec3& p) { return ball_distance(p); })
                                       : walk(accessor, [this](const Vec3& p) { return turned_distance(p); });
  }

 private:
  template <class Distance>
  Count walk(openvdb::FloatGrid::Accessor& accessor, Distance distance) const {
    Count count;
    for (std::int32_t x = box_.min.x; x <= box_.max.x; ++x)
      for (std::int32_t y = box_.min.y; y <= box_.max.y; ++y)
        for (std::int32_t z = box_.min.z; z <= box_.max.z; ++z) {
          ++count.visited;
          const Vec3 p = turn_ * position_mm({x, y, z}, pitch_) + shift_;
          if ((p.array() < local_.min_mm.array()).any() || (p.array() > local_.max_mm.array()).any()) continue;
          ++count.computed;
          const double d = std::clamp(distance(p), -band_, band_);
          const auto rounded = static_cast<float>(std::nearbyint(d * 1024.0) / 1024.0);
          const openvdb::Coord xyz(x, y, z);
          if (rounded < accessor.getValue(xyz)) {
            accessor.setValue(xyz, rounded);
            ++count.modified;
          }
        }
    return count;
  }
  [[nodiscard]] double ball_distance(const Vec3& p) const {
    const Vec3 q = p + Vec3(0, 0, radius_);
    const double t = std::clamp(q.dot(motion_) / motion_.squaredNorm(), 0.0, 1.0);
    return (q - t * motion_).norm() - radius_;
  }
  [[nodiscard]] double turned_distance(const Vec3& p) const {
    const double r = std::sqrt(p.x() * p.x() + p.y() * p.y()), s = p.z();
    double inside = -1e9, outside = 1e9;
    for (const Edge& e : edges_) {
      const double dr = r - e.r, ds = s - e.s, along = std::clamp(dr * e.er + ds * e.es, 0.0, e.length);
      inside = std::max(inside, dr * e.es - ds * e.er);
      const double qr = dr - along * e.er, qs = ds - along * e.es;
      outside = std::min(outside, qr * qr + qs * qs);
    }
    return inside > 0.0 ? std::sqrt(outside) : inside;
  }

  struct Edge {
    double r, s, er, es, length;
  };
  static const CutBody& body_of(const Cut& cut) {
    static const auto tools = builtin_tool_box();
    return tools->find(cut.tool)->body;
  }

  const CutBody& body_;
  double pitch_ = 0.0, band_ = 0.0, radius_ = 0.0;
  Eigen::Matrix3d turn_;
  Vec3 shift_, motion_;
  Box local_;
  CoordBox box_;
  std::vector<Edge> edges_;
};

openvdb::FloatGrid::Ptr plain_grid() { return openvdb::FloatGrid::create(band_mm(level_pitch_mm(kPitch_mm, 2))); }

void world_box(benchmark::State& state, const Cut& cut) {
  const PlainCut plain(cut);
  const auto grid = plain_grid();
  PlainCut::Count first, count;
  for (auto _ : state) {
    auto accessor = grid->getAccessor();
    count = plain.apply(accessor);
    if (first.visited == 0) first = count;
  }
  count_samples(state, static_cast<double>(count.visited), static_cast<double>(count.computed),
                static_cast<double>(first.modified));
}

// A working tool: cuts of 8 ms, each from where the last one ended, always into fresh bone.
std::vector<Cut> at_work(const char* tool_name, const Vec3& from, const Vec3& way_mm_s, int count) {
  const Tool tool = tool_at_finest(tool_name);
  std::vector<Cut> cuts;
  for (int i = 0; i < count; ++i)
    cuts.push_back(
        straight_cut(tool, from + i * kCutSeconds * way_mm_s, from + (i + 1) * kCutSeconds * way_mm_s, {0, 0, -1}));
  return cuts;
}
// 48 mm across the block, half immersed, and 6.4 mm straight in.
std::vector<Cut> burr_at_work() { return at_work("burr-round-3.2", {-24, 0.03, -1.6}, {15, 0, 0}, 400); }
std::vector<Cut> drill_at_work() { return at_work("drill-3.5", {0.04, 0.03, 0}, {0, 0, -1}, 800); }

double middle_of(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

// Makes the same cuts with our field with one and with two threads, and in the plain way on a grid of its own. They
// take turns after some cuts each. All three must hold the same bone at the end. `ratio` is that of the medians of
// single cuts, with its least and most over several passes through the whole sequence.
void work(benchmark::State& state, const std::vector<Cut>& cuts) {
  constexpr int kPasses = 5;
  constexpr std::size_t kTurn = 20;
  std::vector<PlainCut> plain_cuts(cuts.begin(), cuts.end());
  std::array<Times, 3> all;  // one thread, two threads, plain way
  std::array<std::vector<double>, 2> ratios;
  PlainCut::Count plain_count;
  double computed = 0, modified = 0, visited = 0;
  std::int64_t differing = 0, compared = 0;
  for (auto _ : state) {
    for (int pass = 0; pass < kPasses; ++pass) {
      std::array<CutField, 2> fields{CutField(bone(), BodyId{}), CutField(bone(), BodyId{})};
      const auto grid = plain_grid();
      auto accessor = grid->getAccessor();
      std::array<std::vector<double>, 3> us;
      plain_count = {};
      visited = computed = modified = 0;
      for (std::size_t first = 0; first < cuts.size(); first += kTurn) {
        const std::size_t last = std::min(cuts.size(), first + kTurn);
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t who = (k + first / kTurn + static_cast<std::size_t>(pass)) % 3;
          const Threads threads(who == 1 ? 2 : 1);
          for (std::size_t i = first; i < last; ++i) {
            const auto start = Clock::now();
            if (who < 2) {
              const CutReport report = fields[who].apply(cuts[i]);
              us[who].push_back(us_since(start));
              if (who == 1) continue;
              visited += static_cast<double>(report.visited);
              computed += static_cast<double>(report.computed);
              modified += static_cast<double>(report.modified);
            } else {
              const PlainCut::Count count = plain_cuts[i].apply(accessor);
              us[2].push_back(us_since(start));
              plain_count.visited += count.visited;
              plain_count.computed += count.computed;
              plain_count.modified += count.modified;
            }
          }
        }
      }
      for (std::size_t who = 0; who < 3; ++who) all[who].us.insert(all[who].us.end(), us[who].begin(), us[who].end());
      for (std::size_t who = 0; who < 2; ++who) ratios[who].push_back(middle_of(us[2]) / middle_of(us[who]));
      if (pass > 0) continue;
      // The plain way computes in doubles: it differs by a quantum where the two round a half to different sides.
      OSTEON_CHECK(fields[0].hash() == fields[1].hash());
      for (const FieldLeaf& leaf : fields[0].leaves())
        for (std::int32_t i = 0; i < kLeafVoxels; ++i) {
          const Coord c = leaf.origin + Coord{i / 64, i / 8 % 8, i % 8};
          const std::int16_t ours = leaf.values[leaf.values.size() == 1 ? 0 : static_cast<std::size_t>(i)];
          const auto other =
              static_cast<std::int32_t>(std::lround(accessor.getValue(openvdb::Coord(c.x, c.y, c.z)) * 1024.0f));
          const std::int32_t apart = std::abs(other - ours);
          OSTEON_CHECK(apart <= 1);
          differing += apart;
          ++compared;
        }
    }
  }
  const auto n = static_cast<double>(cuts.size());
  count_samples(state, visited / n, computed / n, modified / n);
  state.counters["plain_visited"] = static_cast<double>(plain_count.visited) / n;
  state.counters["plain_computed"] = static_cast<double>(plain_count.computed) / n;
  state.counters["plain_modified"] = static_cast<double>(plain_count.modified) / n;
  state.counters["differing_share"] = static_cast<double>(differing) / static_cast<double>(compared);
  const std::array<std::string, 3> names{"ours", "ours_2", "plain"};
  for (std::size_t who = 0; who < 3; ++who) all[who].report(state, names[who] + "_");
  for (std::size_t who = 0; who < 2; ++who) {
    const std::string name = who == 0 ? "ratio" : "ratio_2";
    state.counters[name] = middle_of(all[2].us) / middle_of(all[who].us);
    state.counters[name + "_min"] = std::ranges::min(ratios[who]);
    state.counters[name + "_max"] = std::ranges::max(ratios[who]);
  }
}

// The accessor again, but with the kernel's own distances and only for leaves near the tool. This is the plain way with
// our culling.
void near_leaves(benchmark::State& state, const Cut& cut) {
  const auto tools = builtin_tool_box();
  const SweptTool swept(cut, tools->find(cut.tool)->body, kPitch_mm);
  const auto leaves = swept.leaves();
  OSTEON_CHECK(!leaves.empty());
  const float band = band_mm(swept.level_pitch_mm());
  const auto grid = openvdb::FloatGrid::create(band);
  std::int64_t first_modified = -1;
  for (auto _ : state) {
    auto accessor = grid->getAccessor();
    std::int64_t modified = 0;
    for (const Coord& leaf : leaves)
      for (std::int32_t i = 0; i < kLeafVoxels; ++i) {
        const Coord c = leaf + Coord{i / (kLeafSize * kLeafSize), i / kLeafSize % kLeafSize, i % kLeafSize};
        const openvdb::Coord xyz(c.x, c.y, c.z);
        const float distance = std::clamp(swept.distance_mm(position_mm(c, swept.level_pitch_mm())), -band, band);
        const float rounded = std::nearbyint(distance * 1024.0f) / 1024.0f;
        if (rounded < accessor.getValue(xyz)) {
          accessor.setValue(xyz, rounded);
          ++modified;
        }
      }
    if (first_modified < 0) first_modified = modified;
  }
  const auto samples = static_cast<double>(leaves.size() * kLeafVoxels);
  count_samples(state, samples, samples, static_cast<double>(first_modified));
}

// Working motion, tip and axis. A tool that turns in bone along its axis goes in at a millimetre a second (20 for one
// driven by blows). A tool that mills or saws moves across at 15 mm/s. All have the tilt of a hand, 0.1 rad/s.
struct Motion {
  Vec3 way_mm_s;
  double tilt_rad_s = 0.1;
};

Motion motion_of(const Tool& tool) {
  switch (tool.kind) {
    case ToolKind::round_burr:
    case ToolKind::barrel_burr:
    case ToolKind::contoured_burr:
      return {{15, 0, -1}};
    case ToolKind::oscillating_saw:
      return {{1, 0, -5}};
    case ToolKind::reciprocating_saw:
      return {{10, 0, -1}};
    case ToolKind::broach:
      return {{0, 0, -20}};
    case ToolKind::screw:
      return {{0, 0, -2}};
    default:
      return {{0.2, 0, -1}};
  }
}

// Deep enough for the longest broach.
const Case& big_bone() {
  static const Case block = plain_block(90, 140, kPitch_mm);
  return block;
}

// Where a tool's cuts begin: with half a millimetre of its tip in the bone, or with its whole cutting part in it.
enum class Begin { entering, seated };

double first_depth_mm(const Tool& tool, Begin begin, double on_the_way_mm) {
  if (begin == Begin::entering) return 0.5;
  switch (tool.kind) {
    case ToolKind::round_burr:
      return tool.diameter_mm;
    case ToolKind::sphere_reamer:
      return 0.5 * tool.diameter_mm;
    case ToolKind::oscillating_saw:
      return 20.0;  // the plate follows its teeth
    case ToolKind::broach:
      return tool.cutting_length_mm - on_the_way_mm;  // whole at the end, where it stops
    default:
      return tool.cutting_length_mm;
  }
}

// Each cut continues from the one before it, inwards. What a seated tool has removed on its way in is removed before,
// in one cut.
void cut_with(benchmark::State& state, const Tool& tool, Begin begin) {
  constexpr int kCuts = 120;
  const Threads threads(state.range(0));
  const Motion motion = motion_of(tool);
  const double depth = first_depth_mm(tool, begin, -motion.way_mm_s.z() * kCuts * kCutSeconds);
  Times times;
  double visited = 0, computed = 0, modified = 0, memory = 0;
  for (auto _ : state) {
    CutField field(big_bone(), BodyId{});
    const int level = std::min(tool.cut_level, finest_level(kPitch_mm));
    double sum = 0.0;
    visited = computed = modified = 0;
    const auto cut_between = [&](const Pose& from, const Pose& to) {
      Cut cut = straight_cut(tool, Vec3::Zero(), Vec3::Zero(), {0, 0, -1});
      cut.level = level;
      cut.path = {quantise(from), quantise(to)};
      return cut;
    };
    const auto pose_at = [&](int i) {
      const double t = i * kCutSeconds, tilt = motion.tilt_rad_s * t;
      // Tilted from one rotation, so that it does not spin: a spinning blade is another motion.
      Pose pose = pose_along(Vec3(0, 0, -depth) + t * motion.way_mm_s, {0, 0, -1});
      pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vec3(0.3, 1.0, 0.0).normalized())) * pose.rotation;
      return pose;
    };
    if (begin == Begin::seated) field.apply(cut_between(pose_along(Vec3(0, 0, 1), {0, 0, -1}), pose_at(0)));
    for (int i = 0; i < kCuts; ++i) {
      const Cut cut = cut_between(pose_at(i), pose_at(i + 1));
      const auto start = Clock::now();
      const CutReport report = field.apply(cut);
      const double us = us_since(start);
      sum += us;
      times.us.push_back(us);
      visited += static_cast<double>(report.visited) / kCuts;
      computed += static_cast<double>(report.computed) / kCuts;
      modified += static_cast<double>(report.modified) / kCuts;
    }
    memory = static_cast<double>(field.memory_bytes());
    state.SetIterationTime(sum / kCuts * 1e-6);
    state.counters["pitch_mm"] = level_pitch_mm(kPitch_mm, level);
  }
  times.report(state);
  count_samples(state, visited, computed, modified);
  state.counters["memory_bytes"] = memory;
  state.counters["depth_mm"] = depth;
}

template <class Run>
void add(const std::string& name, Run run) {
  benchmark::RegisterBenchmark(name.c_str(), run)
      ->ArgName("threads")
      ->Arg(1)
      ->Arg(2)
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime();
}
template <class Run>
void add_timed(const std::string& name, Run run, int iterations) {
  benchmark::RegisterBenchmark(name.c_str(), run)
      ->ArgName("threads")
      ->Arg(1)
      ->Arg(2)
      ->Unit(benchmark::kMicrosecond)
      ->UseManualTime()
      ->Iterations(iterations);
}
template <class Run>
void add_plain(const std::string& name, Run run) {
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond)->UseRealTime();
}

const bool registered = [] {
  const auto once = [](const char* name, auto cuts) {
    benchmark::RegisterBenchmark(name, [cuts](benchmark::State& state) { work(state, cuts()); })
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  };
  once("cut_burr/work", burr_at_work);
  once("cut_drill/work", drill_at_work);
  add("cut_burr/hot", [](benchmark::State& state) { hot(state, burr_cut()); });
  add_plain("cut_burr/world_box", [](benchmark::State& state) { world_box(state, burr_cut()); });
  add_plain("cut_burr/near_leaves", [](benchmark::State& state) { near_leaves(state, burr_cut()); });
  add_timed(
      "cut_burr/cold", [](benchmark::State& state) { cold(state, burr_cut, Heap::reserved); }, 1);
  add_timed(
      "cut_burr/cold_given", [](benchmark::State& state) { cold(state, burr_cut, Heap::given); }, 1);
  add("cut_drill/hot", [](benchmark::State& state) { hot(state, drill_cut()); });
  add_plain("cut_drill/world_box", [](benchmark::State& state) { world_box(state, drill_cut()); });
  add_plain("cut_drill/near_leaves", [](benchmark::State& state) { near_leaves(state, drill_cut()); });
  add_timed(
      "cut_drill/cold", [](benchmark::State& state) { cold(state, drill_cut, Heap::reserved); }, 1);
  add_timed(
      "cut_drill/cold_given", [](benchmark::State& state) { cold(state, drill_cut, Heap::given); }, 1);
  for (const Tool& tool : builtin_tools())
    if (tool.cuts()) {
      const std::string name = "cut_tool/" + tool.name;
      add_timed(
          name + "/entering", [tool](benchmark::State& state) { cut_with(state, tool, Begin::entering); }, 1);
      add_timed(
          name + "/seated", [tool](benchmark::State& state) { cut_with(state, tool, Begin::seated); }, 1);
    }
  return true;
}();

}  // namespace
}  // namespace osteon::test
