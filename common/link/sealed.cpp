#include "common/link/sealed.hpp"

#include <sodium.h>

#include <algorithm>
#include <limits>

#include "common/core/check.hpp"

namespace osteon {
namespace {

constexpr std::size_t kGenerationAt = 4, kCounterAt = 5, kHeaderBytes = 13, kTagBytes = 16;
static_assert(kHeaderBytes + kTagBytes == kSealBytes);
static_assert(kTagBytes == crypto_aead_chacha20poly1305_ietf_ABYTES);
static_assert(sizeof(SealKey::bytes) == crypto_aead_chacha20poly1305_ietf_KEYBYTES);
static_assert(sizeof(SealKey::bytes) == crypto_kdf_KEYBYTES);

// Chooses the fastest code for the processor. Any thread, any number of times.
void ready_sodium() { OSTEON_CHECK(sodium_init() >= 0); }

void put_little(std::uint64_t value, std::span<std::uint8_t> into) {
  for (std::size_t i = 0; i < into.size(); ++i) into[i] = static_cast<std::uint8_t>(value >> 8 * i);
}

std::uint64_t little(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value |= std::uint64_t{bytes[i]} << 8 * i;
  return value;
}

struct Nonce {
  std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES> bytes{};
  explicit Nonce(std::uint64_t counter) { put_little(counter, std::span(bytes).subspan<4>()); }
};

bool authentic(std::span<const std::uint8_t> datagram, const Nonce& nonce, const SealKey& key,
               std::span<std::uint8_t> into) {
  const auto header = datagram.first(kHeaderBytes), body = datagram.subspan(kHeaderBytes);
  return crypto_aead_chacha20poly1305_ietf_decrypt(into.data(), nullptr, nullptr, body.data(), body.size(),
                                                   header.data(), header.size(), nonce.bytes.data(),
                                                   key.bytes.data()) == 0;
}

}  // namespace

SealKey::~SealKey() { sodium_memzero(bytes.data(), bytes.size()); }

std::optional<SealKey> key_of(std::span<const std::uint8_t> bytes) noexcept {
  SealKey key;
  if (bytes.size() != key.bytes.size()) return {};
  std::ranges::copy(bytes, key.bytes.begin());
  return key;
}

SessionKeys make_session_keys(std::uint32_t session, const FillRandom& random) {
  SessionKeys keys{session, {}, {}};
  random(keys.up.bytes);
  random(keys.down.bytes);
  return keys;
}

SealKey next_key(const SealKey& key) noexcept {
  SealKey next;
  crypto_kdf_derive_from_key(next.bytes.data(), next.bytes.size(), 1, "osteonUD", key.bytes.data());
  return next;
}

Sealer::Sealer(std::uint32_t session, const SealKey& key, const SealRules& rules)
    : session_(session), rules_(rules), key_(key), counter_(rules.first_counter) {
  ready_sodium();
}

std::span<const std::uint8_t> Sealer::seal(std::span<const std::uint8_t> plain, std::chrono::nanoseconds now,
                                           std::span<std::uint8_t> into) noexcept {
  OSTEON_CHECK(plain.size() <= kMostPlainBytes && into.size() >= plain.size() + kSealBytes);
  // otherwise the next counter would be 0, which was used before
  OSTEON_CHECK(counter_ != std::numeric_limits<std::uint64_t>::max());
  if (under_key_ > 0 && (now - began_ >= rules_.rekey_after || under_key_ >= rules_.rekey_packets)) {
    key_ = next_key(key_);
    ++generation_;
    under_key_ = 0;
  }
  if (under_key_++ == 0) began_ = now;

  const auto datagram = into.first(plain.size() + kSealBytes), header = datagram.first(kHeaderBytes);
  put_little(session_, header.first(kGenerationAt));
  header[kGenerationAt] = static_cast<std::uint8_t>(generation_);
  put_little(counter_, header.subspan(kCounterAt));
  crypto_aead_chacha20poly1305_ietf_encrypt(datagram.data() + kHeaderBytes, nullptr, plain.data(), plain.size(),
                                            header.data(), header.size(), nullptr, Nonce(counter_).bytes.data(),
                                            key_.bytes.data());
  ++counter_;
  return datagram;
}

Opener::Opener(std::uint32_t session, const SealKey& key, const SealRules& rules)
    : session_(session), rules_(rules), key_(key) {
  ready_sodium();
}

void Opener::expire(std::chrono::nanoseconds now) noexcept {
  if (previous_ && now >= previous_until_) previous_.reset();  // its destructor erases it
}

std::optional<Opened> Opener::open(std::span<const std::uint8_t> datagram, std::chrono::nanoseconds now,
                                   std::span<std::uint8_t> into) noexcept {
  OSTEON_CHECK(into.size() >= kMostPlainBytes);
  expire(now);
  if (datagram.size() < kSealBytes || datagram.size() > kMostDatagramBytes || session_of(datagram) != session_) {
    ++counts_.malformed;
    return {};
  }
  // How far the sender's key is ahead of ours; 255 is the key before ours.
  const auto ahead = static_cast<std::uint8_t>(datagram[kGenerationAt] - static_cast<std::uint8_t>(generation_));
  const bool of_previous = ahead == 255 && previous_.has_value();
  if (!of_previous && ahead > kMostAhead) {
    ++counts_.malformed;
    return {};
  }
  const std::uint64_t counter = little(datagram.subspan(kCounterAt, 8));
  if (!window_.is_fresh(counter)) {
    ++counts_.replayed;
    return {};
  }
  // Advances copies to the sender's key, because only an authentic datagram may advance ours.
  SealKey key = of_previous ? *previous_ : key_, before = key;
  for (int step = 0; !of_previous && step < ahead; ++step) {
    before = key;
    key = next_key(key);
  }
  if (!authentic(datagram, Nonce(counter), key, into)) {
    ++counts_.forged;
    return {};
  }
  if (!of_previous && ahead > 0) {
    generation_ += ahead;
    key_ = key;
    previous_ = before;
    previous_until_ = now + rules_.previous_for;
  }
  const bool newest = window_.is_newest(counter);
  window_.mark(counter);
  ++counts_.opened;
  return Opened{into.first(datagram.size() - kSealBytes), counter, newest};
}

std::optional<std::uint32_t> session_of(std::span<const std::uint8_t> datagram) noexcept {
  if (datagram.size() < kGenerationAt) return {};
  return static_cast<std::uint32_t>(little(datagram.first(kGenerationAt)));
}

}  // namespace osteon
