// The line from HU to density as a user chooses it, and what the case says of it.
#include "server/import/scan_calibration.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "server/import/case_report.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

constexpr double kHuPerDensity = 1500.0, kHuOfNothing = 15.0;  // of rods

// Three rods, 12 mm wide, of 0, 0.1 and 0.2 g/cm³ in a block of plastic, in air.
imaging::HuVolume rods() {
  imaging::HuVolume volume;
  volume.dims = {80, 40, 6};
  for (int z = 0; z < 6; ++z)
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 80; ++x) {
        double hu = x < 4 || x > 75 || y < 8 || y > 32 ? -1000.0 : 90.0;
        for (int rod = 0; rod < 3; ++rod)
          if (std::hypot(x - 18 - 22 * rod, y - 20) < 6.0) hu = kHuOfNothing + kHuPerDensity * 0.1 * rod;
        volume.values.push_back(static_cast<std::int16_t>(hu));
      }
  return volume;
}

TEST(ScanCalibration, RodsGiveTheLine) {
  imaging::HuVolume scan = rods();
  const auto found = calibrate_scan(scan, {.line = {}, .rods_g_cm3 = {0.2, 0.0, 0.1}}, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->line.slope_g_cm3_per_hu, 1.0 / kHuPerDensity, 1e-9);
  EXPECT_NEAR(found->line.intercept_g_cm3, -kHuOfNothing / kHuPerDensity, 1e-9);
  EXPECT_EQ(found->provenance.method, "rods in the scan");
  EXPECT_NEAR(found->provenance.parameters.at("rod_3_g_cm3"), 0.2, 1e-12);
  EXPECT_NEAR(found->provenance.parameters.at("rod_3_hu"), kHuOfNothing + 0.2 * kHuPerDensity, 1e-9);
  EXPECT_NEAR(found->provenance.parameters.at(kCorticalError), 0.0, 1e-9) << "the readings are on a line";
  EXPECT_NE(found->text.find("rod        0.2 g/cm3: 315.0 +- 0.0 HU, +0.0000 g/cm3 from the line; at 62.0 20.0 2.5"),
            std::string::npos)
      << found->text;
}

