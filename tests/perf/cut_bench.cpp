// Cost of one cut of a haptic client (8 ms of tool path) with cold caches, and of a cut with each tool at its own
// level, with the memory that its field takes. cut_versus.cpp compares cuts with the baselines.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/perf/cold_caches.hpp"
#include "tests/perf/cut_scenes.hpp"

namespace osteon::test {
namespace {

void count_samples(benchmark::State& state, double visited, double computed, double modified) {
  state.counters["visited"] = visited;
  state.counters["computed"] = computed;
  state.counters["modified"] = modified;
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

// Each cut is made in untouched bone, and the caches hold other work. Every leaf that a cut changes is new.
void cold(benchmark::State& state, Cut (*cut_at)(const Vec3&), Heap heap) {
  constexpr int kPlaces = 200;
  const Threads threads(state.range(0));
  const std::vector<Cut> cuts = scattered_cuts(cut_at, kPlaces);
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
  static const Case block = plain_block(90, 140, kCutPitch_mm);
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
    const int level = std::min(tool.cut_level, finest_level(kCutPitch_mm));
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
    state.counters["pitch_mm"] = level_pitch_mm(kCutPitch_mm, level);
  }
  times.report(state);
  count_samples(state, visited, computed, modified);
  state.counters["memory_bytes"] = memory;
  state.counters["depth_mm"] = depth;
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

const bool registered = [] {
  add_timed(
      "cut_burr/cold", [](benchmark::State& state) { cold(state, burr_cut, Heap::reserved); }, 1);
  add_timed(
      "cut_burr/cold_given", [](benchmark::State& state) { cold(state, burr_cut, Heap::given); }, 1);
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
