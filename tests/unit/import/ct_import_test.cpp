#include "server/import/ct_import.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include "server/import/dicom_reader.hpp"
#include "server/import/dicom_writer.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

// Writes the phantom as DICOM files and imports them, at the scan's own pitch unless another is given.
Result<Case> round_trip(const Phantom& phantom, double spacing_mm, double threshold_hu,
                        std::optional<double> pitch_mm = {}) {
  const test::TempDir folder;
  auto scan = scan_phantom(phantom, spacing_mm, keep_going);
  if (!scan) return tl::unexpected(scan.error());
  if (auto written = write_dicom_series(*scan, folder / "series", keep_going); !written)
    return tl::unexpected(written.error());
  auto read = read_dicom_series(folder / "series", keep_going);
  if (!read) return tl::unexpected(read.error());
  return import_bone(std::move(*read), {.pitch_mm = pitch_mm, .threshold_hu = threshold_hu}, keep_going);
}

// Largest |S| at points exactly on the phantom's surface, in voxels of the scan. Edges are left out by 2 mm, because a
// scanner rounds them.
double surface_error(const Case& bone, const Phantom& phantom, double spacing_mm) {
  double worst = 0.0;
  const double half = 0.5 * phantom.width_mm;
  const double deep = phantom.thickness_mm();
  const auto at = [&](const Vec3& p) { worst = std::max(worst, std::abs(bone.surface_mm(p)) / spacing_mm); };
  for (double u = -half + 2.0; u <= half - 2.0; u += 0.31) {
    if (phantom.kind == PhantomKind::block) {
      for (double v = -half + 2.0; v <= half - 2.0; v += 0.31) {
        at({u, v, 0.0});
        at({u, v, -deep});
      }
      for (double v = 2.0; v <= deep - 2.0; v += 0.31)
        for (const double side : {-half, half}) {
          at({side, u, -v});
          at({u, side, -v});
        }
    } else {
      for (double angle = 0.0; angle < 2.0 * std::numbers::pi; angle += 0.05)
        at({deep * std::cos(angle), deep * std::sin(angle), u});
      for (double r = 0.0; r < deep - 2.0; r += 0.5)
        for (const double end : {-half, half}) at({r, 0.3, end});
    }
  }
  return worst;
}

TEST(CtImport, BlockThroughDicomIsTheBlock) {
  const Phantom phantom{.kind = PhantomKind::block, .layers = {{4.0, 1.9}, {6.0, 1.4}, {4.0, 1.9}}, .width_mm = 12.0};
  const double spacing_mm = 0.5;
  const auto bone = round_trip(phantom, spacing_mm, suitable_threshold_hu(phantom));
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_LT(surface_error(*bone, phantom, spacing_mm), 0.15);
  // The mean over a voxel rounds the edges of the block.
  EXPECT_NEAR(bone->volume_mm3(), phantom.volume_mm3(), 0.015 * phantom.volume_mm3());
  // In the middle of the layers, no neighbouring layer is blurred in.
  EXPECT_NEAR(bone->density_g_cm3({0.1, 0.2, -2.0}), 1.9, 0.02 * 1.9);
  EXPECT_NEAR(bone->density_g_cm3({0.1, 0.2, -7.0}), 1.4, 0.02 * 1.4);
  EXPECT_NEAR(bone->density_g_cm3({0.1, 0.2, -12.0}), 1.9, 0.02 * 1.9);
}

