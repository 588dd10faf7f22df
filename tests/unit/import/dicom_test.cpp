#include "server/import/dicom_reader.hpp"

#include <gdcmVR.h>

#include <fstream>

#include "server/import/dicom_writer.hpp"
#include "server/import/simulated_scanner.hpp"
#include "tests/support/size_limit.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

TEST(DicomSeries, ReturnsWhatWasWritten) {
  const test::TempDir folder;
  const auto volume = numbered_volume(7, 5, 4);
  ASSERT_TRUE(write_dicom_series(volume, folder / "series", keep_going));
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_same(scan->volume, volume);
}

TEST(DicomSeries, KeepsAnObliqueGeometry) {
  const test::TempDir folder;
  auto volume = numbered_volume(7, 5, 4);
  volume.directions = Eigen::AngleAxisd(0.35, Vec3(1.0, 0.2, 0.1).normalized()).toRotationMatrix();
  ASSERT_TRUE(write_dicom_series(volume, folder / "series", keep_going));
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.values, volume.values);
  // Positions are decimal text of at most 16 characters.
  for (const Vec3& voxel : {Vec3(0, 0, 0), Vec3(6, 0, 3), Vec3(6, 4, 3)})
    EXPECT_LT((scan->volume.position_mm(voxel) - volume.position_mm(voxel)).norm(), 1e-4);
}

TEST(DicomSeries, BrightPaddingIsAir) {
  const test::TempDir folder;
  auto volume = numbered_volume(7, 5, 4);
  volume.values[3] = 3071;
  ASSERT_TRUE(write_dicom_series(volume, folder / "series", keep_going));
  const std::int16_t stored = 3071 + 1024;  // with the intercept that the writer uses
  const std::string bytes(reinterpret_cast<const char*>(&stored), sizeof stored);
  for (const fs::path& file : files_of(folder / "series")) set_tag(file, 0x0028, 0x0120, bytes, gdcm::VR::SS);
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.values[3], -1024);
  EXPECT_EQ(scan->volume.values[4], volume.values[4]);
}

// HU = slope · stored + intercept, in DICOM PS3.3 C.11.1.1.2. Also where the intercept is 0.
TEST(DicomSeries, ScalesByTheSlope) {
  const test::TempDir folder;
  const auto volume = numbered_volume(7, 5, 4);
  ASSERT_TRUE(write_dicom_series(volume, folder / "series", keep_going));
  for (const fs::path& file : files_of(folder / "series")) {
    set_tag(file, 0x0028, 0x1052, "0");
    set_tag(file, 0x0028, 0x1053, "2");
  }
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    ASSERT_EQ(scan->volume.values[i], 2 * (volume.values[i] + 1024)) << i;  // stored with the writer's intercept
}

// Signed pixels of 12 stored bits, whose upper four bits are zero in the file. In 12 bits of two's complement, 0xfe8 is
// -24 and 0x800 is -2048.
TEST(DicomSeries, ExtendsTheSignOfFewerThan16Bits) {
  const test::TempDir folder;
  ASSERT_TRUE(write_dicom_series(numbered_volume(2, 2, 4), folder / "series", keep_going));
  for (const fs::path& file : files_of(folder / "series")) {
    set_tag(file, 0x0028, 0x0101, std::string("\x0c\x00", 2));
    set_tag(file, 0x0028, 0x0102, std::string("\x0b\x00", 2));
    set_tag(file, 0x0028, 0x1052, "0");
    set_tag(file, 0x7fe0, 0x0010, std::string("\xe8\x0f\x00\x08\x17\x00\xff\x07", 8));
  }
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  const std::vector<std::int16_t> slice(scan->volume.values.begin(), scan->volume.values.begin() + 4);
  EXPECT_EQ(slice, (std::vector<std::int16_t>{-24, -2048, 23, 2047}));
}

TEST(DicomSeries, OrderOfFileNamesDoesNotMatter) {
  const test::TempDir folder;
  const auto volume = numbered_volume(7, 5, 4);
  ASSERT_TRUE(write_dicom_series(volume, folder / "series", keep_going));
  const auto files = files_of(folder / "series");
  for (std::size_t i = 0; i < files.size(); ++i)
    fs::rename(files[i], folder / "series" / (std::string(1, "qdza"[i]) + "-renamed"));
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_same(scan->volume, volume);
}

TEST(DicomSeries, FilesBesideItThatAreNotDicomArePassedOver) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder / "series"));
  std::ofstream(folder / "series" / "README.md") << "# Notes\n";
  EXPECT_TRUE(read_dicom_series(folder / "series", keep_going));
}

