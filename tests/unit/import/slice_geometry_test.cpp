// Tilted, unevenly spaced, doubled and missing slices against closed forms.
#include <cmath>
#include <functional>
#include <numbers>
#include <tuple>

#include "server/import/dicom_reader.hpp"
#include "server/import/dicom_writer.hpp"
#include "server/import/slice_grid.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/dicom_elements.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kTilt_degrees = 20.0;
const std::vector<double> kMixed_mm{1.0, 3.0, 2.0, 1.5, 2.5, 1.0, 2.0, 3.0, 1.0,
                                    2.0, 2.0, 3.0, 1.0, 1.0, 2.0, 3.0, 2.0};

using Hu = std::function<double(const Vec3& position_mm)>;

// Slices round the origin of LPS. The gantry is tilted about x: the slices' normal leans to the back, and the table
// moves along z. Gaps are those along the normal.
SliceStack gantry(double tilt_degrees, const std::vector<double>& gaps_mm) {
  SliceStack stack{.columns = 48, .rows = 48, .column_mm = 1.0, .row_mm = 0.8, .directions = {}, .positions_mm = {}};
  stack.directions = Eigen::AngleAxisd(-tilt_degrees * std::numbers::pi / 180.0, Vec3::UnitX()).toRotationMatrix();
  const Vec3 normal = stack.directions.col(2);
  double length_mm = 0.0;
  for (const double gap_mm : gaps_mm) length_mm += gap_mm;
  const Vec3 corner = stack.directions * Vec3(-23.5, -18.8, 0.0);
  double along_mm = -0.5 * length_mm;
  for (std::size_t i = 0; i <= gaps_mm.size(); ++i) {
    stack.positions_mm.emplace_back(corner + Vec3::UnitZ() * along_mm / normal.z());
    if (i < gaps_mm.size()) along_mm += gaps_mm[i];
  }
  return stack;
}

void move_slice(const fs::path& file, const Vec3& position_mm) {
  set_tag(file, 0x0020, 0x0032,
          decimal(position_mm.x()) + "\\" + decimal(position_mm.y()) + "\\" + decimal(position_mm.z()));
}

// What a scanner would store of `hu`: its value at the centre of each pixel.
void write_slices(const fs::path& folder, const SliceStack& stack, const Hu& hu) {
  imaging::HuVolume volume;
  volume.dims = {stack.columns, stack.rows, static_cast<int>(stack.positions_mm.size())};
  volume.spacing_mm = {stack.column_mm, stack.row_mm, 1.0};
  volume.directions = stack.directions;
  for (const Vec3& position_mm : stack.positions_mm)
    for (int row = 0; row < stack.rows; ++row)
      for (int column = 0; column < stack.columns; ++column)
        volume.values.push_back(static_cast<std::int16_t>(
            std::lround(hu(position_mm + stack.directions * Vec3(column * stack.column_mm, row * stack.row_mm, 0.0)))));
  ASSERT_TRUE(write_dicom_series(volume, folder, keep_going));
  const auto files = files_of(folder);
  for (std::size_t i = 0; i < files.size(); ++i) move_slice(files[i], stack.positions_mm[i]);
}

// The largest difference from `hu`, over all voxels between the first and last slice that slices cover.
double worst_error_hu(const imaging::HuVolume& volume, const SliceStack& stack, const Hu& hu) {
  double worst = 0.0;
  std::size_t compared = 0;
  for (int k = 0; k < volume.dims[2]; ++k)
    for (int j = 0; j < volume.dims[1]; ++j)
      for (int i = 0; i < volume.dims[0]; ++i) {
        const Vec3 at = volume.position_mm(Vec3(i, j, k));
        const bool covered = std::ranges::all_of(stack.positions_mm, [&](const Vec3& first) {
          const Vec3 pixel = stack.directions.transpose() * (at - first);
          return pixel.x() >= 0.0 && pixel.x() <= (stack.columns - 1) * stack.column_mm && pixel.y() >= 0.0 &&
                 pixel.y() <= (stack.rows - 1) * stack.row_mm;
        });
        if (!covered) continue;
        ++compared;
        worst = std::max(worst, std::abs(volume.at(i, j, k) - hu(at)));
      }
  EXPECT_GT(compared, volume.count() / 3);
  return worst;
}

