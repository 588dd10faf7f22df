#include "tests/fuzz/import_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <string_view>

#include "common/core/check.hpp"

namespace osteon::fuzz {

const std::filesystem::path& InputFile::write(std::span<const std::uint8_t> data) const {
  std::ofstream out(path_, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  OSTEON_CHECK(out.flush());
  return path_;
}

Bytes bytes_of_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  OSTEON_CHECK(in);
  return {std::istreambuf_iterator<char>(in), {}};
}

Bytes bytes_of_text(std::string_view text) { return {text.begin(), text.end()}; }

void expect_bounded(const Error& error) {
  constexpr std::size_t kLongest = 4096;
  OSTEON_CHECK(!error.message.empty() && error.message.size() <= kLongest);
}

void change_number(Bytes& input, std::mt19937& random) {
  constexpr std::array<std::string_view, 12> kHard{"0",    "-0",   "-1",         "1e308",       "-1e39",      "1e-320",
                                                   ".nan", ".inf", "2147483648", "-2147483649", "4294967296", "1e17"};
  const auto is_digit = [](std::uint8_t c) { return std::isdigit(c) != 0; };
  if (input.empty()) return;
  const auto from = input.begin() + static_cast<std::ptrdiff_t>(random() % input.size());
  const auto first = std::find_if(from, input.end(), is_digit);
  const auto last = std::find_if_not(first, input.end(), [&](std::uint8_t c) { return is_digit(c) || c == '.'; });
  const std::string_view hard = kHard[random() % kHard.size()];
  input.insert(input.erase(first, last), hard.begin(), hard.end());
}

}  // namespace osteon::fuzz
