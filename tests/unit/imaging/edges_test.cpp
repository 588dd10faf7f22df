#include "common/imaging/edges.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kStep_hu = 1000.0;

// HU of each voxel by its position, mm.
template <class Hu>
HuVolume scanned(std::array<int, 3> dims, const Vec3& spacing_mm, const Hu& hu) {
  HuVolume volume;
  volume.dims = dims;
  volume.spacing_mm = spacing_mm;
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x)
        volume.values.push_back(static_cast<std::int16_t>(std::lround(hu(volume.position_mm(Vec3(x, y, z))))));
  return volume;
}

HuVolume noise(std::array<int, 3> dims, const Vec3& spacing_mm) {
  std::mt19937 random(5);
  return scanned(dims, spacing_mm, [&](const Vec3&) { return static_cast<double>(random() % 2000); });
}

TEST(Gradient, OfARampIsItsSlopeEverywhere) {
  const Vec3 slope(40.0, -20.0, 10.0), spacing(0.5, 1.0, 3.0);  // whole HU at every voxel
  const HuVolume ramp = scanned({9, 7, 5}, spacing, [&](const Vec3& at) { return slope.dot(at); });
  const auto in_volume = gradient_magnitude(ramp, {}, always);
  const auto in_slice = gradient_magnitude(ramp, {.space = EdgeSpace::slice}, always);
  ASSERT_TRUE(in_volume && in_slice);
  for (const float found : *in_volume) ASSERT_NEAR(found, slope.norm(), 1e-3);
  for (const float found : *in_slice) ASSERT_NEAR(found, std::hypot(slope.x(), slope.y()), 1e-3);
}

TEST(Gradient, OfABlurredStepIsThatOfTheNormalDistribution) {
  constexpr double kSigma_mm = 2.0, kSpacing_mm = 0.5;
  for (const int axis : {0, 1, 2}) {
    std::array<int, 3> dims{5, 5, 5};
    dims[static_cast<std::size_t>(axis)] = 60;
    const HuVolume step = scanned(dims, Vec3::Constant(kSpacing_mm), [&](const Vec3& at) {
      return at[axis] > 14.75 ? kStep_hu : 0.0;  // half-way between two voxels
    });
    const auto found = gradient_magnitude(step, {.sigma_mm = kSigma_mm}, always);
    ASSERT_TRUE(found);
    // kStep_hu / (sqrt(2 pi) sigma). Central differences take about (h / sigma)^2 / 6 = 1 % of it, and the nearest
    // voxel lies h / 2 beside the step, which takes another 0.8 %. Whole HU add at most half a HU over the spacing.
    const double largest = kStep_hu / (std::sqrt(2.0 * M_PI) * kSigma_mm);
    EXPECT_NEAR(*std::ranges::max_element(*found), largest, 0.02 * largest + 0.5 / kSpacing_mm);
  }
}

TEST(Gradient, DoesNotCrossSlicesThatAreSeenAlone) {
  const HuVolume slices = scanned({8, 8, 6}, Vec3::Ones(), [](const Vec3& at) { return 900.0 * at.z(); });
  const auto found = gradient_magnitude(slices, {.sigma_mm = 1.0, .space = EdgeSpace::slice}, always);
  ASSERT_TRUE(found);
  EXPECT_TRUE(std::ranges::all_of(*found, [](float value) { return value == 0.0f; }));
}

