// The files of a scan's input: those of a folder, or those unpacked from an archive.
#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/volume/iso_surface.hpp"
#include "server/import/skipped_files.hpp"

namespace osteon::import {

struct FoundFile {
  std::filesystem::path path;
  std::string name;  // within the input, for people
};

struct FoundFiles {
  std::string input;  // as it was given
  bool archive = false;
  std::vector<FoundFile> files;  // sorted by name
  SkippedFiles skipped;          // everything that is not a regular file

  // "folder/inner/name", "archive.zip: inner/name"
  [[nodiscard]] std::string shown(std::size_t file) const;
};

inline constexpr int kMostFiles = 200'000;
inline constexpr int kMostLevels = 32;

// Regular files of a folder and of its subfolders, `levels` deep. A link to a file counts as a file; a link to a folder
// is not followed. Errors: not_found, invalid_input (too many files), cancelled.
[[nodiscard]] Result<FoundFiles> find_files(const std::filesystem::path& folder, int levels,
                                            const KeepGoing& keep_going);

// The kind of a file, according to its first bytes.
enum class Content { empty, dicom, archive, other };
inline constexpr std::size_t kHeadBytes = 4096;
// DICOM has its mark at byte 128. Files of old scanners instead begin with several valid elements of group 2 or 8;
// these are checked so that raw numbers are not mistaken for DICOM. `head`: the first kHeadBytes, or all of a shorter
// file.
[[nodiscard]] Content content_of(std::span<const unsigned char> head);

// How a path can be read as a scan.
enum class InputKind { absent, folder, archive, dicom_file, inv3, volume_file, other };
[[nodiscard]] InputKind input_kind(const std::filesystem::path& path, const KeepGoing& keep_going);

}  // namespace osteon::import
