// Slabs and shells of cortex around cancellous bone, blurred by a Gaussian in closed form.
#include "common/imaging/thin_cortex.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "common/imaging/calibration.hpp"
#include "common/imaging/resample.hpp"
#include "common/volume/narrow_band.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kSample_mm = 0.5, kSurface_hu = 226.0;
constexpr double kMuscle_hu = 50.0, kInside_hu = 300.0;  // cancellous bone of 0.451 g/cm³
constexpr double kDensity = 1.85;
double cortex_hu(double density = kDensity) { return hounsfield(kRho1995, density); }
double density_of(double hu) { return bone_density_g_cm3(kRho1995, hu); }

double gauss(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

// A ball of 1 convolved with a Gaussian.
double blurred_ball(double r, double radius, double sigma) {
  const double a = (radius - r) / sigma, b = (radius + r) / sigma;
  if (r < 1e-3 * sigma) r = 1e-3 * sigma;
  return gauss(a) + gauss(b) - 1.0 -
         sigma / (r * std::sqrt(2.0 * std::numbers::pi)) * (std::exp(-0.5 * a * a) - std::exp(-0.5 * b * b));
}

HuVolume scanned_layers(const std::array<int, 3>& dims, const std::function<double(const Vec3&)>& hu) {
  HuVolume volume;
  volume.dims = dims;
  volume.spacing_mm = Vec3::Constant(kSample_mm);
  for (int axis = 0; axis < 3; ++axis)
    volume.origin_mm[axis] = -0.5 * kSample_mm * (dims[static_cast<std::size_t>(axis)] - 1) + 0.11;
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x)
        volume.values.push_back(static_cast<std::int16_t>(std::lround(hu(volume.position_mm(Vec3(x, y, z))))));
  return volume;
}

// Along z: air, 7 mm of soft tissue, bone of twice `half_mm` with cortex on both sides, soft tissue, air.
HuVolume cortical_slab(double thickness_mm, double half_mm, double sigma_mm, double density = kDensity) {
  const int slices = 2 * static_cast<int>((half_mm + 11.0) / kSample_mm);
  return scanned_layers({24, 24, slices}, [=](const Vec3& p) {
    const auto layer = [&](double half, double hu) {
      return hu * (gauss((half - p.z()) / sigma_mm) - gauss((-half - p.z()) / sigma_mm));
    };
    return kAir_hu + layer(half_mm + 7.0, kMuscle_hu - kAir_hu) + layer(half_mm, cortex_hu(density) - kMuscle_hu) +
           layer(half_mm - thickness_mm, kInside_hu - cortex_hu(density));
  });
}

struct Corrected {
  SparseVolume surface_mm{0.0f};
  CortexCorrection made;
  const HuVolume* volume;

  [[nodiscard]] double density_before(const Vec3& at) const { return density_of(hu_at(*volume, volume->voxel(at))); }
  // At a sample.
  [[nodiscard]] double density(Coord sample) const {
    return density_of(hu_at(*volume, volume->voxel(position_mm(sample, kSample_mm))) +
                      static_cast<double>(made.change_hu.value(sample)));
  }
};

Corrected corrected(const HuVolume& volume) {
  Corrected c;
  c.volume = &volume;
  CoordBox box;
  const Vec3 last = volume.position_mm(Vec3(volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1));
  box.min = {static_cast<int>(std::ceil(volume.origin_mm.x() / kSample_mm)),
             static_cast<int>(std::ceil(volume.origin_mm.y() / kSample_mm)),
             static_cast<int>(std::ceil(volume.origin_mm.z() / kSample_mm))};
  box.max = {static_cast<int>(std::floor(last.x() / kSample_mm)), static_cast<int>(std::floor(last.y() / kSample_mm)),
             static_cast<int>(std::floor(last.z() / kSample_mm))};
  const VoxelBox all{{0, 0, 0}, {volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1}};
  const SampledField field{
      .box = box,
      .inside = [](const CoordBox&) { return Inside::some; },
      .read = [&](const CoordBox& part,
                  std::span<float> out) { resample(volume, all, volume.values, part, kSample_mm, out); }};
  auto surface = narrow_band_mm(field, static_cast<float>(kSurface_hu), kSample_mm, always);
  EXPECT_TRUE(surface);
  c.surface_mm = std::move(*surface);
  auto made = correct_thin_cortex(volume, c.surface_mm, kSample_mm, kRho1995, always);
  EXPECT_TRUE(made);
  c.made = std::move(*made);
  return c;
}

