#include "common/link/path_watch.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Time = std::chrono::nanoseconds;

constexpr Endpoint kHome{0, 1, 1000}, kAway{0, 2, 2000}, kFar{0, 3, 3000};
constexpr std::size_t kChallengeBytes = 46;

FillRandom seeded(std::uint64_t seed) {
  return [random = std::mt19937_64(seed)](std::span<std::uint8_t> into) mutable {
    for (auto& byte : into) byte = static_cast<std::uint8_t>(random());
  };
}

// A watch whose peer has proven kHome.
PathWatch at_home(const PathRules& rules = {}) {
  PathWatch watch(seeded(1), rules);
  watch.received(kHome, true, 100, 0ms);
  const auto challenge = watch.challenge_due(kChallengeBytes, 0ms);
  EXPECT_TRUE(challenge && challenge->to == kHome);
  EXPECT_TRUE(watch.echoed(kHome, challenge->token, 1ms));
  EXPECT_EQ(watch.address(), kHome);
  return watch;
}

TEST(PathWatch, BelievesNoAddressBeforeItIsProven) {
  PathWatch watch(seeded(1));
  EXPECT_FALSE(watch.challenge_due(kChallengeBytes, 0ms));
  watch.received(kHome, true, 100, 0ms);
  EXPECT_FALSE(watch.address().is_set());
  const auto challenge = watch.challenge_due(kChallengeBytes, 0ms);
  ASSERT_TRUE(challenge);
  EXPECT_FALSE(watch.address().is_set());
  EXPECT_TRUE(watch.echoed(kHome, challenge->token, 50ms));
  EXPECT_EQ(watch.address(), kHome);
}

TEST(PathWatch, MovesWhenTheNewAddressEchoes) {
  PathWatch watch = at_home();
  watch.received(kAway, true, 100, 10ms);
  const auto challenge = watch.challenge_due(kChallengeBytes, 10ms);
  ASSERT_TRUE(challenge);
  EXPECT_EQ(challenge->to, kAway);
  EXPECT_EQ(watch.address(), kHome) << "data still goes to the old address";
  PathToken wrong = challenge->token;
  wrong[15] ^= 1;
  EXPECT_FALSE(watch.echoed(kAway, wrong, 20ms));
  EXPECT_FALSE(watch.echoed(kHome, challenge->token, 20ms)) << "an echo from another address proves nothing";
  EXPECT_FALSE(watch.echoed(kFar, challenge->token, 20ms));
  EXPECT_EQ(watch.address(), kHome);
  EXPECT_TRUE(watch.echoed(kAway, challenge->token, 20ms));
  EXPECT_EQ(watch.address(), kAway);
  EXPECT_EQ(watch.moves(), 2u);
  EXPECT_FALSE(watch.echoed(kAway, challenge->token, 21ms)) << "a token is valid once";
}

TEST(PathWatch, IsNotMovedByWhatIsNotNewer) {
  PathWatch watch = at_home();
  watch.received(kAway, false, 1000, 10ms);
  EXPECT_FALSE(watch.challenge_due(kChallengeBytes, 10ms));
  EXPECT_FALSE(watch.echoed(kAway, PathToken{}, 10ms));
  EXPECT_EQ(watch.address(), kHome);
}

TEST(PathWatch, ChallengesThriceAndForgets) {
  PathWatch watch = at_home();
  watch.received(kAway, true, 1000, 0ms);
  PathToken token{};
  std::vector<Time> sent;
  for (Time now = 0ms; now < 5s; now += 1ms)
    if (const auto challenge = watch.challenge_due(kChallengeBytes, now)) {
      sent.push_back(now);
      token = challenge->token;
    }
  EXPECT_EQ(sent, (std::vector<Time>{0ms, 200ms, 400ms}));
  EXPECT_FALSE(watch.echoed(kAway, token, 5s));
  // A new challenge may begin, with another token.
  watch.received(kAway, true, 100, 6s);
  const auto again = watch.challenge_due(kChallengeBytes, 6s);
  ASSERT_TRUE(again);
  EXPECT_NE(again->token, token);
  EXPECT_FALSE(watch.echoed(kAway, token, 6s));
  EXPECT_TRUE(watch.echoed(kAway, again->token, 6s + 900ms)) << "an echo over a slow path counts";
}

