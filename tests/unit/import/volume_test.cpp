// Volumes of one file. The tests write the files themselves, byte by byte, from the formats' own documents, so that the
// reader is compared with these and not with another program's opinion.
#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <span>
#include <sstream>

#include "server/import/found_files.hpp"
#include "server/import/volume_reader.hpp"
#include "tests/support/content.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// A volume of 3 x 4 x 5 voxels. Voxel (i, j, k) lies at axes * (i, j, k) + origin, in the file's own frame.
struct Volume {
  std::array<std::int16_t, 3> dims{3, 4, 5};
  Eigen::Matrix3d axes_mm = Vec3(0.5, 0.75, 2.0).asDiagonal();
  Vec3 origin_mm{10.0, -20.0, 30.0};
  [[nodiscard]] Vec3 position_mm(int i, int j, int k) const { return axes_mm * Vec3(i, j, k) + origin_mm; }
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(dims[0] * dims[1] * dims[2]); }
};
std::int16_t value_at(int i, int j, int k) { return static_cast<std::int16_t>(i + 10 * j + 100 * k - 250); }

template <class T = std::int16_t>
std::string voxels(const Volume& volume, T (*value)(int, int, int)) {
  std::string bytes;
  for (int k = 0; k < volume.dims[2]; ++k)
    for (int j = 0; j < volume.dims[1]; ++j)
      for (int i = 0; i < volume.dims[0]; ++i) {
        const T v = value(i, j, k);
        bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
      }
  return bytes;
}
std::string voxels(const Volume& volume) { return voxels<std::int16_t>(volume, value_at); }

template <class T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

struct NiftiType {
  std::int16_t code = 4, bits = 16;  // int16
};

// The header of NIfTI-1 (nifti1.h): 348 bytes and 4 of no extension. Its frame is RAS.
std::string nifti_header(const Volume& volume, NiftiType type = {}, std::int16_t times = 1) {
  std::string h(352, '\0');
  put(h, 0, std::int32_t{348});
  put(h, 40, static_cast<std::int16_t>(times > 1 ? 4 : 3));
  for (std::size_t d = 0; d < 3; ++d) {
    put(h, 42 + 2 * d, volume.dims[d]);
    put(h, 80 + 4 * d, static_cast<float>(volume.axes_mm.col(static_cast<Eigen::Index>(d)).norm()));
  }
  put(h, 48, times);
  put(h, 70, type.code);
  put(h, 72, type.bits);
  put(h, 76, 1.0f);
  put(h, 108, 352.0f);  // where the voxels begin
  h[123] = 2;           // millimetres
  put(h, 254, std::int16_t{1});
  for (Eigen::Index r = 0; r < 3; ++r) {
    const auto row = 280 + 16 * static_cast<std::size_t>(r);
    for (Eigen::Index c = 0; c < 3; ++c)
      put(h, row + 4 * static_cast<std::size_t>(c), static_cast<float>(volume.axes_mm(r, c)));
    put(h, row + 12, static_cast<float>(volume.origin_mm[r]));
  }
  h.replace(344, 3, "n+1");
  return h;
}

std::string triple(const Vec3& v) {
  std::ostringstream out;
  out << v.x() << "," << v.y() << "," << v.z();
  return out.str();
}

std::string nrrd_header(const Volume& volume, const std::string& space) {
  std::ostringstream h;
  h << "NRRD0004\ntype: int16\ndimension: 3\nspace: " << space << "\nsizes: " << volume.dims[0] << " " << volume.dims[1]
    << " " << volume.dims[2] << "\nspace directions:";
  for (Eigen::Index d = 0; d < 3; ++d) h << " (" << triple(volume.axes_mm.col(d)) << ")";
  h << "\nendian: little\nencoding: raw\nspace origin: (" << triple(volume.origin_mm) << ")\n\n";
  return h.str();
}

// The frame of MetaImage is LPS.
std::string meta_header(const Volume& volume) {
  std::ostringstream h;
  h << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
    << "TransformMatrix =";
  for (Eigen::Index d = 0; d < 3; ++d)
    for (Eigen::Index r = 0; r < 3; ++r) h << " " << volume.axes_mm(r, d) / volume.axes_mm.col(d).norm();
  h << "\nOffset = " << volume.origin_mm.x() << " " << volume.origin_mm.y() << " " << volume.origin_mm.z()
    << "\nElementSpacing =";
  for (Eigen::Index d = 0; d < 3; ++d) h << " " << volume.axes_mm.col(d).norm();
  h << "\nDimSize = " << volume.dims[0] << " " << volume.dims[1] << " " << volume.dims[2]
    << "\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  return h.str();
}

