// The segments of a DICOM SEG file, frame by frame.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/imaging/components.hpp"

namespace osteon::import {

struct DicomSegment {
  int number = 0;
  std::string label, type;  // SegmentLabel; meaning of the coded type, such as "Femur"
};

struct DicomSegmentation {
  std::string frame_of_reference;
  std::array<std::int32_t, 3> dims{};  // columns, rows, slices; slices without a frame have no voxels
  std::array<double, 3> spacing_mm{};
  std::array<double, 3> origin_mm{};  // LPS
  std::array<double, 6> axes{};       // of columns and rows; slices go along their cross product
  std::vector<DicomSegment> segments;
};

// Frames lie by their Image Position and Orientation (Patient), in any order. `name`: of the file, for people.
// `on_header` is called once, and then `on_frame` for each frame with the index of its segment and the runs of its
// voxels. GDCM may abort on a damaged file, so call this in a process that may die. Errors: invalid_input (no
// segmentation, damaged, frames that lie on no grid), unsupported (fractional, compressed, big-endian).
[[nodiscard]] Result<void> read_segmentation(
    const std::filesystem::path& file, const std::string& name,
    const std::function<void(const DicomSegmentation&)>& on_header,
    const std::function<void(std::size_t segment, const std::vector<imaging::VoxelRun>&)>& on_frame);

}  // namespace osteon::import
