// Cost of finding fragments: labelling a ball of bone at first, updating the labels after cuts, and taking a half that
// a kerf separated. Also the cost of building the ball's case part by part. Takes the ball's size in samples. Prints
// JSON.
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/fragments.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;

double ms_since(std::chrono::steady_clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void print(const char* name, std::vector<double> values) {
  std::ranges::sort(values);
  std::printf("\"%s_p50\": %.4f, \"%s_max\": %.4f, ", name, values[values.size() / 2], name, values.back());
}

int run(int samples) {
  const double radius_mm = 0.5 * samples * kPitch_mm;
  auto start = std::chrono::steady_clock::now();
  const Case built = large_ball(radius_mm, kPitch_mm);
  const double build_ms = ms_since(start);
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  std::printf("{\"samples\": %d, \"build_ms\": %.1f, \"case_megabytes\": %.2f, \"peak_megabytes\": %.1f, ", samples,
              build_ms, static_cast<double>(built.memory_bytes()) * 1e-6, static_cast<double>(used.ru_maxrss) * 1e-3);

  CutField field(built, {});
  start = std::chrono::steady_clock::now();
  FragmentFinder finder(field);
  std::printf("\"label_ms\": %.1f, ", ms_since(start));

  const auto burr = find_tool("burr-round-5");
  OSTEON_CHECK(burr.has_value());
  std::vector<double> touch_ms, search_ms;
  Vec3 at{0, 0, radius_mm - 1.5};
  for (int i = 0; i < 100; ++i) {
    const Vec3 next = at + Vec3{0.12, 0.02, 0};
    const CutReport report = field.apply(straight_cut(*burr, at, next, {0, 0, -1}));
    at = next;
    start = std::chrono::steady_clock::now();
    finder.touch(field, report.level, report.changed_leaves);
    touch_ms.push_back(ms_since(start));
    start = std::chrono::steady_clock::now();
    OSTEON_CHECK(finder.take_fragments(field).empty());
    search_ms.push_back(ms_since(start));
  }
  print("touch_ms", touch_ms);
  print("search_ms", search_ms);

  // A kerf of 1 mm across a cap 6 mm high, as leaves of the finest level.
  const double x0 = radius_mm - 6.0, pitch = level_pitch_mm(kPitch_mm, 2);
  const std::int32_t band = band_quanta(pitch);
  const double cap = std::sqrt(radius_mm * radius_mm - x0 * x0) + 2.0;
  const CoordBox box = covering_samples(Box{{x0 - 1.5, -cap, -cap}, {x0 + 1.5, cap, cap}}, pitch);
  const Coord first = floor_to(box.min, kLeafSize);
  std::vector<Coord> changed;
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize) {
        FieldLeaf leaf{{}, 2, {x, y, z}, std::vector<std::int16_t>(kLeafVoxels)};
        bool cuts = false;
        for (std::int32_t i = 0; i < kLeafVoxels; ++i) {
          const double mm = std::abs((x + i / 64) * pitch - x0) - 0.5;
          leaf.values[static_cast<std::size_t>(i)] =
              static_cast<std::int16_t>(std::clamp(std::lround(mm * 1024.0), -long{band}, long{band}));
          cuts |= leaf.values[static_cast<std::size_t>(i)] < band;
        }
        if (!cuts || !built.has_bone({shift_down({x, y, z}, 2), shift_down({x + 7, y + 7, z + 7}, 2)})) continue;
        field.restore(leaf);
        changed.push_back({x, y, z});
      }
  start = std::chrono::steady_clock::now();
  const TouchCost cost = finder.touch(field, 2, changed);
  const double kerf_ms = ms_since(start);
  start = std::chrono::steady_clock::now();
  const auto pieces = finder.take_fragments(field);
  const double height = 6.0 - 0.5;
  const double exact = 3.14159265358979 * height * height * (3.0 * radius_mm - height) / 3.0;
  std::printf(
      "\"kerf_cells\": %zu, \"kerf_touch_ms\": %.1f, \"take_ms\": %.1f, \"pieces\": %zu, \"volume_error\": %.5f, ",
      cost.cells, kerf_ms, ms_since(start), pieces.size(), pieces.empty() ? 1.0 : pieces[0].volume_mm3 / exact - 1.0);
  std::printf("\"taken_leaves\": %zu, \"left_leaves\": %zu}\n", pieces.empty() ? 0 : pieces[0].taken.size(),
              pieces.empty() ? 0 : pieces[0].left.size());
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const int samples = argc > 1 ? std::atoi(argv[1]) : 0;
  if (samples < 40) {
    std::fprintf(stderr, "osteon-pieces-bench: needs the ball's size in samples, 40 or more\n");
    return 1;
  }
  return osteon::test::run(samples);
}
