// What one cut of a haptic client (8 ms of tool path) costs at a pitch of 0.125 mm, against the plain way of writing it;
// and what a cut costs with each of the tools at its own level, with the memory that its field takes.
#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;  // so a cut at level 2 has 0.125 mm
constexpr double kCutSeconds = 0.008;
using Clock = std::chrono::steady_clock;

double us_since(Clock::time_point start) { return std::chrono::duration<double, std::micro>(Clock::now() - start).count(); }

Tool tool_at_finest(const char* name) {
  auto tool = find_tool(name);
  OSTEON_CHECK(tool.has_value());
  OSTEON_CHECK(tool->cut_level == 2);
  return *tool;
}

// A burr half in bone moving sideways, and a drill going in.
Cut burr_cut(const Vec3& at = Vec3::Zero()) {
  return straight_cut(tool_at_finest("burr-round-3.2"), at + Vec3(0, 0, -1.6), at + Vec3(15 * kCutSeconds, 0, -1.6), {0, 0, -1});
}
Cut drill_cut(const Vec3& at = Vec3::Zero()) {
  return straight_cut(tool_at_finest("drill-3.5"), at + Vec3(0, 0, -6), at + Vec3(0, 0, -6 - 1 * kCutSeconds), {0, 0, -1});
}

const Case& bone() {
  static const Case block = plain_block(60, 16, kPitch_mm);
  return block;
}

class Threads {
 public:
  explicit Threads(std::int64_t count) : limit_(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count)) {}

 private:
  tbb::global_control limit_;
};

void count_samples(benchmark::State& state, double visited, double computed, double modified) {
  state.counters["visited"] = visited;
  state.counters["computed"] = computed;
  state.counters["modified"] = modified;
}

// The same cut again and again, after a first that removed: every distance is evaluated, nothing changes.
void hot(benchmark::State& state, const Cut& cut) {
  const Threads threads(state.range(0));
  CutField field(bone(), BodyId{});
  const CutReport first = field.apply(cut);
  for (auto _ : state) benchmark::DoNotOptimize(field.apply(cut).visited);
  count_samples(state, static_cast<double>(first.visited), static_cast<double>(first.computed), static_cast<double>(first.modified));
}

struct Times {
  std::vector<double> us;
  void report(benchmark::State& state) {
    std::ranges::sort(us);
    const auto at = [&](double part) { return us[std::min(us.size() - 1, static_cast<std::size_t>(part * static_cast<double>(us.size())))]; };
    state.counters["median_us"] = at(0.5);
    state.counters["min_us"] = us.front();
    state.counters["max_us"] = us.back();
    state.counters["p99_us"] = at(0.99);
    state.counters["cuts"] = static_cast<double>(us.size());
  }
};

// Other work of the process: it leaves nothing of ours in the caches.
void flush_caches() {
  static std::vector<std::uint64_t> memory(std::size_t{12} << 20);
  for (std::size_t i = 0; i < memory.size(); i += 8) memory[i] += i;
  benchmark::ClobberMemory();
}

// A fresh place for every cut: none of its leaves is there yet, and the caches hold other work.
void cold(benchmark::State& state, Cut (*cut_at)(const Vec3&)) {
  const Threads threads(state.range(0));
  Times times;
  CutReport report;
  for (auto _ : state) {
    CutField field(bone(), BodyId{});
    double sum = 0.0;
    for (int i = 0; i < 400; ++i) {
      const Cut cut = cut_at({-24.0 + 2.4 * (i % 20) + 0.01 * i, -24.0 + 2.4 * (i / 20), i % 7 * 0.037});
      if (i % 4 == 0) {
        flush_caches();
      }
      const auto start = Clock::now();
      report = field.apply(cut);
      const double us = us_since(start);
      sum += us;
      times.us.push_back(us);
    }
    state.SetIterationTime(sum / 400 * 1e-6);
  }
  times.report(state);
  count_samples(state, static_cast<double>(report.visited), static_cast<double>(report.computed), static_cast<double>(report.modified));
}