TEST(CtImport, TubeThroughDicomIsTheTube) {
  const Phantom phantom{.kind = PhantomKind::tube, .layers = {{3.0, 1.9}, {5.0, 0.3}}, .width_mm = 14.0};
  const double spacing_mm = 0.5;
  // Only the shell lies on the round surface, so half of its own height is the right threshold there.
  const Phantom shell{.kind = PhantomKind::tube, .layers = {{3.0, 1.9}}, .width_mm = 14.0};
  const double threshold_hu = suitable_threshold_hu(shell);
  const auto bone = round_trip(phantom, spacing_mm, threshold_hu);
  ASSERT_TRUE(bone) << bone.error().message;
  for (double angle = 0.0; angle < 6.28; angle += 0.03)
    for (const double z : {-4.3, 0.0, 3.1})
      EXPECT_NEAR(bone->surface_mm({8.0 * std::cos(angle), 8.0 * std::sin(angle), z}) / spacing_mm, 0.0, 0.15) << angle;
  EXPECT_NEAR(bone->density_g_cm3({6.5, 0.0, 0.0}), 1.9, 0.02 * 1.9);
  // The medulla is below that threshold, but between cortex. It is bone with its own density.
  EXPECT_LT(bone->surface_mm({0.0, 0.0, 0.0}), 0.0);
  EXPECT_NEAR(bone->density_g_cm3({0.0, 0.0, 0.0}), 0.3, 0.02 * 0.3);
}

// The slab of the README: cortex of 1.9, cancellous bone of 0.3 g/cm3, which is 158 HU, open to the air on four sides.
TEST(CtImport, ASlabsCancellousLayerIsWholeAtTheDefaultThreshold) {
  const Phantom slab{.kind = PhantomKind::block, .layers = {{5.0, 1.9}, {20.0, 0.3}, {5.0, 1.9}}, .width_mm = 20.0};
  for (const double spacing_mm : {0.5, 0.37}) {
    const auto bone = round_trip(slab, spacing_mm, imaging::kBoneThreshold_hu);
    ASSERT_TRUE(bone) << bone.error().message;
    EXPECT_NEAR(bone->volume_mm3(), slab.volume_mm3(), 0.02 * slab.volume_mm3()) << spacing_mm;
    for (const Vec3& at : {Vec3(0, 0, 0), Vec3(8.5, 8.5, 0), Vec3(-8.5, 3, 0)}) {
      EXPECT_NEAR(bone->density_g_cm3(at - Vec3(0, 0, 2.5)), 1.9, 0.05 * 1.9);
      EXPECT_NEAR(bone->density_g_cm3(at - Vec3(0, 0, 15.0)), 0.3, 0.05 * 0.3);
      EXPECT_NEAR(bone->density_g_cm3(at - Vec3(0, 0, 27.5)), 1.9, 0.05 * 1.9);
      EXPECT_LT(bone->surface_mm(at - Vec3(0, 0, 15.0)), 0.0);
    }
  }
}

TEST(CtImport, HollowLeavesTheMarrowOut) {
  CtScan scan = [] {
    const Phantom tube{.kind = PhantomKind::tube, .layers = {{3.0, 1.9}, {5.0, 0.3}}, .width_mm = 14.0};
    return CtScan{*scan_phantom(tube, 0.5, keep_going), "test"};
  }();
  const auto filled = import_bone(scan, {}, keep_going);
  const auto hollow = import_bone(scan, {.hollow = true}, keep_going);
  ASSERT_TRUE(filled && hollow);
  EXPECT_LT(filled->surface_mm({0, 0, 0}), 0.0);
  EXPECT_GT(hollow->surface_mm({0, 0, 0}), 0.0);
  const double all = std::numbers::pi * 64.0 * 14.0, shell = std::numbers::pi * (64.0 - 25.0) * 14.0;
  EXPECT_NEAR(filled->volume_mm3(), all, 0.02 * all);
  EXPECT_NEAR(hollow->volume_mm3(), shell, 0.02 * shell);
  // At 226 HU the inner wall lies up to a voxel within the medulla, whose edge to cortex is at 908.
  const auto thick = import_bone(scan, {.hollow = true, .surface = SurfaceAt::threshold}, keep_going);
  ASSERT_TRUE(thick);
  EXPECT_GT(thick->volume_mm3(), 1.03 * shell);
  EXPECT_LT(thick->volume_mm3(), 1.15 * shell);
}