TEST(PathWatch, HasOneCandidateTheNewest) {
  PathWatch watch = at_home();
  watch.received(kAway, true, 100, 10ms);
  const auto away = watch.challenge_due(kChallengeBytes, 10ms);
  watch.received(kFar, true, 100, 11ms);
  const auto far = watch.challenge_due(kChallengeBytes, 11ms);
  ASSERT_TRUE(away && far);
  EXPECT_EQ(far->to, kFar);
  watch.received(kAway, false, 100, 12ms);  // it arrives late and changes nothing
  EXPECT_FALSE(watch.echoed(kAway, away->token, 13ms));
  EXPECT_TRUE(watch.echoed(kFar, far->token, 13ms));
}

TEST(PathWatch, DropsTheCandidateWhenThePeerSendsFromItsOldAddress) {
  PathWatch watch = at_home();
  watch.received(kAway, true, 100, 10ms);
  const auto challenge = watch.challenge_due(kChallengeBytes, 10ms);
  ASSERT_TRUE(challenge);
  watch.received(kHome, false, 100, 11ms);  // sent before the move
  watch.received(kHome, true, 100, 12ms);   // sent after the move: the peer has come back
  EXPECT_FALSE(watch.echoed(kAway, challenge->token, 13ms));
  EXPECT_EQ(watch.address(), kHome);
}

TEST(PathWatch, WaitsWithAChallengeUntilEnoughHasCome) {
  PathWatch watch = at_home();
  watch.received(kAway, true, 30, 10ms);
  EXPECT_FALSE(watch.challenge_due(91, 10ms));
  EXPECT_TRUE(watch.challenge_due(90, 10ms));
  EXPECT_FALSE(watch.challenge_due(kChallengeBytes, 300ms));
  watch.received(kAway, false, 16, 300ms);
  EXPECT_TRUE(watch.challenge_due(48, 300ms));
}

// For any order of events: the peer's address is always one that echoed the last token sent there. An unproven address
// is sent at most three times the bytes that came from it. At most one address is challenged at a time.
TEST(PathWatch, KeepsItsRulesUnderAnyOrderOfEvents) {
  std::uint64_t moves = 0, challenges = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    PathWatch watch(seeded(seed));
    const Endpoint all[] = {kHome, kAway, kFar, {0, 4, 4000}};
    std::map<Endpoint, std::size_t> received, sent;  // bytes since the last datagram of the peer from another address
    std::map<Endpoint, PathToken> tokens;            // the last token sent to each
    std::optional<Endpoint> newest_from;             // source of the newest datagram
    Time now{0};
    Endpoint from = kHome;
    for (int i = 0; i < 2000; ++i) {
      now += std::chrono::milliseconds(random() % 5 == 0 ? 210 : random() % 20);
      if (random() % 3 == 0) from = all[random() % std::size(all)];
      const Endpoint before = watch.address();
      if (random() % 3 > 0) {
        const bool newest = random() % 4 > 0;
        const std::size_t bytes = 29 + random() % 10;
        watch.received(from, newest, bytes, now);
        if (newest && newest_from != from) {
          newest_from = from;
          received[from] = sent[from] = 0;
        }
        received[from] += bytes;
        ASSERT_EQ(watch.address(), before);
      } else {
        const bool knows = tokens.contains(from) && random() % 8 > 0;
        const PathToken token = knows ? tokens[from] : PathToken{static_cast<std::uint8_t>(i)};
        const bool moved = watch.echoed(from, token, now);
        ASSERT_EQ(watch.address(), moved ? from : before);
        if (moved) {
          ASSERT_TRUE(knows);
          ASSERT_EQ(from, newest_from) << "a newer datagram came from elsewhere";
          ++moves;
        }
      }
      if (const auto challenge = watch.challenge_due(kChallengeBytes, now)) {
        ++challenges;
        ASSERT_NE(challenge->to, watch.address());
        ASSERT_EQ(challenge->to, newest_from);
        sent[challenge->to] += kChallengeBytes;
        tokens[challenge->to] = challenge->token;
        ASSERT_LE(sent[challenge->to], 3 * received[challenge->to]);
      }
    }
  }
  EXPECT_GT(moves, 3000u);
  EXPECT_GT(challenges, moves);
}

}  // namespace
}  // namespace osteon
