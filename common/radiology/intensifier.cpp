#include "common/radiology/intensifier.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/check.hpp"

namespace osteon::radiology {
namespace {

// Photons of 50 keV in 1 mm² that make an air kerma of 1 µGy: kerma over energy and the mass energy-absorption
// coefficient of air, 0.04098 cm²/g (Hubbell 1995).
constexpr double kJoulePerPhoton = 50e3 * 1.602177e-19;
constexpr double kPhotonsPerMm2PerUgy = 1e-6 / (kJoulePerPhoton * 0.004098) * 1e-6;
// From this mean on, a normal distribution stands for that of Poisson. Its skewness is then below 0.13.
constexpr double kNormalFrom = 60.0;
constexpr double kMetre_mm = 1000.0;
constexpr double kMostGlare_pixels = 1e8;
constexpr double kMostKerma_ugy = 1e9;
constexpr float kMostPhotons = 1e30f, kLeastContrast = 1.01f;

// SplitMix64 (Steele 2014), with a state of its own for each pixel.
class PixelRandom {
 public:
  PixelRandom(std::uint64_t seed, std::uint64_t pixel) : state_(mix(seed) ^ mix(pixel * kStride + 1)) {}
  double unit() {  // 0 < u < 1
    state_ += kStride;
    return (static_cast<double>(mix(state_) >> 12U) + 0.5) * 0x1.0p-52;
  }

