// What the targets of the import have in common: the file that a reader opens, and what a refusal must be.
#pragma once
#include <filesystem>
#include <random>
#include <span>
#include <string>

#include "common/core/result.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::fuzz {

// A file in a folder of its own, written anew for each input.
class InputFile {
 public:
  explicit InputFile(const std::string& name) : path_(folder_ / name) {}
  const std::filesystem::path& write(std::span<const std::uint8_t> data) const;
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_.path(); }

 private:
  test::TempDir folder_;
  std::filesystem::path path_;
};

[[nodiscard]] Bytes bytes_of_file(const std::filesystem::path& file);
[[nodiscard]] Bytes bytes_of_text(std::string_view text);

// A refusal says something, and never repeats a whole file.
void expect_bounded(const Error& error);

// For targets that read text: replaces one number of it by one that is hard to take.
void change_number(Bytes& input, std::mt19937& random);

}  // namespace osteon::fuzz
