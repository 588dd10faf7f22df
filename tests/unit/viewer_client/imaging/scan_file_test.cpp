#include "viewer_client/imaging/scan_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "server/import/raw_nrrd.hpp"
#include "server/import/volume_reader.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

bool go_on(double) { return true; }

// 3 x 4 x 5 voxels, each with its own number, on oblique axes that no short decimal number names.
imaging::HuVolume oblique() {
  imaging::HuVolume volume;
  volume.dims = {3, 4, 5};
  volume.spacing_mm = {1.0 / 3.0, 0.7, 2.0};
  volume.origin_mm = {-1.0 / 7.0, 20.1, 1e-3};
  volume.directions = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (int i = 0; i < 60; ++i) volume.values.push_back(static_cast<std::int16_t>(100 * i - 1024));
  return volume;
}

TEST(ScanFile, HasTheVoxelsThatWereWritten) {
  const test::TempDir folder;
  const imaging::HuVolume volume = oblique();
  ASSERT_TRUE(import::write_raw_nrrd(volume, volume.values, folder / "scan.nrrd", go_on));
  const auto read = read_scan_file(folder / "scan.nrrd");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->geometry.dims, volume.dims);
  EXPECT_EQ(read->values, volume.values);
  EXPECT_EQ(read->geometry.origin_mm, volume.origin_mm);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_EQ(read->geometry.axes_mm.col(axis), volume.directions.col(axis) * volume.spacing_mm[axis]);
  EXPECT_EQ(read->at({2, 3, 4}), volume.at(2, 3, 4));
}

// ITK, which knows nothing of this program, reads the same.
TEST(ScanFile, IsReadByAnotherLibrary) {
  const test::TempDir folder;
  const imaging::HuVolume volume = oblique();
  ASSERT_TRUE(import::write_raw_nrrd(volume, volume.values, folder / "scan.nrrd", go_on));
  const auto read = import::read_volume(folder / "scan.nrrd", go_on);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->volume.dims, volume.dims);
  EXPECT_EQ(read->volume.values, volume.values);
  EXPECT_LT((read->volume.origin_mm - volume.origin_mm).norm(), 1e-9);
  EXPECT_LT((read->volume.directions - volume.directions).norm(), 1e-9);
  EXPECT_LT((read->volume.spacing_mm - volume.spacing_mm).norm(), 1e-9);
}

TEST(ScanFile, KeepsNumbersAsBytes) {
  const test::TempDir folder;
  imaging::HuVolume grid = oblique();
  std::vector<std::uint8_t> numbers(grid.count());
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<std::uint8_t>(i % 7);
  ASSERT_TRUE(import::write_raw_nrrd(grid, numbers, folder / "islands.nrrd", go_on));
  const auto read = read_number_file(folder / "islands.nrrd");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->values, numbers);
  EXPECT_FALSE(read_scan_file(folder / "islands.nrrd"));
}

TEST(ScanFile, RefusesWhatIsNoneAndWhatEndsEarly) {
  const test::TempDir folder;
  const imaging::HuVolume volume = oblique();
  EXPECT_FALSE(read_scan_file(folder / "none.nrrd"));
  std::ofstream(folder / "letter.nrrd") << "Dear reader\n";
  EXPECT_FALSE(read_scan_file(folder / "letter.nrrd"));
  ASSERT_TRUE(import::write_raw_nrrd(volume, volume.values, folder / "scan.nrrd", go_on));
  std::filesystem::resize_file(folder / "scan.nrrd", std::filesystem::file_size(folder / "scan.nrrd") - 1);
  const auto cut = read_scan_file(folder / "scan.nrrd");
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().message.find("ends early"), std::string::npos);
}

// Eight terabytes are named, and none is there.
TEST(ScanFile, ClaimsNoMemoryThatItDoesNotFill) {
  const test::TempDir folder;
  std::ofstream(folder / "scan.nrrd") << "NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\n"
                                         "sizes: 16384 16384 16384\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                                         "endian: little\nencoding: raw\nspace origin: (0,0,0)\n\nvoxels";
  const auto read = read_scan_file(folder / "scan.nrrd");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("ends early"), std::string::npos) << read.error().message;
}

TEST(ScanFile, IsNotLeftHalfWritten) {
  const test::TempDir folder;
  const imaging::HuVolume volume = oblique();
  const auto stopped =
      import::write_raw_nrrd(volume, volume.values, folder / "scan.nrrd", [](double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  EXPECT_FALSE(import::write_raw_nrrd(volume, volume.values, folder / "no" / "scan.nrrd", go_on));
  EXPECT_FALSE(import::write_raw_nrrd(volume, volume.values, folder / "scan.nii", go_on));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace osteon
