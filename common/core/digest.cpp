#include "common/core/digest.hpp"

#include <sodium.h>

#include <bit>

namespace osteon {
namespace {

crypto_hash_sha256_state* sodium_state(std::array<std::byte, 128>& storage) {
  static_assert(sizeof(crypto_hash_sha256_state) <= sizeof(storage));
  return reinterpret_cast<crypto_hash_sha256_state*>(storage.data());
}

}  // namespace

std::string to_hex(const Digest& digest) {
  char hex[2 * sizeof digest.bytes + 1];
  return sodium_bin2hex(hex, sizeof hex, digest.bytes.data(), digest.bytes.size());
}

Result<Digest> digest_from_hex(std::string_view hex) {
  Digest digest;
  if (hex.size() != 2 * digest.bytes.size())
    return failure(ErrorCode::invalid_input,
                   "a hash needs 64 hexadecimal digits, this has " + std::to_string(hex.size()));
  // libsodium also takes capitals. One digest has one text.
  const bool is_hex =
      sodium_hex2bin(digest.bytes.data(), digest.bytes.size(), hex.data(), hex.size(), nullptr, nullptr, nullptr) == 0;
  if (!is_hex || to_hex(digest) != hex)
    return failure(ErrorCode::invalid_input, "a hash has only the digits 0-9 and a-f");
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
