// Media as hospitals hand them out: CT series among indexes, reports, pictures and programs, in folders, zips and CD
// images.
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>

#include "server/import/dicom_reader.hpp"
#include "server/import/dicom_writer.hpp"
#include "tests/support/privileges.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// A TMPDIR of the test's own. It must be empty at the end.
class Scratch {
 public:
  Scratch() { ::setenv("TMPDIR", folder_.path().c_str(), 1); }
  ~Scratch() {
    ::unsetenv("TMPDIR");
    EXPECT_TRUE(files_of(folder_.path()).empty()) << "left behind: " << files_of(folder_.path()).front();
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

 private:
  test::TempDir folder_;
};

void tag_all(const fs::path& series, std::uint16_t group, std::uint16_t element, const std::string& value) {
  for (const fs::path& file : files_of(series)) set_tag(file, group, element, value);
}

class CdFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(write_dicom_series(large_, cd_ / "DICOM" / "ST0" / "SE1", keep_going));
    ASSERT_TRUE(write_dicom_series(small_, cd_ / "DICOM" / "ST0" / "SE0", keep_going));
    tag_all(series("SE1"), 0x0020, 0x0011, "5");
    tag_all(series("SE1"), 0x0008, 0x103e, "HEAD 1.0 H60s");
    tag_all(series("SE1"), 0x0018, 0x1210, "H60s");
    tag_all(series("SE0"), 0x0020, 0x0011, "3");
  }
  // Other files beside the images on a CD.
  void add_the_rest() {
    const std::string storage = "1.2.840.10008.5.1.4.1.1.";
    write_object(cd_ / "DICOMDIR", "1.2.840.10008.1.3.10", "");
    write_object(cd_ / "DICOM" / "DIRFILE", "1.2.840.10008.1.3.10", "");
    write_object(cd_ / "DICOM" / "dose", storage + "88.67", "SR");
    write_object(cd_ / "DICOM" / "screen", storage + "7", "CT", "DERIVED\\SECONDARY");
    fs::copy(series("SE0") / "slice-0001.dcm", cd_ / "DICOM" / "topogram");
    set_tag(cd_ / "DICOM" / "topogram", 0x0008, 0x0008, "ORIGINAL\\PRIMARY\\LOCALIZER");
    std::ofstream(cd_ / "README.txt") << "Insert the disc.\n";
    std::ofstream(cd_ / "autorun.exe") << "MZ" << std::string(5000, '\x90');
    std::ofstream(cd_ / "logo.jpg") << "\xff\xd8\xff\xe0 JFIF";
    std::ofstream(cd_ / "empty");
  }
  static constexpr const char* kRest =
      "2 DICOMDIRs, 1 localizer, 1 dose report, 1 secondary capture, 3 files that are not DICOM, 1 empty file";
  [[nodiscard]] fs::path series(const char* name) const { return cd_ / "DICOM" / "ST0" / name; }
  void expect_large(const Result<CtScan>& scan) const {
    ASSERT_TRUE(scan) << scan.error().message;
    expect_same(scan->volume, large_);
  }
  // Expects the large volume, or one sentence.
  void expect_sound(const Result<CtScan>& scan, const std::string& named) const {
    if (scan)
      expect_same(scan->volume, large_);
    else
      expect_one_sentence(scan.error(), named);
  }

  test::TempDir folder_;
  const fs::path cd_ = folder_ / "cd";
  const imaging::HuVolume large_ = numbered_volume(16, 12, 20);
  const imaging::HuVolume small_ = numbered_volume(12, 10, 9);
};

TEST_F(CdFolder, TheLargestCtIsTakenAndTheRestCounted) {
  add_the_rest();
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_NO_FATAL_FAILURE(expect_large(scan));
  ASSERT_EQ(scan->report.series.size(), 2u);
  EXPECT_EQ(scan->report.taken, 2);
  EXPECT_EQ(scan->report.skipped.text(), kRest);
  EXPECT_EQ(report_lines(scan->report),
            "series     2 of 2: \"HEAD 1.0 H60s\", 20 slices, 16x12, 0.5x0.75x1.25 mm, axial, kernel H60s\n"
            "also       1: no description, 9 slices, 12x10, 0.5x0.75x1.25 mm, axial\n"
            "           --series N takes another\n"
            "skipped    " +
                std::string(kRest) + "\n");
  EXPECT_EQ(scan->source, "DICOM CT, 16x12x20, 0.5x0.75x1.25 mm");
}

TEST_F(CdFolder, ArchivesGiveTheSameVolume) {
  add_the_rest();
  for (const char* format : {"zip", "iso9660", "pax"}) {
    SCOPED_TRACE(format);
    const Scratch scratch;
    const fs::path file = folder_ / (std::string("export-") + format);  // known by content, not by name
    ASSERT_NO_FATAL_FAILURE(write_archive(cd_, file, format));
    const auto scan = read_dicom_series(file, keep_going);
    expect_large(scan);
    ASSERT_TRUE(scan);
    EXPECT_EQ(scan->report.skipped.text(), kRest);
    EXPECT_EQ(scan->report.taken, 2);
  }
}

