// Cost of a cut as the bone grows, and the memory of cuts. Takes the bones' sizes in samples per axis and prints JSON.
#include <malloc.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <vector>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/known_cuts.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;
constexpr std::size_t kCuts = 400, kBatch = 50;

// Memory that the system gives for the first time costs more than a cut, and a server has it before the first cut.
// Keeps `bytes` of it ready in the heap.
void warm_heap(std::size_t bytes) {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // larger values are refused
  mallopt(M_TRIM_THRESHOLD, 2'000'000'000);
  constexpr std::size_t kPart = 1 << 20;
  std::vector<std::unique_ptr<char[]>> parts;
  for (std::size_t i = 0; i < bytes / kPart; ++i) {
    parts.push_back(std::make_unique_for_overwrite<char[]>(kPart));
    std::fill_n(parts.back().get(), kPart, '\1');
  }
}

// Bytes in the heap. This program has one thread, so all of it is in the main arena or mapped.
double heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

double quantile(std::vector<double> values, double part) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Grown {
  int samples;
  double bone_bytes;
  std::unique_ptr<CutField> field;
  std::vector<Vec3> places;
  std::vector<double> us;
  double bytes = 0;
};

double median_of(const std::vector<double>& values, std::size_t first) {
  const auto from = values.begin() + static_cast<std::ptrdiff_t>(first);
  return quantile({from, from + static_cast<std::ptrdiff_t>(kBatch)}, 0.5);
}

Cut burr_stroke(const Tool& burr, const Vec3& middle, const Vec3& way) {
  return straight_cut(burr, middle - 0.5 * way, middle + 0.5 * way, {0, 0, -1});
}

// A cube of bone with `samples` per axis, made in parts: the largest would not fit into memory as a whole.
Case cube_of_bone(int samples) {
  const std::int32_t half = samples / 2 - 5;
  const double reach = half * kPitch_mm, band = kBandVoxels * kPitch_mm;
  const auto distance = [=](Coord c) {
    return std::max({std::abs(c.x), std::abs(c.y), std::abs(c.z)}) * kPitch_mm - reach;
  };
  const auto fill = [=](const CoordBox& box, PartSamples& samples) {
    std::ranges::fill(samples.density_g_cm3, 1.9f);
    const auto deepest = [](std::int32_t low, std::int32_t high) { return std::max(std::abs(low), std::abs(high)); };
    const Coord far{deepest(box.min.x, box.max.x), deepest(box.min.y, box.max.y), deepest(box.min.z, box.max.z)};
    if (distance(far) < -band) return PartKind::inside;
    std::size_t i = 0;
    for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
      for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
        for (std::int32_t z = box.min.z; z <= box.max.z; ++z)
          samples.surface_mm[i++] = static_cast<float>(distance({x, y, z}));
    return PartKind::samples;
  };
  const std::int32_t end = half + kBandVoxels + 1;
  const CaseInfo info{
      .title = "Cube", .source = "closed form", .pitch_mm = kPitch_mm, .calibration = {}, .threshold_hu = 0.0};
  auto built = Case::build(info, CoordBox{{-end, -end, -end}, {end, end, end}}, fill);
  OSTEON_CHECK(built.has_value());
  return *built;
}

// Positions for cuts that are farther apart than the reach of a bur and its bands, so that every cut finds the same
// untouched bone. The number is the same in every bone, spread over all of it.
std::vector<Vec3> apart(double width_mm, Random& random) {
  constexpr double kCell_mm = 6.0;
  const auto cells = static_cast<std::size_t>((width_mm - 4.0) / kCell_mm);
  std::vector<std::size_t> taken;
  std::vector<Vec3> places;
  while (places.size() < kCuts) {
    const std::size_t cell = random.index(cells * cells * cells);
    if (std::ranges::find(taken, cell) != taken.end()) continue;
    taken.push_back(cell);
    const auto along = [&](std::size_t i) {
      return (static_cast<double>(i % cells) + 0.5 - 0.5 * static_cast<double>(cells)) * kCell_mm;
    };
    places.push_back(Vec3{along(cell / cells / cells), along(cell / cells), along(cell)} + random.in_cube(0.5));
  }
  return places;
}

// Makes the same number of cuts in every bone, in turn.
void cost_of_size(const std::vector<int>& sizes, const Tool& burr) {
  std::vector<Grown> bones;
  for (const int samples : sizes) {
    std::fprintf(stderr, "bone of %d^3 samples\n", samples);
    const double width = (samples - 10) * kPitch_mm;
    Random random(static_cast<std::uint64_t>(samples));
    const double before = heap_bytes();
    auto field = std::make_unique<CutField>(cube_of_bone(samples), BodyId{});
    bones.push_back({samples, heap_bytes() - before, std::move(field), apart(width, random), {}, 0});
  }
  warm_heap(sizes.size() * kCuts * 300'000);
  for (std::size_t i = 0; i < kCuts; ++i)
    for (Grown& bone : bones) {
      const Cut cut = burr_stroke(burr, bone.places[i], {0.12, 0.0, 0.0});
      const double before = heap_bytes();
      const auto start = std::chrono::steady_clock::now();
      const CutReport report = bone.field->apply(cut);
      bone.us.push_back(1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
      bone.bytes += heap_bytes() - before - static_cast<double>(report.changed_leaves.capacity() * sizeof(Coord));
    }
  std::printf("\"sizes\": [");
  for (std::size_t b = 0; b < bones.size(); ++b) {
    Grown& bone = bones[b];
    // The cuts of all sizes take turns, so a lasting disturbance of the machine affects all. Compares medians of
    // batches.
    std::vector<double> ratios;
    for (std::size_t i = 0; i + kBatch <= kCuts; i += kBatch)
      ratios.push_back(median_of(bone.us, i) / median_of(bones[0].us, i));
    std::printf(
        "%s{\"samples\": %d, \"cuts\": %zu, \"us_min\": %.3f, \"us_p50\": %.3f, \"us_p99\": %.3f, \"ratio_p50\": %.4f, "
        "\"ratio_min\": %.4f, \"ratio_max\": %.4f, \"bytes_per_cut\": %.0f, \"bone_bytes\": %.0f}",
        b == 0 ? "" : ", ", bone.samples, kCuts, quantile(bone.us, 0), quantile(bone.us, 0.5), quantile(bone.us, 0.99),
        quantile(ratios, 0.5), quantile(ratios, 0), quantile(ratios, 1), bone.bytes / static_cast<double>(kCuts),
        bone.bone_bytes);
  }
  std::printf("]");
}

// Grooves of one bur side by side, of many lengths: what each of them removes, and what it adds to the field's memory.
void memory_of_cuts(const Tool& burr) {
  const double radius = 0.5 * burr.diameter_mm, width = 120.0;
  CutField field(plain_block(width, 6.0, kPitch_mm), BodyId{});
  Random random(4);
  std::printf("{\"tool\": \"%s\", \"diameter_mm\": %g, \"grooves\": [", burr.name.c_str(), burr.diameter_mm);
  const double row = burr.diameter_mm + 3.0;  // farther apart than two bands and a leaf, so that no two share a leaf
  bool head = true;
  for (double y = -0.5 * width + row; y < 0.5 * width - row; y += row)
    for (double x = -0.5 * width + row;;) {
      const double length = random.between(1.0, 40.0);
      if (x + length > 0.5 * width - row) break;
      const double before = heap_bytes();
      // The ball's centre is on the bone's face, so half of a capsule is cut.
      field.apply(straight_cut(burr, {x, y, -radius}, {x + length, y, -radius}, {0, 0, -1}));
      const double bytes = heap_bytes() - before;
      const double area = std::numbers::pi * radius * length + 2.0 * std::numbers::pi * radius * radius;
      const double volume = std::numbers::pi * radius * radius * (0.5 * length + 2.0 / 3.0 * radius);
      std::printf("%s{\"area_mm2\": %.3f, \"volume_mm3\": %.3f, \"bytes\": %.0f}", head ? "" : ", ", area, volume,
                  bytes);
      x += length + row;
      head = false;
    }
  std::printf("]}");
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  using namespace osteon::test;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<int> sizes;
  for (int i = 1; i < argc; ++i) sizes.push_back(std::atoi(argv[i]));
  const auto burr = nearest_tool(osteon::ToolKind::round_burr, 3.2),
             large = nearest_tool(osteon::ToolKind::round_burr, 6.0);
  if (sizes.empty() || !burr || !large || std::ranges::any_of(sizes, [](int n) { return n < 32 || n > 2048; })) {
    std::fprintf(stderr, "osteon-growth: needs sizes in samples an axis, 32 to 2048 each\n");
    return 1;
  }
  std::printf("{\"tool\": \"%s\", ", burr->name.c_str());
  cost_of_size(sizes, *burr);
  std::printf(", \"memory\": [");
  memory_of_cuts(*burr);
  std::printf(", ");
  memory_of_cuts(*large);
  std::printf("]}\n");
}
