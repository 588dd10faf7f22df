// Cuts of a burr and of a drill in turns with the baselines (tests/perf/baselines), with warm and with cold caches. The
// ratio is that of the fastest baseline over ours: above 1, ours is faster.
#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/perf/baselines/csg_cut.hpp"
#include "tests/perf/baselines/dense_cut.hpp"
#include "tests/perf/baselines/leaf_cut.hpp"
#include "tests/perf/cold_caches.hpp"
#include "tests/perf/cut_scenes.hpp"

namespace osteon::test {
namespace {

using baselines::SweptShape;

// Everyone who makes the cuts; "_2": with two threads.
enum Who : std::size_t { ours, ours_2, dense, dense_2, leaves, leaves_2, kFast, csg = kFast, kAll };
constexpr std::array<const char*, kAll> kNames{"ours", "ours_2", "dense", "dense_2", "leaves", "leaves_2", "csg"};
constexpr bool has_two(std::size_t who) { return who == ours_2 || who == dense_2 || who == leaves_2; }

// The bones of everyone. Whoever has two threads has a bone of their own.
struct Bones {
  explicit Bones(const Case& bone)
      : fields{CutField(bone, BodyId{}), CutField(bone, BodyId{})},
        box{4 * bone.bounds_samples().min, 4 * bone.bounds_samples().max} {
    openvdb::initialize();
    for (int i = 0; i < 2; ++i) {
      arrays.push_back(std::make_unique<baselines::DenseCut>(min(), max(), pitch, band));
      grids.push_back(std::make_unique<baselines::LeafCut>(min(), max(), pitch, band));
    }
  }
  [[nodiscard]] std::array<int, 3> min() const { return {box.min.x, box.min.y, box.min.z}; }
  [[nodiscard]] std::array<int, 3> max() const { return {box.max.x, box.max.y, box.max.z}; }

  // Time of one cut, us.
  double apply(std::size_t who, const Cut& cut, const SweptShape& shape) {
    const std::size_t i = has_two(who) ? 1 : 0;
    const int threads = has_two(who) ? 2 : 1;
    const auto start = Clock::now();
    switch (who) {
      case ours:
      case ours_2:
        benchmark::DoNotOptimize(fields[i].apply(cut).modified);
        break;
      case dense:
      case dense_2:
        arrays[i]->apply(shape, threads);
        break;
      case leaves:
      case leaves_2:
        grids[i]->apply(shape, threads);
        break;
      default:
        level_set->apply(shape);
    }
    return us_since(start);
  }

