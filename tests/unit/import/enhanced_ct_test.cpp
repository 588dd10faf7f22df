// Enhanced multi-frame CT, written byte by byte from DICOM PS3.5 (explicit, little endian) and PS3.3 A.38, C.7.6.16.
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmWriter.h>

#include <fstream>
#include <numeric>
#include <random>

#include "server/import/dicom_reader.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/dicom_elements.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

std::string decimals(const Vec3& v) { return decimal(v.x()) + "\\" + decimal(v.y()) + "\\" + decimal(v.z()); }

// A frame of an enhanced image: a slice of a volume, and the numbers with which its HU are stored.
struct Frame {
  int slice = 0, time = 1;
  double slope = 1.0, intercept = -1024.0;
  bool has_position = true;
  std::string unit = "HU";
};

struct Enhanced {
  std::string instance = "1.2.3.4.1";
  bool shared = true;  // orientation and pixel spacing are those of all frames; otherwise each frame has its own
  bool groups = true;
  std::size_t missing_groups = 0;
};

std::string plane_of(const imaging::HuVolume& v) {
  return sequence(0x0020, 0x9116,
                  item(element(0x0020, 0x0037, "DS",
                               decimals(v.directions.col(0)) + "\\" + decimals(v.directions.col(1))))) +
         sequence(0x0028, 0x9110,
                  item(element(0x0018, 0x0050, "DS", decimal(v.spacing_mm.z())) +
                       element(0x0028, 0x0030, "DS", decimal(v.spacing_mm.y()) + "\\" + decimal(v.spacing_mm.x()))));
}

void write_enhanced(const fs::path& file, const imaging::HuVolume& v, const std::vector<Frame>& frames,
                    const Enhanced& enhanced = {}) {
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2.1";
  const std::size_t pixels = static_cast<std::size_t>(v.dims[0]) * static_cast<std::size_t>(v.dims[1]);
  std::string stored;
  std::vector<std::string> groups;
  for (const Frame& f : frames) {
    for (std::size_t i = 0; i < pixels; ++i) {
      const double hu = v.values[static_cast<std::size_t>(f.slice) * pixels + i];
      stored += little_endian(static_cast<std::uint16_t>(std::lround((hu - f.intercept) / f.slope)), 2);
    }
    groups.push_back(item(
        sequence(0x0020, 0x9111,
                 item(element(0x0020, 0x9128, "UL", little_endian(static_cast<std::size_t>(f.time), 4)))) +
        (f.has_position ? sequence(0x0020, 0x9113,
                                   item(element(0x0020, 0x0032, "DS", decimals(v.position_mm(Vec3(0, 0, f.slice))))))
                        : "") +
        (enhanced.shared ? "" : plane_of(v)) +
        sequence(0x0028, 0x9145,
                 item(element(0x0028, 0x1052, "DS", decimal(f.intercept)) +
                      element(0x0028, 0x1053, "DS", decimal(f.slope)) + element(0x0028, 0x1054, "LO", f.unit)))));
  }
  std::string all;
  for (std::size_t i = 0; i + enhanced.missing_groups < groups.size(); ++i) all += groups[i];
  const std::string meta =
      element(2, 2, "UI", ct) + element(2, 3, "UI", enhanced.instance) + element(2, 0x10, "UI", "1.2.840.10008.1.2.1");
  std::ofstream out(file, std::ios::binary);
  out << std::string(128, '\0') << "DICM" << element(2, 0, "UL", little_endian(meta.size(), 4)) << meta
      << element(8, 8, "CS", "ORIGINAL\\PRIMARY\\VOLUME\\NONE") << element(8, 0x16, "UI", ct)
      << element(8, 0x18, "UI", enhanced.instance) << element(8, 0x60, "CS", "CT")
      << element(0x20, 0x0e, "UI", "1.2.3.4") << element(0x20, 0x11, "IS", "1")
      << element(0x28, 2, "US", little_endian(1, 2)) << element(0x28, 4, "CS", "MONOCHROME2")
      << element(0x28, 8, "IS", std::to_string(frames.size()))
      << element(0x28, 0x10, "US", little_endian(static_cast<std::size_t>(v.dims[1]), 2))
      << element(0x28, 0x11, "US", little_endian(static_cast<std::size_t>(v.dims[0]), 2))
      << element(0x28, 0x100, "US", little_endian(16, 2)) << element(0x28, 0x101, "US", little_endian(16, 2))
      << element(0x28, 0x102, "US", little_endian(15, 2)) << element(0x28, 0x103, "US", little_endian(0, 2));
  if (enhanced.groups) {
    if (enhanced.shared) out << sequence(0x5200, 0x9229, item(plane_of(v)));
    out << sequence(0x5200, 0x9230, all);
  }
  out << element(0x7fe0, 0x10, "OW", stored);
}

// One frame for each slice, in any order, each stored by its own slope and intercept.
std::vector<Frame> shuffled(int slices) {
  std::vector<Frame> frames;
  for (int i = 0; i < slices; ++i)
    frames.push_back({.slice = i, .slope = i % 3 == 0 ? 0.5 : 1.0, .intercept = -1024.0 - 8.0 * i});
  std::ranges::shuffle(frames, std::mt19937(5));
  return frames;
}

