#include "server/import/phantom.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include "common/imaging/calibration.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

Phantom plate() {
  return {.kind = PhantomKind::block, .layers = {{5.0, 1.9}, {20.0, 0.3}, {5.0, 1.9}}, .width_mm = 12.0};
}
Phantom long_bone() { return {.kind = PhantomKind::tube, .layers = {{4.0, 1.9}, {6.0, 0.3}}, .width_mm = 24.0}; }

TEST(ParseLayers, ReadsThicknessAndDensity) {
  const auto layers = parse_layers("5:1.9,20:0.3,5.5:1.8");
  ASSERT_TRUE(layers);
  ASSERT_EQ(layers->size(), 3u);
  EXPECT_EQ((*layers)[1].thickness_mm, 20.0);
  EXPECT_EQ((*layers)[2].density_g_cm3, 1.8);
}

TEST(ParseLayers, RefusesNonsenseAndSaysHowToWriteIt) {
  for (const char* text : {"", "5", "5:", ":1.9", "5:1.9,", "5;1.9", "five:1.9", "5:1.9x", "-5:1.9", "0:1.9", "5:0",
                           "5:-1", "5:7", "900:1", "5:nan"}) {
    const auto layers = parse_layers(text);
    ASSERT_FALSE(layers) << text;
    expect_one_sentence(layers.error(), "--layers");
    EXPECT_NE(layers.error().message.find("5:1.9,20:0.3,5:1.9"), std::string::npos);
  }
}

TEST(Phantom, DistanceIsThatToTheNearestOfManySurfacePoints) {
  // Another way to compute it: brute force over points scattered on the surface of the tube.
  const Phantom tube = long_bone();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Vec3> points;
  for (int i = 0; i < 60000; ++i) {
    const double angle = 2.0 * std::numbers::pi * unit(random);
    points.push_back({10.0 * std::cos(angle), 10.0 * std::sin(angle), 24.0 * unit(random) - 12.0});
    const double r = 10.0 * std::sqrt(unit(random));
    points.push_back({r * std::cos(angle), r * std::sin(angle), i % 2 == 0 ? 12.0 : -12.0});
  }
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(28.0 * unit(random) - 14.0, 28.0 * unit(random) - 14.0, 34.0 * unit(random) - 17.0);
    double nearest = 1e9;
    for (const Vec3& q : points) nearest = std::min(nearest, (q - p).norm());
    const double s = tube.surface_mm(p);
    EXPECT_NEAR(std::abs(s), nearest, 0.15) << p.transpose();
    EXPECT_EQ(s < 0.0, std::hypot(p.x(), p.y()) < 10.0 && std::abs(p.z()) < 12.0) << p.transpose();
  }
}

TEST(Phantom, LayersOfABlockGoDownFromItsTop) {
  const Phantom block = plate();
  EXPECT_NEAR(block.density_g_cm3({0, 0, -2.5}, 0.4), 1.9, 1e-12);
  EXPECT_NEAR(block.density_g_cm3({0, 0, -15.0}, 0.4), 0.3, 1e-12);
  EXPECT_NEAR(block.density_g_cm3({0, 0, -28.0}, 0.4), 1.9, 1e-12);
  EXPECT_NEAR(block.density_g_cm3({0, 0, -5.0}, 0.4), 1.1, 1e-12);  // half of each at the interface
}

TEST(Phantom, LayersOfATubeGoInwards) {
  const Phantom tube = long_bone();
  EXPECT_NEAR(tube.density_g_cm3({8.0, 0, 3.0}, 0.4), 1.9, 1e-12);
  EXPECT_NEAR(tube.density_g_cm3({0, -3.0, 3.0}, 0.4), 0.3, 1e-12);
  EXPECT_NEAR(tube.density_g_cm3({0, 0, 0}, 0.4), 0.3, 1e-12);
}