// Wet bone with 0.12 g/cm³ of mineral has 0.2 g/cm³, because ash is 0.6 of it.
TEST(ScanCalibration, RodsOfHydroxyapatiteGiveTheDensityOfWetBone) {
  imaging::HuVolume scan = rods();
  const auto found = calibrate_scan(
      scan, {.line = {}, .rods_g_cm3 = {0.0, 0.1, 0.2}, .rods_of = RodMaterial::hydroxyapatite}, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(imaging::density_g_cm3(found->line, kHuOfNothing + 0.12 * kHuPerDensity), 0.2, 1e-9);
  EXPECT_NEAR(found->provenance.parameters.at("rod_2_g_cm3"), 0.1, 1e-12) << "as it was given";
}

TEST(ScanCalibration, AirAndSoftTissueGiveTheScale) {
  imaging::HuVolume scan;
  scan.dims = {20, 20, 2};
  for (std::size_t i = 0; i < scan.count(); ++i)
    scan.values.push_back(static_cast<std::int16_t>(i % 3 == 0 ? 66 : i % 20 == 1 ? 900 : -1035));
  const auto found = calibrate_scan(scan, {.line = {}, .rods_g_cm3 = {}, .rescale_hu = true}, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(scan.values[0], 45);
  EXPECT_EQ(scan.values[2], -1000);
  // -1000 + (900 + 1035) · 1045 / 1101
  EXPECT_EQ(scan.values[1], 837);
  EXPECT_EQ(found->line, imaging::kRho1995);
  EXPECT_NEAR(found->provenance.parameters.at("soft_tissue_hu"), 66.0, 0.5);
  // Cortex of 1.85 g/cm³ has (1.85 - 0.131) / 0.001067 = 1611 HU; 20 HU of soft tissue are 50 HU there.
  EXPECT_NEAR(found->provenance.parameters.at(kCorticalError), std::hypot(0.2, 0.001067 * 2611.0 / 1045.0 * 20.0),
              1e-4);
}

TEST(ScanCalibration, OnlyOneIsTaken) {
  imaging::HuVolume scan = rods();
  const CalibrationOptions both[] = {{.line = imaging::kRho1995, .rods_g_cm3 = {0.0, 0.1}},
                                     {.line = imaging::kRho1995, .rods_g_cm3 = {}, .rescale_hu = true},
                                     {.line = {}, .rods_g_cm3 = {0.0, 0.1}, .rescale_hu = true}};
  for (const CalibrationOptions& options : both) {
    const auto refused = calibrate_scan(scan, options, keep_going);
    ASSERT_FALSE(refused);
    expect_one_sentence(refused.error(), "only one of --calibration");
  }
  const auto falling = calibrate_scan(scan, {.line = DensityCalibration{-0.001, 0.1}, .rods_g_cm3 = {}}, keep_going);
  ASSERT_FALSE(falling);
  expect_one_sentence(falling.error(), "--calibration");
}

// The block has (1.5 - 0.131) / 0.001067 = 1283 HU.
TEST(ScanCalibration, TheCaseKeepsTheLineAndItsOrigin) {
  const test::TempDir temp;
  const auto import_with = [&](const CalibrationOptions& calibration) {
    auto scan = scan_phantom(small_block(), 0.5, keep_going);
    EXPECT_TRUE(scan);
    return import_ct({.volume = std::move(*scan), .source = "test"}, {.calibration = calibration}, keep_going);
  };
  const auto given = import_with({.line = DensityCalibration{0.0008, -0.1}, .rods_g_cm3 = {}});
  ASSERT_TRUE(given) << given.error().message;
  EXPECT_NEAR(given->bone->density_g_cm3({0.0, 0.0, -3.0}), 0.0008 * 1283.0 - 0.1, 2e-3);
  ASSERT_TRUE(given->bone->save(temp / "given", given->scan));
  const auto loaded = Case::load(temp / "given");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->info().calibration, (DensityCalibration{0.0008, -0.1}));
  ASSERT_TRUE(loaded->info().density_from);
  EXPECT_EQ(loaded->info().density_from->method, "given");
  EXPECT_NE(report_text(*loaded).find("density    -0.1 + 0.0008 HU g/cm3\n           given; its error is not known\n"),
            std::string::npos)
      << report_text(*loaded);

  const auto usual = import_with({});
  ASSERT_TRUE(usual) << usual.error().message;
  const std::string said = report_text(*usual->bone);
  EXPECT_NE(said.find("Rho 1995, cancellous bone of the proximal femur; standard error 0.1 g/cm3 at 0.4 g/cm3, 0.2 at "
                      "1.85\n"),
            std::string::npos)
      << said;
  const auto json = nlohmann::json::parse(report_json(*usual->bone));
  EXPECT_EQ(json["calibration"]["provenance"]["parameters"]["cortical_error_g_cm3"], 0.2);
}

TEST(ScanCalibration, MetalBeginsWhereTheUserSays) {
  const auto import_with = [](double metal_hu) {
    auto scan = scan_phantom(small_block(), 0.5, keep_going);
    EXPECT_TRUE(scan);
    return import_ct({.volume = std::move(*scan), .source = "test"}, {.metal_hu = metal_hu, .keep = {1}}, keep_going);
  };
  const auto bone = import_with(3000.0), metal = import_with(1200.0);
  ASSERT_TRUE(bone && metal);
  EXPECT_EQ(bone->bone->tissue({0, 0, -6}), Tissue::cortical);
  EXPECT_EQ(metal->bone->tissue({0, 0, -6}), Tissue::metal);
  EXPECT_NE(segmentation_text(metal->found).find("at or around 1200 HU"), std::string::npos);
  EXPECT_EQ(metal->bone->info().tissues.back().provenance.parameters.at("from_hu"), 1200.0);
}

}  // namespace
}  // namespace osteon::import