// The plain way, §5.4 of the dissertation: walk the voxels of the World Bounding Block, here of the swept tool and grown
// by the band; reject those outside the Local Bounding Block, compute the tool's distance for the others, and write the
// lower of it and the voxel's value by an accessor.
void world_box(benchmark::State& state, const Cut& cut) {
  const Tool tool = [&] {
    for (const Tool& t : builtin_tools())
      if (t.hash() == cut.tool) return t;
    OSTEON_CHECK(false);
    return Tool{};
  }();
  const CutBody body = tool.cut_body();
  const double pitch = level_pitch_mm(kPitch_mm, cut.level);
  const SweptTool swept(cut, body, kPitch_mm);
  const float band = band_mm(pitch);
  const auto band_d = static_cast<double>(band);
  Box world;
  for (const ToolSweep& sweep : swept.sweeps())
    for (int corner = 0; corner < 2; ++corner) {
      const double* p = corner ? sweep.max_mm : sweep.min_mm;
      world.include({p[0], p[1], p[2]});
    }
  const CoordBox box = covering_samples(world.grown(band_d), pitch);
  const Pose from = dequantise(cut.path.front()), to = dequantise(cut.path.back());
  const Vec3 motion = from.inverse().direction(to.position_mm - from.position_mm);
  Box local;
  for (const Vec3& shift : {Vec3(Vec3::Zero()), motion}) {
    local.include(Vec3(body.lowest[0], body.lowest[1], body.lowest[2]) * kQuantum_mm + shift);
    local.include(Vec3(body.highest[0], body.highest[1], body.highest[2]) * kQuantum_mm + shift);
  }
  local = local.grown(band_d);
  const Pose to_tool = from.inverse();
  const auto is_ball = body.kind == CutKind::ball;
  const double radius = is_ball ? body.radius * kQuantum_mm : 0.0;
  // The outline's edges, as the tool's implicit function has them.
  struct Edge {
    double r, s, er, es, length;
  };
  std::vector<Edge> edges;
  const double stretch = std::min(0.0, -motion.z());  // of a drill going in: its back stays where it was
  for (std::size_t i = 0; i < body.profile.size(); ++i) {
    const ProfileCorner &a = body.profile[i], &b = body.profile[(i + 1) % body.profile.size()];
    if (a.r == 0 && b.r == 0) continue;
    const double r0 = a.r * kQuantum_mm, r1 = b.r * kQuantum_mm;
    double s0 = a.z * kQuantum_mm, s1 = b.z * kQuantum_mm;
    if (a.z * kQuantum_mm == local.min_mm.z() + band_d) s0 += stretch;
    if (b.z * kQuantum_mm == local.min_mm.z() + band_d) s1 += stretch;
    const double length = std::hypot(r1 - r0, s1 - s0);
    edges.push_back({r0, s0, (r1 - r0) / length, (s1 - s0) / length, length});
  }
  const auto distance = [&](const Vec3& p) {
    if (is_ball) {
      const Vec3 q = p + Vec3(0, 0, radius);
      const double t = std::clamp(q.dot(motion) / motion.squaredNorm(), 0.0, 1.0);
      return (q - t * motion).norm() - radius;
    }
    const double r = std::sqrt(p.x() * p.x() + p.y() * p.y()), s = p.z() - motion.z();
    double inside = -1e9, outside = 1e9;
    for (const Edge& e : edges) {
      const double dr = r - e.r, ds = s - e.s, along = std::clamp(dr * e.er + ds * e.es, 0.0, e.length);
      inside = std::max(inside, dr * e.es - ds * e.er);
      const double qr = dr - along * e.er, qs = ds - along * e.es;
      outside = std::min(outside, qr * qr + qs * qs);
    }
    return inside > 0.0 ? std::sqrt(outside) : inside;
  };

  const auto grid = openvdb::FloatGrid::create(band);
  std::int64_t visited = 0, computed = 0, modified = 0, first_modified = -1;
  for (auto _ : state) {
    auto accessor = grid->getAccessor();
    visited = computed = modified = 0;
    for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
      for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
        for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
          ++visited;
          const Vec3 p = to_tool.point(position_mm({x, y, z}, pitch));
          if ((p.array() < local.min_mm.array()).any() || (p.array() > local.max_mm.array()).any()) continue;
          ++computed;
          const double d = std::clamp(distance(p), -band_d, band_d);
          const auto rounded = static_cast<float>(std::nearbyint(d * 1024.0) / 1024.0);
          const openvdb::Coord xyz(x, y, z);
          if (rounded < accessor.getValue(xyz)) {
            accessor.setValue(xyz, rounded);
            ++modified;
          }
        }
    if (first_modified < 0) first_modified = modified;
  }
  count_samples(state, static_cast<double>(visited), static_cast<double>(computed), static_cast<double>(first_modified));
}

// The accessor again, but with the kernel's own distances and only for leaves near the tool: what is left when the plain
// way is given our culling.
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