TEST_F(CdFolder, ADicomdirStandsForItsFolder) {
  add_the_rest();
  expect_large(read_dicom_series(cd_ / "DICOMDIR", keep_going));
}

TEST_F(CdFolder, ASliceStandsForItsSeries) {
  const auto scan = read_dicom_series(series("SE0") / "slice-0003.dcm", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_same(scan->volume, small_);
  for (const fs::path& file : files_of(series("SE1"))) fs::copy(file, series("SE0") / ("b" + file.filename().string()));
  const auto among = read_dicom_series(series("SE0") / "slice-0003.dcm", keep_going);
  ASSERT_TRUE(among) << among.error().message;
  expect_same(among->volume, small_);
}

TEST_F(CdFolder, AnotherSeriesIsTakenByItsNumber) {
  const auto scan = read_dicom_series(cd_, {.series = 1}, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_same(scan->volume, small_);
  EXPECT_EQ(scan->report.taken, 1);
  for (const int number : {0, 3, -1}) {
    const auto none = read_dicom_series(cd_, {.series = number}, keep_going);
    ASSERT_FALSE(none);
    expect_one_sentence(none.error(), "has the series 1 to 2; osteon-import series lists them");
  }
}

TEST_F(CdFolder, AListReadsNoPixels) {
  truncate_file(series("SE0") / "slice-0003.dcm", 0.95);
  const auto report = list_dicom_series(cd_, keep_going);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->taken, 2);
  EXPECT_EQ(list_text(*report),
            "1          no description, 9 slices, 12x10, 0.5x0.75x1.25 mm, axial\n"
            "2          \"HEAD 1.0 H60s\", 20 slices, 16x12, 0.5x0.75x1.25 mm, axial, kernel H60s\n"
            "taken      2; ct --series N takes another\n");
}

TEST_F(CdFolder, DescriptionsAreShownWithoutControlsAndNotStored) {
  tag_all(series("SE1"), 0x0008, 0x103e, "a\x1b[2J\nb" + std::string(100, 'c'));
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_NO_FATAL_FAILURE(expect_large(scan));
  EXPECT_EQ(scan->report.series[1].description, "a?[2J?b" + std::string(57, 'c') + "...");
  EXPECT_EQ(scan->source.find('c'), std::string::npos) << scan->source;
}

TEST_F(CdFolder, ALargerOneOfAKindThatCannotBeImportedIsNotTaken) {
  tag_all(series("SE1"), 0x0028, 0x0008, "2");
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_same(scan->volume, small_);
  EXPECT_NE(report_lines(scan->report).find("(cannot be imported: several frames in a file)"), std::string::npos)
      << report_lines(scan->report);
}

// The larger series is most likely the wanted one: the smaller one may be another bone.
TEST_F(CdFolder, ALargerOneWithAMissingSliceIsReportedAndNoOtherTaken) {
  fs::remove(series("SE1") / "slice-0010.dcm");
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), "2.5 mm apart where 1.25 mm is usual");
  EXPECT_NE(scan.error().message.find("or take another series by --series N"), std::string::npos)
      << scan.error().message;
  const auto other = read_dicom_series(cd_, {.series = 1}, keep_going);
  ASSERT_TRUE(other) << other.error().message;
  expect_same(other->volume, small_);
}

TEST_F(CdFolder, AFewSlicesAreNotTakenForALargeOne) {
  fs::remove(series("SE1") / "slice-0010.dcm");
  for (int i = 4; i <= 9; ++i) fs::remove(series("SE0") / ("slice-000" + std::to_string(i) + ".dcm"));
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), "2.5 mm apart where 1.25 mm is usual");
  EXPECT_NE(scan.error().message.find("--series N"), std::string::npos) << scan.error().message;
}

TEST_F(CdFolder, OneOddImageDoesNotSpoilItsSeries) {
  fs::copy(series("SE1") / "slice-0010.dcm", series("SE1") / "odd.dcm");
  set_tag(series("SE1") / "odd.dcm", 0x0008, 0x0018, "1.2.3.4");
  set_tag(series("SE1") / "odd.dcm", 0x0020, 0x0037, "1\\0\\0\\0\\0\\-1");
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_NO_FATAL_FAILURE(expect_large(scan));
  ASSERT_EQ(scan->report.series.size(), 3u);
  EXPECT_EQ(scan->report.series[2].problem, "a single slice");
  EXPECT_EQ(scan->report.series[2].plane, "coronal");
}

