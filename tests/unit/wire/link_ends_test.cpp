// The two ends of the fast path on networks from good to hostile, on virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/scenario/recording.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/unit/wire/link_trial.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::hostile;
using test::node;
using test::PathQuality;
using test::Random;
using test::Time;
using test::Trial;
using test::TrialOptions;

double ms(Time t) { return std::chrono::duration<double, std::milli>(t).count(); }

double share_of(std::vector<double>& values, double share) {
  std::ranges::sort(values);
  return values.empty() ? 0.0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

TEST(LinkEnds, EverythingOnceAndInOrderOnAHostileNetwork) {
  std::size_t cuts = 0, by_stream = 0, rows = 0;
  std::vector<double> settled_ms;
  std::uint64_t corrupted = 0, forged = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Trial trial({.seed = seed, .quality = hostile()});
    Random random(seed);
    if (seed % 4 != 0) {
      const Time from(static_cast<std::int64_t>(random.between(0.2e9, 1.2e9)));
      const Time until = from + Time(static_cast<std::int64_t>(random.between(0.3e9, seed % 4 == 1 ? 3e9 : 0.8e9)));
      if (seed % 4 == 3) trial.partition(from, until);
      else trial.block(from, until);
    }
    trial.cut(true);
    trial.time.run_until(1500ms);
    trial.cut(false);
    const Time took = trial.settle(8s);
    ASSERT_TRUE(trial.exact()) << "seed " << seed;
    ASSERT_TRUE(trial.settled()) << "seed " << seed;
    if (seed % 4 == 0) settled_ms.push_back(ms(took));
    for (std::size_t c = 0; c < Trial::kClients; ++c) {
      cuts += trial.clients[c]->cuts.size();
      rows += trial.clients[c]->rows.size();
      by_stream += trial.clients[c]->rows_by_stream;
      forged += trial.sessions[c]->link.half().open_counts().forged + trial.clients[c]->link.half().open_counts().forged;
      EXPECT_EQ(trial.sessions[c]->link.half().counts().malformed, 0u);
      EXPECT_EQ(trial.clients[c]->link.half().counts().malformed, 0u);
    }
    corrupted += trial.network.counts().paths.corrupted;
  }
  std::printf("200 seeds: %zu cuts, %zu rows taken, %zu of them by stream; %llu datagrams corrupted, %llu seen as forged; without "
              "partition settled after p50 %.0f, most %.0f ms\n",
              cuts, rows, by_stream, static_cast<unsigned long long>(corrupted), static_cast<unsigned long long>(forged),
              share_of(settled_ms, 0.5), share_of(settled_ms, 1.0));
  EXPECT_GT(forged, corrupted / 3);
  EXPECT_LT(share_of(settled_ms, 1.0), 2000.0);
}

TEST(LinkEnds, DelayUntilAPartnerHasACut) {
  for (const bool bad : {false, true}) {
    std::vector<double> felt;
    double up = 0, down = 0;
    PathQuality quality = hostile(40ms);
    quality.reorder = quality.duplicate = quality.corrupt = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      Trial trial({.seed = seed, .quality = bad ? quality : PathQuality{}, .long_cuts = 0, .events = 0});
      trial.time.run_until(1s);
      trial.cut(true);
      trial.time.run_until(5s);
      trial.cut(false);
      trial.settle(4s);
      ASSERT_TRUE(trial.settled());
      up += static_cast<double>(trial.clients[0]->uplink_bytes) * 8 / 5000 / 40;
      down += static_cast<double>(trial.sessions[0]->downlink_bytes) * 8 / 5000 / 40;
      for (const auto& client : trial.clients) felt.insert(felt.end(), client->felt_ms.begin(), client->felt_ms.end());
    }
    std::printf("%s: p50 %.1f p90 %.1f p99 %.1f p99.9 %.1f max %.1f ms; %.0f kbit/s up, %.0f down\n", bad ? "40 +- 10 ms, 30 % lost" : "no impairment",
                share_of(felt, 0.5), share_of(felt, 0.9), share_of(felt, 0.99), share_of(felt, 0.999), share_of(felt, 1), up, down);
    EXPECT_LE(share_of(felt, 0.99), bad ? 135.0 : 25.0);
  }
}

}  // namespace
}  // namespace osteon
