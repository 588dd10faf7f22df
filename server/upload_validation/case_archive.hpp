// Packs a case into one zip archive, and unpacks it. The sender of an archive may be hostile. So no name in an archive
// becomes a path on the disk, and nothing is unpacked beyond a quota.
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

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"

namespace osteon {

struct UploadQuota {
  std::uint64_t archive_bytes = std::uint64_t{2} << 30;
  std::uint64_t unpacked_bytes = std::uint64_t{8} << 30;
  std::uint64_t kept_bytes = std::uint64_t{64} << 30;  // of all cases in the folder; unfinished uploads come on top
  // Memory of the process that checks a case. With its program it is 1 GiB.
  std::uint64_t memory_bytes = std::uint64_t{960} << 20;
  std::chrono::seconds time = std::chrono::minutes(5);  // time limit of the same process
  // Limits of an upload, because only few uploads run at once. A working connection delivers data every half minute. 2
  // GiB arrive within two hours over a line of 2.4 Mbit/s.
  std::chrono::milliseconds idle = std::chrono::seconds(30);  // without data
  std::chrono::milliseconds sending = std::chrono::hours(2);  // until all of it has arrived
  int entries = 16;
  double ratio = 200.0;  // unpacked to packed, once ratio_free_bytes are unpacked
  std::uint64_t ratio_free_bytes = std::uint64_t{1} << 20;
};

// The files of a case, the ones that it must have first. An archive may contain only these names, at its top or all in
// one folder.
inline constexpr std::string_view kCaseFiles[] = {"case.json", "bone.vdb", "scan.vdb"};
inline constexpr std::size_t kNeededCaseFiles = 2;

// Takes the next part of a file of the case. The parts of one file follow each other.
using PutPiece = std::function<Result<void>(std::string_view file, std::span<const std::byte> piece)>;

// Returns the files and their sizes. Errors: invalid_input (not a zip archive; damaged or encrypted; an entry that is
// not a plain file of a case, has a path of more than one folder or occurs twice; a missing file), exhausted (beyond a
// quota), and those of `put`. Each names the archive as `name`, the entry and the remedy.
[[nodiscard]] Result<std::map<std::string, std::uint64_t>> unpack_case(const std::filesystem::path& archive,
                                                                       const UploadQuota& quota, const PutPiece& put);
[[nodiscard]] Result<std::map<std::string, std::uint64_t>> unpack_case(std::span<const std::byte> archive,
                                                                       const std::string& name,
                                                                       const UploadQuota& quota, const PutPiece& put);

// Writes a case's folder as an archive. The same files always become the same bytes: case.json comes first, and entries
// have no time and no owner. Errors: not_found (no case there), internal (disk), cancelled. After an error the archive
// may be there in part.
[[nodiscard]] Result<void> pack_case(const std::filesystem::path& folder, const std::filesystem::path& archive,
                                     const KeepGoing& keep_going = {});

}  // namespace osteon
