// Regions against their definitions: fixed ones without any queue, adaptive ones with one queue of voxels.
#include "common/imaging/region_growing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <random>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

using Voxel = std::array<int, 3>;
using Labels = std::vector<std::uint32_t>;

constexpr std::array<Voxel, 8> kShapes{
    {{9, 8, 7}, {150, 3, 2}, {23, 4, 3}, {1, 1, 1}, {17, 13, 1}, {1, 1, 12}, {1, 9, 5}, {2, 1, 6}}};
constexpr Voxel kLarge{150, 7, 5};  // more voxels than are worked out at once
constexpr std::array kSpaces{GrowBy::slice, GrowBy::volume};
constexpr std::array kConnectivities{Connectivity::faces, Connectivity::corners};

// Few different values, so that regions of all sizes are there.
HuVolume speckled(const Voxel& dims, std::uint32_t seed) {
  HuVolume volume;
  volume.dims = dims;
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < volume.count(); ++i)
    volume.values.push_back(static_cast<std::int16_t>(static_cast<int>(random() % 8) * 100 - 100));
  return volume;
}

Voxel random_voxel(const Voxel& dims, std::mt19937& random) {
  Voxel at{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    at[axis] = static_cast<int>(random() % static_cast<unsigned>(dims[axis]));
  return at;
}

void each_voxel(const Voxel& dims, const std::function<void(const Voxel&)>& visit) {
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x) visit({x, y, z});
}

// The neighbours within the volume, in the order of memory.
std::vector<Voxel> neighbours(const Voxel& dims, const Voxel& at, GrowBy by, Connectivity connectivity) {
  std::vector<Voxel> found;
  each_voxel({3, 3, 3}, [&](const Voxel& d) {
    const int x = d[0] - 1, y = d[1] - 1, z = d[2] - 1;
    const int axes = std::abs(x) + std::abs(y) + std::abs(z);
    if (axes == 0 || (axes > 1 && connectivity == Connectivity::faces) || (z != 0 && by == GrowBy::slice)) return;
    const Voxel to{at[0] + x, at[1] + y, at[2] + z};
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (to[axis] < 0 || to[axis] >= dims[axis]) return;
    found.push_back(to);
  });
  return found;
}

std::uint32_t& label_at(Labels& labels, const HuVolume& volume, const Voxel& at) {
  return labels[volume.index(at[0], at[1], at[2])];
}

// A region is closed: adds to it, again and again, each voxel that is similar and has a neighbour in it.
void close(const HuVolume& volume, const GrowingParams& params, const std::function<bool(int)>& similar,
           std::uint32_t number, Labels& labels) {
  for (bool changed = true; changed;) {
    changed = false;
    each_voxel(volume.dims, [&](const Voxel& at) {
      std::uint32_t& label = label_at(labels, volume, at);
      if (label != 0 || !similar(volume.at(at[0], at[1], at[2]))) return;
      for (const Voxel& beside : neighbours(volume.dims, at, params.by, params.connectivity))
        if (label_at(labels, volume, beside) == number) {
          label = number;
          changed = true;
          return;
        }
    });
  }
}

std::function<bool(int)> fixed_similarity(const GrowingParams& params, int seed_hu) {
  if (params.similarity == Similarity::interval)
    return [params](int hu) { return params.low_hu <= hu && hu <= params.high_hu; };
  return [params, seed_hu](int hu) { return std::abs(hu - seed_hu) <= params.tolerance_hu; };
}

// The voxels above and below the region's in one slice start the next one.
void carry_on(const HuVolume& volume, const std::function<bool(int)>& similar, std::uint32_t number, int from, int to,
              Labels& labels) {
  each_voxel(volume.dims, [&](const Voxel& at) {
    if (at[2] != from || label_at(labels, volume, at) != number) return;
    std::uint32_t& label = label_at(labels, volume, {at[0], at[1], to});
    if (label == 0 && similar(volume.at(at[0], at[1], to))) label = number;
  });
}

Labels fixed_by_definition(const HuVolume& volume, const std::vector<Voxel>& seeds, const GrowingParams& params) {
  Labels labels(volume.count(), 0);
  std::uint32_t number = 0;
  for (const Voxel& seed : seeds) {
    if (label_at(labels, volume, seed) != 0) continue;
    const auto similar = fixed_similarity(params, volume.at(seed[0], seed[1], seed[2]));
    label_at(labels, volume, seed) = ++number;
    close(volume, params, similar, number, labels);
    if (params.by == GrowBy::volume) continue;
    for (int z = seed[2] + 1; z < volume.dims[2]; ++z) {
      carry_on(volume, similar, number, z - 1, z, labels);
      close(volume, params, similar, number, labels);
    }
    for (int z = seed[2] - 1; z >= 0; --z) {
      carry_on(volume, similar, number, z + 1, z, labels);
      close(volume, params, similar, number, labels);
    }
  }
  return labels;
}

