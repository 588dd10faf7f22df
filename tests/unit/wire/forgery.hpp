// The server's end of fast paths, its clients, and an attacker on the path. The attacker sees every datagram, and has
// no key.
#pragma once
#include <array>
#include <cstdint>

namespace osteon::test {

// What the attacker sends. A forgery of a client's datagram is made while that datagram is still on its way. So only
// the seal tells one from the other.
enum class Forgery {
  noise,
  plausible_header,
  flipped,
  cut_short,
  extended,
  other_generation,
  spliced,
  replayed,
  reflected
};
inline constexpr std::size_t kForgeries = 9;
inline constexpr std::array<const char*, kForgeries> kForgeryNames{"noise",     "plausible_header", "flipped",
                                                                   "cut_short", "extended",         "other_generation",
                                                                   "spliced",   "replayed",         "reflected"};

struct ForgeryReport {
  std::array<std::uint64_t, kForgeries> sent{};  // by kind
  // Forged datagrams that were opened, or that changed the session's wire::ServerLink: what it holds for its owner, its
  // client's address, or when it sends.
  std::uint64_t accepted = 0;
  // Bytes that the server sent, and its twin did not. The twin has the same class and keys, and receives no forgery.
  std::uint64_t answered_bytes = 0;
  // Why the server refused the forgeries, by its own counts. `unknown_session`: no such session.
  std::uint64_t unknown_session = 0, malformed = 0, replayed = 0, forged = 0;
  // The clients' own datagrams, in between. The clients also move to other addresses and change keys.
  std::uint64_t genuine = 0, genuine_accepted = 0, genuine_answered = 0;
  std::uint64_t cuts = 0, cuts_returned = 0;  // cuts that clients made, and log entries of them that clients received
  std::uint64_t moves = 0, moves_noticed = 0;
  std::uint64_t generations = 0;  // keys used by the busiest client
};

// Sends `count` forged datagrams. `seed` determines everything. Time is virtual.
[[nodiscard]] ForgeryReport forge(std::uint64_t count, std::uint64_t seed);

}  // namespace osteon::test
