#include "tests/fuzz/datagram_target.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/core/check.hpp"
#include "common/link/sealed.hpp"

namespace osteon::fuzz {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kSession = 7;
constexpr std::uint64_t kSeeds = 3;  // sealed datagrams as seeds, with counters from 1 and one key each

SealKey the_key() {
  SealKey key;
  key.bytes.fill(0x5a);
  return key;
}

Bytes seed_plain(std::uint64_t counter) { return Bytes(20 * counter, static_cast<std::uint8_t>(counter)); }

std::vector<Bytes> seeds() {
  Sealer sealer(kSession, the_key(), {.rekey_packets = 1});
  std::vector<Bytes> sealed;
  for (std::uint64_t counter = 1; counter <= kSeeds; ++counter) {
    DatagramBuffer into;
    const auto datagram = sealer.seal(seed_plain(counter), 0s, into);
    sealed.emplace_back(datagram.begin(), datagram.end());
  }
  return sealed;
}

// Without the key nobody can make a datagram that is opened. Whatever is opened must be one of the seeds, byte for
// byte.
void as_datagram(std::span<const std::uint8_t> data) {
  Opener opener(kSession, the_key());
  DatagramBuffer plain;
  const auto opened = opener.open(data, 0s, plain);
  const OpenCounts& counts = opener.counts();
  OSTEON_CHECK(counts.opened + counts.malformed + counts.forged == 1 && counts.opened == (opened ? 1 : 0));
  if (!opened) return;
  static const std::vector<Bytes> known = seeds();
  OSTEON_CHECK(std::ranges::any_of(known, [&](const Bytes& seed) { return std::ranges::equal(seed, data); }));
  OSTEON_CHECK(opened->counter >= 1 && opened->counter <= kSeeds);
  OSTEON_CHECK(std::ranges::equal(opened->plain, seed_plain(opened->counter)));
  OSTEON_CHECK(!opener.open(data, 0s, plain) && opener.counts().replayed == 1);
}

// Whatever a peer sends must come out unchanged, and goes to the layer above.
void as_plain(std::span<const std::uint8_t> data, const PlainTarget& above) {
  const auto said = data.first(std::min(data.size(), kMostPlainBytes));
  Sealer sealer(kSession, the_key());
  Opener opener(kSession, the_key());
  DatagramBuffer sealed, plain;
  const auto opened = opener.open(sealer.seal(said, 0s, sealed), 0s, plain);
  OSTEON_CHECK(opened && std::ranges::equal(opened->plain, said));
  if (above) above(opened->plain);
}

}  // namespace

Target datagram_target(PlainTarget above, const std::vector<Bytes>& plain_seeds) {
  std::vector<Bytes> all = seeds();
  all.insert(all.end(), plain_seeds.begin(), plain_seeds.end());
  return {"datagram",
          [above = std::move(above)](std::span<const std::uint8_t> data) {
            as_datagram(data);
            as_plain(data, above);
          },
          std::move(all)};
}

}  // namespace osteon::fuzz