  std::array<CutField, 2> fields;
  CoordBox box;
  float pitch = static_cast<float>(level_pitch_mm(kCutPitch_mm, 2)), band = band_mm(level_pitch_mm(kCutPitch_mm, 2));
  std::vector<std::unique_ptr<baselines::DenseCut>> arrays;
  std::vector<std::unique_ptr<baselines::LeafCut>> grids;
  std::unique_ptr<baselines::CsgCut> level_set;
};

// All must hold the same bone wherever ours stores any. Returns the part of the samples that are a quantum apart, as
// baselines round in another order. perf.baselines compares them in full.
double share_apart(const Bones& bones) {
  OSTEON_CHECK(bones.fields[0].hash() == bones.fields[1].hash());
  std::int64_t differing = 0, compared = 0;
  for (const FieldLeaf& leaf : bones.fields[0].leaves())
    for (std::int32_t i = 0; i < kLeafVoxels; ++i) {
      const Coord c = leaf.origin + Coord{i / 64, i / 8 % 8, i % 8};
      if (!bones.box.contains(c)) continue;
      const std::int16_t mine = leaf.values[leaf.values.size() == 1 ? 0 : static_cast<std::size_t>(i)];
      for (std::size_t k = 0; k < 2; ++k)
        for (const float value : {bones.arrays[k]->at(c.x, c.y, c.z), bones.grids[k]->at(c.x, c.y, c.z)}) {
          const auto apart = std::abs(static_cast<std::int32_t>(std::lround(value * 1024.0f)) - mine);
          OSTEON_CHECK(apart <= 1);
          differing += apart;
          ++compared;
        }
    }
  OSTEON_CHECK(compared > 0);
  return static_cast<double>(differing) / static_cast<double>(compared);
}

double middle_of(std::vector<double> values) {
  OSTEON_CHECK(!values.empty());
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

using AllTimes = std::array<Times, kAll>;

// The fastest baseline by its median: for one thread among those with one, for two among all.
std::size_t fastest(const AllTimes& all, bool two) {
  std::size_t best = dense;
  for (std::size_t who = dense; who < kAll; ++who)
    if (!all[who].us.empty() && (two || !has_two(who)) && middle_of(all[who].us) < middle_of(all[best].us)) best = who;
  return best;
}

// `parts`: the same, in parts of the run that show how much the ratio varies.
void report_ratios(benchmark::State& state, AllTimes& all, const std::vector<AllTimes>& parts) {
  for (const bool two : {false, true}) {
    const std::size_t best = fastest(all, two), mine = two ? ours_2 : ours;
    const auto ratio = [&](const AllTimes& of) { return middle_of(of[best].us) / middle_of(of[mine].us); };
    std::vector<double> ratios;
    for (const AllTimes& part : parts) ratios.push_back(ratio(part));
    const std::string name = two ? "ratio_2" : "ratio";
    state.counters[name] = ratio(all);
    state.counters[name + "_min"] = std::ranges::min(ratios);
    state.counters[name + "_max"] = std::ranges::max(ratios);
    state.counters[two ? "fastest_2" : "fastest"] = static_cast<double>(best);
  }
  for (std::size_t who = 0; who < kAll; ++who)
    if (!all[who].us.empty()) all[who].report(state, std::string(kNames[who]) + "_");
}

void add_to(AllTimes& all, const AllTimes& part) {
  for (std::size_t who = 0; who < kAll; ++who)
    all[who].us.insert(all[who].us.end(), part[who].us.begin(), part[who].us.end());
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

std::vector<SweptShape> shapes_of(const std::vector<Cut>& cuts) {
  std::vector<SweptShape> shapes;
  for (const Cut& cut : cuts) shapes.push_back(baselines::swept_shape(cut, kCutPitch_mm));
  return shapes;
}

// Everyone makes the same cuts, and takes turns after some cuts each. The shapes of the baselines are made beforehand.
// csgDifference takes milliseconds: it makes the first cuts of the first pass only.
void work(benchmark::State& state, const std::vector<Cut>& cuts) {
  constexpr int kPasses = 5;
  constexpr std::size_t kTurn = 20, kCsgCuts = 100;
  static const Case bone = plain_block(60, 16, kCutPitch_mm);
  const std::vector<SweptShape> shapes = shapes_of(cuts);
  AllTimes all;
  std::vector<AllTimes> passes;
  for (auto _ : state)
    for (int pass = 0; pass < kPasses; ++pass) {
      Bones bones(bone);
      AllTimes& times = passes.emplace_back();
      for (std::size_t first = 0; first < cuts.size(); first += kTurn)
        for (std::size_t k = 0; k < kFast; ++k) {
          const std::size_t who = (k + first / kTurn + static_cast<std::size_t>(pass)) % kFast;
          const Threads threads(has_two(who) ? 2 : 1);
          for (std::size_t i = first; i < std::min(cuts.size(), first + kTurn); ++i)
            times[who].us.push_back(bones.apply(who, cuts[i], shapes[i]));
        }
      if (pass == 0) {
        state.counters["differing_share"] = share_apart(bones);
        const auto block = [](float x, float y, float z) {
          return std::max({std::abs(x) - 30.0f, std::abs(y) - 30.0f, std::abs(z + 8.0f) - 8.0f});
        };
        bones.level_set = std::make_unique<baselines::CsgCut>(bones.min(), bones.max(), bones.pitch, bones.band, block);
        const Threads threads(1);
        for (std::size_t i = 0; i < kCsgCuts; ++i) times[csg].us.push_back(bones.apply(csg, cuts[i], shapes[i]));
      }
      add_to(all, times);
    }
  report_ratios(state, all, passes);
}

// Each cut is made in untouched bone with cold caches. Ours and OpenVDB's leaves get their memory from the same
// reserve; all pages of the dense array are there already, which is in its favour.
void cold_versus(benchmark::State& state, Cut (*cut_at)(const Vec3&)) {
  constexpr int kPlaces = 100, kParts = 5;
  const std::vector<Cut> cuts = scattered_cuts(cut_at, kPlaces);
  const std::vector<SweptShape> shapes = shapes_of(cuts);
  AllTimes all;
  std::vector<AllTimes> parts(kParts);
  for (auto _ : state) {
    Bones bones(wide_bone());
    MemoryReserve reserve(kCutReserve);
    for (std::size_t i = 0; i < cuts.size(); ++i)
      for (std::size_t k = 0; k < kFast; ++k) {
        const std::size_t who = (k + i) % kFast;
        const Threads threads(has_two(who) ? 2 : 1);
        reserve.refill();
        flush_caches();
        parts[i * kParts / cuts.size()][who].us.push_back(bones.apply(who, cuts[i], shapes[i]));
      }
    state.counters["differing_share"] = share_apart(bones);
  }
  for (const AllTimes& part : parts) add_to(all, part);
  report_ratios(state, all, parts);
}

const bool registered = [] {
  const auto once = [](const char* name, auto run) {
    benchmark::RegisterBenchmark(name, run)->Iterations(1)->Unit(benchmark::kMillisecond);
  };
  once("cut_burr/work", [](benchmark::State& state) { work(state, burr_at_work()); });
  once("cut_drill/work", [](benchmark::State& state) { work(state, drill_at_work()); });
  once("cut_burr/versus_cold", [](benchmark::State& state) { cold_versus(state, burr_cut); });
  once("cut_drill/versus_cold", [](benchmark::State& state) { cold_versus(state, drill_cut); });
  return true;
}();

}  // namespace
}  // namespace osteon::test