// A shaft that is broken right through. The marrow space bridges a narrow gap, and the import reports it.
TEST(CtImport, PiecesThatOnlyMarrowJoinsAreReported) {
  const auto broken = [](double gap_mm) {
    CtScan scan;
    scan.volume.dims = {60, 60, 60};
    scan.volume.spacing_mm = Vec3::Constant(0.5);
    scan.volume.values.resize(scan.volume.count());
    for (int k = 0; k < 60; ++k)
      for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 60; ++i) {
          const double r = 0.5 * std::hypot(i - 29.5, j - 29.5);
          const bool in_gap = std::abs(0.5 * (k - 29.5)) < 0.5 * gap_mm;
          scan.volume.values[scan.volume.index(i, j, k)] = r < 8.0 ? -60 : r < 12.0 && !in_gap ? 1500 : 50;
        }
    return import_ct(std::move(scan), {}, keep_going);
  };
  const auto whole = broken(0.0), narrow = broken(2.0), wide = broken(6.0);
  ASSERT_TRUE(whole && narrow && wide);
  EXPECT_EQ(whole->found.joined_cm3.size(), 1u);
  ASSERT_EQ(narrow->found.joined_cm3.size(), 2u);
  const double half_cm3 = std::numbers::pi * (144.0 - 64.0) * 14.0 * 1e-3;
  EXPECT_NEAR(narrow->found.joined_cm3[1], half_cm3, 0.05 * half_cm3);
  EXPECT_NE(segmentation_text(narrow->found).find("joined     by marrow alone"), std::string::npos);
  EXPECT_EQ(wide->found.islands.size(), 2u);
}

TEST(CtImport, DensityEndsAtCompactBoneAndMetalIsLabelled) {
  CtScan scan;
  scan.volume.dims = {30, 30, 30};
  scan.volume.values.assign(scan.volume.count(), -1000);
  for (int k = 5; k < 25; ++k)
    for (int j = 5; j < 25; ++j)
      for (int i = 5; i < 25; ++i) {
        const bool screw = std::hypot(i - 14.5, j - 14.5) < 3.0 && k > 12;
        scan.volume.values[scan.volume.index(i, j, k)] = screw ? 3071 : k < 8 ? 2400 : 1400;
      }
  const auto made = import_ct(std::move(scan), {}, keep_going);
  ASSERT_TRUE(made);
  const Case& bone = *made->bone;
  const CoordBox box = bone.bounds_samples();
  double most = 0.0;
  std::vector<float> density(static_cast<std::size_t>(box.dims().x) * static_cast<std::size_t>(box.dims().y) *
                             static_cast<std::size_t>(box.dims().z));
  bone.gather_density(box, density);
  for (const float rho : density) most = std::max(most, static_cast<double>(rho));
  EXPECT_NEAR(most, 2.1, 1e-6);
  EXPECT_EQ(bone.tissue({14, 14, 18}), Tissue::metal);
  EXPECT_EQ(bone.tissue({14, 14, 6}), Tissue::enamel);
  EXPECT_EQ(bone.tissue({8, 8, 15}), Tissue::cortical);
  EXPECT_GT(made->found.metal_cm3, 0.25);
  EXPECT_GT(made->found.enamel_cm3, 1.1);
  EXPECT_NE(segmentation_text(made->found).find("metal"), std::string::npos);
}

TEST(CtImport, MedullaAboveTheThresholdIsBone) {
  const Phantom phantom{.kind = PhantomKind::tube, .layers = {{3.0, 1.9}, {5.0, 0.3}}, .width_mm = 14.0};
  const auto bone = round_trip(phantom, 0.5, suitable_threshold_hu(phantom));
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_LT(bone->surface_mm({0.0, 0.0, 0.0}), 0.0);
  EXPECT_NEAR(bone->density_g_cm3({0.0, 0.0, 0.0}), 0.3, 0.02 * 0.3);
  EXPECT_EQ(bone->tissue({12, 0, 0}), Tissue::cortical);
  EXPECT_EQ(bone->tissue({2, 0, 0}), Tissue::trabecular);
}

