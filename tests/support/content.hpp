// What is in a file.
#pragma once
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace osteon::test {

// All of its bytes; empty where it cannot be read.
[[nodiscard]] inline std::string content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace osteon::test
