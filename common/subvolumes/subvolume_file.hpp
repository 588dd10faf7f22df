// The files of sub-volumes (Niu 2008, §5.2.1): a Meta file that lists them, and SBB1.dat, SBB2.dat ... with the HU of
// a section each. Text has exactly one form. What differs from it is refused, so a file that was read is written back
// to the same bytes.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/subvolumes/bone_voxels.hpp"

namespace osteon::subvolumes {

inline constexpr int kLargestFileAxis = 1 << 14;  // voxels along an axis of a file
inline constexpr int kMostFiles = 1 << 14;        // that a Meta file lists
inline constexpr const char* kMetaFile = "Meta.dat";

// The first and the last column of bone in a row, over all slices of the section; both −1 if there is none.
struct RowBoundary {
  int first = -1, last = -1;
  friend bool operator==(const RowBoundary&, const RowBoundary&) = default;
};

// The content of SBBn.dat. Position and spacing are mm along the columns, rows and slices of the scan, from the origin
// of the bone's frame. These are x, y and z of LPS if the scan lies straight.
struct SubVolumeData {
  std::array<int, 3> dims{};  // columns, rows, slices
  std::array<double, 3> spacing_mm{1.0, 1.0, 1.0};
  std::array<double, 3> origin_mm{};  // of the first voxel's centre
  std::vector<RowBoundary> boundary;  // one for each row
  std::vector<std::int16_t> hu;       // columns fastest, then rows, then slices
  friend bool operator==(const SubVolumeData&, const SubVolumeData&) = default;
};

struct MetaEntry {
  std::string file;     // SBB1.dat for the first, and so on
  int start_slice = 0;  // of the scan, from 0
  int slices = 0;
  int subdivisions = 0;  // of this sub-volume
  friend bool operator==(const MetaEntry&, const MetaEntry&) = default;
};

struct MetaFile {
  std::string directory = ".";  // of the files; relative to the Meta file, unless it is absolute
  std::vector<MetaEntry> entries;
  friend bool operator==(const MetaFile&, const MetaFile&) = default;
};

// The data of a section of the scan.
[[nodiscard]] SubVolumeData data_of(const BoneVoxels& voxels, const CoordBox& section);
// The Meta file of sections, in the order of their slices.
[[nodiscard]] MetaFile meta_of(const std::vector<CoordBox>& sections, int subdivisions);

[[nodiscard]] std::string to_text(const SubVolumeData& data);
[[nodiscard]] std::string to_text(const MetaFile& meta);
// Bytes of the text for a box of the scan, without making it.
[[nodiscard]] std::int64_t text_bytes(const BoneVoxels& voxels, const CoordBox& box);

// `name`: of the file, for errors. The text may come from anywhere. Errors: invalid_input, naming the file, the line
// and what it must be.
[[nodiscard]] Result<SubVolumeData> parse_sub_volume(std::string_view text, const std::string& name);
[[nodiscard]] Result<MetaFile> parse_meta(std::string_view text, const std::string& name);

// Reads a Meta file and all files that it lists. Errors: not_found (no such file), invalid_input (as above, or a file
// does not fit the Meta file), cancelled.
[[nodiscard]] Result<std::vector<SubVolumeData>> read_sub_volumes(const std::filesystem::path& meta_file,
                                                                  const KeepGoing& keep_going);

}  // namespace osteon::subvolumes