TEST(CtImport, AFinerPitchSeesTheSameSurface) {
  const Phantom phantom{.kind = PhantomKind::block, .layers = {{8.0, 1.7}}, .width_mm = 10.0};
  const double spacing_mm = 0.6;
  const auto bone = round_trip(phantom, spacing_mm, suitable_threshold_hu(phantom), 0.25);
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_EQ(bone->pitch_mm(), 0.25);
  EXPECT_LT(surface_error(*bone, phantom, spacing_mm), 0.15);
}

TEST(CtImport, BoneThatReachesTheEndOfTheScanEndsWithTheLastVoxel) {
  CtScan scan;
  scan.volume.dims = {12, 12, 10};
  scan.volume.spacing_mm = {1.0, 1.0, 2.0};
  scan.volume.values.assign(scan.volume.count(), -1000);
  for (int k = 0; k < 10; ++k)
    for (int j = 3; j < 9; ++j)
      for (int i = 3; i < 9; ++i) scan.volume.values[scan.volume.index(i, j, k)] = 1452;  // 226 is half way to air
  const auto bone = import_bone(std::move(scan), {}, keep_going);
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_EQ(bone->pitch_mm(), 1.0);
  EXPECT_NEAR(bone->surface_mm({5.5, 5.5, -1.0}), 0.0, 0.01);
  EXPECT_NEAR(bone->surface_mm({5.5, 5.5, 19.0}), 0.0, 0.01);
  EXPECT_NEAR(bone->surface_mm({5.5, 5.5, 0.0}), -1.0, 0.01);
  EXPECT_NEAR(bone->surface_mm({2.5, 5.5, 10.0}), 0.0, 0.01);
  EXPECT_NEAR(bone->volume_mm3(), 6.0 * 6.0 * 20.0, 0.02 * 720.0);
}

// Single wrong voxels around and within the bone, as a worn scanner makes them.
TEST(CtImport, AMedianTakesOutSingleWrongVoxels) {
  const Phantom phantom{.kind = PhantomKind::block, .layers = {{8.0, 1.5}}, .width_mm = 8.0};
  auto scan = scan_phantom(phantom, 0.5, keep_going);
  ASSERT_TRUE(scan);
  const auto clean = import_ct({*scan, "phantom", {}}, {.threshold_hu = 500.0}, keep_going);
  ASSERT_TRUE(clean) << clean.error().message;
  std::mt19937 random(3);
  for (std::int16_t& hu : scan->values)
    if (random() % 200 == 0) hu = hu > 500 ? -1000 : 3000;
  const auto noisy = import_ct({*scan, "phantom", {}}, {.threshold_hu = 500.0, .keep_all = true}, keep_going);
  ASSERT_TRUE(noisy) << noisy.error().message;
  EXPECT_GT(noisy->found.islands.size(), 10u);
  for (const auto box : {imaging::MedianBox::slice, imaging::MedianBox::volume}) {
    const auto mended =
        import_ct({*scan, "phantom", {}}, {.threshold_hu = 500.0, .keep_all = true, .median = box}, keep_going);
    ASSERT_TRUE(mended) << mended.error().message;
    EXPECT_EQ(mended->found.islands.size(), 1u);
    // It rounds the twelve edges of 8 mm: half a voxel's section is 12 mm³ along all of them.
    EXPECT_NEAR(mended->bone->volume_mm3(), clean->bone->volume_mm3(), 16.0);
  }
}