Result<CtScan> scan_of(const SliceStack& stack, const Hu& hu) {
  const test::TempDir folder;
  write_slices(folder / "series", stack, hu);
  return read_dicom_series(folder / "series", keep_going);
}

// Interpolation is linear, so a linear field comes back exactly, but for two roundings to whole HU.
TEST(SliceGeometry, ALinearFieldComesBackFromTiltedAndUnevenSlices) {
  const Hu ramp = [](const Vec3& p) { return 100.0 + p.dot(Vec3(7.0, -5.0, 9.0)); };
  for (const double tilt : {0.0, kTilt_degrees, -kTilt_degrees})
    for (const auto& gaps : {kMixed_mm, std::vector<double>(15, 2.0)}) {
      const SliceStack stack = gantry(tilt, gaps);
      const auto scan = scan_of(stack, ramp);
      ASSERT_TRUE(scan) << scan.error().message;
      EXPECT_LE(worst_error_hu(scan->volume, stack, ramp), 1.01) << tilt << " " << gaps.size();
    }
}

// Linear interpolation over a distance h is wrong by at most h²/8 of the second derivative, here 1000/σ² HU/mm²
// along each axis. Gaps of up to 3 mm and pixels of 1 and 0.8 mm give (9 + 1 + 0.64)/8 of the steepest axis.
TEST(SliceGeometry, AnEllipsoidComesBackFromTiltedAndUnevenSlices) {
  const Vec3 sigma(5.0, 4.5, 6.0);
  const Hu blob = [&](const Vec3& p) { return 1000.0 * std::exp(-0.5 * p.cwiseQuotient(sigma).squaredNorm()); };
  const SliceStack stack = gantry(kTilt_degrees, kMixed_mm);
  const auto scan = scan_of(stack, blob);
  ASSERT_TRUE(scan) << scan.error().message;
  const double bound_hu = (9.0 + 1.0 + 0.64) / 8.0 * 1000.0 / (4.5 * 4.5) + 1.0;
  const double worst_hu = worst_error_hu(scan->volume, stack, blob);
  EXPECT_LE(worst_hu, bound_hu);
  double sum_hu = 0.0;
  for (const std::int16_t hu : scan->volume.values) sum_hu += std::max<int>(hu, 0);
  const double volume = sum_hu * scan->volume.spacing_mm.prod();
  const double expected = 1000.0 * std::pow(2.0 * std::numbers::pi, 1.5) * sigma.prod();
  EXPECT_NEAR(volume, expected, 0.02 * expected);
  std::printf("[          ] worst %.1f HU of %.1f, volume %+.2f %%\n", worst_hu, bound_hu,
              100.0 * (volume / expected - 1.0));
}

TEST(SliceGeometry, ASphereOfBoneKeepsItsVolumeAndItsPlace) {
  const Vec3 centre(2.0, -1.5, 1.0);
  const double radius_mm = 12.0;
  const Hu sphere = [&](const Vec3& p) {
    return std::clamp(226.0 + 400.0 * (radius_mm - (p - centre).norm()), -1000.0, 1452.0);
  };
  const double expected_mm3 = 4.0 / 3.0 * std::numbers::pi * std::pow(radius_mm, 3);
  for (const double tilt : {0.0, kTilt_degrees}) {
    auto scan = scan_of(gantry(tilt, kMixed_mm), sphere);
    ASSERT_TRUE(scan) << scan.error().message;
    const auto bone = import_bone(std::move(*scan), {}, keep_going);
    ASSERT_TRUE(bone) << bone.error().message;
    EXPECT_NEAR(bone->volume_mm3(), expected_mm3, 0.02 * expected_mm3) << tilt;
    Vec3 sum = Vec3::Zero();
    int samples = 0;
    const CoordBox box = bone->bounds_samples();
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z)
          if (const Vec3 at = position_mm({x, y, z}, bone->pitch_mm()); bone->surface_mm(at) < 0.0)
            sum += at, ++samples;
    EXPECT_LT((sum / samples - centre).norm(), 0.1) << tilt;
    std::printf("[          ] tilt %.0f: volume %+.2f %%\n", tilt, 100.0 * (bone->volume_mm3() / expected_mm3 - 1.0));
  }
}

