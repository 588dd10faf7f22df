#include "server/import/inv3_reader.hpp"

#include <fstream>

#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

TEST(Inv3, ReadsShapeSpacingAndValues) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder / "a.inv3", {}));
  const auto scan = read_inv3(folder / "a.inv3", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims, (std::array<int, 3>{4, 5, 6}));
  EXPECT_EQ(scan->volume.spacing_mm, Vec3(0.5, 0.75, 2.0));
  EXPECT_EQ(scan->volume.at(3, 2, 4), 4203);
}

TEST(Inv3, RowsGoToTheFrontAndSlicesToTheHead) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder / "a.inv3", {}));
  const auto scan = read_inv3(folder / "a.inv3", keep_going);
  ASSERT_TRUE(scan);
  const auto at = [&](double i, double j, double k) { return scan->volume.position_mm(Vec3(i, j, k)); };
  EXPECT_LT((at(1, 0, 0) - at(0, 0, 0) - Vec3(0.5, 0, 0)).norm(), 1e-12);    // left
  EXPECT_LT((at(0, 1, 0) - at(0, 0, 0) - Vec3(0, -0.75, 0)).norm(), 1e-12);  // front
  EXPECT_LT((at(0, 0, 1) - at(0, 0, 0) - Vec3(0, 0, 2.0)).norm(), 1e-12);    // head
  EXPECT_LT(at(0, 4, 0).norm(), 1e-12);                                      // the lowest corner is the origin
}

TEST(Inv3, TheSourceSaysNothingOfThePatient) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder / "Somebody.inv3", {}));
  const auto scan = read_inv3(folder / "Somebody.inv3", keep_going);
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->source.find("Somebody"), std::string::npos);
  EXPECT_EQ(scan->source, "InVesalius CT, 4x5x6, 0.5x0.75x2 mm");
}

void expect_refused(const fs::path& file, const std::string& why) {
  const auto scan = read_inv3(file, keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), file.string());
  EXPECT_NE(scan.error().message.find(why), std::string::npos) << scan.error().message;
}

TEST(Inv3, RefusesWhatIsNoProject) {
  const test::TempDir folder;
  std::ofstream(folder / "text.inv3") << "This is a letter, not a scan.\n";
  expect_refused(folder / "text.inv3", "is not an InVesalius project");
  std::ofstream(folder / "empty.inv3");
  expect_refused(folder / "empty.inv3", "is not an InVesalius project");
  expect_refused(folder / "absent.inv3", "there is no file");
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder / "other.inv3", {.with_list = false, .with_matrix = false}));
  expect_refused(folder / "other.inv3", "no main.plist");
}

TEST(Inv3, RefusesATruncatedArchiveWhereverItEnds) {
  const test::TempDir folder;
  // Large enough that gzip needs more than one block.
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder / "whole.inv3", {.columns = 200, .rows = 200, .slices = 30}));
  for (const double part : {0.002, 0.1, 0.5, 0.9, 0.99}) {
    const fs::path file = folder / ("cut-" + std::to_string(part) + ".inv3");
    fs::copy(folder / "whole.inv3", file);
    truncate_file(file, part);
    expect_refused(file, "");
  }
}

// A tar of one file that claims `size` bytes. Sizes that do not fit into octal digits are written as GNU tar does.
std::string tar_entry(const std::string& name, std::uint64_t size) {
  std::string head = name;
  head.resize(512, '\0');
  head.replace(100, 7, "0000644");
  for (int i = 0; i < 8; ++i) head[135 - i] = static_cast<char>(size >> 8 * i & 0xff);
  head[124] = '\x80';
  head.replace(148, 8, 8, ' ');
  head[156] = '0';
  head.replace(257, 8, std::string("ustar  \0", 8));
  unsigned sum = 0;
  for (const char c : head) sum += static_cast<unsigned char>(c);
  char digits[8];
  std::snprintf(digits, sizeof digits, "%06o", sum);
  head.replace(148, 7, digits, 7);
  return head;
}

TEST(Inv3, AMatrixThatClaimsTwoTerabytesTakesNoMemory) {
  const test::TempDir folder;
  std::string list =
      "<plist><dict><key>matrix</key><dict><key>dtype</key><string>int16</string><key>filename</"
      "key><string>matrix.dat</string>"
      "<key>shape</key><array><integer>4000</integer><integer>16384</integer><integer>16384</integer></array></dict>"
      "<key>spacing</key><array><real>1</real><real>1</real><real>1</real></array></dict></plist>";
  const std::string head = tar_entry("main.plist", list.size());
  list.resize(512 * ((list.size() + 511) / 512), '\0');
  std::ofstream(folder / "a.inv3", std::ios::binary)
      << head << list << tar_entry("matrix.dat", std::uint64_t{4000} * 16384 * 16384 * 2) << std::string(4096, '\0');
  expect_refused(folder / "a.inv3", "is truncated or damaged");
}

TEST(Inv3, NamesTheFieldThatIsWrong) {
  const test::TempDir folder;
  const auto refused = [&](const Inv3& project, const std::string& why) {
    ASSERT_NO_FATAL_FAILURE(write_inv3(folder / "a.inv3", project));
    expect_refused(folder / "a.inv3", why);
    fs::remove(folder / "a.inv3");
  };
  refused({.modality = "MR"}, "modality is MR");
  refused({.dtype = "float32"}, "dtype is \"float32\"");
  refused({.orientation = "2"}, "orientation is 2");
  refused({.spacing = "<real>0.5</real><real>0.5</real>"}, "spacing");
  refused({.spacing = "<real>0.5</real><real>0.5</real><real>0</real>"}, "spacing");
  refused({.spacing = ""}, "spacing");
  refused({.with_matrix = false}, "matrix.dat");
  refused({.missing_bytes = 2}, "238 bytes where the shape in main.plist needs 240");
  refused({.slices = 1}, "shape");
}

TEST(Inv3, StopsWhenAsked) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder / "a.inv3", {}));
  const auto scan = read_inv3(folder / "a.inv3", [](double) { return false; });
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::import