TEST(CtImport, AGaussianTakesOutNoise) {
  const Phantom phantom{.kind = PhantomKind::block, .layers = {{8.0, 1.5}}, .width_mm = 8.0};
  auto scan = scan_phantom(phantom, 0.5, keep_going);
  ASSERT_TRUE(scan);
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 150.0);
  for (std::int16_t& hu : scan->values) hu = static_cast<std::int16_t>(hu + std::lround(noise(random)));
  const auto worst = [&](double gaussian_mm) {
    const auto made =
        import_ct({*scan, "phantom", {}}, {.threshold_hu = 500.0, .gaussian_mm = gaussian_mm}, keep_going);
    EXPECT_TRUE(made);
    double error = 0.0;
    for (double x = -2.0; x <= 2.0; x += 0.25)
      for (double z = -6.0; z <= -2.0; z += 0.25)
        error = std::max(error, std::abs(made->bone->density_g_cm3({x, 0.25, z}) - 1.5));
    return error;
  };
  const double before = worst(0.0), after = worst(0.7);
  EXPECT_GT(before, 0.1);
  EXPECT_LT(after, 0.4 * before);
}

TEST(CtImport, TheSourceNamesTheFilters) {
  const Phantom phantom{.kind = PhantomKind::block, .layers = {{8.0, 1.5}}, .width_mm = 8.0};
  const auto scan = scan_phantom(phantom, 0.5, keep_going);
  ASSERT_TRUE(scan);
  const CtOptions options{.threshold_hu = 500.0, .median = imaging::MedianBox::volume, .gaussian_mm = 0.5};
  const auto made = import_ct({*scan, "phantom", {}}, options, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->bone->info().source, "phantom, median 3x3x3, Gaussian 0.5 mm");
  const auto refused = import_ct({*scan, "phantom", {}}, {.gaussian_mm = std::nan("")}, keep_going);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("--gaussian"), std::string::npos);
}

TEST(CtImport, OtherIslandsAreGone) {
  CtScan scan;
  scan.volume.dims = {30, 20, 20};
  scan.volume.values.assign(scan.volume.count(), -1000);
  const auto fill = [&](int from, int to, std::int16_t hu) {
    for (int k = 6; k < 14; ++k)
      for (int j = 6; j < 14; ++j)
        for (int i = from; i < to; ++i) scan.volume.values[scan.volume.index(i, j, k)] = hu;
  };
  fill(4, 14, 1452);
  fill(20, 24, 3000);
  const auto bone = import_bone(std::move(scan), {}, keep_going);
  ASSERT_TRUE(bone);
  EXPECT_NEAR(bone->volume_mm3(), 10.0 * 8.0 * 8.0, 0.03 * 640.0);
  EXPECT_GT(bone->surface_mm({22.0, 10.0, 10.0}), 0.0);
}

// Three separate cubes: 1000, 512 and 64 mm3.
CtScan three_cubes() {
  CtScan scan;
  scan.volume.dims = {40, 20, 20};
  scan.volume.values.assign(scan.volume.count(), -1000);
  const auto cube = [&](int from, int edge) {
    for (int k = 4; k < 4 + edge; ++k)
      for (int j = 4; j < 4 + edge; ++j)
        for (int i = from; i < from + edge; ++i) scan.volume.values[scan.volume.index(i, j, k)] = 1452;
  };
  cube(3, 10);
  cube(16, 8);
  cube(30, 4);
  return scan;
}

TEST(CtImport, KeepTakesTheIslandsThatAreNamedAndEachIsABoneOfItsOwn) {
  const auto made = import_ct(three_cubes(), {.keep = {1, 3}}, keep_going);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->found.islands.size(), 3u);
  EXPECT_NEAR(made->found.left_out_cm3, 0.512, 1e-9);
  EXPECT_NEAR(made->bone->volume_mm3(), 1064.0, 0.03 * 1064.0);
  EXPECT_EQ(made->bone->bone_number({8, 8, 8}), 1);
  EXPECT_EQ(made->bone->bone_number({32, 6, 6}), 2);
  EXPECT_EQ(made->bone->bone_number({20, 8, 8}), 0);
  EXPECT_EQ(made->bone->bone_number({3, 4, 4}), 1) << "at the surface too";
}

