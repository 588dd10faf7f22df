// The two methods of raising the resolution (Niu 2008, §5.5, Table 5.4), at twice and four times. Measures the time of
// a cut that touches new bone and of later cuts, memory, unconnected areas, and the finest pitch that a given memory
// allows. Prints JSON.
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "common/volume/refinement.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;
constexpr int kCutsASite = 60;

double us_since(std::chrono::steady_clock::time_point start) {
  return 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void print(const std::string& name, std::vector<double> values) {
  std::ranges::sort(values);
  std::printf("\"%s_p50\": %.2f, \"%s_min\": %.2f, \"%s_max\": %.2f, ", name.c_str(), values[values.size() / 2],
              name.c_str(), values.front(), name.c_str(), values.back());
}

// A bur at four sites of the bone, with some tenths of a second of 8 ms strokes at each.
std::vector<std::vector<Cut>> strokes(int level) {
  const auto burr = find_tool("burr-round-5");
  OSTEON_CHECK(burr.has_value());
  std::vector<std::vector<Cut>> sites;
  for (const Vec3& site : {Vec3{-24, -24, -1.5}, Vec3{20, -22, -1.5}, Vec3{-20, 21, -1.5}, Vec3{24, 24, -1.5}}) {
    std::vector<Cut> cuts;
    Vec3 at = site;
    for (int i = 0; i < kCutsASite; ++i) {
      const double angle = 0.2 * i;
      const Vec3 next = site + Vec3{3.0 * std::cos(angle) - 3.0, 3.0 * std::sin(angle), -0.02 * i};
      cuts.push_back(straight_cut(*burr, at, next, {0, 0, -1}));
      cuts.back().level = level;
      at = next;
    }
    sites.push_back(std::move(cuts));
  }
  return sites;
}

struct Difference {
  std::size_t compared = 0, differing = 0, cut = 0;  // samples; `cut`: those that the cuts changed
};

// Compares the bone f of both methods on every sample of the level. One reads what was resampled, the other computes it
// from the coarse bone and the cuts. The boxes lie across the sub-volumes' faces.
Difference difference_of(const SubVolumeField& whole, const CutField& local, int level) {
  const CoordBox bounds = local.bone().bounds_samples();
  const std::int32_t n = kSubVolumeSamples, half = n / 2;
  const Coord first = floor_to(bounds.min, n) - Coord{half, half, half};
  Difference found;
  std::vector<float> a, b, uncut;
  for (std::int32_t x = first.x; x <= bounds.max.x; x += n)
    for (std::int32_t y = first.y; y <= bounds.max.y; y += n)
      for (std::int32_t z = first.z; z <= bounds.max.z; z += n) {
        const std::int32_t last = (n << level) - 1;
        const Coord from = (1 << level) * Coord{x, y, z};
        const CoordBox box{from, from + Coord{last, last, last}};
        const auto side = static_cast<std::size_t>(last + 1);
        for (std::vector<float>* values : {&a, &b, &uncut}) values->resize(side * side * side);
        whole.gather_solid(box, a);
        local.gather_solid(level, box, b);
        local.gather_surface(level, box, uncut);
        for (std::size_t i = 0; i < a.size(); ++i) {
          ++found.compared;
          found.differing += a[i] == b[i] ? 0 : 1;
          found.cut += b[i] == uncut[i] ? 0 : 1;
        }
      }
  return found;
}

void compare(const Case& bone, int level) {
  const std::vector<std::vector<Cut>> sites = strokes(level);
  SubVolumeField whole(bone, level);
  CutField local(bone, {});
  // Runs once before anything is timed, to load the code and pages that both share.
  {
    CutField warm(bone, {});
    for (const Cut& cut : sites.front()) warm.apply(cut);
  }
  std::vector<double> first[2], later[2];
  for (const auto& site : sites)
    for (const Cut& cut : site) {
      auto start = std::chrono::steady_clock::now();
      const bool new_bone = whole.apply(cut).resampled > 0;
      (new_bone ? first : later)[0].push_back(us_since(start));
      start = std::chrono::steady_clock::now();
      local.apply(cut);
      (new_bone ? first : later)[1].push_back(us_since(start));  // the same cuts in both lists
    }
  const std::string at = std::to_string(1 << level) + "x_";
  for (const int method : {0, 1}) {
    const std::string name = at + "method" + std::to_string(method + 1) + "_";
    print(name + "first_us", first[method]);
    print(name + "later_us", later[method]);
    const double bytes = static_cast<double>(method == 0 ? whole.memory_bytes() : local.memory_bytes());
    std::printf("\"%smegabytes\": %.3f, ", name.c_str(), bytes * 1e-6);
    // Pitch that the same strokes would reach with 1 GB: the memory of samples grows with the inverse cube of the
    // pitch.
    std::printf("\"%sreachable_mm\": %.4f, ", name.c_str(), level_pitch_mm(kPitch_mm, level) * std::cbrt(bytes / 1e9));
  }
  const Difference difference = difference_of(whole, local, level);
  std::printf("\"%scompared_samples\": %zu, \"%scut_samples\": %zu, \"%sdiffering_samples\": %zu, ", at.c_str(),
              difference.compared, at.c_str(), difference.cut, at.c_str(), difference.differing);
  std::vector<Coord> leaves;
  for (const FieldLeaf& leaf : local.leaf_places()) leaves.push_back(leaf.origin);
  std::printf(
      "\"%smethod1_areas\": %zu, \"%smethod2_areas\": %zu, \"%smethod1_sub_volumes\": %zu, \"%smethod2_leaves\": %zu",
      at.c_str(), unconnected_areas(whole.sub_volumes(), kSubVolumeSamples), at.c_str(),
      unconnected_areas(leaves, kLeafSize), at.c_str(), whole.sub_volumes().size(), at.c_str(), leaves.size());
}

int run() {
  const Case bone = plain_block(64.0, 16.0, kPitch_mm);
  std::printf("{\"pitch_mm\": %g, \"cuts\": %d, ", kPitch_mm, 4 * kCutsASite);
  compare(bone, 1);
  std::printf(", ");
  compare(bone, 2);
  std::printf("}\n");
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main() {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  return osteon::test::run();
}