// A region whose voxels wait in one queue. `sum` and `count` are those of its voxels.
struct AdaptiveRegion {
  const HuVolume& volume;
  const GrowingParams& params;
  std::uint32_t number;
  Labels& labels;
  double sum = 0.0, count = 0.0;
  std::queue<Voxel> waiting;

  void offer(const Voxel& at) {
    std::uint32_t& label = label_at(labels, volume, at);
    const double hu = volume.at(at[0], at[1], at[2]);
    if (label != 0 || (count > 0.0 && std::abs(hu - sum / count) > params.tolerance_hu)) return;
    label = number;
    sum += hu;
    ++count;
    waiting.push(at);
  }
  void flood() {
    for (; !waiting.empty(); waiting.pop())
      for (const Voxel& beside : neighbours(volume.dims, waiting.front(), params.by, params.connectivity))
        offer(beside);
  }
};

Labels adaptive_by_definition(const HuVolume& volume, const std::vector<Voxel>& seeds, const GrowingParams& params) {
  Labels labels(volume.count(), 0);
  std::uint32_t number = 0;
  for (const Voxel& seed : seeds) {
    if (label_at(labels, volume, seed) != 0) continue;
    AdaptiveRegion region{volume, params, ++number, labels, 0.0, 0.0, {}};
    region.offer(seed);
    region.flood();
    if (params.by == GrowBy::volume) continue;
    for (const int step : {1, -1})
      for (int z = seed[2] + step; 0 <= z && z < volume.dims[2]; z += step) {
        each_voxel(volume.dims, [&](const Voxel& at) {
          if (at[2] == z - step && label_at(labels, volume, at) == number) region.offer({at[0], at[1], z});
        });
        region.flood();
      }
  }
  return labels;
}

void expect_boxes_and_counts(const HuVolume& volume, const SeededRegions& found) {
  for (std::size_t n = 0; n < found.list.size(); ++n) {
    Voxel first = volume.dims, last{-1, -1, -1};
    std::int64_t voxels = 0;
    each_voxel(volume.dims, [&](const Voxel& at) {
      if (found.labels.at(at[0], at[1], at[2]) != n + 1) return;
      ++voxels;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        first[axis] = std::min(first[axis], at[axis]);
        last[axis] = std::max(last[axis], at[axis]);
      }
    });
    EXPECT_EQ(found.list[n].voxels, voxels);
    EXPECT_EQ(found.list[n].first, first);
    EXPECT_EQ(found.list[n].last, last);
  }
}

TEST(RegionGrowing, FromSeedsIsWhatTheDefinitionSays) {
  std::mt19937 random(1);
  std::uint32_t round = 0;
  std::vector<Voxel> shapes(kShapes.begin(), kShapes.end());
  shapes.push_back(kLarge);
  for (const Voxel& dims : shapes)
    for (const GrowBy by : kSpaces)
      for (const Connectivity connectivity : kConnectivities)
        for (const Similarity similarity : {Similarity::interval, Similarity::seed, Similarity::mean})
          for (const double tolerance_hu : {0.0, 100.0, 170.5, 300.0}) {
            const HuVolume volume = speckled(dims, round++);
            std::vector<Voxel> seeds;
            for (int i = 0; i < 3; ++i) seeds.push_back(random_voxel(dims, random));
            GrowingParams params{
                .similarity = similarity, .tolerance_hu = tolerance_hu, .by = by, .connectivity = connectivity};
            if (similarity == Similarity::interval) {
              const int hu = volume.at(seeds[0][0], seeds[0][1], seeds[0][2]);
              params.low_hu = hu - tolerance_hu;
              params.high_hu = hu + 0.5 * tolerance_hu;
              std::erase_if(seeds, [&](const Voxel& s) {
                const int its = volume.at(s[0], s[1], s[2]);
                return its < params.low_hu || its > params.high_hu;
              });
            }
            const auto found = grow_from_seeds(volume, seeds, params, always);
            ASSERT_TRUE(found) << found.error().message;
            const Labels expected = similarity == Similarity::mean ? adaptive_by_definition(volume, seeds, params)
                                                                   : fixed_by_definition(volume, seeds, params);
            ASSERT_EQ(Labels(found->labels.values.begin(), found->labels.values.end()), expected) << "round " << round;
            ASSERT_EQ(found->list.size(), *std::ranges::max_element(expected)) << "round " << round;
            expect_boxes_and_counts(volume, *found);
          }
}