TEST(CtImport, KeepAllAndMerge) {
  const auto all = import_ct(three_cubes(), {.keep_all = true}, keep_going);
  const auto merged = import_ct(three_cubes(), {.keep_all = true, .merge = true}, keep_going);
  ASSERT_TRUE(all && merged);
  EXPECT_EQ(all->bone->bone_number({20, 8, 8}), 2);
  EXPECT_EQ(all->bone->bone_number({32, 6, 6}), 3);
  EXPECT_EQ(merged->bone->bone_number({32, 6, 6}), 1);
  EXPECT_EQ(all->found.left_out_cm3, 0.0);
  EXPECT_EQ(all->bone->volume_mm3(), merged->bone->volume_mm3());
  EXPECT_NE(segmentation_text(all->found).find("nothing was left out"), std::string::npos);
}

TEST(CtImport, WhatIsLeftOutIsSaidWithItsVolume) {
  const auto made = import_ct(three_cubes(), {}, keep_going);
  ASSERT_TRUE(made);
  const std::string text = segmentation_text(made->found);
  EXPECT_NE(text.find("kept       1.00 of 1.58 cm3; 2 islands with 0.58 cm3 (37 %) left out\n"), std::string::npos)
      << text;
}

// An arm with a bone of 7 mm radius, and a screw in its flesh. A table lies below it, or a cast around it, as long as
// the scan. Voxels of 2 mm. The threshold of 226 HU is midway between bone and flesh, and between the table and air.
CtScan arm_with(bool table, bool cast) {
  CtScan scan;
  scan.source = "test";
  scan.volume.dims = {48, 48, 40};
  scan.volume.spacing_mm = {2.0, 2.0, 2.0};
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 48; ++j)
      for (int i = 0; i < 48; ++i) {
        const double radius_mm = std::hypot(2.0 * i - 47.0, 2.0 * j - 40.0);
        const bool screw = std::abs(2.0 * i - 62.0) < 3.0 && std::abs(2.0 * j - 40.0) < 3.0 && k > 10 && k < 30;
        const bool sheet = table && j >= 42 && j < 44;
        const bool shell = cast && radius_mm >= 26.0 && radius_mm < 30.0;
        scan.volume.values.push_back(screw              ? 3071
                                     : radius_mm < 7.0  ? 412
                                     : sheet || shell   ? 1452
                                     : radius_mm < 24.0 ? 40
                                                        : -1000);
      }
  return scan;
}
constexpr double kArmBone_mm3 = std::numbers::pi * 49.0 * 80.0;