class EnhancedCt : public ::testing::Test {
 protected:
  void expect_volume() const {
    const auto scan = read_dicom_series(folder_.path(), keep_going);
    ASSERT_TRUE(scan) << scan.error().message;
    expect_same(scan->volume, volume_);
  }
  void expect_refused(const std::string& why) const {
    const auto scan = read_dicom_series(folder_.path(), keep_going);
    ASSERT_FALSE(scan);
    expect_one_sentence(scan.error(), why);
  }
  test::TempDir folder_;
  const fs::path file_ = folder_ / "ct.dcm";
  const imaging::HuVolume volume_ = numbered_volume(7, 5, 12);
};

TEST_F(EnhancedCt, FramesAreSortedByTheirPosition) {
  for (const bool shared : {true, false}) {
    write_enhanced(file_, volume_, shuffled(12), {.shared = shared});
    expect_volume();
  }
  const auto scan = read_dicom_series(file_, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->report.series[0].slices, 12);
}

TEST_F(EnhancedCt, CompressedFramesAreTheSame) {
  const imaging::HuVolume volume = numbered_volume(40, 36, 5);  // JPEG 2000 halves a frame five times
  for (const auto syntax : {gdcm::TransferSyntax::RLELossless, gdcm::TransferSyntax::JPEGLosslessProcess14_1,
                            gdcm::TransferSyntax::JPEGLSLossless, gdcm::TransferSyntax::JPEG2000Lossless}) {
    SCOPED_TRACE(gdcm::TransferSyntax::GetTSString(syntax));
    write_enhanced(file_, volume, shuffled(5));
    gdcm::ImageReader reader;
    reader.SetFileName(file_.c_str());
    ASSERT_TRUE(reader.Read());
    gdcm::ImageChangeTransferSyntax change;
    change.SetTransferSyntax(syntax);
    change.SetInput(reader.GetImage());
    ASSERT_TRUE(change.Change());
    // The writer of images would replace the functional groups.
    gdcm::DataElement pixels = change.GetOutput().GetDataElement();
    gdcm::VL unknown;
    unknown.SetToUndefined();
    pixels.SetVL(unknown);
    reader.GetFile().GetDataSet().Replace(pixels);
    reader.GetFile().GetHeader().SetDataSetTransferSyntax(syntax);
    gdcm::Writer writer;
    writer.SetFile(reader.GetFile());
    writer.SetFileName(file_.c_str());
    ASSERT_TRUE(writer.Write());
    const auto scan = read_dicom_series(file_, keep_going);
    ASSERT_TRUE(scan) << scan.error().message;
    expect_same(scan->volume, volume);
  }
}

// A long scan may come in several files.
TEST_F(EnhancedCt, SeveralFilesOfOneSeriesAreOneVolume) {
  const std::vector<Frame> all = shuffled(12);
  write_enhanced(file_, volume_, {all.begin(), all.begin() + 5});
  write_enhanced(folder_ / "more.dcm", volume_, {all.begin() + 5, all.end()}, {.instance = "1.2.3.4.2"});
  expect_volume();
}

TEST_F(EnhancedCt, ACopyOfTheFileIsSkipped) {
  write_enhanced(file_, volume_, shuffled(12));
  fs::copy(file_, folder_ / "copy.dcm");
  expect_volume();
}

TEST_F(EnhancedCt, TimesAreParted) {
  std::vector<Frame> frames = shuffled(12), later = frames;
  for (Frame& f : later) f.time = 2;
  frames.insert(frames.end(), later.begin(), later.end());
  write_enhanced(file_, volume_, frames);
  expect_volume();
  const auto report = list_dicom_series(folder_.path(), keep_going);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->series.size(), 2u);
}

TEST_F(EnhancedCt, AMissingFrameIsOneSentence) {
  std::vector<Frame> frames = shuffled(12);
  std::erase_if(frames, [](const Frame& f) { return f.slice == 6; });
  write_enhanced(file_, volume_, frames);
  expect_refused("of ct.dcm are 2.5 mm apart where 1.25 mm is usual");
}

TEST_F(EnhancedCt, FramesWithoutTheirGroupsAreOneSentence) {
  write_enhanced(file_, volume_, shuffled(12), {.groups = false});
  expect_refused("ct.dcm holds 12 frames without a position for each; ");
  write_enhanced(file_, volume_, shuffled(12), {.missing_groups = 1});
  expect_refused("ct.dcm holds 12 frames without a position for each; ");
}

TEST_F(EnhancedCt, AFrameWithoutAPositionIsOneSentence) {
  std::vector<Frame> frames = shuffled(12);
  frames[3].has_position = false;
  write_enhanced(file_, volume_, frames);
  expect_refused("ImagePositionPatient (0020,0032)");
}

// A map of blood flow, for example.
TEST_F(EnhancedCt, NumbersThatAreNotHounsfieldUnitsAreOneSentence) {
  std::vector<Frame> frames = shuffled(12);
  for (Frame& f : frames) f.unit = "US";
  write_enhanced(file_, volume_, frames);
  expect_refused("ct.dcm stores numbers that are not Hounsfield units");
  for (Frame& f : frames) f.unit = "HU_MOD";
  write_enhanced(file_, volume_, frames);
  expect_volume();
}

TEST_F(EnhancedCt, OneThatEndsWithinItsPixelsIsOneSentence) {
  write_enhanced(file_, volume_, shuffled(12));
  fs::resize_file(file_, fs::file_size(file_) - 2);
  expect_refused(file_.string() + " is cut off");
}

TEST_F(EnhancedCt, CanBeStopped) {
  write_enhanced(file_, volume_, shuffled(12));
  const auto scan = read_dicom_series(folder_.path(), [](double done) { return done < 0.7; });
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::import