// The mass for each area from the surface down to the middle of a slab, above that of cancellous bone, in g/cm³ mm.
double excess_mass(const Corrected& c, bool before) {
  double sum = 0.0;
  constexpr double kStep_mm = 0.01;
  for (double z = 0.0; z < 20.0; z += kStep_mm) {
    if (c.surface_mm.trilinear(Vec3(0.0, 0.0, z) / kSample_mm) >= 0.0) break;
    const int low = static_cast<int>(std::floor(z / kSample_mm));
    const double part = z / kSample_mm - low;
    const double density = before ? c.density_before({0, 0, z})
                                  : (1.0 - part) * c.density({0, 0, low}) + part * c.density({0, 0, low + 1});
    sum += kStep_mm * (density - density_of(kInside_hu));
  }
  return sum;
}

TEST(ThinCortex, ASlabHasItsMassDensityAndThickness) {
  for (const double sigma : {0.6, 0.8, 1.0})
    for (const double thickness : {0.5, 1.0, 1.5, 2.0, 3.0}) {
      const double half = 8.0;
      const HuVolume volume = cortical_slab(thickness, half, sigma);
      const Corrected c = corrected(volume);
      const double truth = (kDensity - density_of(kInside_hu)) * thickness;
      double peak_before = 0.0, peak = 0.0, beside = 0.0;
      const double surface_z = [&] {
        double z = 0.0;
        while (c.surface_mm.trilinear(Vec3(0.0, 0.0, z) / kSample_mm) < 0.0) z += 0.01;
        return z;
      }();
      for (int z = 0; z * kSample_mm < surface_z; ++z) {
        peak_before = std::max(peak_before, c.density_before({0, 0, z * kSample_mm}));
        peak = std::max(peak, c.density({0, 0, z}));
        if (surface_z - z * kSample_mm > thickness + kSample_mm)
          beside = std::max(beside, std::abs(c.density({0, 0, z}) / density_of(kInside_hu) - 1.0));
      }
      std::printf("sigma %.1f, %.1f mm: mass %.2f -> %.2f of it, density %.2f -> %.2f, cancellous within %.1f %%\n",
                  sigma, thickness, excess_mass(c, true) / truth, excess_mass(c, false) / truth, peak_before, peak,
                  100.0 * beside);
      EXPECT_NEAR(c.made.spread.sigma_mm.z(), std::hypot(sigma, kSample_mm / std::sqrt(6.0)), 0.05 * sigma);
      EXPECT_NEAR(excess_mass(c, false), truth, 0.04 * truth);
      EXPECT_NEAR(c.made.thickness_mm[1], thickness, 0.05 * thickness + 0.02);
      // A sample is the mean of a pitch, so a thinner cortex shows less than its density.
      EXPECT_NEAR(peak, kDensity, thickness >= 2.0 * kSample_mm ? 0.03 * kDensity : 0.3 * kDensity);
      EXPECT_LT(beside, 0.05);
      EXPECT_GT(c.made.corrected, c.made.points * 8 / 10);
    }
}

TEST(ThinCortex, AShellHasItsMassAndDensity) {
  constexpr double kRadius_mm = 9.0, kSigma_mm = 0.7;
  for (const double thickness : {1.0, 2.0}) {
    const HuVolume volume = scanned_layers({72, 72, 72}, [=](const Vec3& p) {
      const double r = p.norm();
      return kAir_hu + (kMuscle_hu - kAir_hu) * blurred_ball(r, 14.0, kSigma_mm) +
             (cortex_hu() - kMuscle_hu) * blurred_ball(r, kRadius_mm, kSigma_mm) +
             (kInside_hu - cortex_hu()) * blurred_ball(r, kRadius_mm - thickness, kSigma_mm);
    });
    const Corrected c = corrected(volume);
    EXPECT_TRUE(c.made.spread.measured[0] && c.made.spread.measured[1] && c.made.spread.measured[2]);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(c.made.spread.sigma_mm[axis], std::hypot(kSigma_mm, kSample_mm / std::sqrt(6.0)), 0.07 * kSigma_mm);
    EXPECT_NEAR(c.made.thickness_mm[1], thickness, 0.06 * thickness);
    // Densities by their depth below the surface.
    double cortex = 0.0, inside = 0.0, mass = 0.0, mass_before = 0.0;
    int cortex_samples = 0, inside_samples = 0;
    double volume_mm3 = 0.0;
    for (int x = -24; x <= 24; ++x)
      for (int y = -24; y <= 24; ++y)
        for (int z = -24; z <= 24; ++z) {
          const double depth = -static_cast<double>(c.surface_mm.value({x, y, z}));
          if (depth <= -kSample_mm) continue;
          const double part = std::clamp(0.5 + depth / kSample_mm, 0.0, 1.0), voxel = std::pow(kSample_mm, 3);
          volume_mm3 += part * voxel;
          mass += part * voxel * c.density({x, y, z});
          mass_before += part * voxel * c.density_before(position_mm({x, y, z}, kSample_mm));
          if (depth > 0.3 * thickness && depth < 0.7 * thickness) {
            cortex += c.density({x, y, z});
            ++cortex_samples;
          } else if (depth > thickness + 0.5 && depth < thickness + 1.9 && depth < 1.99) {
            inside += c.density({x, y, z});
            ++inside_samples;
          }
        }
    ASSERT_GT(cortex_samples, 100);
    cortex /= cortex_samples;
    const double radius = std::cbrt(volume_mm3 * 3.0 / (4.0 * std::numbers::pi));
    const auto ball = [](double r) { return 4.0 / 3.0 * std::numbers::pi * r * r * r; };
    const double truth =
        density_of(kInside_hu) * ball(radius - thickness) + kDensity * (ball(radius) - ball(radius - thickness));
    std::printf("shell of %.1f mm: mass %.3f -> %.3f of it, cortex %.2f\n", thickness, mass_before / truth,
                mass / truth, cortex);
    EXPECT_NEAR(mass, truth, 0.03 * truth);
    EXPECT_NEAR(cortex, kDensity, 0.03 * kDensity);
    if (thickness < 1.5) {  // the band of distances ends below thicker cortex
      ASSERT_GT(inside_samples, 0);
      EXPECT_NEAR(inside / inside_samples, density_of(kInside_hu), 0.05 * density_of(kInside_hu));
    }
  }
}

