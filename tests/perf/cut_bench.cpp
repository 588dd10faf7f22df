// What one cut of a haptic client (8 ms of tool path) costs at a pitch of 0.125 mm, against the plain way of writing
// it: every voxel of the cut's box by an OpenVDB ValueAccessor.
#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>
#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;  // so a cut at level 2 has 0.125 mm
constexpr double kCutSeconds = 0.008;

Tool tool_named(const char* name) {
  auto tool = find_tool(name);
  OSTEON_CHECK(tool.has_value());
  tool->cut_level = 2;
  return *tool;
}

// A burr half in bone moving sideways, and a drill going in.
Cut burr_cut() {
  return straight_cut(tool_named("burr-round-5"), {0, 0, -1.5}, {15 * kCutSeconds, 0, -1.5}, {0, 0, -1});
}
Cut drill_cut() { return straight_cut(tool_named("drill-3.2"), {0, 0, -6}, {0, 0, -6 - 1 * kCutSeconds}, {0, 0, -1}); }

const Case& bone() {
  static const Case block = plain_block(20, 10, kPitch_mm);
  return block;
}

void apply(benchmark::State& state, const Cut& cut) {
  CutField field(bone(), BodyId{});
  std::int64_t visited = 0;
  for (auto _ : state) visited = field.apply(cut).visited;
  state.counters["visited_samples"] = static_cast<double>(visited);
}

// The same samples and the same distances, one voxel at a time.
void apply_plainly(benchmark::State& state, const Cut& cut) {
  const auto tools = builtin_tool_box();
  const SweptTool swept(cut, tools->find(cut.tool)->body, kPitch_mm);
  const auto leaves = swept.leaves();
  OSTEON_CHECK(!leaves.empty());
  const float band = band_mm(swept.level_pitch_mm());
  const auto grid = openvdb::FloatGrid::create(band);
  for (auto _ : state) {
    auto accessor = grid->getAccessor();
    for (const Coord& leaf : leaves) {
      for (std::int32_t i = 0; i < kLeafVoxels; ++i) {
        const Coord c = leaf + Coord{i / (kLeafSize * kLeafSize), i / kLeafSize % kLeafSize, i % kLeafSize};
        const openvdb::Coord xyz(c.x, c.y, c.z);
        const float distance = swept.distance_mm(position_mm(c, swept.level_pitch_mm()));
        const float old = accessor.getValue(xyz);
        if (distance < old) accessor.setValue(xyz, std::nearbyint(std::max(distance, -band) * 1024.0f) / 1024.0f);
      }
    }
  }
  state.counters["visited_samples"] = static_cast<double>(leaves.size() * kLeafVoxels);
}

void cut_burr(benchmark::State& state) { apply(state, burr_cut()); }
void cut_burr_plain(benchmark::State& state) { apply_plainly(state, burr_cut()); }
void cut_drill(benchmark::State& state) { apply(state, drill_cut()); }
void cut_drill_plain(benchmark::State& state) { apply_plainly(state, drill_cut()); }

BENCHMARK(cut_burr)->Unit(benchmark::kMicrosecond);
BENCHMARK(cut_burr_plain)->Unit(benchmark::kMicrosecond);
BENCHMARK(cut_drill)->Unit(benchmark::kMicrosecond);
BENCHMARK(cut_drill_plain)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace osteon::test
