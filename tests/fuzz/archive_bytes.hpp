// Makes small archives in memory. The bytes are the same each time.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

struct ArchiveForm {
  const char* format = "zip";  // name of the format in libarchive: "zip", "iso9660", "pax"
  const char* zip_compression = "deflate";
  bool gzip = false;
};

// `files`: name and contents of each file.
[[nodiscard]] Bytes an_archive(const std::vector<std::pair<std::string, std::string>>& files, const ArchiveForm& form);

}  // namespace osteon::fuzz