// Planes of slices, by the directions of rows and columns. The body has no symmetry that would hide a swapped axis.
TEST(SliceGeometry, ABoneHasTheSameAxesFromSlicesOfEveryPlane) {
  const auto distance_mm = [](const Vec3& p) {
    return std::min({(p - Vec3(-2.0, 1.0, 0.0)).norm() - 8.0, (p - Vec3(5.0, 4.0, -5.0)).norm() - 5.0,
                     (p - Vec3(0.0, -6.0, 5.0)).norm() - 4.0});
  };
  // HU fall by 400 in each mm, which no blur does over 6 mm; so the surface is that of the threshold.
  const Hu body = [&](const Vec3& p) { return std::clamp(226.0 - 400.0 * distance_mm(p), -1000.0, 1452.0); };
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const Vec3 leaning = Vec3(0.0, 0.6, -0.8);
  const std::vector<std::tuple<const char*, Vec3, Vec3>> planes{
      {"axial", x, y}, {"coronal", x, -z}, {"sagittal", y, -z}, {"sagittal", -y, -z}, {"oblique", x, leaning}};
  for (const auto& [name, across, down] : planes) {
    SCOPED_TRACE(testing::Message() << name << " " << across.transpose() << ", " << down.transpose());
    SliceStack stack{.columns = 48, .rows = 60, .column_mm = 0.8, .row_mm = 0.7, .directions = {}, .positions_mm = {}};
    stack.directions << across, down, across.cross(down);
    for (int i = 0; i < 36; ++i) stack.positions_mm.emplace_back(stack.directions * Vec3(-18.8, -20.6, i - 17.5));
    auto scan = scan_of(stack, body);
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_EQ(scan->report.series[0].plane, name);
    EXPECT_LT((scan->volume.directions - stack.directions).norm(), 1e-6);
    const auto bone = import_bone(std::move(*scan), {.surface = SurfaceAt::threshold}, keep_going);
    ASSERT_TRUE(bone) << bone.error().message;
    double worst_mm = 0.0;
    for (int i = -14; i <= 14; ++i)
      for (int j = -14; j <= 14; ++j)
        for (int k = -14; k <= 14; ++k) {
          const Vec3 at(i, j, k);
          // Outside of the balls this is the distance from all of them.
          if (distance_mm(at) > -0.1 && distance_mm(at) < 1.5)
            worst_mm = std::max(worst_mm, std::abs(bone->surface_mm(at) - distance_mm(at)));
        }
    EXPECT_LT(worst_mm, 0.35);  // half a voxel
    std::printf("[          ] %s: surface within %.2f mm\n", name, worst_mm);
  }
}

TEST(SliceGeometry, TheReportSaysWhatWasDone) {
  const auto scan = scan_of(gantry(kTilt_degrees, kMixed_mm), [](const Vec3&) { return 40.0; });
  ASSERT_TRUE(scan) << scan.error().message;
  // 33 mm along the normal, in steps of the least gap.
  EXPECT_EQ(scan->volume.dims[2], 34);
  EXPECT_NEAR(scan->volume.spacing_mm.z(), 1.0, 1e-6);
  const std::string lines = report_lines(scan->report);
  EXPECT_NE(lines.find("resampled  18 slices, tilted by 20.0 degrees, 1 to 3 mm apart, to 34 slices, 1 mm apart\n"),
            std::string::npos)
      << lines;
  EXPECT_NE(scan->source.find("resampled from slices tilted by 20.0 degrees, 1 to 3 mm apart"), std::string::npos)
      << scan->source;
}

