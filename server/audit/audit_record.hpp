// One record of the audit log: who did what, to which object, with which result. A record is one line of JSON. It has
// the hash of the line before it and an Ed25519 signature. So nobody can change, remove or add a line unnoticed.
#pragma once
#include <chrono>
#include <compare>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "server/journal/disk.hpp"
#include "server/journal/signing.hpp"

namespace osteon {

// Who acted. Unknown fields are empty.
struct AuditIdentity {
  std::string person{};       // of the certificate; for a command, the system's user
  std::string certificate{};  // serial number, hexadecimal
  std::string ticket{};       // id, hexadecimal
  std::string address{};      // "ipv4:10.0.0.7"
  friend auto operator<=>(const AuditIdentity&, const AuditIdentity&) = default;
};

// Prefix of a name that a certificate claims, if nobody could verify its signature.
inline constexpr std::string_view kClaimed = "claimed:";

// What happened. Only the identity may name a person, because only the identity can be erased.
struct AuditEvent {
  AuditIdentity who{};
  std::string action;    // one word: "Join", "DeleteRoom", "handshake"
  std::string object{};  // a room, a case, a file
  std::string result;    // kOk, kRefused, kFailed or kLost
  std::string detail{};  // fixed words and numbers
  std::chrono::system_clock::time_point at = std::chrono::system_clock::now();
};
inline constexpr const char *kOk = "ok", *kRefused = "refused", *kFailed = "failed", *kLost = "lost";
// The action of a record that says how many older ones were removed.
inline constexpr const char* kRetention = "retention";

struct AuditRecord {
  std::uint64_t sequence = 0;  // from 1, without gaps
  std::string time;            // RFC 3339, UTC, microseconds
  std::string identity;        // pseudonym; empty: the server itself
  std::string action, object, result, detail;
  Digest previous;  // SHA-256 of the line before this one, without its line end; zeros in the first record
  PublicKey key;    // the key that signed it
};

// The record as a line without its line end. Sets `record.key` to that of `key`. Replaces bytes that are not UTF-8.
[[nodiscard]] std::string encode(AuditRecord& record, const SigningKey& key);
// Error invalid_input: not a record, or its signature does not fit.
[[nodiscard]] Result<AuditRecord> decode_record(std::string_view line);
[[nodiscard]] Digest hash_of_line(std::string_view line);

// "2026-11-25T12:08:31.123456Z". Two such texts compare like their times.
[[nodiscard]] std::string rfc3339(std::chrono::system_clock::time_point time);

// The first kMostText bytes as valid UTF-8, without control characters. Invalid bytes are replaced.
inline constexpr std::size_t kMostText = 256;
[[nodiscard]] std::string clean_text(std::string_view text);
[[nodiscard]] AuditIdentity clean(const AuditIdentity& who);

// Hexadecimal digits of any bytes, and the reverse. Error invalid_input: not lower-case digits, two for each byte.
[[nodiscard]] std::string hex_of(std::string_view bytes);
[[nodiscard]] Result<std::string> bytes_of_hex(std::string_view hex);

// Passes each complete line of a file to `take`, in order, until `take` returns false. `take` gets the line without its
// line end, and the offset of the next line. Returns the number of bytes after the last complete line, or 0 if `take`
// returned false. Errors: those of Disk::read; invalid_input (a line of more than 1 MiB).
[[nodiscard]] Result<std::uint64_t> for_each_line(
    Disk& disk, const std::filesystem::path& file,
    const std::function<bool(std::string_view line, std::uint64_t next)>& take);

}  // namespace osteon