void write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

void write_compressed(const fs::path& file, const std::string& bytes) {
  const std::unique_ptr<archive, decltype(&archive_write_free)> a(archive_write_new(), archive_write_free);
  archive_write_add_filter_gzip(a.get());
  archive_write_set_format_raw(a.get());
  ASSERT_EQ(archive_write_open_filename(a.get(), file.c_str()), ARCHIVE_OK);
  const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(), archive_entry_free);
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  ASSERT_EQ(archive_write_header(a.get(), entry.get()), ARCHIVE_OK);
  ASSERT_EQ(archive_write_data(a.get(), bytes.data(), bytes.size()), static_cast<la_ssize_t>(bytes.size()));
  ASSERT_EQ(archive_write_close(a.get()), ARCHIVE_OK);
}

// Every voxel has its value at its position. `to_lps`: from the file's frame.
void expect_equal(const imaging::HuVolume& read, const Volume& volume, const Eigen::Matrix3d& to_lps) {
  ASSERT_EQ(read.dims, (std::array<int, 3>{volume.dims[0], volume.dims[1], volume.dims[2]}));
  for (int k = 0; k < volume.dims[2]; ++k)
    for (int j = 0; j < volume.dims[1]; ++j)
      for (int i = 0; i < volume.dims[0]; ++i) {
        const Vec3 at = read.voxel(to_lps * volume.position_mm(i, j, k));
        const Vec3 whole = at.array().round();
        ASSERT_LT((at - whole).norm(), 1e-4) << i << " " << j << " " << k;
        ASSERT_TRUE((whole.array() >= 0).all());
        ASSERT_EQ(read.at(static_cast<int>(whole.x()), static_cast<int>(whole.y()), static_cast<int>(whole.z())),
                  value_at(i, j, k));
      }
}

void expect_refused(const fs::path& file, const std::string& bytes, const std::string& why) {
  write(file, bytes);
  const auto scan = read_volume(file, keep_going);
  ASSERT_FALSE(scan) << why;
  expect_one_sentence(scan.error(), file.string());
  EXPECT_NE(scan.error().message.find(why), std::string::npos) << scan.error().message;
}

const Eigen::Matrix3d kFromRas = Vec3(-1.0, -1.0, 1.0).asDiagonal();
const Eigen::Matrix3d kFromLps = Eigen::Matrix3d::Identity();

// The axes of the file along those of the patient, in every order and with every sign: 48 volumes.
template <class Check>
void each_orientation(const Check& check) {
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Volume volume;
      volume.axes_mm.setZero();
      for (int d = 0; d < 3; ++d)
        volume.axes_mm(order[static_cast<std::size_t>(d)], d) = (signs >> d & 1 ? -1.0 : 1.0) * (0.5 + 0.25 * d);
      SCOPED_TRACE(testing::Message() << "order " << order[0] << order[1] << order[2] << ", signs " << signs);
      ASSERT_NO_FATAL_FAILURE(check(volume));
    }
  } while (std::ranges::next_permutation(order).found);
}

