#include "common/link/send_rate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <deque>

#include "common/link/pose_deadband.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
constexpr auto kNothing = SendRate::Time::max();

TEST(SendRate, GoesEvery8MsWithSomethingToSayAnd4TimesASecondWithout) {
  SendRate rate;
  EXPECT_EQ(rate.next(3s, kNothing), 3s) << "the first packet is sent at once";
  rate.sent(3s, 100);
  EXPECT_EQ(rate.next(3s, 3s), 3s + 8ms);
  EXPECT_EQ(rate.next(3s + 5ms, 3s), 3s + 8ms);
  EXPECT_EQ(rate.next(4s, 3s), 4s) << "it is long due";
  EXPECT_EQ(rate.next(3s, 3s + 100ms), 3s + 100ms) << "as soon as there is something to send";
  EXPECT_EQ(rate.next(3s, kNothing), 3s + 250ms);
  EXPECT_EQ(rate.next(3s, 10s), 3s + 250ms);
  EXPECT_EQ(rate.budget(3s + 7ms), 0u);
  EXPECT_GT(rate.budget(3s + 8ms), 0u);
}

// As long as the rate allows it: once bytes are short, packets with new items are sent no sooner than others.
TEST(SendRate, NewItemsAreSentSooner) {
  SendRate rate;
  rate.sent(3s, 100);
  EXPECT_EQ(rate.next(3s, 3s, 0, true), 3s + 4ms);
  EXPECT_EQ(rate.budget(3s + 3ms, true), 0u);
  EXPECT_GT(rate.budget(3s + 4ms, true), 0u);
  EXPECT_EQ(rate.budget(3s + 4ms), 0u);
  SendRate::Time now = 3s + 4ms;
  for (int i = 0; i < 100; ++i) {
    now = rate.next(now, now, 0, true);
    rate.sent(now, 252);
  }
  EXPECT_GT(rate.next(now, now, 0, true), now + 7ms) << "280 bytes at 300 kbit/s";
}

// Sends everything that is allowed, at times of any kind. In every interval it is at most the rate and one burst.
TEST(SendRate, KeepsTheBytesASecond) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    test::Random random(seed);
    SendRateParams params;
    params.bytes_per_s = random.between(5'000, 100'000);
    SendRate rate(params);
    std::deque<std::pair<SendRate::Time, double>> sent;
    double worst = 0;
    for (SendRate::Time now{}; now < 20s; now += std::chrono::microseconds(random.index(6000))) {
      const std::size_t budget = rate.budget(now);
      ASSERT_LE(budget, kMostDatagramBytes);
      if (budget == 0 || random.unit() < 0.05) continue;
      ASSERT_EQ(rate.next(now, now), now);
      rate.sent(now, budget);
      sent.emplace_back(now, static_cast<double>(budget + 28));
      double bytes = 0;
      for (auto at = sent.rbegin(); at != sent.rend() && now - at->first <= 5s; ++at) {
        bytes += at->second;
        const double allowed = std::chrono::duration<double>(now - at->first).count() * params.bytes_per_s;
        worst = std::max(worst, bytes - allowed);
      }
    }
    EXPECT_LE(worst, static_cast<double>(params.burst_bytes) + 1.0);
    EXPECT_GT(worst, 0.5 * static_cast<double>(params.burst_bytes)) << "a burst is used";
  }
}

TEST(SendRate, WaitsForWhatALongItemNeeds) {
  SendRateParams params;
  params.bytes_per_s = 10'000;
  SendRate rate(params);
  for (SendRate::Time now = rate.next(0s, 0s, 900); now < 30s; now = rate.next(now, now, 900)) {
    ASSERT_GE(rate.budget(now), 900u);
    rate.sent(now, rate.budget(now));
  }
  EXPECT_LE(rate.next(30s, 30s, 1 << 20), 31s) << "it never waits for more than a packet holds";
}

