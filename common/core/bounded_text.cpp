#include "common/core/bounded_text.hpp"

#include <algorithm>

namespace osteon {
namespace {

// Error texts with a slash that are not paths: "Input/output error" of the system, "disk I/O error" of SQLite.
bool is_of_an_error_text(std::string_view word) { return word == "Input/output" || word == "I/O"; }

}  // namespace

std::string bounded_text(std::string_view text, std::size_t most) {
  const auto is_inside_letter = [&](std::size_t at) { return (static_cast<unsigned char>(text[at]) & 0xc0u) == 0x80u; };
  std::size_t size = text.size();
  if (size > most) {
    size = most;
    while (size > 0 && is_inside_letter(size)) --size;
  }
  std::string bounded(text.substr(0, size));
  for (char& c : bounded)
    if (static_cast<unsigned char>(c) < 0x20u || c == 0x7f) c = ' ';
  // C1 control characters in UTF-8: U+0080 to U+009F.
  for (std::size_t i = 0; i + 1 < bounded.size(); ++i)
    if (bounded[i] == '\xc2' && static_cast<unsigned char>(bounded[i + 1]) < 0xa0u) bounded[i] = bounded[i + 1] = ' ';
  return size < text.size() ? bounded + " ..." : bounded;
}

std::string without_paths(std::string_view text) {
  constexpr std::string_view kAround = " \"'(),;=", kPartial = ".partial-";
  std::string kept;
  while (!text.empty()) {
    const std::size_t size = std::min(text.find_first_of(kAround), text.size());
    std::string_view word = text.substr(0, size);
    // A word that ends in a slash is a folder.
    while (word.size() > 1 && word.ends_with('/')) word.remove_suffix(1);
    if (!is_of_an_error_text(word)) word.remove_prefix(std::min(word.rfind('/') + 1, word.size()));
    kept += word.substr(0, word.find(kPartial));
    if (const std::size_t partial = word.find(kPartial); partial != word.npos) {
      word.remove_prefix(partial + kPartial.size());
      kept += word.substr(std::min(word.find_first_not_of("0123456789"), word.size()));
    }
    kept += text.substr(size, 1);
    text.remove_prefix(std::min(size + 1, text.size()));
  }
  return kept;
}

}  // namespace osteon
