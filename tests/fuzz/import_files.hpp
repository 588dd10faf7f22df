// What the targets of the import share: the file that a reader opens, and the check of an error.
#pragma once
#include <filesystem>
#include <random>
#include <span>
#include <string>

#include "common/core/result.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::fuzz {

// A file in a folder of its own. It is written anew for each input.
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

// Checks that an error has a message, and that the message does not repeat a whole file.
void expect_bounded(const Error& error);

// Replaces one number of a text by a dangerous one. For targets that read text.
void change_number(Bytes& input, std::mt19937& random);

}  // namespace osteon::fuzz