void expect_read(const fs::path& file, const std::string& bytes, const Volume& volume, const Eigen::Matrix3d& to_lps) {
  write(file, bytes);
  ASSERT_EQ(input_kind(file, keep_going), InputKind::volume_file);
  const auto scan = read_volume(file, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_equal(scan->volume, volume, to_lps);
}

TEST(VolumeFile, NiftiKeepsEveryOrientation) {
  const test::TempDir folder;
  each_orientation([&](const Volume& volume) {
    expect_read(folder / "a.nii", nifti_header(volume) + voxels(volume), volume, kFromRas);
  });
}

TEST(VolumeFile, NrrdKeepsEveryOrientationInBothFrames) {
  const test::TempDir folder;
  each_orientation([&](const Volume& volume) {
    expect_read(folder / "a.nrrd", nrrd_header(volume, "left-posterior-superior") + voxels(volume), volume, kFromLps);
    expect_read(folder / "b.nrrd", nrrd_header(volume, "right-anterior-superior") + voxels(volume), volume, kFromRas);
  });
}

TEST(VolumeFile, MetaImageKeepsEveryOrientation) {
  const test::TempDir folder;
  each_orientation([&](const Volume& volume) {
    expect_read(folder / "a.mha", meta_header(volume) + voxels(volume), volume, kFromLps);
  });
}

// Of a computer with the other order of bytes.
TEST(VolumeFile, NiftiOfTheOtherByteOrderIsTheSame) {
  const test::TempDir folder;
  const Volume volume;
  std::string bytes = nifti_header(volume) + voxels(volume);
  const auto swap = [&](std::size_t from, std::size_t to, std::ptrdiff_t size) {
    const auto begin = bytes.begin();
    for (auto at = begin + static_cast<std::ptrdiff_t>(from); at < begin + static_cast<std::ptrdiff_t>(to); at += size)
      std::reverse(at, at + size);
  };
  swap(0, 4, 4);      // size of the header
  swap(40, 56, 2);    // dimensions
  swap(68, 76, 2);    // type of the voxels
  swap(76, 120, 4);   // spacing, offset, scale
  swap(252, 256, 2);  // codes of the frames
  swap(256, 328, 4);  // frames
  swap(352, bytes.size(), 2);
  expect_read(folder / "a.nii", bytes, volume, kFromRas);
}

TEST(VolumeFile, NiftiKeepsATiltedScan) {
  const test::TempDir folder;
  Volume volume;
  volume.axes_mm =
      Eigen::AngleAxisd(0.35, Vec3(1.0, 2.0, -0.5).normalized()).toRotationMatrix() * Vec3(0.5, 0.75, 2.0).asDiagonal();
  expect_read(folder / "a.nii", nifti_header(volume) + voxels(volume), volume, kFromRas);
}

TEST(VolumeFile, ACompressedOneIsTheSame) {
  const test::TempDir folder;
  const Volume volume;
  ASSERT_NO_FATAL_FAILURE(write_compressed(folder / "a.nii.gz", nifti_header(volume) + voxels(volume)));
  ASSERT_EQ(input_kind(folder / "a.nii.gz", keep_going), InputKind::volume_file);
  const auto scan = read_volume(folder / "a.nii.gz", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_equal(scan->volume, volume, kFromRas);
}

TEST(VolumeFile, ScaledValuesBecomeHounsfieldUnits) {
  const test::TempDir folder;
  const Volume volume;
  std::string header = nifti_header(volume);
  put(header, 112, 2.0f);
  put(header, 116, -1000.0f);
  write(folder / "a.nii", header + voxels(volume));
  const auto scan = read_volume(folder / "a.nii", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.at(2, 3, 4), 2 * value_at(2, 3, 4) - 1000);
}

TEST(VolumeFile, EveryNumberFitsInInt16) {
  const test::TempDir folder;
  const Volume volume;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto value = [](int i, int j, int k) -> float {
    constexpr std::array<float, 6> kValues{
        std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, 1e30f, 99.6f, -99.6f};
    return j == 0 && k == 0   ? kValues[static_cast<std::size_t>(i)]
           : j == 1 && k == 0 ? kValues[static_cast<std::size_t>(3 + i)]
                              : 7.0f;
  };
  std::string header = nrrd_header(volume, "left-posterior-superior");
  header.replace(header.find("int16"), 5, "float");
  write(folder / "a.nrrd", header + voxels<float>(volume, value));
  const auto scan = read_volume(folder / "a.nrrd", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.at(0, 0, 0), -1024);
  EXPECT_EQ(scan->volume.at(1, 0, 0), -1024);
  EXPECT_EQ(scan->volume.at(2, 0, 0), -1024);
  EXPECT_EQ(scan->report.without_number, 3);
  EXPECT_EQ(scan->volume.at(0, 1, 0), 32767);
  EXPECT_EQ(scan->volume.at(1, 1, 0), 100);
  EXPECT_EQ(scan->volume.at(2, 1, 0), -100);
  EXPECT_EQ(scan->volume.at(0, 2, 0), 7);
}

// A real 0 stays 0, so voxels without a number are not known by what the library of NIfTI makes of them.
TEST(VolumeFile, WhatIsNoNumberInNiftiIsAirAndCounted) {
  const test::TempDir folder;
  const Volume volume;
  const auto single = [](int i, int j, int k) -> float {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (j != 0 || k != 2) return i == 0 ? 0.0f : 99.6f;
    return i == 0 ? std::numeric_limits<float>::quiet_NaN() : i == 1 ? kInfinity : -kInfinity;
  };
  const auto twice = [](int i, int j, int k) -> double {
    if (j != 0 || k != 2) return i == 0 ? 0.0 : 99.6;
    return i == 0 ? std::numeric_limits<double>::quiet_NaN() : i == 1 ? HUGE_VAL : -HUGE_VAL;
  };
  // The same with the other order of bytes: the header's fields of 16 and of 32 bits that are not 0, and the voxels.
  std::string swapped = nifti_header(volume, {16, 32}) + voxels<float>(volume, single);
  const auto swap = [&](std::size_t first, std::size_t end, std::ptrdiff_t bytes) {
    for (auto at = swapped.begin() + static_cast<std::ptrdiff_t>(first);
         at != swapped.begin() + static_cast<std::ptrdiff_t>(end); at += bytes)
      std::reverse(at, at + bytes);
  };
  swap(0, 4, 4), swap(40, 56, 2), swap(70, 74, 2), swap(76, 120, 4), swap(252, 256, 2), swap(280, 328, 4);
  swap(352, swapped.size(), 4);
  write(folder / "single.nii", nifti_header(volume, {16, 32}) + voxels<float>(volume, single));
  write(folder / "double.nii", nifti_header(volume, {64, 64}) + voxels<double>(volume, twice));
  write(folder / "swapped.nii", swapped);
  write_compressed(folder / "packed.nii.gz", nifti_header(volume, {16, 32}) + voxels<float>(volume, single));
  for (const char* name : {"single.nii", "double.nii", "swapped.nii", "packed.nii.gz"}) {
    const auto scan = read_volume(folder / name, keep_going);
    ASSERT_TRUE(scan) << scan.error().message;
    for (int k = 0; k < 5; ++k)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 3; ++i)
          EXPECT_EQ(scan->volume.at(i, j, k), j == 0 && k == 2 ? -1024 : i == 0 ? 0 : 100) << name;
    EXPECT_EQ(scan->report.without_number, 3) << name;
    EXPECT_EQ(report_lines(scan->report), "warning    3 voxels have no finite number: they count as air\n");
  }
}

TEST(VolumeFile, TheSourceSaysNothingOfThePatient) {
  const test::TempDir folder;
  const Volume volume;
  std::string header = nifti_header(volume);
  header.replace(148, 8, "Somebody");  // its description
  write(folder / "Somebody.nii", header + voxels(volume));
  const auto scan = read_volume(folder / "Somebody.nii", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->source, "NIfTI CT, 3x4x5, 0.5x0.75x2 mm");
}

TEST(VolumeFile, RefusesWhatIsNoScan) {
  const test::TempDir folder;
  const Volume volume;
  expect_refused(folder / "a.nii", "a letter", "neither NIfTI nor NRRD nor MetaImage");
  expect_refused(folder / "b.img", nifti_header(volume) + voxels(volume), "let its name end in .nii");
  expect_refused(folder / "c.nii", nifti_header(volume, {128, 24}) + std::string(3 * volume.count(), '\0'), "colours");
  expect_refused(folder / "d.nii", nifti_header(volume, {}, 2) + voxels(volume) + voxels(volume), "2 volumes");
  Volume flat;
  flat.dims[2] = 1;
  expect_refused(folder / "e.nii", nifti_header(flat) + voxels(flat), "1 voxels along an axis");
  Volume skewed;
  skewed.axes_mm(0, 1) = 0.4;
  expect_refused(folder / "f.nrrd", nrrd_header(skewed, "left-posterior-superior") + voxels(skewed), "right angles");
  std::string second(544, '\0');
  put(second, 0, std::int32_t{540});
  second.replace(4, 3, "n+2");
  expect_refused(folder / "h.nii", second, "save it as NIfTI-1");
  Volume sheared;
  sheared.axes_mm(0, 1) = 0.4;
  expect_refused(folder / "i.nii", nifti_header(sheared) + voxels(sheared), "right angles");
  ASSERT_NO_FATAL_FAILURE(write_compressed(folder / "packed", nifti_header(volume) + voxels(volume)));
  expect_refused(folder / "j.nii", test::content(folder / "packed"), "let its name end in .nii.gz");
  Volume still;
  still.axes_mm.setZero();
  expect_refused(folder / "g.nii", nifti_header(still) + voxels(still), "");
  const auto absent = read_volume(folder / "absent.nii", keep_going);
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().code, ErrorCode::not_found);
}

