#include "common/core/digest.hpp"

// Its functions of before version 3 keep the state in the object itself, without an allocation.
#define OPENSSL_API_COMPAT 0x10100000L
#include <openssl/sha.h>
#include <sodium.h>

#include <bit>

namespace osteon {
namespace {

// OpenSSL uses the processor's instructions for SHA-256, which makes it six times as fast as libsodium.
SHA256_CTX* state_in(std::array<std::byte, 128>& storage) {
  static_assert(sizeof(SHA256_CTX) <= sizeof(storage) && alignof(SHA256_CTX) <= 16);
  return reinterpret_cast<SHA256_CTX*>(storage.data());
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

Hasher::Hasher() { SHA256_Init(state_in(state_)); }

void Hasher::bytes(std::span<const std::byte> data) { SHA256_Update(state_in(state_), data.data(), data.size()); }

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
  SHA256_Final(digest.bytes.data(), state_in(state_));
  return digest;
}

}  // namespace osteon
