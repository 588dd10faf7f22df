// The server's end of fast paths, its clients, and somebody on the way who knows all that passes but no key.
#pragma once
#include <array>
#include <cstdint>

namespace osteon::test {

// What he sends. Those made from a datagram of a client are made while it is still on its way, so that nothing but the
// seal tells them from it.
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
  // Forged ones that were opened, or after which the session's wire::ServerLink was another than before: in what it has
  // for its owner, where it takes its client to be, or when it sends.
  std::uint64_t accepted = 0;
  // Bytes that it sent, anywhere and at any time, and that the same class with the same keys did not send which heard
  // none of the forged ones.
  std::uint64_t answered_bytes = 0;
  // Why the forged ones went no further, by the server's own counts.
  std::uint64_t strangers = 0, malformed = 0, replayed = 0, forged = 0;
  // The clients' own, in between; they also move to other addresses and change keys.
  std::uint64_t genuine = 0, genuine_accepted = 0, genuine_answered = 0;
  std::uint64_t cuts = 0, cuts_told = 0;  // that clients made, and entries of them that came back
  std::uint64_t moves = 0, moves_noticed = 0;
  std::uint64_t generations = 0;  // keys used by the busiest client
};

// `count` forged datagrams. Everything follows from `seed`, on virtual time.
[[nodiscard]] ForgeryReport forge(std::uint64_t count, std::uint64_t seed);

}  // namespace osteon::test
