// Every transfer syntax that GDCM decodes, and files without a header. GDCM's own filter writes them.
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>
#include <gdcmJPEG2000Codec.h>

#include <fstream>

#include "server/import/dicom_header.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/dicom_writer.hpp"
#include "tests/support/content.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;
using gdcm::TransferSyntax;

constexpr int kEdge = 32, kSlices = 3;
constexpr double kQuality_db = 90.0;  // of JPEG 2000: peak signal to noise

// Smooth, as lossy encodings need it; `most` is its largest value, in the last corner.
imaging::HuVolume smooth_volume(int most) {
  imaging::HuVolume volume;
  volume.dims = {kEdge, kEdge, kSlices};
  volume.spacing_mm = {0.5, 0.75, 1.25};
  for (int k = 0; k < kSlices; ++k)
    for (int j = 0; j < kEdge; ++j)
      for (int i = 0; i < kEdge; ++i)
        volume.values.push_back(static_cast<std::int16_t>(most * (2 * i + j + k) / (3 * kEdge + kSlices)));
  return volume;
}

std::string number(std::uint16_t value) { return {static_cast<char>(value & 0xff), static_cast<char>(value >> 8)}; }

// A series of unsigned numbers with so many stored bits, whose HU are the numbers themselves.
void write_unsigned(const fs::path& folder, const imaging::HuVolume& volume, std::uint16_t bits) {
  ASSERT_TRUE(write_dicom_series(volume, folder, keep_going));
  const std::size_t pixels = kEdge * kEdge;
  std::size_t slice = 0;
  for (const fs::path& file : files_of(folder)) {
    std::string bytes;
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto value = static_cast<std::uint16_t>(volume.values[slice * pixels + i]);
      bytes += bits == 8 ? std::string(1, static_cast<char>(value)) : number(value);
    }
    ++slice;
    set_tag(file, 0x0028, 0x0100, number(bits == 8 ? 8 : 16));
    set_tag(file, 0x0028, 0x0101, number(bits));
    set_tag(file, 0x0028, 0x0102, number(static_cast<std::uint16_t>(bits - 1)));
    set_tag(file, 0x0028, 0x0103, number(0));
    set_tag(file, 0x0028, 0x1052, "0");
    set_tag(file, 0x7fe0, 0x0010, bytes);
  }
}

void encode(const fs::path& folder, TransferSyntax::TSType syntax) {
  for (const fs::path& file : files_of(folder)) {
    gdcm::ImageReader reader;
    reader.SetFileName(file.c_str());
    ASSERT_TRUE(reader.Read()) << file;
    gdcm::ImageChangeTransferSyntax change;
    change.SetTransferSyntax(syntax);
    gdcm::JPEG2000Codec lossy;
    lossy.SetReversible(false);
    lossy.SetQuality(0, kQuality_db);
    if (syntax == TransferSyntax::JPEG2000) change.SetUserCodec(&lossy);
    change.SetInput(reader.GetImage());
    ASSERT_TRUE(change.Change()) << TransferSyntax::GetTSString(syntax);
    gdcm::ImageWriter writer;
    writer.SetFile(reader.GetFile());
    writer.SetImage(change.GetOutput());
    writer.SetFileName(file.c_str());
    ASSERT_TRUE(writer.Write());
  }
}

struct Encoding {
  TransferSyntax::TSType syntax;
  std::uint16_t bits;  // unsigned; 0: 16 bits with a sign
  int tolerance_hu = 0;
  bool lossy = false;  // by its name
};

// Baseline JPEG has 8 bits, and its extended form 12. At full quality a coefficient of their transform is rounded to
// a whole number: a pixel is a sum of 64 coefficients, each weighted by at most 1/4, half a unit wrong at most. 90 dB
// of 16 bits are a root mean square of 2.1 HU; few pixels are more than some times as wrong. The library's filter
// writes the nearly lossless JPEG-LS without loss.
constexpr Encoding kEncodings[] = {
    {TransferSyntax::ImplicitVRLittleEndian, 0},
    {TransferSyntax::ExplicitVRLittleEndian, 0},
    {TransferSyntax::ExplicitVRBigEndian, 0},
    {TransferSyntax::DeflatedExplicitVRLittleEndian, 0},
    {TransferSyntax::RLELossless, 0},
    {TransferSyntax::JPEGLosslessProcess14, 0},
    {TransferSyntax::JPEGLosslessProcess14_1, 0},
    {TransferSyntax::JPEGLSLossless, 0},
    {TransferSyntax::JPEG2000Lossless, 0},
    {TransferSyntax::RLELossless, 8},
    {TransferSyntax::JPEGLosslessProcess14_1, 12},
    {TransferSyntax::JPEGBaselineProcess1, 8, 8, true},
    {TransferSyntax::JPEGExtendedProcess2_4, 12, 8, true},
    {TransferSyntax::JPEGLSNearLossless, 0, 0, true},
    {TransferSyntax::JPEG2000, 0, 20, true},
};

