// Unpacks files that may be DICOM from a zip, an ISO 9660 image or a tar.
#pragma once
#include <cstdint>
#include <filesystem>

#include "common/core/result.hpp"
#include "common/volume/iso_surface.hpp"
#include "server/import/found_files.hpp"

namespace osteon::import {

// A folder that only this user can read. It is removed with all its contents.
class TemporaryFolder {
 public:
  // Error: internal (no space, no permission), with the remedy.
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

// Numbers the files in `into`, so that no name in the archive becomes a name on the disk. Links, archives in the
// archive and files that cannot be DICOM are counted but not unpacked.
// Errors: invalid_input (damaged, encrypted, too many entries), exhausted (too many bytes), internal (disk), cancelled.
[[nodiscard]] Result<FoundFiles> unpack_archive(const std::filesystem::path& archive, const std::filesystem::path& into,
                                                const ArchiveLimits& limits, const KeepGoing& keep_going);

// The content of a tar, with or without gzip: an InVesalius project, other files, or no tar at all.
[[nodiscard]] InputKind tar_kind(const std::filesystem::path& archive, const KeepGoing& keep_going);

}  // namespace osteon::import