TEST_F(CdFolder, TwoPassesOfOneSeriesAreParted) {
  for (const fs::path& file : files_of(series("SE1"))) {
    const fs::path second = series("SE1") / ("again-" + file.filename().string());
    fs::copy(file, second);
    set_tag(second, 0x0008, 0x0018,
            "1.2.3." + std::to_string(100 + file.string().back()) + file.stem().string().substr(6));
    set_tag(second, 0x0020, 0x0012, "2");
  }
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_NO_FATAL_FAILURE(expect_large(scan));
  EXPECT_EQ(scan->report.series.size(), 3u);
}

TEST_F(CdFolder, CopiesAreSkippedAndTheWholeOneIsKept) {
  fs::create_directories(cd_ / "COPY");
  for (const fs::path& file : files_of(series("SE1"))) fs::copy(file, cd_ / "COPY" / file.filename());
  truncate_file(cd_ / "COPY" / "slice-0007.dcm", 0.9);
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_NO_FATAL_FAILURE(expect_large(scan));
  EXPECT_EQ(scan->report.skipped.text(), "20 copies of other files");
}

TEST_F(CdFolder, WithoutCtItSaysWhatIsThere) {
  fs::remove_all(cd_ / "DICOM" / "ST0" / "SE0");
  tag_all(series("SE1"), 0x0008, 0x0060, "MR");
  write_object(cd_ / "dose", "1.2.840.10008.5.1.4.1.1.88.67", "SR");
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::unsupported);
  expect_one_sentence(scan.error(), "holds no CT series: 1 dose report, 20 MR images; ");
}

TEST_F(CdFolder, ADamagedFileIsCountedAndNamed) {
  std::ofstream(cd_ / "IM_1", std::ios::binary) << std::string(128, '\0') << "DICM";  // GDCM ends with an assertion
  std::ofstream(cd_ / "IM_2", std::ios::binary) << std::string(128, '\0') << "DICM" << std::string(1000, '\xff');
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_NO_FATAL_FAILURE(expect_large(scan));
  EXPECT_EQ(scan->report.skipped.text(), "2 damaged files (IM_1, IM_2)");
}

TEST_F(CdFolder, AGapNamesTheDamagedSlice) {
  fs::remove_all(series("SE0"));
  fs::resize_file(series("SE1") / "slice-0010.dcm", 700);
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(),
                      "2.5 mm apart where 1.25 mm is usual, and DICOM/ST0/SE1/slice-0010.dcm is damaged; ");
}

TEST_F(CdFolder, MoreDamagedFilesThanAnyDiscHasAreRefused) {
  for (int i = 0; i < 120; ++i)
    std::ofstream(cd_ / ("IM_" + std::to_string(i)), std::ios::binary) << std::string(128, '\0') << "DICM";
  const auto scan = read_dicom_series(cd_, keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), "more than 100 damaged files");
}

TEST_F(CdFolder, PipesLoopsAndLockedFilesDoNotStopIt) {
  ASSERT_EQ(::mkfifo((cd_ / "pipe").c_str(), 0600), 0);
  fs::create_directory_symlink(cd_, cd_ / "DICOM" / "loop");
  std::ofstream(cd_ / "locked") << "x";
  fs::permissions(cd_ / "locked", fs::perms::none);
  const auto scan = [&] {
    const test::WithoutPrivileges nothing_is_locked_to_root;
    return read_dicom_series(cd_, keep_going);
  }();
  ASSERT_NO_FATAL_FAILURE(expect_large(scan));
  EXPECT_EQ(scan->report.skipped.text(), "1 file that cannot be opened (locked), 1 link, 1 pipe or device");
}

TEST_F(CdFolder, RandomBytesBehindTheMarkAreDamagedFiles) {
  unsigned state = 7;
  for (int i = 0; i < 40; ++i) {
    std::string bytes(128, '\0');
    bytes += "DICM";
    for (int j = 0; j < 60 * i; ++j) {
      state = state * 1664525u + 1013904223u;
      bytes += static_cast<char>(state >> 24);
    }
    std::ofstream(cd_ / ("R" + std::to_string(i)), std::ios::binary) << bytes;
  }
  expect_large(read_dicom_series(cd_, keep_going));
}

// Lengths of 4 GB in a file of 2 KB must cost neither time nor memory.
TEST_F(CdFolder, AHugeLengthIsADamagedFile) {
  for (const char* vr : {"OB", "UN", "SQ", "UT", "LO"}) {
    write_object(cd_ / vr, "1.2.840.10008.5.1.4.1.1.2", "CT");
    std::ofstream out(cd_ / vr, std::ios::binary | std::ios::app);
    out << std::string("\x21\x00\x10\x00", 4) << vr << std::string("\0\0\xf0\xff\xff\xff", 6) << std::string(2000, 'x');
  }
  expect_large(read_dicom_series(cd_, keep_going));
}

