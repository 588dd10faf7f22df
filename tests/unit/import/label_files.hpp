// Label maps of all kinds, written byte by byte from the formats' own documents, so that the readers are compared with
// these and not with a library's opinion.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/geometry/pose.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

// Voxels on a grid: voxel (i, j, k) lies at origin + axes * (i, j, k), LPS.
struct TestGrid {
  std::array<int, 3> dims{};
  Vec3 origin_mm = Vec3::Zero();
  Eigen::Matrix3d axes_mm = Eigen::Matrix3d::Identity();

  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
  }
  [[nodiscard]] Vec3 position_mm(int i, int j, int k) const { return origin_mm + axes_mm * Vec3(i, j, k); }
};
// The label at a position; 0: none.
using LabelAt = std::function<int(const Vec3& position_mm)>;
// One number for each voxel, columns fastest.
[[nodiscard]] std::vector<int> labels_of(const TestGrid& grid, const LabelAt& label_at);

// The same voxels, with axis d of the new grid along axis order[d] of the old one, backwards if flipped[d].
[[nodiscard]] TestGrid turned(const TestGrid& grid, const std::array<int, 3>& order,
                              const std::array<bool, 3>& flipped);

// Voxels as numbers of type T.
template <class T>
[[nodiscard]] std::string bytes_of(const std::vector<int>& values) {
  std::string bytes;
  for (const int value : values) {
    const T v = static_cast<T>(value);
    bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  return bytes;
}

// A NIfTI-1 file (nifti1.h) in RAS. `code`: 2 uint8, 4 int16, 16 float32, 512 uint16. `names`: header extension with
// the LabelTable of Caret.
struct NiftiVoxels {
  std::int16_t code = 2, bits = 8;
  std::string bytes;
};
[[nodiscard]] std::string nifti_file(const TestGrid& grid, const NiftiVoxels& voxels,
                                     const std::vector<std::pair<int, std::string>>& names = {});
[[nodiscard]] std::string nifti_file(const TestGrid& grid, const LabelAt& label_at);

// A NRRD file of bytes with fields of its header, in LPS. `layers`: numbers of each voxel. Compressed by gzip.
[[nodiscard]] std::string nrrd_file(const TestGrid& grid, const std::vector<int>& values, int layers,
                                    const std::string& fields);
// Fields of one segment of 3D Slicer.
[[nodiscard]] std::string slicer_segment(int number, const std::string& name, int value, int layer,
                                         const std::string& tags = "Segmentation.Status:inprogress|");

[[nodiscard]] std::string compressed(const std::string& bytes);
[[nodiscard]] std::string uncompressed(const std::string& bytes);

// A DICOM SEG file (PS3.3 A.51), explicit little endian.
struct SegSegment {
  int number = 1;
  std::string label, type;  // type: meaning of its coded type
  std::vector<int> mask;    // of the grid's voxels: not 0 in the segment
};
struct SegOptions {
  std::string type = "BINARY", sop_class = "1.2.840.10008.5.1.4.1.1.66.4", syntax = "1.2.840.10008.1.2.1";
  std::string frame_of_reference = "1.2.3.4";
  double slice_gap_mm = 0.0;       // SpacingBetweenSlices; 0: not in the file
  bool without_positions = false;  // of the frames
  bool with_empty_frames = false;  // a frame for each slice of each segment
  double shift_mm = 0.0;           // of the last frame, along the columns
  std::size_t missing_bytes = 0;   // of the pixels
  int listed_number = 0;           // that frames name instead of the segment's own
};
// Frames come from the last slice to the first.
[[nodiscard]] std::string seg_file(const TestGrid& grid, const std::vector<SegSegment>& segments,
                                   const SegOptions& options = {});

void write_bytes(const std::filesystem::path& file, const std::string& bytes);

// A scan on the voxels of a grid whose axes are at right angles, with the HU at each position.
[[nodiscard]] CtScan scan_of(const TestGrid& grid, const std::function<int(const Vec3& position_mm)>& hu_at);

}  // namespace osteon::import