TEST(VolumeFile, RefusesATruncatedOne) {
  const test::TempDir folder;
  const Volume volume;
  for (const auto& [name, bytes] : {std::pair<std::string, std::string>("a.nii", nifti_header(volume) + voxels(volume)),
                                    {"a.nrrd", nrrd_header(volume, "left-posterior-superior") + voxels(volume)},
                                    {"a.mha", meta_header(volume) + voxels(volume)}})
    for (const std::size_t kept : {bytes.size() - 1, bytes.size() - voxels(volume).size(), std::size_t{100}})
      expect_refused(folder / name, bytes.substr(0, std::min(kept, bytes.size())), "");
}

TEST(VolumeFile, RefusesATruncatedCompressedOne) {
  const test::TempDir folder;
  const Volume volume;
  ASSERT_NO_FATAL_FAILURE(write_compressed(folder / "whole.nii.gz", nifti_header(volume) + voxels(volume)));
  const std::string whole = test::content(folder / "whole.nii.gz");
  for (const std::size_t missing : {9, 20, 60})
    expect_refused(folder / "a.nii.gz", whole.substr(0, whole.size() - missing), "");
  // A whole archive of a file that ends early.
  const std::string file = nifti_header(volume) + voxels(volume);
  ASSERT_NO_FATAL_FAILURE(write_compressed(folder / "b.nii.gz", file.substr(0, file.size() - 1)));
  const auto scan = read_volume(folder / "b.nii.gz", keep_going);
  ASSERT_FALSE(scan);
  expect_one_sentence(scan.error(), (folder / "b.nii.gz").string());
}

