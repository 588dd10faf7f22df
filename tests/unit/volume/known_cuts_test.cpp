// Compares what a cut removes with closed forms, at random positions and orientations on the lattice.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/scenes/known_cuts.hpp"

namespace osteon::test {
namespace {

constexpr int kTrials = 4;

struct Worst {
  double volume_percent = 0.0, mean_percent = 0.0, deviation_pitches = 0.0;
  std::size_t vertices = 0;
};

template <class Make>
Worst worst_of(Make make, double pitch_mm) {
  Random random(17);
  Worst worst;
  for (int trial = 0; trial < kTrials; ++trial) {
    const CutAccuracy accuracy = accuracy_of(make(pitch_mm, random));
    worst.volume_percent = std::max(worst.volume_percent, 100.0 * std::abs(accuracy.volume_error));
    worst.mean_percent += 100.0 * std::abs(accuracy.volume_error) / kTrials;
    worst.vertices += accuracy.deviation_pitches.size();
    for (const double deviation : accuracy.deviation_pitches)
      worst.deviation_pitches = std::max(worst.deviation_pitches, deviation);
  }
  return worst;
}

template <class Make>
void expect_true(Make make) {
  const Worst coarse = worst_of(make, 0.25), fine = worst_of(make, 0.125);
  EXPECT_LE(fine.volume_percent, 0.5);
  // Distances are exact on the samples and linear between them, so half the pitch should leave a quarter of the error.
  // A hundredth of a per cent is the rounding of distances to quanta.
  EXPECT_LE(fine.mean_percent, 0.5 * coarse.mean_percent + 0.01);
  // A surface of curvature 1/r is a chord between samples: p²/8r, with p ≤ r a part of the pitch far below this bound.
  EXPECT_LE(coarse.deviation_pitches, 0.15);
  EXPECT_LE(fine.deviation_pitches, 0.15);
  EXPECT_GT(fine.vertices, 1000u);
}

TEST(KnownCut, ASphereHasItsVolumeAndSurface) {
  const auto burr = nearest_tool(ToolKind::round_burr, 3.2);
  ASSERT_TRUE(burr);
  expect_true([&](double pitch, Random& random) { return sphere_in_bone(*burr, pitch, random); });
}

TEST(KnownCut, ADrilledHoleHasItsVolumeAndSurface) {
  const auto drill = nearest_tool(ToolKind::drill, 3.2);
  ASSERT_TRUE(drill);
  expect_true([&](double pitch, Random& random) { return hole_through_slab(*drill, pitch, random); });
}

TEST(KnownCut, AKerfIsAsWideAsPlateAndSetTogether) {
  const auto saw = widest_saw();
  ASSERT_TRUE(saw);
  ASSERT_GT(saw->set_mm, 0.0);
  expect_true([&](double pitch, Random& random) { return kerf_through_shaft(*saw, pitch, random); });
}

}  // namespace
}  // namespace osteon::test
