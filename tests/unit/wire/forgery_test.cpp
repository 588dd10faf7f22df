// Datagrams that reach a server from an attacker without a key.
#include "tests/unit/wire/forgery.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace osteon {
namespace {

// The server opens no forgery, and sends nothing because of one. The clients' own datagrams arrive meanwhile, also
// after moves to other addresses. perf/forgery.cpp does the same 10 million times.
TEST(Forgery, IsNeitherAcceptedNorAnswered) {
  constexpr std::uint64_t kCount = 100'000;
  const test::ForgeryReport report = test::forge(kCount, 3);
  EXPECT_EQ(report.accepted, 0u);
  EXPECT_EQ(report.answered_bytes, 0u);
  EXPECT_EQ(std::accumulate(report.sent.begin(), report.sent.end(), std::uint64_t{0}), kCount);
  for (std::size_t i = 0; i < test::kForgeries; ++i) EXPECT_GT(report.sent[i], 10'000u) << test::kForgeryNames[i];
  // The server saw each of them, and counts why it refused it.
  EXPECT_EQ(report.unknown_session + report.malformed + report.replayed + report.forged, kCount);
  EXPECT_GT(report.replayed, 10'000u);
  EXPECT_GT(report.forged, 40'000u);
  EXPECT_EQ(report.genuine_accepted, report.genuine);
  EXPECT_GT(report.genuine, 3000u);
  EXPECT_GT(report.genuine_answered, 1000u);
  EXPECT_GT(report.cuts, 1000u);
  EXPECT_GT(report.cuts_returned, report.cuts * 9 / 10);  // the newest are on their way
  EXPECT_GE(report.moves, 4u);
  EXPECT_GE(report.moves_noticed, report.moves);
  EXPECT_GE(report.generations, 2u);
}

}  // namespace
}  // namespace osteon
