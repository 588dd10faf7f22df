// Integers as 8 bytes, little endian, and random bytes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>

namespace osteon {

inline void put_integer(std::string& to, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) to += static_cast<char>(value >> (8 * i));
}

// The integer at an offset; `bytes` must go 8 bytes beyond it.
[[nodiscard]] inline std::uint64_t integer_at(std::string_view bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value |= std::uint64_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i);
  return value;
}

// The system's, which nobody can foresee.
[[nodiscard]] inline std::string random_bytes(std::size_t count) {
  std::random_device random;
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

}  // namespace osteon
