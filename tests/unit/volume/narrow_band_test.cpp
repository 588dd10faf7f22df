#include "common/volume/narrow_band.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "common/geometry/triangle_distance.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon {
namespace {

constexpr double kBandPitch_mm = 0.5;
constexpr float kBand_mm = 4.0f * 0.5f;
constexpr int kBeyond = 6;  // samples beyond the box that the surface nearest to a sample may lie in

bool always(double) { return true; }

SampledField parts_of(const DenseVolume<float>& field, float iso, std::atomic<std::size_t>* read = nullptr) {
  const auto each = [&field](const CoordBox& part, auto visit) {
    for (int x = part.min.x; x <= part.max.x; ++x)
      for (int y = part.min.y; y <= part.max.y; ++y)
        for (int z = part.min.z; z <= part.max.z; ++z) visit(field.at({x, y, z}));
  };
  return {.box = field.box,
          .inside =
              [each, iso](const CoordBox& part) {
                bool any = false, all = true;
                each(part, [&](float v) {
                  any = any || v >= iso;
                  all = all && v >= iso;
                });
                return all ? Inside::all : any ? Inside::some : Inside::none;
              },
          .read =
              [each, read](const CoordBox& part, std::span<float> values) {
                std::size_t n = 0;
                each(part, [&](float v) { values[n++] = v; });
                if (read != nullptr) *read += n;
              }};
}

// Sums of waves in random directions, with wave lengths of several samples.
DenseVolume<float> random_field(const CoordBox& box, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  DenseVolume<float> field(box, 0.0f);
  for (int wave = 0; wave < 6; ++wave) {
    const Vec3 direction = 0.3 * Vec3(normal(random), normal(random), normal(random));
    const double phase = 3.0 * normal(random), height = 200.0 * normal(random);
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z)
          field.at({x, y, z}) += static_cast<float>(height * std::sin(direction.dot(Vec3(x, y, z)) + phase));
  }
  return field;
}

// The surface by its definition: a point in every crossed cell, a quad around every crossed edge. In samples.
struct Surface {
  std::map<Coord, Vec3> points;
  std::vector<std::array<Vec3, 3>> triangles;

  Surface(const DenseVolume<float>& field, double iso) {
    const CoordBox& box = field.box;
    const auto value = [&](Coord c) {
      const double d = iso - static_cast<double>(
                                 field.at({std::clamp(c.x, box.min.x, box.max.x), std::clamp(c.y, box.min.y, box.max.y),
                                           std::clamp(c.z, box.min.z, box.max.z)}));
      return d == 0.0 ? -1e-3 : d;
    };
    const std::array<Coord, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const CoordBox all = box.grown(kBeyond);
    const auto each = [&](auto visit) {
      for (int x = all.min.x; x < all.max.x; ++x)
        for (int y = all.min.y; y < all.max.y; ++y)
          for (int z = all.min.z; z < all.max.z; ++z) visit(Coord{x, y, z});
    };
    each([&](Coord cell) {
      Vec3 sum = Vec3::Zero();
      int crossings = 0;
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (int u = 0; u < 2; ++u)
          for (int v = 0; v < 2; ++v) {
            const Coord from = cell + u * axes[(axis + 1) % 3] + v * axes[(axis + 2) % 3], to = from + axes[axis];
            const double a = value(from), b = value(to);
            if ((a < 0) == (b < 0)) continue;
            sum += position_mm(from, 1.0) + a / (a - b) * position_mm(axes[axis], 1.0);
            ++crossings;
          }
      if (crossings > 0) points[cell] = sum / crossings;
    });
    each([&](Coord c) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Coord u = axes[(axis + 1) % 3], v = axes[(axis + 2) % 3];
        if (!points.contains(c) || (value(c) < 0) == (value(c + axes[axis]) < 0)) continue;
        if (!points.contains(c - u) || !points.contains(c - v) || !points.contains(c - u - v)) continue;
        triangles.push_back({points[c - u - v], points[c - v], points[c]});
        triangles.push_back({points[c - u - v], points[c], points[c - u]});
      }
    });
  }

  // Over all triangles, in samples; at most 4.
  [[nodiscard]] double distance(Coord sample) const {
    double least = 16.0;
    for (const auto& [a, b, c] : triangles)
      least = std::min(least, distance_to_triangle<double>(position_mm(sample, 1.0), a, b, c).squared);
    return std::sqrt(least);
  }
};