TEST(TransferSyntax, EveryOneGivesTheSameVoxelsOrSaysThatItDoesNot) {
  for (const Encoding& e : kEncodings) {
    SCOPED_TRACE(std::string(TransferSyntax::GetTSString(e.syntax)) + " with bits " + std::to_string(e.bits));
    const test::TempDir folder;
    const fs::path series = folder / "series";
    const imaging::HuVolume volume = smooth_volume(e.bits == 8 ? 250 : 3000);
    if (e.bits == 0)
      ASSERT_TRUE(write_dicom_series(volume, series, keep_going));
    else
      ASSERT_NO_FATAL_FAILURE(write_unsigned(series, volume, e.bits));
    ASSERT_NO_FATAL_FAILURE(encode(series, e.syntax));
    EXPECT_EQ(read_headers(files_of(series).front()).front().transfer_syntax, TransferSyntax::GetTSString(e.syntax));
    const auto scan = read_dicom_series(series, keep_going);
    ASSERT_TRUE(scan) << scan.error().message;
    ASSERT_EQ(scan->volume.dims, volume.dims);
    int worst = 0;
    for (std::size_t i = 0; i < volume.values.size(); ++i)
      worst = std::max(worst, std::abs(scan->volume.values[i] - volume.values[i]));
    EXPECT_LE(worst, e.tolerance_hu);
    EXPECT_EQ(worst > 0, e.tolerance_hu > 0) << "without loss, the tolerance tests nothing";
    const bool warned = report_lines(scan->report).find("3 of 3 slices were compressed with loss") != std::string::npos;
    EXPECT_EQ(warned, e.lossy);
    EXPECT_EQ(scan->source.ends_with(", compressed with loss"), e.lossy) << scan->source;
    if (e.lossy) std::printf("[          ] %s: %d HU\n", TransferSyntax::GetTSString(e.syntax), worst);
  }
}

TEST(TransferSyntax, PixelsThatWereOnceCompressedWithLossAreReported) {
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder / "series"));
  const auto files = files_of(folder / "series");
  set_tag(files[1], 0x0028, 0x2110, "01", gdcm::VR::CS);
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_NE(report_lines(scan->report)
                .find("warning    1 of " + std::to_string(files.size()) + " slices were compressed with loss"),
            std::string::npos);
}

TEST(TransferSyntax, OneWithoutADecoderIsOneSentence) {
  EXPECT_EQ(compression_of("1.2.840.10008.1.2.4.91", "00"), Compression::lossless);
  EXPECT_EQ(compression_of("1.2.840.10008.1.2.4.91", ""), Compression::lossy);
  EXPECT_EQ(compression_of("1.2.840.10008.1.2.4.53", ""), Compression::retired);
  const test::TempDir folder;
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder / "series"));
  for (const fs::path& file : files_of(folder / "series")) {
    std::string bytes = test::content(file);
    const std::string plain = "1.2.840.10008.1.2.1\0", video = "1.2.840.10008.1.2.8\0";
    const std::size_t at = bytes.find(plain);
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at, plain.size(), video);
    std::ofstream(file, std::ios::binary) << bytes;
  }
  const auto scan = read_dicom_series(folder / "series", keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), "files of an unknown transfer syntax; export the series uncompressed");
}

// Where the data set begins: after the preamble, the mark, and the elements of group 2, whose first gives their
// length.
std::size_t data_set_of(const std::string& bytes) {
  std::size_t length = 0;
  for (std::size_t i = 0; i < 4; ++i)
    length |= static_cast<std::size_t>(static_cast<unsigned char>(bytes[140 + i])) << 8 * i;
  return 144 + length;
}

TEST(TransferSyntax, AFileNeedsNoHeader) {
  const imaging::HuVolume volume = smooth_volume(3000);
  for (const auto syntax : {TransferSyntax::ImplicitVRLittleEndian, TransferSyntax::ExplicitVRLittleEndian,
                            TransferSyntax::ExplicitVRBigEndian})
    for (const bool with_group_2 : {true, false}) {
      SCOPED_TRACE(std::string(TransferSyntax::GetTSString(syntax)) + (with_group_2 ? " with group 2" : ""));
      const test::TempDir folder;
      ASSERT_TRUE(write_dicom_series(volume, folder / "series", keep_going));
      ASSERT_NO_FATAL_FAILURE(encode(folder / "series", syntax));
      for (const fs::path& file : files_of(folder / "series")) {
        const std::string bytes = test::content(file);
        std::ofstream(file, std::ios::binary) << bytes.substr(with_group_2 ? 132 : data_set_of(bytes));
      }
      const auto scan = read_dicom_series(folder / "series", keep_going);
      ASSERT_TRUE(scan) << scan.error().message;
      expect_same(scan->volume, volume);
    }
}

}  // namespace
}  // namespace osteon::import