TEST(CtImport, ATableThatIsLargerThanTheBoneIsLeftOutByName) {
  const auto made = import_ct(arm_with(true, false), {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->found.islands.size(), 3u);
  EXPECT_EQ(made->found.kept, std::vector{2});
  EXPECT_NEAR(made->bone->volume_mm3(), kArmBone_mm3, 0.1 * kArmBone_mm3);
  const std::string text = segmentation_text(made->found);
  // The table has 96 x 80 x 4 mm, the screw 3 x 3 x 19 voxels of 8 mm3.
  for (const char* said : {"not bone   table or headrest, island 1, 30.72 cm3, left out: thin and long, in the air",
                           "           metal, island 3, 1.37 cm3, left out: most of it reaches 3000 HU\n"})
    EXPECT_NE(text.find(said), std::string::npos) << text;
  const LabelProvenance& provenance = made->bone->info().labels.front().provenance;
  EXPECT_NEAR(provenance.parameters.at("left_out_table_cm3"), 30.72, 1e-9);
  EXPECT_NEAR(provenance.parameters.at("left_out_metal_cm3"), 1.368, 1e-9);
  EXPECT_EQ(provenance.parameters.at("island"), 2.0);
}

TEST(CtImport, KeepStillTakesATable) {
  const auto made = import_ct(arm_with(true, false), {.keep = {1}}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_NEAR(made->bone->volume_mm3(), 30720.0, 0.1 * 30720.0);
  EXPECT_NE(segmentation_text(made->found).find("table or headrest, island 1, 30.72 cm3, kept: "), std::string::npos);
  EXPECT_EQ(made->bone->info().labels.front().provenance.method,
            "threshold, enclosed marrow, islands, surface at half maximum, its shape is that of a table or headrest");
}

// A cast closes around the arm as cortex does around marrow. The arm must not become its marrow.
TEST(CtImport, ACastDoesNotEncloseTheLimbAsMarrow) {
  const auto made = import_ct(arm_with(false, true), {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->found.islands.size(), 3u);
  EXPECT_EQ(made->found.natures[0].kind, imaging::IslandKind::cast);
  EXPECT_EQ(made->found.kept, std::vector{2});
  EXPECT_NEAR(made->bone->volume_mm3(), kArmBone_mm3, 0.1 * kArmBone_mm3);
  EXPECT_NE(segmentation_text(made->found).find("cast, island 1, "), std::string::npos);
}

// A vertebra of 5 x 4 x 6 cm, cortex around cancellous bone, and an aorta of 14 mm radius that touches it.
CtScan vertebra_with_aorta() {
  CtScan scan{.volume = {}, .source = "test"};
  scan.volume.dims = {64, 40, 30};
  scan.volume.spacing_mm = Vec3::Constant(2.0);
  for (int z = 0; z < 30; ++z)
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 64; ++x) {
        const int inside = std::min({x - 34, 59 - x, y - 9, 30 - y});  // voxels from the vertebra's surface
        const int bone = inside == 1 ? 900 : (x + y + z) % 2 == 0 ? 330 : 190;
        const bool blood = std::hypot(x - 27.0, y - 20.0) <= 7.0;
        scan.volume.values.push_back(static_cast<std::int16_t>(inside > 0 ? bone : blood ? 300 : 40));
      }
  return scan;
}
constexpr double kVertebra_cm3 = 24 * 20 * 30 * 8e-3;

TEST(CtImport, AnAortaWithContrastMediumIsLeftOutByName) {
  const auto made = import_ct(vertebra_with_aorta(), {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->found.islands.size(), 2u);
  EXPECT_EQ(made->found.kept, std::vector{1});
  EXPECT_NEAR(made->found.islands[0].volume_cm3, kVertebra_cm3, 1e-9);
  EXPECT_EQ(made->found.natures[1].kind, imaging::IslandKind::contrast);
  // A disc of 7 voxels has 149 of them.
  EXPECT_NEAR(made->found.islands[1].volume_cm3, 149 * 30 * 8e-3, 1e-9);
  const std::string text = segmentation_text(made->found);
  EXPECT_NE(text.find("not bone   contrast medium, island 2, 35.76 cm3, left out: blood of 300 HU with noise of 0 HU"),
            std::string::npos)
      << text;
  EXPECT_NEAR(made->bone->info().labels.front().provenance.parameters.at("left_out_contrast_cm3"), 35.76, 1e-9);
}

TEST(CtImport, KeepTakesContrastMediumAsAnIslandOfItsOwn) {
  const auto made = import_ct(vertebra_with_aorta(), {.keep_all = true}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  const auto& labels = made->bone->info().labels;
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_EQ(labels[0].provenance.method.find("its HU are"), std::string::npos);
  EXPECT_NE(labels[1].provenance.method.find("its HU are those of contrast medium"), std::string::npos);
}

TEST(CtImport, ContrastMediumCountsAsBoneIfSomebodySaysSo) {
  const auto made = import_ct(vertebra_with_aorta(), {.contrast_is_bone = true}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->found.islands.size(), 1u);
  EXPECT_GT(made->found.islands[0].volume_cm3, kVertebra_cm3 + 35.0);
  EXPECT_FALSE(made->found.contrast);
}

// More regions than kinds of voxels: their numbers are no kinds.
TEST(CtImport, WhatGrowsFromSeedsIsBoneWhateverItsNumber) {
  CtScan scan{.volume = {}, .source = "test"};
  scan.volume.dims = {60, 12, 12};
  scan.volume.spacing_mm = Vec3::Ones();
  for (int z = 0; z < 12; ++z)
    for (int y = 0; y < 12; ++y)
      for (int x = 0; x < 60; ++x)
        scan.volume.values.push_back(x % 10 >= 3 && std::min(y, z) >= 3 && std::max(y, z) <= 8 ? 900 : 40);
  CtOptions options;
  for (int i = 0; i < 6; ++i) options.grow.seeds_mm.emplace_back(10.0 * i + 6.0, 6.0, 6.0);
  const auto made = import_ct(std::move(scan), options, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->found.islands.size(), 6u);
  EXPECT_EQ(made->found.kept.size(), 6u);
  // With marrow below the threshold there is none.
  EXPECT_EQ(made->found.marrow_cm3, 0.0);
}

TEST(CtImport, MetalAloneIsNoBone) {
  CtScan scan = arm_with(false, false);
  for (std::int16_t& hu : scan.volume.values) hu = hu == 412 ? 40 : hu;
  const auto made = import_ct(scan, {}, keep_going);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::invalid_input);
  EXPECT_EQ(made.error().message.find("no island is bone: all that reaches the threshold of 226 HU is metal; "), 0u)
      << made.error().message;
  EXPECT_TRUE(import_ct(scan, {.keep = {1}}, keep_going));
}

TEST(CtImport, AnIslandThatIsNotThereIsRefused) {
  const auto made = import_ct(three_cubes(), {.keep = {2, 4}}, keep_going);
  ASSERT_FALSE(made);
  expect_one_sentence(made.error(), "--keep names island 4");
}

TEST(CtImport, SameScanSameHash) {
  const auto phantom = small_block();
  const auto first = round_trip(phantom, 0.4, suitable_threshold_hu(phantom));
  const auto second = round_trip(phantom, 0.4, suitable_threshold_hu(phantom));
  const auto other = round_trip(phantom, 0.4, suitable_threshold_hu(phantom) + 40.0);
  ASSERT_TRUE(first && second && other);
  EXPECT_EQ(to_hex(first->hash()), to_hex(second->hash()));
  EXPECT_NE(to_hex(first->hash()), to_hex(other->hash()));
}

TEST(CtImport, NoBoneNamesTheThreshold) {
  const auto bone = round_trip(small_block(), 1.0, 3900.0);
  ASSERT_FALSE(bone);
  expect_one_sentence(bone.error(), "3900 HU");
  EXPECT_NE(bone.error().message.find("--threshold"), std::string::npos);
}

TEST(CtImport, TooFineAPitchIsRefusedBeforeTheMemoryIsFull) {
  CtScan scan;
  scan.volume.dims = {200, 200, 200};
  scan.volume.values.assign(scan.volume.count(), 1000);
  const auto bone = import_bone(std::move(scan), {.pitch_mm = 0.1}, keep_going);
  ASSERT_FALSE(bone);
  expect_one_sentence(bone.error(), "--pitch");
}

TEST(CtImport, StopsAtEveryStage) {
  // However late the stop is asked for, only `cancelled` may follow.
  for (const double until : {0.0, 0.05, 0.2, 0.5, 0.84}) {
    auto scan = scan_phantom(small_block(), 0.25, keep_going);
    ASSERT_TRUE(scan);
    const auto bone = import_bone({std::move(*scan), "test"}, {}, [&](double done) { return done < until; });
    ASSERT_FALSE(bone) << until;
    EXPECT_EQ(bone.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::import