// One region after the other: the next seed is the first voxel without a label.
Labels everywhere_by_definition(const HuVolume& volume, const GrowingParams& params) {
  Labels labels(volume.count(), 0);
  std::uint32_t number = 0;
  each_voxel(volume.dims, [&](const Voxel& seed) {
    if (label_at(labels, volume, seed) != 0) return;
    ++number;
    if (params.similarity == Similarity::mean) {
      AdaptiveRegion region{volume, params, number, labels, 0.0, 0.0, {}};
      region.offer(seed);
      region.flood();
      return;
    }
    label_at(labels, volume, seed) = number;
    close(volume, params, fixed_similarity(params, volume.at(seed[0], seed[1], seed[2])), number, labels);
  });
  return labels;
}

TEST(RegionGrowing, EverywhereGivesEachVoxelItsRegion) {
  std::uint32_t round = 0;
  for (const Voxel& dims : kShapes)
    for (const GrowBy by : kSpaces)
      for (const Connectivity connectivity : kConnectivities)
        for (const Similarity similarity : {Similarity::seed, Similarity::mean})
          for (const double tolerance_hu : {0.0, 120.5, 200.0}) {
            const HuVolume volume = speckled(dims, 1000 + round++);
            const GrowingParams params{
                .similarity = similarity, .tolerance_hu = tolerance_hu, .by = by, .connectivity = connectivity};
            const auto found = grow_everywhere(volume, params, always);
            ASSERT_TRUE(found);
            ASSERT_EQ(found->labels, everywhere_by_definition(volume, params)) << "round " << round;
            std::vector<int> voxels(found->count, 0);
            for (const std::uint32_t label : found->labels) {
              ASSERT_TRUE(1 <= label && label <= found->count);
              ++voxels[label - 1];
            }
            EXPECT_TRUE(std::ranges::all_of(voxels, [](int n) { return n > 0; })) << "round " << round;
          }
}

TEST(RegionGrowing, WhatIsEqualEverywhereIsOneRegion) {
  for (const std::int16_t hu : {std::int16_t{-32768}, std::int16_t{0}, std::int16_t{32767}})
    for (const Similarity similarity : {Similarity::seed, Similarity::mean}) {
      HuVolume volume;
      volume.dims = {40, 30, 6};
      volume.values.assign(volume.count(), hu);
      GrowingParams params{.similarity = similarity, .tolerance_hu = 0.0};
      EXPECT_EQ(grow_everywhere(volume, params, always)->count, 1u);
      const std::array seeds{Voxel{7, 8, 3}, Voxel{39, 29, 5}};
      const auto found = grow_from_seeds(volume, seeds, params, always);
      ASSERT_EQ(found->list.size(), 1u) << "the second seed lies in the first region";
      EXPECT_EQ(found->list[0].voxels, 40 * 30 * 6);
      EXPECT_EQ(found->list[0].low_hu, hu);
      EXPECT_EQ(found->list[0].high_hu, hu);
      params.by = GrowBy::slice;
      EXPECT_EQ(grow_everywhere(volume, params, always)->count, 6u) << "one in each slice";
      EXPECT_EQ(grow_from_seeds(volume, seeds, params, always)->list[0].voxels, 40 * 30 * 6);
    }
}

// HU rise by `step` from voxel to voxel. A fixed region takes 1 + tolerance / step voxels. The mean of n voxels is
// step (n - 1) / 2, so the next one is within the tolerance while step (n + 1) / 2 <= tolerance: 2 tolerance / step.
TEST(RegionGrowing, AnAdaptiveRegionFollowsASlowRise) {
  HuVolume volume;
  volume.dims = {200, 1, 1};
  for (int x = 0; x < 200; ++x) volume.values.push_back(static_cast<std::int16_t>(10 * x));
  const std::vector seed{Voxel{0, 0, 0}};
  for (const int tolerance : {10, 50, 300, 640}) {
    GrowingParams params{.similarity = Similarity::seed, .tolerance_hu = static_cast<double>(tolerance)};
    EXPECT_EQ(grow_from_seeds(volume, seed, params, always)->list[0].voxels, 1 + tolerance / 10);
    params.similarity = Similarity::mean;
    const Region region = grow_from_seeds(volume, seed, params, always)->list[0];
    EXPECT_EQ(region.voxels, 2 * tolerance / 10);
    const double mean = 10.0 * static_cast<double>(region.voxels - 1) / 2.0;
    EXPECT_NEAR(region.low_hu, mean - tolerance, 1e-9);
    EXPECT_NEAR(region.high_hu, mean + tolerance, 1e-9);
  }
}

