// Sealed datagrams: ChaCha20-Poly1305 (RFC 8439) with a counter, a key for each session and direction, and a new key
// every two minutes.
//
//   session (4 bytes) | generation of the key, its low 8 bits | counter (8) | ciphertext | tag (16)      little endian
//
// The first 13 bytes are authenticated with the rest. The nonce is 4 zero bytes and the counter. The counter continues
// from key to key, so one replay window serves all keys. Keyed BLAKE2b derives the next key from the present one. So
// nobody who learns a key can compute earlier keys. The server makes the keys and sends them over mutual TLS.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "common/link/datagram.hpp"
#include "common/link/random_bytes.hpp"
#include "common/link/replay_window.hpp"

namespace osteon {

inline constexpr std::size_t kSealBytes = 4 + 1 + 8 + 16;  // bytes that sealing adds
inline constexpr std::size_t kMostPlainBytes = kMostDatagramBytes - kSealBytes;

// Erases itself in the destructor.
struct SealKey {
  std::array<std::uint8_t, 32> bytes{};
  SealKey() = default;
  explicit SealKey(const std::array<std::uint8_t, 32>& from) : bytes(from) {}
  SealKey(const SealKey&) = default;
  SealKey& operator=(const SealKey&) = default;
  ~SealKey();
  friend bool operator==(const SealKey&, const SealKey&) = default;
};
// Nothing unless there are exactly 32 bytes.
[[nodiscard]] std::optional<SealKey> key_of(std::span<const std::uint8_t> bytes) noexcept;
// The key of the generation after `key`'s.
[[nodiscard]] SealKey next_key(const SealKey& key) noexcept;

// What a server makes for each session and sends to its peer.
struct SessionKeys {
  std::uint32_t session = 0;
  SealKey up, down;  // up: from the client to the server
};
[[nodiscard]] SessionKeys make_session_keys(std::uint32_t session, const FillRandom& random);

struct SealRules {
  std::chrono::nanoseconds rekey_after = std::chrono::seconds{120};  // since the first datagram under a key
  std::uint64_t rekey_packets = std::uint64_t{1} << 32;              // largest number under one key
  std::chrono::nanoseconds previous_for = std::chrono::seconds{10};  // after the first datagram under the next key
  std::uint64_t first_counter = 1;
};

// The sending end of one direction. Two sealers must never share a key, because their counters would collide.
class Sealer {
 public:
  Sealer(std::uint32_t session, const SealKey& key, const SealRules& rules = {});
  Sealer(const Sealer&) = delete;
  Sealer& operator=(const Sealer&) = delete;

  // Seals `plain` (at most kMostPlainBytes) into the beginning of `into`. `into` must be large enough and must not
  // overlap `plain`. `now`: since any start, the same for all calls. One thread.
  std::span<const std::uint8_t> seal(std::span<const std::uint8_t> plain, std::chrono::nanoseconds now,
                                     std::span<std::uint8_t> into) noexcept;
  // Counter of the next datagram.
  [[nodiscard]] std::uint64_t counter() const noexcept { return counter_; }
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }

 private:
  const std::uint32_t session_;
  const SealRules rules_;
  SealKey key_;
  std::uint64_t generation_ = 0, counter_, under_key_ = 0;
  std::chrono::nanoseconds began_{};
};

struct Opened {
  std::span<const std::uint8_t> plain;
  std::uint64_t counter = 0;
  bool newest = false;  // its counter is above all earlier ones
};

// Received datagrams by result.
struct OpenCounts {
  std::uint64_t opened = 0;
  std::uint64_t malformed = 0;  // too short, too long, of another session, or of an impossible generation
  std::uint64_t replayed = 0;   // seen before, or too old to know
  std::uint64_t forged = 0;     // not sealed with the key
};

// The receiving end of one direction.
class Opener {
 public:
  // If datagrams were lost over more than this many keys, the peer cannot be understood any more. The session must join
  // again.
  static constexpr std::uint64_t kMostAhead = 8;

  Opener(std::uint32_t session, const SealKey& key, const SealRules& rules = {});
  Opener(const Opener&) = delete;
  Opener& operator=(const Opener&) = delete;

  // Nothing if the datagram is not the peer's or was opened before. Then only the counts have changed. The plain bytes
  // lie at the beginning of `into` (kMostPlainBytes, apart from `datagram`). The previous content of `into` is always
  // lost. One thread.
  [[nodiscard]] std::optional<Opened> open(std::span<const std::uint8_t> datagram, std::chrono::nanoseconds now,
                                           std::span<std::uint8_t> into) noexcept;
  // Erases the previous key when its time is over. open() does it too. Call this now and then while nothing arrives.
  void expire(std::chrono::nanoseconds now) noexcept;

  [[nodiscard]] const OpenCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }
  [[nodiscard]] bool keeps_previous() const noexcept { return previous_.has_value(); }

 private:
  const std::uint32_t session_;
  const SealRules rules_;
  std::uint64_t generation_ = 0;
  SealKey key_;
  std::optional<SealKey> previous_;
  std::chrono::nanoseconds previous_until_{};
  ReplayWindow window_;
  OpenCounts counts_;
};

// The session that a datagram names, so that a server can find its opener. Not authenticated.
[[nodiscard]] std::optional<std::uint32_t> session_of(std::span<const std::uint8_t> datagram) noexcept;

}  // namespace osteon