// Working motion, tip and axis: what turns in bone along its axis goes in at a millimetre a second (20 for what is driven
// by blows), what mills and saws moves across at 15; all with the tilt of a hand, 0.1 rad/s.
struct Motion {
  Vec3 way_mm_s;
  double tilt_rad_s = 0.1;
};

Motion motion_of(const Tool& tool) {
  switch (tool.kind) {
    case ToolKind::round_burr:
    case ToolKind::barrel_burr:
    case ToolKind::contoured_burr: return {{15, 0, -1}};
    case ToolKind::oscillating_saw: return {{1, 0, -5}};
    case ToolKind::reciprocating_saw: return {{10, 0, -1}};
    case ToolKind::broach: return {{0, 0, -20}};
    case ToolKind::screw: return {{0, 0, -2}};
    default: return {{0.2, 0, -1}};
  }
}

const Case& big_bone() {
  static const Case block = plain_block(110, 70, kPitch_mm);
  return block;
}

// Each cut goes on from the one before it, from the surface inwards.
void cut_with(benchmark::State& state, const Tool& tool) {
  const Threads threads(state.range(0));
  const Motion motion = motion_of(tool);
  Times times;
  double visited = 0, computed = 0, modified = 0, memory = 0;
  for (auto _ : state) {
    CutField field(big_bone(), BodyId{});
    const int cuts = 120;
    const int level = std::min(tool.cut_level, finest_level(kPitch_mm));
    double sum = 0.0;
    visited = computed = modified = 0;
    const auto pose_at = [&](int i) {
      const double t = i * kCutSeconds, tilt = motion.tilt_rad_s * t;
      // Begins with half a millimetre of its tip in the bone. Tilted from one rotation, so that it does not spin: a blade
      // that spins is another motion.
      Pose pose = pose_along(Vec3(0, 0, -0.5) + t * motion.way_mm_s, {0, 0, -1});
      pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(tilt, Vec3(0.3, 1.0, 0.0).normalized())) * pose.rotation;
      return pose;
    };
    for (int i = 0; i < cuts; ++i) {
      Cut cut = straight_cut(tool, Vec3::Zero(), Vec3::Zero(), {0, 0, -1});
      cut.level = level;
      cut.path = {quantise(pose_at(i)), quantise(pose_at(i + 1))};
      const auto start = Clock::now();
      const CutReport report = field.apply(cut);
      const double us = us_since(start);
      sum += us;
      times.us.push_back(us);
      visited += static_cast<double>(report.visited) / cuts;
      computed += static_cast<double>(report.computed) / cuts;
      modified += static_cast<double>(report.modified) / cuts;
    }
    memory = static_cast<double>(field.memory_bytes());
    state.SetIterationTime(sum / cuts * 1e-6);
    state.counters["pitch_mm"] = level_pitch_mm(kPitch_mm, level);
  }
  times.report(state);
  count_samples(state, visited, computed, modified);
  state.counters["memory_bytes"] = memory;
}

template <class Run>
void add(const std::string& name, Run run) {
  benchmark::RegisterBenchmark(name.c_str(), run)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond)->UseRealTime();
}
template <class Run>
void add_timed(const std::string& name, Run run, int iterations) {
  benchmark::RegisterBenchmark(name.c_str(), run)->ArgName("threads")->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond)->UseManualTime()->Iterations(iterations);
}
template <class Run>
void add_plain(const std::string& name, Run run) {
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond)->UseRealTime();
}

const bool registered = [] {
  add("cut_burr/hot", [](benchmark::State& state) { hot(state, burr_cut()); });
  add_plain("cut_burr/world_box", [](benchmark::State& state) { world_box(state, burr_cut()); });
  add_plain("cut_burr/near_leaves", [](benchmark::State& state) { near_leaves(state, burr_cut()); });
  add_timed("cut_burr/cold", [](benchmark::State& state) { cold(state, burr_cut); }, 2);
  add("cut_drill/hot", [](benchmark::State& state) { hot(state, drill_cut()); });
  add_plain("cut_drill/world_box", [](benchmark::State& state) { world_box(state, drill_cut()); });
  add_plain("cut_drill/near_leaves", [](benchmark::State& state) { near_leaves(state, drill_cut()); });
  add_timed("cut_drill/cold", [](benchmark::State& state) { cold(state, drill_cut); }, 2);
  for (const Tool& tool : builtin_tools())
    if (tool.cuts()) add_timed("cut_tool/" + tool.name, [tool](benchmark::State& state) { cut_with(state, tool); }, 1);
  return true;
}();

}  // namespace
}  // namespace osteon::test