 private:
  static constexpr std::uint64_t kStride = 0x9e3779b97f4a7c15U;
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_;
};

double poisson(double mean, PixelRandom& random) {
  if (mean >= kNormalFrom) {
    const double radius = std::sqrt(-2.0 * std::log(random.unit()));
    const double normal = radius * std::cos(2.0 * std::numbers::pi * random.unit());
    return std::max(0.0, std::round(mean + std::sqrt(mean) * normal));
  }
  // The number of events before the product of their intervals is spent.
  const double end = std::exp(-mean);
  double product = random.unit(), count = 0.0;
  while (product > end) {
    product *= random.unit();
    count += 1.0;
  }
  return count;
}

// Means over 2 · half + 1 values of a line. Beyond its ends there is no light.
void blur_line(float* line, std::ptrdiff_t stride, int count, int half, std::vector<double>& sums) {
  sums.assign(static_cast<std::size_t>(count) + 1, 0.0);
  for (int i = 0; i < count; ++i)
    sums[static_cast<std::size_t>(i) + 1] = sums[static_cast<std::size_t>(i)] + static_cast<double>(line[i * stride]);
  for (int i = 0; i < count; ++i) {
    const auto first = static_cast<std::size_t>(std::max(0, i - half));
    const auto end = static_cast<std::size_t>(std::min(count, i + half + 1));
    line[i * stride] = static_cast<float>((sums[end] - sums[first]) / (2 * half + 1));
  }
}

}  // namespace

Result<void> check(const Exposure& exposure) {
  if (!(exposure.air_kerma_at_metre_ugy >= 0.0 && exposure.air_kerma_at_metre_ugy <= kMostKerma_ugy))
    return bad_field("the exposure's air_kerma_at_metre_ugy", "must be from 0 to 1e9");
  return {};
}

Result<void> check(const Intensifier& intensifier) {
  if (!(intensifier.detected > 0.0 && intensifier.detected <= 1.0))
    return bad_field("the intensifier's detected", "must be above 0 and at most 1");
  if (!(intensifier.glare >= 0.0 && intensifier.glare <= 1.0))
    return bad_field("the intensifier's glare", "must be from 0 to 1");
  if (!(intensifier.glare_radius_mm >= 0.0 && intensifier.glare_radius_mm <= kMostOfCArm_mm))
    return bad_field("the intensifier's glare_radius_mm", "must be from 0 to 1e6");
  return {};
}

Result<void> check(const Contrast& contrast) {
  if (!(contrast.black > 0.0f && contrast.black <= kMostPhotons))
    return bad_field("the contrast's black", "must be above 0 and at most 1e30");
  if (!(contrast.white >= kLeastContrast * contrast.black && contrast.white <= kMostPhotons))
    return bad_field("the contrast's white", "must be at least 1.01 times its black and at most 1e30");
  return {};
}

Result<void> check(const ExposureControl& control) {
  if (!(control.photons_per_mm2 > 0.0 && control.photons_per_mm2 <= static_cast<double>(kMostPhotons)))
    return bad_field("the exposure control's photons_per_mm2", "must be above 0 and at most 1e30");
  if (!(control.least_kerma_ugy >= 0.0 && control.least_kerma_ugy <= kMostKerma_ugy))
    return bad_field("the exposure control's least_kerma_ugy", "must be from 0 to 1e9");
  if (!(control.most_kerma_ugy >= control.least_kerma_ugy && control.most_kerma_ugy <= kMostKerma_ugy))
    return bad_field("the exposure control's most_kerma_ugy", "must be from its least_kerma_ugy to 1e9");
  return {};
}

double dose_area_gy_cm2(const ConeBeam& beam, const Exposure& exposure) {
  OSTEON_CHECK(check(exposure).has_value());
  const PixelGrid& grid = beam.detector;
  const Vec3 cross = grid.column_mm.cross(grid.row_mm);
  const double distance = std::abs(cross.normalized().dot(grid.first_mm - beam.source_mm));
  const double area_mm2 = cross.norm() * static_cast<double>(grid.count());
  const double at_metre = kMetre_mm / distance;
  return exposure.air_kerma_at_metre_ugy * 1e-6 * area_mm2 * at_metre * at_metre * 0.01;
}

void count_photons(const ConeBeam& beam, const Layers& layers, const Exposure& exposure, const Intensifier& intensifier,
                   const PixelBox& box, std::span<float> photons) {
  const PixelGrid& grid = beam.detector;
  OSTEON_CHECK(photons.size() == grid.count() && grid.holds(box) && layers.bone.size() == grid.count());
  OSTEON_CHECK(layers.metal.empty() || layers.metal.size() == grid.count());
  OSTEON_CHECK(check(exposure).has_value() && check(intensifier).has_value());
  const Vec3 cross = grid.column_mm.cross(grid.row_mm), normal = cross.normalized();
  const double at_metre = kPhotonsPerMm2PerUgy * exposure.air_kerma_at_metre_ugy * cross.norm() * intensifier.detected;
  for (int row = box.first_row; row <= box.last_row; ++row)
    for (int column = box.first_column; column <= box.last_column; ++column) {
      const Vec3 ray = grid.at(column, row) - beam.source_mm;
      const double square = ray.squaredNorm(), cosine = std::abs(normal.dot(ray)) / std::sqrt(square);
      const std::size_t i = grid.index(column, row);
      const double metal = layers.metal.empty() ? 0.0 : static_cast<double>(layers.metal[i]);
      photons[i] = static_cast<float>(at_metre * kMetre_mm * kMetre_mm / square * cosine *
                                      std::exp(-(static_cast<double>(layers.bone[i]) + metal)));
    }
}

Exposure controlled_exposure(const ConeBeam& beam, const Layers& layers, const Intensifier& intensifier,
                             const ExposureControl& control) {
  OSTEON_CHECK(check(control).has_value());
  const PixelGrid& grid = beam.detector;
  const PixelBox middle{grid.columns / 4, grid.rows / 4, grid.columns - 1 - grid.columns / 4,
                        grid.rows - 1 - grid.rows / 4};
  // Photons are in proportion to kerma, so those of 1 µGy tell what is needed.
  std::vector<float> photons(grid.count());
  count_photons(beam, layers, {.air_kerma_at_metre_ugy = 1.0}, intensifier, middle, photons);
  double sum = 0.0, pixels = 0.0;
  for (int row = middle.first_row; row <= middle.last_row; ++row)
    for (int column = middle.first_column; column <= middle.last_column; ++column, pixels += 1.0)
      sum += static_cast<double>(photons[grid.index(column, row)]);
  const double needed = control.photons_per_mm2 * grid.column_mm.cross(grid.row_mm).norm() * pixels;
  // Behind metal that lets no photon through, the tube does what it can.
  const double kerma_ugy = sum * control.most_kerma_ugy > needed ? needed / sum : control.most_kerma_ugy;
  return {std::max(kerma_ugy, control.least_kerma_ugy)};
}

void add_quantum_noise(const PixelGrid& detector, const PixelBox& box, std::uint64_t seed, std::span<float> photons) {
  OSTEON_CHECK(photons.size() == detector.count() && detector.holds(box));
  for (int row = box.first_row; row <= box.last_row; ++row)
    for (int column = box.first_column; column <= box.last_column; ++column) {
      const std::size_t i = detector.index(column, row);
      PixelRandom random(seed, i);
      photons[i] = static_cast<float>(poisson(static_cast<double>(photons[i]), random));
    }
}

void add_glare(const PixelGrid& detector, const Intensifier& intensifier, std::span<float> photons) {
  OSTEON_CHECK(photons.size() == detector.count());
  OSTEON_CHECK(check(intensifier).has_value());
  std::vector<float> veil(photons.begin(), photons.end());
  std::vector<double> sums;
  // A square that is wider than the image spreads light beyond it, but needs no number that an int cannot hold.
  const auto half = [&](double pixel_mm) {
    return static_cast<int>(std::min(intensifier.glare_radius_mm / pixel_mm, kMostGlare_pixels));
  };
  for (int row = 0; row < detector.rows; ++row)
    blur_line(veil.data() + detector.index(0, row), 1, detector.columns, half(detector.column_mm.norm()), sums);
  for (int column = 0; column < detector.columns; ++column)
    blur_line(veil.data() + column, detector.columns, detector.rows, half(detector.row_mm.norm()), sums);
  const auto part = static_cast<float>(intensifier.glare);
  for (std::size_t i = 0; i < photons.size(); ++i) photons[i] += part * (veil[i] - photons[i]);
}

Contrast automatic_window(std::span<const float> photons) {
  OSTEON_CHECK(!photons.empty());
  std::vector<float> sorted(photons.begin(), photons.end());
  const std::size_t hundredth = sorted.size() / 100;
  const auto value = [&](std::size_t place) {
    std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(place));
    return std::max(sorted[place], 1.0f);
  };
  Contrast contrast{value(hundredth), value(sorted.size() - 1 - hundredth)};
  contrast.white = std::max(contrast.white, contrast.black * kLeastContrast);
  return contrast;
}

std::vector<std::uint8_t> grey_of(std::span<const float> photons, const Contrast& contrast) {
  OSTEON_CHECK(check(contrast).has_value());
  const float black = std::log(contrast.black), range = std::log(contrast.white) - black;
  std::vector<std::uint8_t> grey(photons.size());
  std::ranges::transform(photons, grey.begin(), [&](float count) {
    const float light = std::clamp((std::log(std::max(count, contrast.black)) - black) / range, 0.0f, 1.0f);
    return static_cast<std::uint8_t>(std::lround(255.0f * (contrast.inverted ? 1.0f - light : light)));
  });
  return grey;
}

}  // namespace osteon::radiology
