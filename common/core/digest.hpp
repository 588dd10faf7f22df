// SHA-256, which names cases, tools and field states.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon {

struct Digest {
  std::array<std::uint8_t, 32> bytes{};
  friend bool operator==(const Digest&, const Digest&) = default;
  friend auto operator<=>(const Digest&, const Digest&) = default;
};

// 64 lower-case hexadecimal digits.
[[nodiscard]] std::string to_hex(const Digest& digest);
[[nodiscard]] Result<Digest> digest_from_hex(std::string_view hex);

// Hashes data in order. Integers are little endian, floats are their bit pattern, strings include their length.
class Hasher {
 public:
  Hasher();
  void bytes(std::span<const std::byte> data);
  void integer(std::uint64_t value);
  void number(double value);
  void text(std::string_view value);
  [[nodiscard]] Digest finish();  // call once, last

 private:
  alignas(16) std::array<std::byte, 128> state_;  // SHA256_CTX of OpenSSL
};

}  // namespace osteon