// Writes a header, its voxels in another file, and tries to read them whole, without their end, and not at all.
void expect_both_needed(const fs::path& file, const std::string& header, const fs::path& data, const Volume& volume,
                        const Eigen::Matrix3d& to_lps) {
  write(data, voxels(volume));
  ASSERT_NO_FATAL_FAILURE(expect_read(file, header, volume, to_lps));
  const std::string whole = test::content(data);
  write(data, whole.substr(0, whole.size() - 1));
  const auto cut = read_volume(file, keep_going);
  ASSERT_FALSE(cut) << file;
  expect_one_sentence(cut.error(), data.string());
  fs::remove(data);
  const auto alone = read_volume(file, keep_going);
  ASSERT_FALSE(alone) << file;
  expect_one_sentence(alone.error(), file.string());
}

TEST(VolumeFile, ReadsVoxelsFromTheFileBesideAndNeedsAllOfThem) {
  const test::TempDir folder;
  const Volume volume;
  std::string nifti = nifti_header(volume);
  nifti.replace(344, 3, "ni1");
  put(nifti, 108, 0.0f);
  expect_both_needed(folder / "a.hdr", nifti, folder / "a.img", volume, kFromRas);
  std::string nrrd = nrrd_header(volume, "left-posterior-superior");
  nrrd.insert(nrrd.size() - 1, "data file: b.raw\n");
  expect_both_needed(folder / "b.nhdr", nrrd, folder / "b.raw", volume, kFromLps);
  std::string meta = meta_header(volume);
  meta.replace(meta.find("LOCAL"), 5, "c.raw");
  expect_both_needed(folder / "c.mhd", meta, folder / "c.raw", volume, kFromLps);
  meta.replace(meta.find("c.raw"), 5, "c%02d.raw 1 5 1");
  expect_refused(folder / "d.mhd", meta, "");
}