TEST(Canny, FindsAClosedLayerOnABall) {
  for (const Vec3& spacing : {Vec3(0.5, 0.5, 0.5), Vec3(0.4, 0.5, 0.8)}) {
    constexpr double kRadius_mm = 6.0, kSigma_mm = 1.0;
    // A Gaussian moves the largest gradient of a ball inwards: (r - R) / sigma^2 = -1 / r there.
    constexpr double kEdge_mm = kRadius_mm - kSigma_mm * kSigma_mm / kRadius_mm;
    const Vec3 centre = Vec3::Constant(9.1);
    const std::array<int, 3> dims{static_cast<int>(18.2 / spacing.x()), static_cast<int>(18.2 / spacing.y()),
                                  static_cast<int>(18.2 / spacing.z())};
    const HuVolume ball =
        scanned(dims, spacing, [&](const Vec3& at) { return (at - centre).norm() < kRadius_mm ? kStep_hu : 0.0; });
    const auto edges = canny_edges(ball, {.sigma_mm = kSigma_mm}, always);
    ASSERT_TRUE(edges);

    // Within one voxel of the sphere, and about one voxel thick.
    int count = 0;
    for (int z = 0; z < dims[2]; ++z)
      for (int y = 0; y < dims[1]; ++y)
        for (int x = 0; x < dims[0]; ++x) {
          if (edges->at(x, y, z) == 0) continue;
          ++count;
          const double away = (ball.position_mm(Vec3(x, y, z)) - centre).norm() - kEdge_mm;
          ASSERT_LE(std::abs(away), spacing.maxCoeff()) << x << ' ' << y << ' ' << z;
        }
    // A digital sphere has between 1 and sqrt(3) voxels on each voxel's face of its area.
    const double faces = 4.0 * M_PI * kRadius_mm * kRadius_mm / std::pow(spacing.prod(), 2.0 / 3.0);
    EXPECT_GT(count, 0.8 * faces);
    EXPECT_LT(count, 1.8 * faces);

    // Closed: no path through voxel faces leads from the centre to the outside.
    std::vector<std::uint8_t> seen(ball.count(), 0);
    std::vector<std::array<int, 3>> open{{dims[0] / 2, dims[1] / 2, dims[2] / 2}};
    ASSERT_EQ(edges->at(open[0][0], open[0][1], open[0][2]), 0);
    bool outside = false;
    while (!open.empty() && !outside) {
      const std::array<int, 3> at = open.back();
      open.pop_back();
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int d : {-1, 1}) {
          std::array<int, 3> next = at;
          next[axis] += d;
          outside = outside || next[axis] < 0 || next[axis] >= dims[axis];
          if (outside || edges->at(next[0], next[1], next[2]) != 0) continue;
          std::uint8_t& visited = seen[ball.index(next[0], next[1], next[2])];
          if (visited == 0) open.push_back(next);
          visited = 1;
        }
    }
    EXPECT_FALSE(outside);
  }
}

TEST(Canny, KeepsAWeakEdgeOnlyBesideAStrongOne) {
  // Two faces whose step fades from 800 HU to 200 HU, and a separate one of 200 HU.
  const HuVolume faces = scanned({40, 60, 1}, Vec3::Ones(), [](const Vec3& at) {
    if (at.x() < 20.0) return at.x() < 10.0 ? 0.0 : 200.0 + 10.0 * at.y();
    return at.x() < 30.0 ? 200.0 + 10.0 * at.y() : 400.0 + 10.0 * at.y();
  });
  const auto edges = canny_edges(faces, {.sigma_mm = 1.0, .low_hu_per_mm = 50.0, .high_hu_per_mm = 200.0}, always);
  ASSERT_TRUE(edges);
  int on_fading = 0, on_weak = 0;
  for (int y = 5; y < 55; ++y)
    for (int x = 5; x < 35; ++x) (x < 20 ? on_fading : on_weak) += edges->at(x, y, 0);
  EXPECT_EQ(on_fading, 50);  // one in each row, also where the step is weak
  EXPECT_EQ(on_weak, 0);
}

// `volume` with its axes in the order of `from`.
template <class Volume>
Volume permuted(const Volume& volume, std::array<std::size_t, 3> from) {
  Volume out = volume;
  for (std::size_t axis = 0; axis < 3; ++axis) out.dims[axis] = volume.dims[from[axis]];
  std::array<int, 3> at{};
  std::size_t i = 0;
  for (int z = 0; z < out.dims[2]; ++z)
    for (int y = 0; y < out.dims[1]; ++y)
      for (int x = 0; x < out.dims[0]; ++x) {
        at[from[0]] = x;
        at[from[1]] = y;
        at[from[2]] = z;
        out.values[i++] = volume.values[volume.index(at[0], at[1], at[2])];
      }
  return out;
}

