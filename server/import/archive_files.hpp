// Unpacks what may be DICOM from a zip, an ISO 9660 image or a tar.
#pragma once
#include <cstdint>
#include <filesystem>

#include "common/core/result.hpp"
#include "common/volume/iso_surface.hpp"
#include "server/import/found_files.hpp"

namespace osteon::import {

// A folder that only this user can look into, removed with everything in it.
class TemporaryFolder {
 public:
  // Error: internal (no room, no permission), with the remedy.
  [[nodiscard]] static Result<TemporaryFolder> make();
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::move(other.path_)) { other.path_.clear(); }
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  explicit TemporaryFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

struct ArchiveLimits {
  int entries = kMostFiles;
  std::uint64_t bytes = std::uint64_t{64} << 30;
  std::uint64_t spare_bytes = std::uint64_t{256} << 20;  // left free on the disk
};

// Files are numbered in `into`; no name of the archive becomes one of the disk. Links, archives in the archive and what
// cannot be DICOM are counted, not unpacked.
// Errors: invalid_input (damaged, encrypted, too many entries), exhausted (too many bytes), internal (disk), cancelled.
[[nodiscard]] Result<FoundFiles> unpack_archive(const std::filesystem::path& archive, const std::filesystem::path& into,
                                                const ArchiveLimits& limits, const KeepGoing& keep_going);

// What a tar, packed by gzip or not, holds: an InVesalius project, other files, or nothing that is a tar.
[[nodiscard]] InputKind tar_kind(const std::filesystem::path& archive, const KeepGoing& keep_going);

}  // namespace osteon::import
