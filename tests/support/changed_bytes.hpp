// Seeded changes of a file's bytes, as a disk, a line or an attacker makes them.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

namespace osteon::test {

// Changes one to three bytes. Half of the changes are in the first `head` bytes.
inline std::string changed_bytes(std::string bytes, std::mt19937& random, std::size_t head = 1200) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  for (std::size_t changes = 1 + below(3); changes > 0; --changes) {
    const std::size_t at = below(below(2) == 0 ? std::min(head, bytes.size()) : bytes.size());
    const auto flip = below(2) == 0 ? std::uint8_t{1} << below(8) : 1 + below(255);
    bytes[at] = static_cast<char>(static_cast<std::uint8_t>(bytes[at]) ^ flip);
  }
  return bytes;
}

}  // namespace osteon::test
