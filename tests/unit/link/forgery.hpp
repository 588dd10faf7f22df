// A server's end of the datagram link in small, its peers, and somebody on the way who knows all that passes but no key.
#pragma once
#include <array>
#include <cstdint>

namespace osteon::test {

// What he sends. Those made from a datagram of a peer are made while it is still on its way, so that nothing but the seal
// tells them from it.
enum class Forgery { noise, plausible_header, flipped, cut_short, extended, other_generation, spliced, replayed, reflected };
inline constexpr std::size_t kForgeries = 9;
inline constexpr std::array<const char*, kForgeries> kForgeryNames{
    "noise", "plausible_header", "flipped", "cut_short", "extended", "other_generation", "spliced", "replayed", "reflected"};

struct ForgeryReport {
  std::array<std::uint64_t, kForgeries> sent{};  // by kind
  std::uint64_t accepted = 0;                    // forged ones that were opened
  std::uint64_t answered_bytes = 0;              // that the server sent, anywhere, on account of them
  // The peers' own, in between; they also move to other addresses and change keys.
  std::uint64_t genuine = 0, genuine_accepted = 0, genuine_answered = 0;
  std::uint64_t moves = 0, moves_noticed = 0;
  std::uint64_t generations = 0;  // keys used by the busiest peer
};

// `count` forged datagrams. Everything follows from `seed`, on virtual time.
[[nodiscard]] ForgeryReport forge(std::uint64_t count, std::uint64_t seed);

}  // namespace osteon::test