TEST(RegionGrowing, StopsAtEveryQuestion) {
  const HuVolume volume = speckled({48, 48, 24}, 5);
  const std::vector seed{Voxel{20, 20, 10}};
  for (const GrowBy by : kSpaces)
    for (const Similarity similarity : {Similarity::seed, Similarity::mean})
      for (const bool everywhere : {false, true}) {
        const GrowingParams params{.similarity = similarity, .tolerance_hu = 320.0, .by = by};
        const auto code = [&](const KeepGoing& keep_going) {
          const auto of = [](const auto& result) { return result ? ErrorCode::internal : result.error().code; };
          return everywhere ? of(grow_everywhere(volume, params, keep_going))
                            : of(grow_from_seeds(volume, seed, params, keep_going));
        };
        int questions = 0;
        double before = 0.0;
        EXPECT_NE(code([&](double done) {
                    EXPECT_TRUE(before <= done && done <= 1.0);
                    before = done;
                    return ++questions > 0;
                  }),
                  ErrorCode::cancelled);
        EXPECT_GT(questions, 1);
        for (int stop = 1; stop <= questions; ++stop) {
          int asked = 0;
          EXPECT_EQ(code([&](double) { return ++asked < stop; }), ErrorCode::cancelled);
          EXPECT_EQ(asked, stop) << "goes on after it was told to stop";
        }
      }
}

TEST(RegionGrowing, SaysWhyASeedWillNotDo) {
  const HuVolume volume = speckled({5, 4, 3}, 1);
  const auto expect_refused = [&](const std::vector<Voxel>& seeds, const GrowingParams& params, const char* why) {
    const auto found = grow_from_seeds(volume, seeds, params, always);
    ASSERT_FALSE(found) << why;
    EXPECT_EQ(found.error().code, ErrorCode::invalid_input);
    EXPECT_NE(found.error().message.find(why), std::string::npos) << found.error().message;
  };
  expect_refused({}, {}, "from 1 to 255 seeds");
  expect_refused(std::vector<Voxel>(256, Voxel{0, 0, 0}), {}, "from 1 to 255 seeds");
  for (const Voxel& outside : {Voxel{-1, 0, 0}, {5, 0, 0}, {0, 4, 0}, {0, 0, 3}, {0, -1, 0}, {0, 0, -1}})
    expect_refused({outside}, {}, "outside the scan");
  expect_refused({{1, 1, 1}}, {.low_hu = 5000.0, .high_hu = 6000.0}, "takes 5000 to 6000 HU");
}

TEST(RegionGrowing, ASeedInMillimetresIsTheNearestVoxel) {
  HuVolume volume = speckled({20, 10, 5}, 1);
  volume.spacing_mm = Vec3(0.5, 0.75, 10.0);
  volume.origin_mm = Vec3(-30.0, 40.0, 5.0);
  volume.directions << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-0.49, 0.49);
  for (int i = 0; i < 100; ++i) {
    const Voxel at = random_voxel(volume.dims, random);
    const Vec3 beside = Vec3(at[0], at[1], at[2]) + Vec3(within(random), within(random), within(random));
    const auto found = seed_voxel(volume, volume.position_mm(beside));
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(*found, at);
  }
  const Vec3 last(19, 9, 4);
  for (const Vec3& position_mm : {volume.position_mm(Vec3(-0.6, 0, 0)), volume.position_mm(last + Vec3(0, 0, 0.6)),
                                  Vec3(0, 0, 1e300), Vec3(std::nan(""), 0, 0), Vec3(0, -INFINITY, 0)}) {
    const auto found = seed_voxel(volume, position_mm);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::invalid_input);
    EXPECT_NE(found.error().message.find("outside the scan"), std::string::npos) << found.error().message;
  }
}

}  // namespace
}  // namespace osteon::imaging