TEST(DicomSeries, TheSourceSaysNothingOfThePatient) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder / "Surname^Forename"));
  for (const fs::path& file : files_of(folder / "Surname^Forename")) set_tag(file, 0x0010, 0x0010, "Surname^Forename");
  const auto scan = read_dicom_series(folder / "Surname^Forename", keep_going);
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->source.find("name"), std::string::npos) << scan->source;
}

TEST(DicomSeries, WritingOverAFolderIsRefused) {
  const test::TempDir folder;
  const auto written = write_dicom_series(numbered_volume(7, 5, 4), folder.path(), keep_going);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::exists);
}

TEST(DicomSeries, AFullDiskIsOneSentenceAndLeavesNothing) {
  const test::TempDir folder;
  const auto volume = numbered_volume(40, 50, 2);
  ScannerSettings settings;
  settings.gaps_mm = {1.0, 1.0};
  settings.width_mm = settings.height_mm = 30.0;
  const auto refused = [&](const Result<void>& written) {
    ASSERT_FALSE(written);
    EXPECT_TRUE(written.error().message.ends_with("; make room on the disk or choose another place"))
        << written.error().message;
    EXPECT_TRUE(fs::is_empty(folder.path()));
  };
  // A slice has 2 bytes for each of at least 1800 pixels.
  for (const rlim_t bytes : {0, 100, 1000, 3000}) {
    const test::SizeLimit small(bytes);
    refused(write_dicom_series(volume, folder / "series", keep_going));
    refused(write_simulated_scan(
        settings, [](const Vec3&) { return 0.0; }, folder / "scan", keep_going));
  }
}

TEST(DicomSeries, AStoppedWriteLeavesNothing) {
  const test::TempDir folder;
  int asked = 0;
  const auto written =
      write_dicom_series(numbered_volume(7, 5, 4), folder / "series", [&](double) { return ++asked < 3; });
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::cancelled);
  EXPECT_TRUE(files_of(folder.path()).empty());
}

TEST(DicomSeries, AStoppedReadSaysSo) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder / "series"));
  const auto scan = read_dicom_series(folder / "series", [](double done) { return done < 0.5; });
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
}

// Each of these breaks a good series in one way.
class BrokenSeries : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(write_small_series(series_));
    files_ = files_of(series_);
    ASSERT_GE(files_.size(), 8u);
  }
  void expect_refused(const std::string& named, const std::string& why) {
    const auto scan = read_dicom_series(series_, keep_going);
    ASSERT_FALSE(scan);
    expect_one_sentence(scan.error(), named);
    EXPECT_NE(scan.error().message.find(why), std::string::npos) << scan.error().message;
    EXPECT_NE(scan.error().message.find(';'), std::string::npos) << "no remedy: " << scan.error().message;
  }
  test::TempDir folder_;
  fs::path series_ = folder_ / "series";
  std::vector<fs::path> files_;
};

TEST_F(BrokenSeries, EmptyFolder) {
  for (const fs::path& file : files_) fs::remove(file);
  expect_refused(series_.string(), "is empty");
}

TEST_F(BrokenSeries, NoDicomFiles) {
  for (const fs::path& file : files_) std::ofstream(file, std::ios::trunc) << "text\n";
  expect_refused(series_.string(), "no DICOM files");
}

TEST_F(BrokenSeries, EmptySubfolder) {
  for (const fs::path& file : files_) fs::remove(file);
  fs::create_directory(series_ / "CT");
  expect_refused(series_.string(), "is empty");
}

TEST_F(BrokenSeries, SingleSlice) {
  for (std::size_t i = 1; i < files_.size(); ++i) fs::remove(files_[i]);
  expect_refused(series_.string(), "single slice");
}

TEST_F(BrokenSeries, MissingSlice) {
  fs::remove(files_[4]);
  expect_refused(series_.string(), "2 mm apart where 1 mm is usual");
}

TEST_F(BrokenSeries, MissingSlicesOfAShortSeries) {
  for (std::size_t i = 0; i < files_.size(); ++i)
    if (i != 0 && i != 1 && i != 4) fs::remove(files_[i]);
  expect_refused(series_.string(), "apart where");
}

// One copy would be left out.
TEST_F(BrokenSeries, DoubledSlices) {
  for (const std::size_t i : {2u, 4u, 5u, 7u}) {
    const fs::path copy = series_ / ("another-" + std::to_string(i) + ".dcm");
    fs::copy(files_[i], copy);
    set_tag(copy, 0x0008, 0x0018, "1.2.3." + std::to_string(i));  // an instance of its own, so not a copy
  }
  expect_refused(series_.string(), "lie at the position of another one");
}

TEST_F(BrokenSeries, ShearedFarMoreThanAGantryTilts) {
  for (std::size_t i = 0; i < files_.size(); ++i)
    set_tag(files_[i], 0x0020, 0x0032, "0\\" + std::to_string(3 * i) + "\\" + std::to_string(i));
  expect_refused(series_.string(), "71.6 degrees");  // atan(3)
}