TEST(SliceGeometry, WhatNoSliceCoversIsAir) {
  const SliceStack stack = gantry(kTilt_degrees, std::vector<double>(15, 2.0));
  const auto scan = scan_of(stack, [](const Vec3&) { return 700.0; });
  ASSERT_TRUE(scan) << scan.error().message;
  // Slices move by tan(20°) of the length within their plane: 30 mm are 10.9 mm, or 13.6 rows.
  EXPECT_EQ(scan->volume.dims, (std::array<int, 3>{48, 48 + 14, 16}));
  const auto air = std::ranges::count(scan->volume.values, -1024), bone = std::ranges::count(scan->volume.values, 700);
  EXPECT_EQ(air + bone, static_cast<std::ptrdiff_t>(scan->volume.count())) << "nothing lies between air and bone";
  EXPECT_NEAR(static_cast<double>(bone), 48.0 * 48.0 * 16.0, 0.01 * static_cast<double>(bone));
}

// HU = slope · stored + intercept, by the slice's own numbers.
TEST(SliceGeometry, EachSliceHasItsOwnSlopeAndIntercept) {
  const test::TempDir folder;
  const auto volume = numbered_volume(7, 5, 4);
  ASSERT_TRUE(write_dicom_series(volume, folder / "series", keep_going));
  const auto files = files_of(folder / "series");
  for (std::size_t i = 0; i < files.size(); ++i) {
    set_tag(files[i], 0x0028, 0x1052, std::to_string(-1000 - 10 * static_cast<int>(i)));
    set_tag(files[i], 0x0028, 0x1053, std::to_string(1 + i));
  }
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 7; ++i)
      EXPECT_EQ(scan->volume.at(i, 2, k), (1 + k) * (volume.at(i, 2, k) + 1024) - 1000 - 10 * k) << i << " " << k;
}

// Two runs of the table that overlap by half: 2 mm between slices of each, 1 mm where both are.
TEST(SliceGeometry, OverlappingRunsAreOrderedByPosition) {
  std::vector<double> gaps(6, 2.0);
  gaps.insert(gaps.end(), 8, 1.0);
  gaps.insert(gaps.end(), 6, 2.0);
  const SliceStack stack = gantry(0.0, gaps);
  const Hu ramp = [](const Vec3& p) { return 20.0 * p.z(); };
  const auto scan = scan_of(stack, ramp);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims[2], 33);
  EXPECT_LE(worst_error_hu(scan->volume, stack, ramp), 1.01);
}

TEST(SliceGeometry, GapsOfMissingSlices) {
  const auto missing = [](std::vector<double> gaps) { return gap_of_missing_slices(gaps); };
  EXPECT_FALSE(missing({2.0}));
  EXPECT_FALSE(missing(kMixed_mm));
  EXPECT_FALSE(missing({1.0, 1.7, 1.0, 1.0}));
  EXPECT_EQ(missing({1.0, 3.0}), 1u);
  EXPECT_EQ(missing({2.0, 1.0, 1.0, 1.0}), 0u);
  EXPECT_EQ(missing({1.0, 1.0, 2.0, 1.0, 1.0}), 2u);
  EXPECT_EQ(missing({1.0, 1.0, 2.0, 2.0, 1.0, 1.0, 1.0, 3.0, 1.0}), 7u) << "the widest";
  // A head: close slices through its base, then wide ones. A slice that is missing there is still found.
  EXPECT_FALSE(missing({2.5, 2.5, 2.5, 2.5, 2.5, 2.5, 5.0, 5.0, 5.0, 5.0}));
  EXPECT_EQ(missing({2.5, 2.5, 2.5, 2.5, 2.5, 2.5, 5.0, 5.0, 5.0, 10.0, 5.0, 5.0, 5.0}), 9u);
}