TEST_F(CdFolder, ATruncatedSliceOfAnyLengthBesideAGoodSeries) {
  const fs::path whole = series("SE0") / "slice-0005.dcm";
  const auto size = fs::file_size(whole);
  ASSERT_GT(size, 1000u);
  for (std::uintmax_t length = 0; length < size; length += 64) {
    fs::copy_file(whole, cd_ / "cut", fs::copy_options::overwrite_existing);
    fs::resize_file(cd_ / "cut", length);
    expect_large(read_dicom_series(cd_, keep_going));
    // Also as the only file of its kind.
    const test::TempDir alone;
    fs::copy(cd_ / "cut", alone / "cut");
    const auto none = read_dicom_series(alone.path(), keep_going);
    ASSERT_FALSE(none);
    expect_one_sentence(none.error(), alone.path().string());
  }
}

TEST_F(CdFolder, ATruncatedSliceOfTheSeriesIsOneSentence) {
  fs::remove_all(series("SE0"));
  const fs::path whole = folder_ / "whole", slice = series("SE1") / "slice-0010.dcm";
  fs::copy(slice, whole);
  for (std::uintmax_t length = 0; length < fs::file_size(whole); length += 64) {
    fs::copy_file(whole, slice, fs::copy_options::overwrite_existing);
    fs::resize_file(slice, length);
    const auto scan = read_dicom_series(cd_, keep_going);
    ASSERT_FALSE(scan) << length;
    expect_one_sentence(scan.error(), cd_.string());
  }
}

TEST_F(CdFolder, ATruncatedArchiveIsTheVolumeOrOneSentence) {
  add_the_rest();
  for (const char* format : {"zip", "iso9660", "pax"}) {
    const Scratch scratch;
    const fs::path whole = folder_ / format, cut = folder_ / "cut";
    ASSERT_NO_FATAL_FAILURE(write_archive(cd_, whole, format));
    int refused = 0;
    for (int i = 0; i < 20; ++i) {
      SCOPED_TRACE(std::string(format) + " " + std::to_string(i));
      fs::copy_file(whole, cut, fs::copy_options::overwrite_existing);
      truncate_file(cut, i / 20.0);
      const auto scan = read_dicom_series(cut, keep_going);
      expect_sound(scan, cut.string());
      refused += scan ? 0 : 1;
    }
    EXPECT_GT(refused, 5);
  }
}

TEST_F(CdFolder, AnEncryptedZipIsOneSentence) {
  const Scratch scratch;
  ASSERT_NO_FATAL_FAILURE(write_archive(cd_, folder_ / "secret", "secret"));
  const auto scan = read_dicom_series(folder_ / "secret", keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), "is encrypted; unpack it with its password");
}

TEST_F(CdFolder, ABrokenSliceOfAnArchiveIsNamedByItsInnerPath) {
  const Scratch scratch;
  fs::remove_all(series("SE0"));
  truncate_file(series("SE1") / "slice-0003.dcm", 0.9);
  ASSERT_NO_FATAL_FAILURE(write_archive(cd_, folder_ / "cd.zip", "zip"));
  const auto scan = read_dicom_series(folder_ / "cd.zip", keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), (folder_ / "cd.zip").string() + ": DICOM/ST0/SE1/slice-0003.dcm is cut off");
}

TEST_F(CdFolder, NoTemporaryFolderIsOneSentence) {
  ASSERT_NO_FATAL_FAILURE(write_archive(cd_, folder_ / "cd.zip", "zip"));
  ::setenv("TMPDIR", (folder_ / "nowhere").c_str(), 1);
  const auto scan = read_dicom_series(folder_ / "cd.zip", keep_going);
  ::unsetenv("TMPDIR");
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), "TMPDIR");
}

TEST_F(CdFolder, StoppedAtAnyMomentLeavesNothing) {
  add_the_rest();
  ASSERT_NO_FATAL_FAILURE(write_archive(cd_, folder_ / "cd.zip", "zip"));
  int calls = 0;
  ASSERT_TRUE(read_dicom_series(folder_ / "cd.zip", [&](double) { return ++calls > 0; }));
  ASSERT_GT(calls, 50);
  int cancelled = 0, tried = 0;
  for (int stop = 1; stop < calls; stop += 7, ++tried) {
    const Scratch scratch;
    int asked = 0;
    const auto scan = read_dicom_series(folder_ / "cd.zip", [&](double) { return ++asked < stop; });
    if (scan) continue;  // silencing the library makes further calls, so their number may differ
    EXPECT_EQ(scan.error().code, ErrorCode::cancelled) << scan.error().message;
    ++cancelled;
  }
  EXPECT_GT(cancelled, tried / 2);
}

}  // namespace
}  // namespace osteon::import