TEST_F(BrokenSeries, AnotherModality) {
  for (const fs::path& file : files_) set_tag(file, 0x0008, 0x0060, "MR");
  expect_refused(series_.string(), std::to_string(files_.size()) + " MR images");
}

TEST_F(BrokenSeries, OnlyScouts) {
  for (const fs::path& file : files_) set_tag(file, 0x0008, 0x0008, "ORIGINAL\\PRIMARY\\LOCALIZER");
  expect_refused(series_.string(), std::to_string(files_.size()) + " localizers");
}

TEST_F(BrokenSeries, AScoutBesideTheSeriesIsNotStacked) {
  set_tag(files_.back(), 0x0008, 0x0008, "ORIGINAL\\PRIMARY\\LOCALIZER");
  const auto scan = read_dicom_series(series_, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims[2], static_cast<int>(files_.size()) - 1);
}

TEST_F(BrokenSeries, NoPixelData) {
  remove_tag(files_[3], 0x7fe0, 0x0010);
  expect_refused(series_.string(), "slice-0004.dcm has no pixel data");
}

TEST_F(BrokenSeries, NoPixelDataAnywhere) {
  for (const fs::path& file : files_) remove_tag(file, 0x7fe0, 0x0010);
  expect_refused(series_.string(), "no pixel data");
}

TEST_F(BrokenSeries, TruncatedFile) {
  truncate_file(files_[2], 0.6);  // ends within its header
  expect_refused(series_.string(), "slice-0003.dcm is damaged");
}

// The library silently leaves missing pixels zero.
TEST_F(BrokenSeries, FileThatEndsWithinItsPixels) {
  fs::resize_file(files_[2], fs::file_size(files_[2]) - 2);
  expect_refused(files_[2].string(), "cut off");
}

TEST_F(BrokenSeries, NoSpacing) {
  remove_tag(files_[0], 0x0028, 0x0030);
  expect_refused(files_[0].string(), "PixelSpacing (0028,0030)");
}

TEST_F(BrokenSeries, SpacingThatIsNoNumber) {
  set_tag(files_[0], 0x0028, 0x0030, "wide\\wide");
  expect_refused(files_[0].string(), "PixelSpacing (0028,0030)");
}

TEST_F(BrokenSeries, NoPosition) {
  remove_tag(files_[5], 0x0020, 0x0032);
  expect_refused(files_[5].string(), "ImagePositionPatient (0020,0032)");
}

TEST_F(BrokenSeries, NoOrientation) {
  remove_tag(files_[5], 0x0020, 0x0037);
  expect_refused(files_[5].string(), "ImageOrientationPatient (0020,0037)");
}

TEST_F(BrokenSeries, NoRescaling) {
  remove_tag(files_[5], 0x0028, 0x1052);
  expect_refused(files_[5].string(), "RescaleIntercept");
}

TEST_F(BrokenSeries, SeveralFrames) {
  set_tag(files_[1], 0x0028, 0x0008, "2");
  expect_refused(series_.string(), "slice-0002.dcm holds 2 frames");
}

TEST_F(BrokenSeries, AnotherPixelSpacingInOneSlice) {
  set_tag(files_[1], 0x0028, 0x0030, "2\\2");
  expect_refused(series_.string(), "slice-0002.dcm has another pixel spacing");
}

TEST_F(BrokenSeries, AnotherOrientationInOneSlice) {
  set_tag(files_[1], 0x0020, 0x0037, "1\\0\\0\\0\\0.8\\0.6");
  expect_refused(series_.string(), "slice-0002.dcm has another orientation");
}

TEST_F(BrokenSeries, OtherColoursInOneSlice) {
  set_tag(files_[1], 0x0028, 0x0004, "MONOCHROME1");
  expect_refused(series_.string(), "slice-0002.dcm has other colours");
}

// Some workstations put coloured pictures into the series of the slices that they show.
TEST_F(BrokenSeries, ColouredPicturesOfSlicesAreLeftOut) {
  const auto before = read_dicom_series(series_, keep_going);
  ASSERT_TRUE(before);
  for (std::size_t i : {1u, 2u, 3u}) {
    const fs::path picture = series_ / ("z-" + std::to_string(i) + ".dcm");
    fs::copy_file(files_[i], picture);
    set_tag(picture, 0x0008, 0x0018, "1.2.3.4." + std::to_string(i));
    set_tag(picture, 0x0028, 0x0004, "PALETTE COLOR");
  }
  const auto scan = read_dicom_series(series_, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_same(scan->volume, before->volume);
}

TEST(DicomSeriesFolder, ThatIsNotThere) {
  const auto scan = read_dicom_series("/no/such/folder", keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), "/no/such/folder");
}

}  // namespace
}  // namespace osteon::import
