#include "common/core/bounded_text.hpp"

#include <algorithm>

namespace osteon {
namespace {

// Error texts with a slash that are not paths: "Input/output error" of the system, "disk I/O error" of SQLite.
bool is_of_an_error_text(std::string_view word) { return word == "Input/output" || word == "I/O"; }

// Bytes of the UTF-8 character with which the text begins, 1 to 4. 0: it begins with none.
std::size_t letter_bytes(std::string_view text) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
  const unsigned char first = byte(0);
  if (first < 0x80u) return 1;
  if (first < 0xc2u || first > 0xf4u) return 0;
  const std::size_t size = first < 0xe0u ? 2 : first < 0xf0u ? 3 : 4;
  if (text.size() < size) return 0;
  // Neither a form that is longer than needed, nor half of a UTF-16 pair, nor beyond U+10FFFF.
  const unsigned char low = first == 0xe0u ? 0xa0u : first == 0xf0u ? 0x90u : 0x80u;
  const unsigned char high = first == 0xedu ? 0x9fu : first == 0xf4u ? 0x8fu : 0xbfu;
  if (byte(1) < low || byte(1) > high) return 0;
  for (std::size_t at = 2; at < size; ++at)
    if ((byte(at) & 0xc0u) != 0x80u) return 0;
  return size;
}

// C0, DEL, and C1, which is U+0080 to U+009F.
bool is_control(std::string_view letter) {
  const auto last = static_cast<unsigned char>(letter.back());
  return letter.size() == 1 ? last < 0x20u || last == 0x7fu
                            : letter.size() == 2 && letter.front() == '\xc2' && last < 0xa0u;
}

}  // namespace

std::string bounded_text(std::string_view text, std::size_t most) {
  std::string bounded;
  bounded.reserve(std::min(text.size(), most));
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t valid = letter_bytes(text.substr(at)), size = std::max<std::size_t>(valid, 1);
    if (at + size > most) return bounded + " ...";
    const std::string_view letter = text.substr(at, size);
    if (valid == 0)
      bounded += '?';
    else if (is_control(letter))
      bounded.append(size, ' ');
    else
      bounded += letter;
    at += size;
  }
  return bounded;
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