TEST(PhantomCase, HasTheExactSurface) {
  const double h = 0.4;
  for (const Phantom& phantom : {plate(), long_bone()}) {
    const auto bone = build_phantom_case(phantom, h, "test", keep_going);
    ASSERT_TRUE(bone) << bone.error().message;
    // At the samples themselves nothing is interpolated. Only the quantum of 2^-10 mm remains.
    const CoordBox box = covering_samples(phantom.bounds().grown(2.0), h);
    for (int x = box.min.x; x <= box.max.x; x += 3)
      for (int y = box.min.y; y <= box.max.y; y += 3)
        for (int z = box.min.z; z <= box.max.z; ++z) {
          const Vec3 p = position_mm({x, y, z}, h);
          const double truth = std::clamp(phantom.surface_mm(p), -4.0 * h, 4.0 * h);
          ASSERT_NEAR(bone->surface_mm(p), truth, 0.6 / 1024.0) << p.transpose();
        }
    EXPECT_NEAR(bone->volume_mm3(), phantom.volume_mm3(), 0.01 * phantom.volume_mm3());
  }
}

TEST(PhantomCase, KeepsEveryLayersMassAndPlace) {
  // 5 mm is not a whole number of pitches here. Still the mass over the depth must be that of the layers.
  const Phantom phantom = plate();
  const double h = 0.37;
  const auto bone = build_phantom_case(phantom, h, "test", keep_going);
  ASSERT_TRUE(bone);
  const auto mass = [&](double from, double to) {
    double sum = 0.0;
    const double step = 0.01;
    for (double depth = from + 0.5 * step; depth < to; depth += step) sum += step * bone->density_g_cm3({0, 0, -depth});
    return sum;
  };
  EXPECT_NEAR(mass(0.0, 10.0), 5.0 * 1.9 + 5.0 * 0.3, 0.02);
  EXPECT_NEAR(mass(20.0, 30.0), 5.0 * 0.3 + 5.0 * 1.9, 0.02);
  EXPECT_NEAR(mass(6.0, 24.0), 18.0 * 0.3, 0.01);
}

TEST(PhantomCase, SaysWhatItIs) {
  const auto bone = build_phantom_case(plate(), 0.5, "A plate", keep_going);
  ASSERT_TRUE(bone);
  EXPECT_EQ(bone->info().title, "A plate");
  EXPECT_NE(bone->info().source.find("5:1.9,20:0.3,5:1.9"), std::string::npos) << bone->info().source;
  EXPECT_EQ(bone->pitch_mm(), 0.5);
  EXPECT_EQ(bone->info().calibration, imaging::kRho1995);
}

TEST(PhantomCase, RefusesAPitchThatLosesALayer) {
  const auto bone = build_phantom_case(plate(), 6.0, "test", keep_going);
  ASSERT_FALSE(bone);
  expect_one_sentence(bone.error(), "--pitch");
}

TEST(PhantomCase, RefusesMoreSamplesThanFit) {
  const auto bone = build_phantom_case({.kind = PhantomKind::block, .layers = {{500.0, 1.0}}, .width_mm = 1000.0}, 0.05,
                                       "test", keep_going);
  ASSERT_FALSE(bone);
  expect_one_sentence(bone.error(), "--pitch");
}

TEST(PhantomCase, StopsWhenAsked) {
  const auto bone = build_phantom_case(plate(), 0.5, "test", [](double) { return false; });
  ASSERT_FALSE(bone);
  EXPECT_EQ(bone.error().code, ErrorCode::cancelled);
}

TEST(PhantomScan, HoldsTheMassOfThePhantom) {
  // Averaging over voxels loses nothing: the sum of (HU - air) is the integral over the layers.
  for (const Phantom& phantom : {plate(), long_bone()}) {
    const double h = 0.7;
    const auto scan = scan_phantom(phantom, h, keep_going);
    ASSERT_TRUE(scan);
    double sum = 0.0;
    for (const std::int16_t hu : scan->values) sum += (hu - imaging::kAir_hu) * h * h * h;
    double truth = 0.0;
    double outer = phantom.thickness_mm();
    for (const Layer& layer : phantom.layers) {
      const double inner = outer - layer.thickness_mm;
      const double volume = phantom.kind == PhantomKind::block
                                ? phantom.width_mm * phantom.width_mm * layer.thickness_mm
                                : std::numbers::pi * (outer * outer - inner * inner) * phantom.width_mm;
      truth += volume * (imaging::hounsfield(imaging::kRho1995, layer.density_g_cm3) - imaging::kAir_hu);
      outer = inner;
    }
    EXPECT_NEAR(sum, truth, 0.002 * truth);
  }
}

}  // namespace
}  // namespace osteon::import