TEST(SliceGeometry, PositionsWithOneDecimalAreEvenAndAreNotResampled) {
  SliceStack stack = gantry(0.0, std::vector<double>(15, 0.625));
  for (Vec3& at : stack.positions_mm) at.z() = std::round(10.0 * at.z()) / 10.0;
  const SliceGrid grid = grid_of(stack);
  EXPECT_TRUE(grid.places.empty());
  EXPECT_EQ(grid.volume.dims[2], 16);
  EXPECT_EQ(irregularity(grid), "");
}

TEST(SliceGeometry, ADoubledSliceIsLeftOutAndManyAreRefused) {
  const test::TempDir folder;
  const fs::path series = folder / "series";
  const auto volume = numbered_volume(7, 5, 12);
  ASSERT_TRUE(write_dicom_series(volume, series, keep_going));
  const auto double_slice = [&](const char* slice, const char* as, const char* instance) {
    fs::copy(series / slice, series / as);
    set_tag(series / as, 0x0008, 0x0018, instance);
  };
  double_slice("slice-0004.dcm", "another.dcm", "1.2.3.4");
  const auto scan = read_dicom_series(series, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_same(scan->volume, volume);
  EXPECT_NE(report_lines(scan->report).find("left out   1 slice at the position of another one\n"), std::string::npos);
  double_slice("slice-0007.dcm", "more.dcm", "1.2.3.5");
  const auto refused = read_dicom_series(series, keep_going);
  ASSERT_FALSE(refused);
  expect_one_sentence(refused.error(), "2 of its 14 slices lie at the position of another one, such as");
}

TEST(SliceGeometry, MoreShearThanAnyGantryIsRefused) {
  SliceStack stack = gantry(0.0, std::vector<double>(9, 1.0));
  for (std::size_t i = 0; i < stack.positions_mm.size(); ++i) stack.positions_mm[i].y() += 1.2 * static_cast<double>(i);
  const auto scan = scan_of(stack, [](const Vec3&) { return 0.0; });
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::unsupported);
  expect_one_sentence(scan.error(), "is sheared by 50.2 degrees, more than a gantry tilts; ");
}

// A slice of a tilted gantry is no plane of the volume, so a window that shows it before the others would show
// something else than afterwards.
TEST(SliceGeometry, OnlyAPlaneOfTheVolumeIsGivenBeforeTheOthers) {
  const Hu ramp = [](const Vec3& p) { return 100.0 + p.dot(Vec3(7.0, -5.0, 9.0)); };
  for (const double tilt : {0.0, kTilt_degrees}) {
    const test::TempDir folder;
    write_slices(folder / "series", gantry(tilt, std::vector<double>(15, 2.0)), ramp);
    ASSERT_TRUE(draw_dicom_series(folder / "series", folder / "pictures", true, keep_going));
    EXPECT_TRUE(fs::exists(folder / "pictures" / "series-1.png"));
    EXPECT_EQ(fs::exists(folder / "pictures" / "series-1.nrrd"), tilt == 0.0) << tilt;
  }
}

TEST(SliceGeometry, ResamplingCanBeStoppedAtAnyMoment) {
  const test::TempDir folder;
  write_slices(folder / "series", gantry(kTilt_degrees, kMixed_mm), [](const Vec3&) { return 40.0; });
  int calls = 0;
  ASSERT_TRUE(read_dicom_series(folder / "series", [&](double) { return ++calls > 0; }));
  ASSERT_GT(calls, 18);
  for (int last = 1; last < calls - 20; last += 5) {
    int asked = 0;
    const auto scan = read_dicom_series(folder / "series", [&](double) { return ++asked < last; });
    ASSERT_FALSE(scan);
    EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::import
