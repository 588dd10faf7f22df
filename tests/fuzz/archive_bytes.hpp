// Small archives in memory, the same bytes each time.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

struct ArchiveForm {
  const char* format = "zip";  // as libarchive names it: "zip", "iso9660", "pax"
  const char* zip_compression = "deflate";
  bool gzip = false;
};

// `files`: names and contents.
[[nodiscard]] Bytes an_archive(const std::vector<std::pair<std::string, std::string>>& files, const ArchiveForm& form);

}  // namespace osteon::fuzz
