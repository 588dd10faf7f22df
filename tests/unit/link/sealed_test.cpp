#include "common/link/sealed.hpp"

#include <gtest/gtest.h>
#include <sodium.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/support/allocation_counter.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;
using Time = std::chrono::nanoseconds;

constexpr std::uint32_t kSession = 0xA1B2C3D4;

SealKey a_key() {
  SealKey key;
  std::iota(key.bytes.begin(), key.bytes.end(), std::uint8_t{0});
  return key;
}

Bytes from_hex(const std::string& hex) {
  Bytes bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

Bytes seal(Sealer& sealer, std::span<const std::uint8_t> plain, Time now) {
  DatagramBuffer into;
  const auto sealed = sealer.seal(plain, now, into);
  return {sealed.begin(), sealed.end()};
}

struct Came {
  Bytes plain;
  std::uint64_t counter;
  bool newest;
};
std::optional<Came> open(Opener& opener, std::span<const std::uint8_t> datagram, Time now) {
  DatagramBuffer into;
  const auto opened = opener.open(datagram, now, into);
  if (!opened) return {};
  return Came{{opened->plain.begin(), opened->plain.end()}, opened->counter, opened->newest};
}

Bytes some_plain(std::size_t size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Bytes plain(size);
  for (auto& byte : plain) byte = static_cast<std::uint8_t>(random());
  return plain;
}

// RFC 8439, section 2.8.2: the primitive of the library is that of the standard.
TEST(Sealed, UsesThePrimitiveOfTheStandard) {
  const std::string text =
      "Ladies and Gentlemen of the class of '99: If I could offer you only one tip for the future, sunscreen would be "
      "it.";
  const Bytes key = from_hex("808182838485868788898a8b8c8d8e8f909192939495969798999a9b9c9d9e9f");
  const Bytes nonce = from_hex("070000004041424344454647"), header = from_hex("50515253c0c1c2c3c4c5c6c7");
  const Bytes expected = from_hex(
      "d31a8d34648e60db7b86afbc53ef7ec2a4aded51296e08fea9e2b5a736ee62d63dbea45e8ca9671282fafb69da92728b1a71de0a9e060b29"
      "05d6a5b6"
      "7ecd3b3692ddbd7f2d778b8c9803aee328091b58fab324e4fad675945585808b4831d7bc3ff4def08e4b7a9de576d26586cec64b61161ae1"
      "0b594f09"
      "e26a7e902ecbd0600691");
  Bytes out(text.size() + 16);
  crypto_aead_chacha20poly1305_ietf_encrypt(out.data(), nullptr, reinterpret_cast<const std::uint8_t*>(text.data()),
                                            text.size(), header.data(), header.size(), nullptr, nonce.data(),
                                            key.data());
  EXPECT_EQ(out, expected);
}

// Made by another program: Python's cryptography and hashlib, with key = bytes(range(32)) and
//   header = struct.pack("<IBQ", 0xA1B2C3D4, generation, counter)
//   header + ChaCha20Poly1305(key).encrypt(bytes(4) + struct.pack("<Q", counter), plain, header)
//   next key = blake2b(b"", digest_size=32, key=key, salt=struct.pack("<QQ", 1, 0), person=b"osteonUD" + bytes(8))
TEST(Sealed, IsWhatAnotherProgramMakes) {
  Bytes plain;
  for (int i = 0; i < 45; ++i) plain.push_back(static_cast<std::uint8_t>(7 * i + 3));
  Sealer sealer(kSession, a_key(), {.rekey_packets = 1, .first_counter = 0x0102030405060708});
  const Bytes first = seal(sealer, plain, 0s), second = seal(sealer, plain, 0s);
  EXPECT_EQ(first, from_hex("d4c3b2a1000807060504030201f343bcfcb41fc72c5fe9639c242604d4937c734c07d2d83afc871e9d2ecc72"
                            "01ba96f1452d3404ed0b164fc0f5d46a251a61fd79ac4200cfa86d039553"));
  EXPECT_EQ(second,
            from_hex("d4c3b2a1010907060504030201f8e3de574c906601a170a77ddd2e1d6842f1d5309c27093624a403564859d494"
                     "9f89f1c807b60a11f104e26311e60ff5f028e5b6ebb2c645b848266217"));
  const Bytes next = from_hex("32af0b6f61463e5d87f37a8c919c49530c0f6d7a7851fc276b0eeb1d724e389e");
  EXPECT_TRUE(std::ranges::equal(next_key(a_key()).bytes, next));
}

TEST(Sealed, OpensWhatWasSealedAndNothingThatWasChanged) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{100}, kMostPlainBytes}) {
    Sealer sealer(kSession, a_key());
    Opener opener(kSession, a_key());
    const Bytes plain = some_plain(size, size);
    const Bytes sealed = seal(sealer, plain, 0s);
    ASSERT_EQ(sealed.size(), size + kSealBytes);
    ASSERT_LE(sealed.size(), kMostDatagramBytes);
    for (std::size_t bit = 0; bit < 8 * sealed.size(); ++bit) {
      Bytes changed = sealed;
      changed[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
      ASSERT_FALSE(open(opener, changed, 0s)) << "bit " << bit;
    }
    for (std::size_t less = 0; less < sealed.size(); ++less)
      ASSERT_FALSE(open(opener, std::span(sealed).first(less), 0s));
    Bytes longer = sealed;
    for (int more = 0; more < 40; ++more) {
      longer.push_back(0);
      ASSERT_FALSE(open(opener, longer, 0s));
    }
    const auto came = open(opener, sealed, 0s);
    ASSERT_TRUE(came) << "failed attempts must not use up its counter";
    EXPECT_EQ(came->plain, plain);
    EXPECT_FALSE(open(opener, sealed, 0s)) << "it must open only once";
    EXPECT_EQ(opener.counts().opened, 1u);
    EXPECT_EQ(opener.counts().replayed, 1u);
  }
}

