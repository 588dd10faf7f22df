// What a cut costs as the bone grows, and what memory cuts take. Takes the bones' sizes in samples an axis, prints JSON.
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <vector>

#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/known_cuts.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;
constexpr std::size_t kCuts = 400;

// What the heap holds; this program has one thread, so all of it is in the main arena or mapped.
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
  std::unique_ptr<CutField> field;
  std::vector<Vec3> places;
  std::vector<double> us;
  double bytes = 0;
};

Cut burr_stroke(const Tool& burr, const Vec3& middle, const Vec3& way) {
  return straight_cut(burr, middle - 0.5 * way, middle + 0.5 * way, {0, 0, -1});
}

// Places for cuts that are farther apart than a bur and its bands reach, so that every cut finds the same: bone that
// nothing has touched. As many in every bone, spread over all of it.
std::vector<Vec3> apart(double width_mm, Random& random) {
  constexpr double kCell_mm = 6.0;
  const auto cells = static_cast<std::size_t>((width_mm - 4.0) / kCell_mm);
  std::vector<std::size_t> taken;
  std::vector<Vec3> places;
  while (places.size() < kCuts) {
    const std::size_t cell = random.index(cells * cells * cells);
    if (std::ranges::find(taken, cell) != taken.end()) continue;
    taken.push_back(cell);
    const auto along = [&](std::size_t i) { return (static_cast<double>(i % cells) + 0.5 - 0.5 * static_cast<double>(cells)) * kCell_mm; };
    places.push_back(Vec3{along(cell / cells / cells), along(cell / cells), along(cell) - 0.5 * width_mm} + random.in_cube(0.5));
  }
  return places;
}

// The same number of cuts in every bone, in turn.
void cost_of_size(const std::vector<int>& sizes, const Tool& burr) {
  std::vector<Grown> bones;
  for (const int samples : sizes) {
    std::fprintf(stderr, "bone of %d^3 samples\n", samples);
    const double width = (samples - 10) * kPitch_mm;
    Random random(static_cast<std::uint64_t>(samples));
    bones.push_back({samples, std::make_unique<CutField>(plain_block(width, width, kPitch_mm), BodyId{}), apart(width, random), {}, 0});
  }
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
    // Of each round's pair: what disturbs the machine for long disturbs both.
    std::vector<double> ratios;
    for (std::size_t i = 0; i < bone.us.size(); ++i) ratios.push_back(bone.us[i] / bones[0].us[i]);
    std::printf("%s{\"samples\": %d, \"cuts\": %zu, \"us_min\": %.3f, \"us_p50\": %.3f, \"us_p99\": %.3f, \"ratio_p50\": %.4f, "
                "\"bytes_per_cut\": %.0f}",
                b == 0 ? "" : ", ", bone.samples, kCuts, quantile(bone.us, 0), quantile(bone.us, 0.5), quantile(bone.us, 0.99),
                quantile(ratios, 0.5), bone.bytes / static_cast<double>(kCuts));
  }
  std::printf("]");
}

// Grooves of one bur side by side, of many lengths: memory of the field against what was cut, both from zero.
void memory_of_cuts(const Tool& burr) {
  const double radius = 0.5 * burr.diameter_mm, width = 120.0;
  CutField field(plain_block(width, 6.0, kPitch_mm), BodyId{});
  Random random(4);
  const double first = heap_bytes();
  double area = 0.0, volume = 0.0;
  std::printf("\"memory\": [");
  const double row = burr.diameter_mm + 2.0;  // farther apart than two bands
  bool head = true;
  for (double y = -0.5 * width + row; y < 0.5 * width - row; y += row)
    for (double x = -0.5 * width + row;;) {
      const double length = random.between(1.0, 12.0);
      if (x + length > 0.5 * width - row) break;
      // The ball's centre is in the bone's face, so half of a capsule is cut.
      field.apply(straight_cut(burr, {x, y, -radius}, {x + length, y, -radius}, {0, 0, -1}));
      area += std::numbers::pi * radius * length + 2.0 * std::numbers::pi * radius * radius;
      volume += 0.5 * std::numbers::pi * radius * radius * length + 2.0 / 3.0 * std::numbers::pi * radius * radius * radius;
      x += length + row;
      std::printf("%s{\"area_mm2\": %.3f, \"volume_mm3\": %.3f, \"bytes\": %.0f}", head ? "" : ", ", area, volume, heap_bytes() - first);
      head = false;
    }
  std::printf("]");
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  using namespace osteon::test;
  std::vector<int> sizes;
  for (int i = 1; i < argc; ++i) sizes.push_back(std::atoi(argv[i]));
  const auto burr = nearest_tool(osteon::ToolKind::round_burr, 3.2);
  if (sizes.empty() || !burr || std::ranges::any_of(sizes, [](int n) { return n < 32 || n > 2048; })) {
    std::fprintf(stderr, "osteon-growth: needs sizes in samples an axis, 32 to 2048 each\n");
    return 1;
  }
  std::printf("{\"tool\": \"%s\", ", burr->name.c_str());
  cost_of_size(sizes, *burr);
  std::printf(", ");
  memory_of_cuts(*burr);
  std::printf("}\n");
}
