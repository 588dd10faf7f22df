// Zip archives in memory, which can contain whatever an attacker may put in.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace osteon::test {

using Bytes = std::vector<std::byte>;

// Kinds of entries, as in a file's mode.
inline constexpr unsigned kFileEntry = 0100000, kFolderEntry = 0040000, kLinkEntry = 0120000;

struct Entry {
  std::string path;
  std::string content{};
  std::string link{};  // target of a symbolic link
  bool hard = false;   // a hard link
  unsigned type = kFileEntry;
};

// libarchive makes it. `options`: of its zip writer; with some the archive is encrypted.
[[nodiscard]] Bytes zip(const std::vector<Entry>& entries, const char* options = nullptr);

}  // namespace osteon::test