// The inner and the outer side of a wall of 1 mm blur into one peak, as in the orbit.
TEST(ThinCortex, AWallHasItsMass) {
  constexpr double kSigma_mm = 0.7;
  for (const double wall : {0.6, 1.0, 1.6}) {
    const HuVolume volume = scanned_layers({24, 24, 48}, [=](const Vec3& p) {
      const auto layer = [&](double half, double hu) {
        return hu * (gauss((half - p.z()) / kSigma_mm) - gauss((-half - p.z()) / kSigma_mm));
      };
      return kAir_hu + layer(8.0, kMuscle_hu - kAir_hu) + layer(0.5 * wall, cortex_hu() - kMuscle_hu);
    });
    const Corrected c = corrected(volume);
    double mass = 0.0, before = 0.0;
    for (int z = -12; z <= 12; ++z) {
      const double depth = -static_cast<double>(c.surface_mm.value({0, 0, z}));
      const double part = kSample_mm * std::clamp(0.5 + depth / kSample_mm, 0.0, 1.0);
      mass += part * (c.density({0, 0, z}) - density_of(kMuscle_hu));
      before += part * (c.density_before({0, 0, z * kSample_mm}) - density_of(kMuscle_hu));
    }
    const double truth = wall * (kDensity - density_of(kMuscle_hu));
    std::printf("wall of %.1f mm: mass %.2f -> %.2f of it\n", wall, before / truth, mass / truth);
    EXPECT_NEAR(mass, truth, 0.06 * truth);
  }
}

TEST(ThinCortex, ThickCortexShowsItsOwnDensity) {
  const HuVolume volume = cortical_slab(3.5, 9.0, 0.6, 1.7);
  const Corrected c = corrected(volume);
  EXPECT_TRUE(c.made.cortex_measured);
  EXPECT_NEAR(density_of(c.made.cortex_hu), 1.7, 0.03 * 1.7);
}

TEST(ThinCortex, WhatIsNoCortexStays) {
  // One density throughout: soft tissue, then 900 HU without a cortex.
  const HuVolume volume = scanned_layers({24, 24, 60}, [](const Vec3& p) {
    return kAir_hu + (kMuscle_hu - kAir_hu) * (gauss((13.0 - p.z()) / 0.7) - gauss((-13.0 - p.z()) / 0.7)) +
           (900.0 - kMuscle_hu) * (gauss((6.0 - p.z()) / 0.7) - gauss((-6.0 - p.z()) / 0.7));
  });
  const Corrected c = corrected(volume);
  for (int z = -9; z <= 9; ++z) EXPECT_NEAR(c.density({0, 0, z}), density_of(900.0), 0.02 * density_of(900.0)) << z;
}

TEST(ThinCortex, CanBeStoppedAtEachStage) {
  const HuVolume volume = cortical_slab(1.0, 6.0, 0.7);
  const Corrected c = corrected(volume);
  for (const double at : {0.0, 0.05, 0.12, 0.3, 0.9, 1.0}) {
    const auto stopped =
        correct_thin_cortex(volume, c.surface_mm, kSample_mm, kRho1995, [&](double done) { return done < at; });
    ASSERT_FALSE(stopped) << at;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::imaging
