// Runs the breaker for less than a minute, and all its trials every night. deploy/test --soak runs it longer, with
// other seeds. It computes and hardly waits: half of the time goes into starts of programs.
#include "tests/integration/breaker.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/trials.hpp"

namespace osteon::test {
namespace {

constexpr int kLives = 5, kDamages = 3, kMoreDamages = 6, kErrors = 4;

class BreakerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { breaker_ = new Breaker(false); }
  static void TearDownTestSuite() {
    const BreakerTally& tally = breaker_->tally();
    std::printf("%lu trials, %lu entries acknowledged: %lu whole, %lu named, %lu refused, %lu silent\n", tally.trials,
                tally.acknowledged, tally.whole, tally.named, tally.refused, tally.silent);
    delete breaker_;
  }
  void TearDown() override {
    const std::vector<std::string>& faults = breaker_->tally().faults;
    for (; told_ < faults.size(); ++told_) ADD_FAILURE() << faults[told_];
  }
  static Breaker& breaker() { return *breaker_; }

 private:
  inline static Breaker* breaker_ = nullptr;
  inline static std::size_t told_ = 0;
};

TEST_F(BreakerTest, DamageToOneFileIsHarmlessNamedOrRefused) {
  const std::uint64_t lives = trials(kLives);
  for (std::uint64_t seed = 1; seed <= lives; ++seed) breaker().damage(seed, kDamages, kMoreDamages);
  EXPECT_GE(breaker().tally().trials, lives);
}

TEST_F(BreakerTest, AClientThatComesBackFindsOutAnOlderCopyOfAllFiles) { breaker().older_copy(1); }

TEST_F(BreakerTest, NoSecondProgramChangesTheJournalOfAServerAtWork) { breaker().second_openers(1); }

TEST_F(BreakerTest, ADiskThatFailsLosesNothingThatWasAcknowledged) { breaker().write_errors(1, kErrors); }

TEST_F(BreakerTest, AFullDiskLosesNothingThatWasAcknowledged) {
  if (!breaker().full_disk(1)) GTEST_SKIP() << "this machine lets nobody mount a disk (unshare -rm)";
}

TEST_F(BreakerTest, AJournalThatNobodyMayWriteToIsReadAndLeftAsItIs) {
  if (!breaker().read_only(1)) GTEST_SKIP() << "this machine lets nobody mount a disk (unshare -rm)";
}

}  // namespace
}  // namespace osteon::test