TEST(SendRate, WaitsForAPacketWorthSending) {
  SendRateParams params;
  params.bytes_per_s = 10'000;
  SendRate rate(params);
  SendRate::Time now{};
  int packets = 0;
  for (; now < 30s; now = rate.next(now, now)) {
    const std::size_t budget = rate.budget(now);
    ASSERT_GE(budget + params.overhead_bytes, params.least_bytes);
    rate.sent(now, params.least_bytes - params.overhead_bytes);
    ++packets;
  }
  // 30 s of 10 kB/s and one burst, in packets of 280 bytes.
  EXPECT_NEAR(packets, (30.0 * 10'000 + static_cast<double>(params.burst_bytes)) / 280.0, 2.0);
}

// The smallest k with loss^k R/T at most 0.0002. The loss is an estimate with a deviation of about sqrt(p (1 - p) /
// 128).
TEST(SendRate, RepeatsAsOftenAsTheLossAsksFor) {
  for (const double loss : {0.02, 0.1, 0.2, 0.3, 0.4, 0.7}) {
    for (const auto round_trip : {10ms, 80ms, 200ms}) {
      SendRate rate;
      rate.set_round_trip(round_trip);
      test::Random random(1);
      std::uint64_t received = 0;
      for (std::uint64_t counter = 1; counter <= 4000; ++counter) {
        if (random.unit() < loss) continue;
        ++received;
        if (random.unit() >= loss) rate.acknowledge(counter, received);
      }
      EXPECT_NEAR(rate.loss(), loss, 4.0 * std::sqrt(loss * (1 - loss) / 128.0));
      const double in_flight = std::chrono::duration<double>(round_trip).count() / 0.008;
      const auto late = [&](int k) { return std::pow(rate.loss(), k) * in_flight; };
      const int k = rate.repeats();
      std::printf("loss %.2f (taken for %.3f), round trip %3lld ms: in %d packets\n", loss, rate.loss(),
                  static_cast<long long>(round_trip.count()), k);
      EXPECT_TRUE(k == 12 || late(k) <= 0.0002) << loss;
      EXPECT_TRUE(k == 2 || late(k - 1) > 0.0002) << loss;
      if (loss == 0.7) {
        EXPECT_EQ(k, 12) << "the bound";
      }
    }
  }
  SendRate good;
  for (std::uint64_t counter = 1; counter <= 4000; ++counter) good.acknowledge(counter, counter);
  EXPECT_NEAR(good.loss(), 0.0, 1e-9);
  EXPECT_LE(good.repeats(), 3);
}

TEST(SendRate, IgnoresReportsThatGoBack) {
  SendRate rate;
  rate.acknowledge(1000, 900);
  const double loss = rate.loss();
  rate.acknowledge(999, 100);
  rate.acknowledge(1000, 1000);
  rate.acknowledge(1001, 899);
  EXPECT_EQ(rate.loss(), loss);
  EXPECT_NEAR(loss, 0.1, 1e-6);
}

TEST(PoseDeadband, LetsThroughWhatIsSeenOrFelt) {
  const Pose said = pose_along({10, -20, 30}, {1, 2, -3});
  const auto moved = [&](double mm, double degrees, const Vec3& axis) {
    Pose now = said;
    now.position_mm += mm * Vec3(0.6, 0.0, -0.8);
    now.rotation =
        now.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.normalized()));
    Pose negative = now;
    negative.rotation.coeffs() *= -1.0;
    EXPECT_EQ(has_moved(said, now), has_moved(said, negative)) << "q and -q are one rotation";
    return has_moved(said, now);
  };
  EXPECT_FALSE(moved(0, 0, Vec3::UnitX()));
  EXPECT_FALSE(moved(0.0199, 0, Vec3::UnitX()));
  EXPECT_TRUE(moved(0.0201, 0, Vec3::UnitX()));
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, -1, 2)}) {
    EXPECT_FALSE(moved(0, 0.0995, axis));
    EXPECT_TRUE(moved(0, 0.1005, axis));
    EXPECT_TRUE(moved(0, -0.1005, axis));
    EXPECT_TRUE(moved(0, 179, axis));
  }
}

}  // namespace
}  // namespace osteon