TEST(Sealed, IsNotOpenedByOthers) {
  Sealer sealer(kSession, a_key());
  const Bytes sealed = seal(sealer, some_plain(50, 1), 0s);
  SealKey other = a_key();
  other.bytes[31] ^= 1;
  Opener other_key(kSession, other), other_session(kSession + 1, a_key());
  EXPECT_FALSE(open(other_key, sealed, 0s));
  EXPECT_FALSE(open(other_session, sealed, 0s));
  EXPECT_EQ(other_key.counts().forged, 1u);
  EXPECT_EQ(other_session.counts().malformed, 1u);
  EXPECT_EQ(session_of(sealed), kSession);
  EXPECT_FALSE(session_of(std::span(sealed).first(3)));
}

TEST(Sealed, SaysWhichIsNewest) {
  Sealer sealer(kSession, a_key());
  Opener opener(kSession, a_key());
  std::vector<Bytes> sealed;
  for (int i = 0; i < 5; ++i) sealed.push_back(seal(sealer, {}, 0s));
  const int order[] = {1, 0, 3, 2, 4};
  const bool newest[] = {true, false, true, false, true};
  for (int i = 0; i < 5; ++i) {
    const auto came = open(opener, sealed[static_cast<std::size_t>(order[i])], 0s);
    ASSERT_TRUE(came);
    EXPECT_EQ(came->newest, newest[i]) << i;
    EXPECT_EQ(came->counter, static_cast<std::uint64_t>(order[i] + 1));
  }
}

TEST(Sealed, ChangesItsKeyByTimeAndByNumber) {
  Sealer by_time(kSession, a_key());
  std::set<std::uint64_t> counters;
  for (int second = 0; second < 1000; second += 10) {
    EXPECT_EQ(by_time.generation(), static_cast<std::uint64_t>(std::max(0, second - 10) / 120));
    EXPECT_TRUE(counters.insert(by_time.counter()).second) << "the counters continue from key to key";
    seal(by_time, {}, std::chrono::seconds(second));
  }
  Sealer by_number(kSession, a_key(), {.rekey_packets = 100});
  for (std::uint64_t i = 0; i < 1000; ++i) {
    seal(by_number, {}, 0s);
    EXPECT_EQ(by_number.generation(), i / 100);
  }
  Sealer silent(kSession, a_key());
  seal(silent, {}, 0s);
  seal(silent, {}, 24h);
  EXPECT_EQ(silent.generation(), 1u) << "a silent sender does not get ahead of its peer";
}