TEST(Canny, FindsTheSameWhicheverAxisIsFirst) {
  const HuVolume volume = noise({14, 11, 9}, Vec3(0.5, 0.8, 1.7));
  const CannyParams params{.sigma_mm = 0.0, .low_hu_per_mm = 400.0, .high_hu_per_mm = 900.0};
  const auto expected = canny_edges(volume, params, always);
  ASSERT_TRUE(expected);
  ASSERT_GT(std::ranges::count(expected->values, 1), 20);
  for (const std::array<std::size_t, 3> from :
       {std::array<std::size_t, 3>{1, 0, 2}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}}) {
    HuVolume turned = permuted(volume, from);
    for (int axis = 0; axis < 3; ++axis)
      turned.spacing_mm[axis] = volume.spacing_mm[static_cast<int>(from[static_cast<std::size_t>(axis)])];
    const auto found = canny_edges(turned, params, always);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->values, permuted(*expected, from).values);
  }
}

TEST(Canny, FindsNothingInWhatIsEqualEverywhere) {
  for (const std::int16_t hu : {std::numeric_limits<std::int16_t>::min(), std::numeric_limits<std::int16_t>::max()})
    for (const std::array<int, 3> dims : {std::array<int, 3>{9, 8, 7}, {9, 8, 1}, {1, 1, 1}}) {
      const auto found = canny_edges(scanned(dims, Vec3(0.1, 1.0, 20.0), [&](const Vec3&) { return double{hu}; }),
                                     {.low_hu_per_mm = 1e-6}, always);
      ASSERT_TRUE(found);
      EXPECT_EQ(std::ranges::count(found->values, 0), std::ssize(found->values));
    }
}

TEST(Canny, TakesTheLargestSteps) {
  const HuVolume halves = scanned({8, 6, 5}, Vec3(0.01, 1.0, 1.0), [](const Vec3& at) {
    return at.x() < 0.035 ? std::numeric_limits<std::int16_t>::min() : std::numeric_limits<std::int16_t>::max();
  });
  const auto gradient = gradient_magnitude(halves, {}, always);
  const auto edges = canny_edges(halves, {.sigma_mm = 0.0}, always);
  ASSERT_TRUE(gradient && edges);
  EXPECT_NEAR(*std::ranges::max_element(*gradient), 65535.0 / 0.02, 1.0);
  // Both sides of the step have the same gradient. The brighter one is the edge.
  for (int z = 0; z < 5; ++z)
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 8; ++x) EXPECT_EQ(edges->at(x, y, z), x == 4 ? 1 : 0);
}

TEST(Edges, CanBeStoppedAtEveryQuestion) {
  const HuVolume volume = noise({8, 7, 6}, Vec3::Ones());
  for (const EdgeSpace space : {EdgeSpace::slice, EdgeSpace::volume})
    for (const bool canny : {false, true}) {
      const auto work = [&](const KeepGoing& keep_going) -> Result<void> {
        if (canny) {
          const auto found = canny_edges(volume, {.space = space}, keep_going);
          return found ? Result<void>{} : tl::unexpected(found.error());
        }
        const auto found = gradient_magnitude(volume, {1.0, space}, keep_going);
        return found ? Result<void>{} : tl::unexpected(found.error());
      };
      int questions = 0;
      double before = 0.0;
      ASSERT_TRUE(work([&](double done) {
        EXPECT_GE(done, before);
        EXPECT_LE(done, 1.0);
        before = done;
        return ++questions > 0;
      }));
      ASSERT_GE(questions, 12);
      for (int last = 0; last < questions; ++last) {
        int asked = 0;
        const auto ended = work([&](double) { return asked++ < last; });
        ASSERT_FALSE(ended);
        EXPECT_EQ(ended.error().code, ErrorCode::cancelled);
        EXPECT_EQ(asked, last + 1);
      }
    }
}

}  // namespace
}  // namespace osteon::imaging
