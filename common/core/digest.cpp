#include "common/core/digest.hpp"

#include <sodium.h>

#include <bit>

namespace osteon {
namespace {

crypto_hash_sha256_state* sodium_state(std::array<std::byte, 128>& storage) {
  static_assert(sizeof(crypto_hash_sha256_state) <= sizeof(storage));
  return reinterpret_cast<crypto_hash_sha256_state*>(storage.data());
}

int nibble(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

}  // namespace

std::string to_hex(const Digest& digest) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  hex.reserve(2 * digest.bytes.size());
  for (const std::uint8_t byte : digest.bytes) {
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

Result<Digest> digest_from_hex(std::string_view hex) {
  Digest digest;
  if (hex.size() != 2 * digest.bytes.size())
    return failure(ErrorCode::invalid_input,
                   "a hash needs 64 hexadecimal digits, this has " + std::to_string(hex.size()));
  for (std::size_t i = 0; i < digest.bytes.size(); ++i) {
    const int high = nibble(hex[2 * i]);
    const int low = nibble(hex[2 * i + 1]);
    if (high < 0 || low < 0) return failure(ErrorCode::invalid_input, "a hash has only the digits 0-9 and a-f");
    digest.bytes[i] = static_cast<std::uint8_t>(16 * high + low);
  }
  return digest;
}

Hasher::Hasher() { crypto_hash_sha256_init(sodium_state(state_)); }

void Hasher::bytes(std::span<const std::byte> data) {
  crypto_hash_sha256_update(sodium_state(state_), reinterpret_cast<const unsigned char*>(data.data()), data.size());
}

void Hasher::integer(std::uint64_t value) {
  std::array<std::byte, 8> little;
  for (int i = 0; i < 8; ++i) little[static_cast<std::size_t>(i)] = static_cast<std::byte>(value >> (8 * i));
  bytes(little);
}

void Hasher::number(double value) { integer(std::bit_cast<std::uint64_t>(value)); }

void Hasher::text(std::string_view value) {
  integer(value.size());
  bytes(std::as_bytes(std::span(value)));
}

Digest Hasher::finish() {
  Digest digest;
  crypto_hash_sha256_final(sodium_state(state_), digest.bytes.data());
  return digest;
}

}  // namespace osteon