// Boxes that leaves and slabs cut in different ways. The surface leaves each through its faces.
TEST(NarrowBand, IsTheDistanceToTheNearestOfAllTriangles) {
  const CoordBox boxes[] = {{{0, 0, 0}, {15, 12, 10}}, {{-5, 3, -9}, {8, 9, 11}}, {{-3, -3, -3}, {57, 2, 2}}};
  int samples = 0, off = 0, near = 0;
  for (unsigned seed = 0; seed < 6; ++seed) {
    const CoordBox& box = boxes[seed % 3];
    const DenseVolume<float> field = random_field(box, seed);
    const Surface surface(field, 20.0);
    const auto band = narrow_band_mm(parts_of(field, 20.0f), 20.0f, kBandPitch_mm, always);
    ASSERT_TRUE(band);
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) {
          const Coord c{x, y, z};
          const double voxels = static_cast<double>(band->value(c)) / kBandPitch_mm, truth = surface.distance(c);
          ASSERT_EQ(std::signbit(voxels), field.at(c) >= 20.0f)
              << "seed " << seed << " at " << x << " " << y << " " << z;
          ASSERT_GT(std::abs(voxels), truth - 1e-4) << "seed " << seed << " at " << x << " " << y << " " << z;
          ++samples;
          near += truth < 4.0 ? 1 : 0;
          off += std::abs(voxels) > truth + 0.001 ? 1 : 0;
        }
  }
  EXPECT_GT(near, samples / 2);
  // Between two sheets, the nearest corner may belong to the farther one.
  EXPECT_LT(off, near / 100);
}

TEST(NarrowBand, NeedsNothingOfAFieldWithoutASurface) {
  const CoordBox box{{-3, 0, 5}, {60, 20, 30}};
  for (const float value : {-100.0f, 100.0f}) {
    std::atomic<std::size_t> read{0};
    const DenseVolume<float> field(box, value);
    const auto band = narrow_band_mm(parts_of(field, 0.0f, &read), 0.0f, kBandPitch_mm, always);
    ASSERT_TRUE(band);
    EXPECT_EQ(read, 0u);
    EXPECT_TRUE(band->leaves().empty());
    EXPECT_EQ(band->constants().empty(), value < 0.0f);
    for (const Coord c : {box.min, box.max, Coord{20, 10, 10}})
      EXPECT_EQ(band->value(c), value < 0.0f ? kBand_mm : -kBand_mm);
  }
}

TEST(NarrowBand, ReadsAndStoresTheLeavesNearTheSurfaceOnly) {
  const CoordBox box{{0, 0, 0}, {159, 39, 39}};
  DenseVolume<float> field(box, 0.0f);
  for (int x = 0; x < 160; ++x)
    for (int y = 0; y < 40; ++y)
      for (int z = 0; z < 40; ++z) field.at({x, y, z}) = static_cast<float>(10.25 - x);
  std::atomic<std::size_t> read{0};
  const auto band = narrow_band_mm(parts_of(field, 0.0f, &read), 0.0f, kBandPitch_mm, always);
  ASSERT_TRUE(band);
  EXPECT_LT(read, field.values.size() / 10);
  for (const Coord leaf : band->leaves()) EXPECT_LT(leaf.x, 16);  // within 4 samples of 10.25
  for (int x = 0; x < 160; ++x)
    EXPECT_NEAR(static_cast<double>(band->value({x, 20, 20})), std::clamp((x - 10.25) * kBandPitch_mm, -2.0, 2.0),
                1e-5);
}

TEST(NarrowBand, IsThatOfTheDenseFieldWithTheSameBytes) {
  const DenseVolume<float> field = random_field({{-7, -2, 1}, {101, 20, 19}}, 7);
  const auto band = narrow_band_mm(parts_of(field, 0.0f), 0.0f, kBandPitch_mm, always);
  const auto dense = signed_distance_mm(field, 0.0f, kBandPitch_mm, always);
  ASSERT_TRUE(band && dense);
  std::vector<float> gathered(field.values.size());
  band->gather(field.box, gathered);
  EXPECT_EQ(gathered, dense->values);
}

TEST(NarrowBand, StopsWhenAsked) {
  const DenseVolume<float> field = random_field({{0, 0, 0}, {40, 10, 10}}, 1);
  const auto band = narrow_band_mm(parts_of(field, 0.0f), 0.0f, kBandPitch_mm, [](double) { return false; });
  ASSERT_FALSE(band);
  EXPECT_EQ(band.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon
