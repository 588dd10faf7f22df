// Metal, photons, noise, glare and grey: closed forms and statistics.
#include "common/radiology/intensifier.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "common/radiology/attenuation.hpp"
#include "common/radiology/metal.hpp"
#include "common/tools/tool_solid.hpp"
#include "tests/unit/radiology/beams.hpp"

namespace osteon::radiology {
namespace {

ConeBeam coarse_beam() {
  CArm arm;
  arm.detector_mm = 120.0;
  arm.columns = 120;
  arm.rows = 90;
  return good_beam(arm);
}

std::vector<float> photons_behind(const ConeBeam& beam, const Layers& layers) {
  std::vector<float> photons(beam.detector.count());
  count_photons(beam, layers, {}, {}, beam.detector.whole(), photons);
  return photons;
}

// An image of one row.
void add_noise(std::vector<float>& photons, std::uint64_t seed) {
  const PixelGrid row{.columns = static_cast<int>(photons.size()), .rows = 1};
  add_quantum_noise(row, row.whole(), seed, photons);
}

template <class Settings>
void expect_refused(const Settings& settings, const char* field) {
  const Result<void> good = check(settings);
  ASSERT_FALSE(good.has_value()) << field;
  EXPECT_EQ(good.error().code, ErrorCode::invalid_input);
  EXPECT_NE(good.error().message.find(field), std::string::npos) << good.error().message;
}

double mean_of(std::span<const float> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(Attenuation, IsThatOfItsMaterials) {
  EXPECT_EQ(attenuation_per_mm(-1000.0), 0.0);
  EXPECT_DOUBLE_EQ(attenuation_per_mm(0.0), kWater_per_mm);
  EXPECT_NEAR(attenuation_per_mm(kCorticalBone_hu), kCorticalBone_per_mm, 1e-12);
  EXPECT_DOUBLE_EQ(attenuation_per_mm(-500.0), 0.5 * kWater_per_mm);
  // The definition of HU with the coefficients at 70 keV.
  // Mass attenuation coefficients at 50 keV, cm²/g, times densities in g/cm³ (Hubbell 1995). A cm is 10 mm.
  EXPECT_NEAR(kWater_per_mm, 0.2269 * 1.00 / 10.0, 1e-5);
  EXPECT_NEAR(kCorticalBone_per_mm, 0.4242 * 1.92 / 10.0, 1e-5);
  EXPECT_NEAR(kTitanium_per_mm, 1.213 * 4.54 / 10.0, 1e-4);
  EXPECT_NEAR(kSteel_per_mm, 1.958 * 7.87 / 10.0, 1e-3);
  EXPECT_NEAR(kCorticalBone_hu, 1000.0 * (1.92 * 0.2616 / 0.1937 - 1.0), 1.0);
}

TEST(Metal, LengthsAreThoseOfTheSolid) {
  const Implicit shaft = placed(cylinder(2.0, -30.0, 30.0), pose_along(Vec3(1, 2, 3), Vec3(0, 0, 1)));
  EXPECT_NEAR(length_in(shaft, Vec3(1, -300, 3), Vec3(1, 300, 3)), 4.0, 2.0 * kMetalStep_mm);
  EXPECT_NEAR(length_in(shaft, Vec3(2, -300, 3), Vec3(2, 300, 3)), 2.0 * std::sqrt(3.0), 2.0 * kMetalStep_mm);
  EXPECT_NEAR(length_in(shaft, Vec3(1, 2, -300), Vec3(1, 2, 300)), 60.0, 2.0 * kMetalStep_mm);
  EXPECT_EQ(length_in(shaft, Vec3(4, -300, 3), Vec3(4, 300, 3)), 0.0);
  // A ray that ends in the solid.
  EXPECT_NEAR(length_in(shaft, Vec3(1, -300, 3), Vec3(1, 2, 3)), 2.0, 2.0 * kMetalStep_mm);
}

TEST(Metal, DarkensOnlyItsShadow) {
  const ConeBeam beam = coarse_beam();
  std::vector<float> metal(beam.detector.count(), 7.0f);  // of an image before
  const MetalSolid nail{ball(Vec3(0, 0, 0), 6.0), kSteel_per_mm};
  cast_metal(beam, {&nail, 1}, beam.detector.whole(), metal);
  double most = 0.0;
  for (int row = 0; row < 90; ++row)
    for (int column = 0; column < 120; ++column) {
      const Vec3 pixel = beam.detector.at(column, row), d = (pixel - beam.source_mm).normalized();
      const double nearest = (-beam.source_mm - d * d.dot(-beam.source_mm)).norm();
      const double length = nearest < 6.0 ? 2.0 * std::sqrt(36.0 - nearest * nearest) : 0.0;
      const double found = static_cast<double>(metal[beam.detector.index(column, row)]);
      ASSERT_NEAR(found, kSteel_per_mm * length, 3.0 * kMetalStep_mm * kSteel_per_mm);
      most = std::max(most, found);
    }
  EXPECT_GT(most, 18.0);
}

TEST(Intensifier, PhotonsFollowTheLawOfBeerAndLambert) {
  const ConeBeam beam = coarse_beam();
  const std::vector<float> none(beam.detector.count(), 0.0f), one(beam.detector.count(), 1.0f);
  const std::vector<float> open = photons_behind(beam, {none}), dimmed = photons_behind(beam, {one});
  for (std::size_t i = 0; i < open.size(); ++i) ASSERT_NEAR(dimmed[i] / open[i], std::exp(-1.0f), 1e-6f);
  EXPECT_EQ(photons_behind(beam, {none, one}), dimmed);  // metal as bone
  // At twice the distance, a quarter of the photons.
  CArm far;
  far.detector_mm = 120.0;
  far.columns = 120;
  far.rows = 90;
  far.source_detector_mm = 2000.0;
  const float middle = open[beam.detector.index(60, 45)];
  EXPECT_NEAR(photons_behind(good_beam(far), {none})[beam.detector.index(60, 45)] / middle, 0.25f, 1e-3f);
}

// 50 keV are 8.011e-15 J, and air takes 0.004098 m²/kg of their energy. So 1 µGy, 1e-6 J/kg, is 3.046e10 photons in a
// square metre. At 1 m, 2 µGy on a pixel of 1 mm² give 60,920, of which 65 % count.
TEST(Intensifier, CountsThePhotonsOfTheKerma) {
  CArm arm;
  arm.detector_mm = 3.0;
  arm.columns = arm.rows = 3;
  const std::vector<float> none(9, 0.0f);
  const float middle = photons_behind(good_beam(arm), {none})[4];
  EXPECT_NEAR(static_cast<double>(middle), 0.65 * 60920.0, 0.001 * 0.65 * 60920.0);
}

TEST(Intensifier, DoseAreaDoesNotDependOnTheDistance) {
  CArm arm;
  arm.columns = 100;
  arm.rows = 100;
  arm.detector_mm = 100.0;
  // 2 µGy at 1 m on 100 cm².
  EXPECT_NEAR(dose_area_gy_cm2(good_beam(arm), {2.0}), 2e-4, 1e-12);
  arm.source_detector_mm = 500.0;
  arm.detector_mm = 50.0;  // the same cone
  EXPECT_NEAR(dose_area_gy_cm2(good_beam(arm), {2.0}), 2e-4, 1e-12);
}

// Behind more matter the pulse is stronger by what the matter takes, as is its dose-area product, and the image has the
// same photons. Beyond its limits the tube does what it can.
TEST(Intensifier, ExposureFollowsTheThickness) {
  const ConeBeam beam = coarse_beam();
  const auto behind = [&](float attenuation) { return std::vector<float>(beam.detector.count(), attenuation); };
  const auto exposure = [&](float attenuation) {
    return controlled_exposure(beam, {behind(attenuation)}, {}, ExposureControl{});
  };
  const auto middle_photons = [&](float attenuation) {
    std::vector<float> photons(beam.detector.count());
    const std::vector<float> layer = behind(attenuation);
    count_photons(beam, {layer}, exposure(attenuation), {}, beam.detector.whole(), photons);
    double sum = 0.0;
    for (int row = 22; row < 68; ++row)
      for (int column = 30; column < 90; ++column)
        sum += static_cast<double>(photons[beam.detector.index(column, row)]);
    return sum / (46.0 * 60.0);  // pixels of 1 mm²
  };
  EXPECT_NEAR(middle_photons(3.5f), 600.0, 0.1);
  EXPECT_NEAR(middle_photons(4.5f), 600.0, 0.1);
  EXPECT_NEAR(dose_area_gy_cm2(beam, exposure(4.5f)) / dose_area_gy_cm2(beam, exposure(3.5f)), std::exp(1.0), 1e-4);
  EXPECT_EQ(exposure(200.0f).air_kerma_at_metre_ugy, 20.0);
  EXPECT_EQ(exposure(0.0f).air_kerma_at_metre_ugy, 0.1);
  expect_refused(ExposureControl{.photons_per_mm2 = 0.0}, "photons_per_mm2");
  expect_refused(ExposureControl{.least_kerma_ugy = -1.0}, "least_kerma_ugy");
  expect_refused(ExposureControl{.most_kerma_ugy = 0.05}, "most_kerma_ugy");
}

// Mean and variance of a Poisson distribution are equal. Bounds: four standard errors.
TEST(Intensifier, NoiseIsPoisson) {
  constexpr std::size_t kPixels = 40000;
  for (const double mean : {0.3, 4.0, 59.0, 61.0, 5000.0}) {
    std::vector<float> photons(kPixels, static_cast<float>(mean));
    add_noise(photons, 1234);
    double squares = 0.0;
    const double found = mean_of(photons);
    for (const float n : photons) squares += (static_cast<double>(n) - found) * (static_cast<double>(n) - found);
    EXPECT_NEAR(found, mean, 4.0 * std::sqrt(mean / kPixels));
    EXPECT_NEAR(squares / kPixels, mean, 4.0 * std::sqrt((2.0 * mean * mean + mean) / kPixels));
  }
}

TEST(Intensifier, NoiseRepeatsWithItsSeed) {
  std::vector<float> a(500, 80.0f), b(500, 80.0f), other(500, 80.0f), longer(700, 80.0f);
  add_noise(a, 1);
  add_noise(b, 1);
  add_noise(other, 2);
  add_noise(longer, 1);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, other);
  EXPECT_TRUE(std::equal(a.begin(), a.end(), longer.begin()));
}

TEST(Intensifier, GlareKeepsTheLight) {
  const PixelGrid detector = grid_about(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 1.0, 201, 201);
  std::vector<float> photons(detector.count(), 0.0f);
  photons[detector.index(100, 100)] = 81.0f * 81.0f;
  add_glare(detector, {.detected = 1.0, .glare = 0.1, .glare_radius_mm = 40.0}, photons);
  EXPECT_NEAR(mean_of(photons) * static_cast<double>(photons.size()), 81.0 * 81.0, 0.1);
  EXPECT_NEAR(photons[detector.index(100 + 40, 100 - 40)], 0.1f, 1e-5f);
  EXPECT_EQ(photons[detector.index(100 + 41, 100)], 0.0f);
  EXPECT_NEAR(photons[detector.index(100, 100)], 0.9f * 81.0f * 81.0f + 0.1f, 0.01f);
}

TEST(Intensifier, GreyFollowsTheLogarithm) {
  const std::vector<float> photons{1.0f, 10.0f, 100.0f, 1000.0f, 10000.0f, 100000.0f};
  EXPECT_EQ(grey_of(photons, {10.0f, 10000.0f, false}), (std::vector<std::uint8_t>{0, 0, 85, 170, 255, 255}));
  EXPECT_EQ(grey_of(photons, {10.0f, 10000.0f, true}), (std::vector<std::uint8_t>{255, 255, 170, 85, 0, 0}));
  std::vector<float> ramp(1000);
  std::iota(ramp.begin(), ramp.end(), 1.0f);
  const Contrast contrast = automatic_window(ramp);
  EXPECT_EQ(contrast.black, 11.0f);
  EXPECT_EQ(contrast.white, 990.0f);
  // An image of one value, such as air.
  EXPECT_GT(automatic_window(std::vector<float>(9, 5.0f)).white, automatic_window(std::vector<float>(9, 5.0f)).black);
}

TEST(Intensifier, RefusesSettingsAndNamesTheField) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const float nanf = std::numeric_limits<float>::quiet_NaN();
  for (const double kerma : {-1.0, nan, 1e300}) expect_refused(Exposure{kerma}, "air_kerma_at_metre_ugy");
  for (const double part : {-0.1, 0.0, 1.1, nan}) expect_refused(Intensifier{.detected = part}, "detected");
  for (const double part : {-0.1, 1.1, nan}) expect_refused(Intensifier{.glare = part}, "glare");
  for (const double mm : {-2.0, nan, 1e300}) expect_refused(Intensifier{.glare_radius_mm = mm}, "glare_radius_mm");
  for (const float black : {0.0f, -1.0f, nanf}) expect_refused(Contrast{black, 1000.0f, false}, "black");
  for (const float white : {5.0f, 5.01f, nanf}) expect_refused(Contrast{5.0f, white, false}, "white");
  EXPECT_TRUE(check(Exposure{}).has_value() && check(Intensifier{}).has_value() && check(Contrast{}).has_value());
}

// Nothing is read beside the image, whatever the radius: all light of one pixel stays in it, or leaves the image.
TEST(Intensifier, GlareOfAnyRadiusStaysWithinTheImage) {
  const PixelGrid detector = grid_about(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 1.0, 20, 10);
  for (const double radius : {0.0, 0.9, 19.0, 1e6}) {
    std::vector<float> photons(detector.count(), 7.0f);
    add_glare(detector, {.detected = 1.0, .glare = 1.0, .glare_radius_mm = radius}, photons);
    for (const float n : photons) ASSERT_TRUE(n >= 0.0f && n <= 7.0f);
    if (radius < 1.0) {
      EXPECT_EQ(photons, std::vector<float>(detector.count(), 7.0f));
    }
  }
}

TEST(IntensifierDeathTest, StepsRelyOnCheckedSettings) {
  const PixelGrid detector = grid_about(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 1.0, 20, 10);
  std::vector<float> photons(detector.count(), 7.0f);
  EXPECT_DEATH(add_glare(detector, {.glare_radius_mm = -2.0}, photons), "check");
  EXPECT_DEATH((void)grey_of(photons, {0.0f, 5.0f, false}), "check");
}

}  // namespace
}  // namespace osteon::radiology