// Datagrams under two keys arrive in any order, and some are lost or repeated. All that arrive are opened exactly once,
// over more generations than a byte can number.
TEST(Sealed, OpensBothGenerationsInFlight) {
  std::mt19937_64 random(5);
  Sealer sealer(kSession, a_key());
  Opener opener(kSession, a_key());
  struct Flying {
    Time due;
    Bytes bytes;
    std::uint64_t counter;
  };
  std::vector<Flying> flying;
  std::uint64_t lost = 0, opened = 0, older = 0, sent = 0;
  for (Time now = 0s; now < 120s * 300; now += 1s) {
    const std::uint64_t counter = sealer.counter();
    const Bytes bytes = seal(sealer, some_plain(20, counter), now);
    ++sent;
    if (random() % 10 < 3) {
      ++lost;
    } else {
      // At most 9 s under way: less time than the previous key is held.
      flying.push_back({now + std::chrono::milliseconds(random() % 9000), bytes, counter});
      if (random() % 10 == 0) flying.push_back({now + std::chrono::milliseconds(random() % 9000), bytes, counter});
    }
    std::ranges::sort(flying, {}, &Flying::due);
    while (!flying.empty() && flying.front().due <= now) {
      const Flying arrived = flying.front();
      flying.erase(flying.begin());
      const bool of_previous = arrived.bytes[4] != static_cast<std::uint8_t>(opener.generation());
      if (const auto came = open(opener, arrived.bytes, arrived.due)) {
        EXPECT_EQ(came->counter, arrived.counter);
        EXPECT_EQ(came->plain, some_plain(20, arrived.counter));
        ++opened;
        older += of_previous ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(
      opened + lost +
          [&] {
            std::set<std::uint64_t> left;
            for (const Flying& one : flying) left.insert(one.counter);
            return left.size();
          }(),
      sent)
      << "each is opened once, lost or still under way";
  EXPECT_EQ(opener.counts().forged, 0u);
  EXPECT_GT(sealer.generation(), 256u);
  EXPECT_EQ(opener.generation(), sealer.generation());
  EXPECT_GT(older, sealer.generation()) << "no datagram arrived under an older key";
}

TEST(Sealed, ForgetsThePreviousKeyTenSecondsAfterTheNextIsSeen) {
  for (const bool late : {false, true}) {
    Sealer sealer(kSession, a_key(), {.rekey_packets = 2});
    Opener opener(kSession, a_key());
    const Bytes first = seal(sealer, {}, 0s), second = seal(sealer, {}, 0s), third = seal(sealer, {}, 0s);
    ASSERT_TRUE(open(opener, first, 500s));
    EXPECT_FALSE(opener.keeps_previous());
    ASSERT_TRUE(open(opener, third, 1000s));
    EXPECT_TRUE(opener.keeps_previous());
    opener.expire(1010s - 1ns);
    EXPECT_TRUE(opener.keeps_previous());
    EXPECT_EQ(open(opener, second, late ? 1010s : Time(1010s - 1ns)).has_value(), !late);
    opener.expire(1010s);
    EXPECT_FALSE(opener.keeps_previous());
    EXPECT_EQ(opener.generation(), 1u);
  }
}

TEST(Sealed, UnderstandsAPeerWhoseKeysWereLostOnTheWayUpToALimit) {
  Sealer sealer(kSession, a_key(), {.rekey_packets = 1});
  Bytes before;
  for (std::uint64_t generation = 0; generation < 20; ++generation) {
    const Bytes sealed = seal(sealer, {}, 0s);
    Opener opener(kSession, a_key());
    ASSERT_EQ(open(opener, sealed, 0s).has_value(), generation <= Opener::kMostAhead) << generation;
    if (generation > 0 && generation <= Opener::kMostAhead) {
      EXPECT_TRUE(open(opener, before, 0s)) << "the key before it is then known, though it was never seen";
    }
    before = sealed;
  }
}

// A forged later generation in a datagram changes no key.
TEST(Sealed, IsNotMovedToAnotherKeyByForgers) {
  Sealer sealer(kSession, a_key());
  Opener opener(kSession, a_key());
  for (int i = 0; i < 256; ++i) {
    Bytes forged = seal(sealer, {}, 0s);
    const Bytes genuine = forged;
    forged[4] = static_cast<std::uint8_t>(i);
    EXPECT_EQ(open(opener, forged, 0s).has_value(), i == 0);
    EXPECT_EQ(opener.generation(), 0u);
    EXPECT_EQ(open(opener, genuine, 0s).has_value(), i != 0);
  }
}

TEST(Sealed, AllocatesNothing) {
  Sealer sealer(kSession, a_key(), {.rekey_packets = 10});
  Opener opener(kSession, a_key());
  DatagramBuffer sealed, plain;
  const Bytes content = some_plain(900, 1);
  std::uint64_t opened = 0;
  const test::AllocationCounter heap;
  for (int i = 0; i < 1000; ++i) opened += opener.open(sealer.seal(content, 0s, sealed), 0s, plain) ? 1 : 0;
  EXPECT_EQ(heap.count(), 0);
  EXPECT_EQ(opened, 1000u);
}

TEST(Sealed, KeysOfTheSystemDiffer) {
  const FillRandom random = system_random();
  std::set<std::array<std::uint8_t, 32>> keys;
  for (std::uint32_t i = 0; i < 50; ++i) {
    const SessionKeys made = make_session_keys(i, random);
    keys.insert({made.up.bytes, made.down.bytes});
  }
  EXPECT_EQ(keys.size(), 100u);
  EXPECT_EQ(key_of(a_key().bytes), a_key());
  EXPECT_FALSE(key_of(Bytes(31)));
}

TEST(SealedDeathTest, NeverUsesACounterTwice) {
  Sealer sealer(kSession, a_key(), {.first_counter = std::numeric_limits<std::uint64_t>::max() - 1});
  seal(sealer, {}, 0s);
  EXPECT_DEATH(seal(sealer, {}, 0s), "counter_");
}

TEST(SealedDeathTest, TakesNoMoreThanADatagramHolds) {
  Sealer sealer(kSession, a_key());
  EXPECT_DEATH(seal(sealer, Bytes(kMostPlainBytes + 1), 0s), "kMostPlainBytes");
}

}  // namespace
}  // namespace osteon
