// A case as one zip archive, made and taken apart. Whoever sends an archive may mean harm: nothing of it names a place
// on the disk, and it is unpacked no further than a quota goes.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon {

struct UploadQuota {
  std::uint64_t archive_bytes = std::uint64_t{2} << 30;
  std::uint64_t unpacked_bytes = std::uint64_t{8} << 30;
  std::uint64_t kept_bytes = std::uint64_t{64} << 30;  // of all cases in the folder; what is under way comes on top
  std::uint64_t memory_bytes = std::uint64_t{960}
                               << 20;  // of the process that looks a case through; with its program 1 GiB
  std::chrono::seconds time = std::chrono::minutes(5);  // and its time
  // Of an upload, which holds one of few places: a line that is well has something in half a minute, and 2 GiB come
  // within two hours over one of 2.4 Mbit/s.
  std::chrono::milliseconds idle = std::chrono::seconds(30);  // without a piece
  std::chrono::milliseconds sending = std::chrono::hours(2);  // until all of it has come
  int entries = 16;
  double ratio = 200.0;  // unpacked to packed, once ratio_free_bytes are unpacked
  std::uint64_t ratio_free_bytes = std::uint64_t{1} << 20;
};

// The files of a case, by which alone an archive may name its entries, at its top or all in one folder.
inline constexpr std::string_view kCaseFiles[] = {"case.json", "bone.vdb"};

// The next piece of a file of the case; pieces of one file come one after the other.
using PutPiece = std::function<Result<void>(std::string_view file, std::span<const std::byte> piece)>;

// Files and their sizes. Errors: invalid_input (no zip archive, damaged, encrypted, an entry that is no plain file of a
// case, is named by a path beyond one folder or comes twice, a file that is missing), exhausted (beyond a quota), and
// those of `put`. Each names the archive as `name`, the entry and the remedy.
[[nodiscard]] Result<std::map<std::string, std::uint64_t>> unpack_case(const std::filesystem::path& archive,
                                                                       const UploadQuota& quota, const PutPiece& put);
[[nodiscard]] Result<std::map<std::string, std::uint64_t>> unpack_case(std::span<const std::byte> archive,
                                                                       const std::string& name,
                                                                       const UploadQuota& quota, const PutPiece& put);

// Writes a case's folder as an archive. Errors: not_found (no case there), internal (disk).
[[nodiscard]] Result<void> pack_case(const std::filesystem::path& folder, const std::filesystem::path& archive);

}  // namespace osteon