// Another program's NRRD: compressed behind its header.
TEST(VolumeFile, ReadsACompressedNrrdAndNeedsAllOfIt) {
  const test::TempDir folder;
  const Volume volume;
  ASSERT_NO_FATAL_FAILURE(write_compressed(folder / "voxels.gz", voxels(volume)));
  std::string header = nrrd_header(volume, "left-posterior-superior");
  header.replace(header.find("raw"), 3, "gzip");
  const std::string packed = test::content(folder / "voxels.gz");
  expect_read(folder / "a.nrrd", header + packed, volume, kFromLps);
  expect_refused(folder / "b.nrrd", header + packed.substr(0, packed.size() - 30), "ends before its last voxel");
}

// The libraries do not compare gzip's checksum, and give other voxels. A large volume is unpacked in several parts.
TEST(VolumeFile, RefusesACompressedFileWithAChangedBit) {
  const test::TempDir folder;
  const Volume small, large{.dims = {128, 128, 40}};
  const auto refuses = [&](const Volume& volume, std::size_t first, std::size_t step, const std::string& why) {
    ASSERT_NO_FATAL_FAILURE(write_compressed(folder / "voxels.gz", voxels(volume)));
    std::string header = nrrd_header(volume, "left-posterior-superior");
    header.replace(header.find("raw"), 3, "gzip");
    const std::string packed = test::content(folder / "voxels.gz");
    for (std::size_t i = first < packed.size() ? first : packed.size() - 8; i < packed.size(); i += step) {
      std::string changed = packed;
      changed[i] = static_cast<char>(changed[i] ^ 1 << i % 8);
      expect_refused(folder / ("changed" + std::to_string(i) + ".nrrd"), header + changed, why);
    }
  };
  refuses(small, 10, 5, "copy or export it again");  // behind gzip's own header
  constexpr std::size_t kFromTheChecksum = std::string::npos;
  refuses(large, kFromTheChecksum, 3, "its checksum is not that of its bytes");
}

// The library reads zeros from it.
TEST(VolumeFile, RefusesACompressedMetaImageWithoutItsSize) {
  const test::TempDir folder;
  std::string header = meta_header(Volume());
  header.replace(header.find("CompressedData = False"), 22, "CompressedData = True");
  expect_refused(folder / "a.mha", header + "x\x9c", "CompressedDataSize");
  header.insert(header.find("DimSize"), "CompressedDataSize = 100\n");
  expect_refused(folder / "b.mha", header + "x\x9c", "ends before its last voxel");
}

TEST(VolumeFile, SaysWhenLeftAndRightAreAGuess) {
  const test::TempDir folder;
  const Volume volume;
  std::string header = nifti_header(volume);
  put(header, 254, std::int16_t{0});
  write(folder / "a.nii", header + voxels(volume));
  const auto scan = read_volume(folder / "a.nii", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_NE(scan->source.find("left and right may be swapped"), std::string::npos) << scan->source;
}

TEST(VolumeFile, RefusesAClaimOfMoreThanItHolds) {
  const test::TempDir folder;
  Volume huge;
  huge.dims = {16000, 16000, 16000};
  expect_refused(folder / "a.nii", nifti_header(huge), "");
  ASSERT_NO_FATAL_FAILURE(write_compressed(folder / "a.nii.gz", nifti_header(huge)));
  const auto scan = read_volume(folder / "a.nii.gz", keep_going);
  ASSERT_FALSE(scan);
  EXPECT_NE(scan.error().message.find("ends before its last voxel"), std::string::npos) << scan.error().message;
}

TEST(VolumeFile, CanBeStopped) {
  const test::TempDir folder;
  const Volume volume;
  write(folder / "a.nii", nifti_header(volume) + voxels(volume));
  const auto scan = read_volume(folder / "a.nii", [](double done) { return done < 0.6; });
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().code, ErrorCode::cancelled);
}

// A header with a flipped bit is another header: it is refused, or read as another volume, but it neither hangs nor
// ends this process.
TEST(VolumeFile, EveryFlippedBitOfAHeaderIsSurvived) {
  const test::TempDir folder;
  const Volume volume;
  const std::string whole = nifti_header(volume) + voxels(volume);
  int refused = 0;
  for (std::size_t at = 0; at < 352; at += 7) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << at % 7));
    write(folder / "a.nii", bytes);
    const auto scan = read_volume(folder / "a.nii", keep_going);
    refused += scan ? 0 : 1;
    if (scan) {
      EXPECT_EQ(scan->volume.values.size(), scan->volume.count()) << at;
    }
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace osteon::import
