#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/periodic.hpp"
#include "common/runtime/spsc_queue.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/runtime/triple_buffer.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

struct Pair {
  std::uint64_t a = 0, b = 0;
};

TEST(TripleBuffer, TheReaderSeesOnlyWholeValuesAndAtLastTheNewest) {
  TripleBuffer<Pair> latest;
  constexpr std::uint64_t kLast = 200'000;
  std::jthread writer([&] {
    for (std::uint64_t i = 1; i <= kLast; ++i) latest.store({i, ~i});
  });
  std::uint64_t previous = 0;
  while (previous < kLast) {
    if (!latest.refresh()) continue;
    const Pair seen = latest.value();
    ASSERT_EQ(seen.b, ~seen.a);
    ASSERT_GT(seen.a, previous);
    previous = seen.a;
  }
  EXPECT_FALSE(latest.refresh());
}

TEST(SpscQueue, KeepsOrderAndLosesNothingWhenPushIsTriedAgain) {
  SpscQueue<int, 64> queue;
  constexpr int kLast = 200'000;
  std::jthread producer([&] {
    for (int i = 0; i < kLast;)
      if (queue.try_push(i)) ++i;
  });
  int value = 0;
  for (int expected = 0; expected < kLast;) {
    if (!queue.try_pop(value)) continue;
    ASSERT_EQ(value, expected++);
  }
  EXPECT_FALSE(queue.try_pop(value));
}

TEST(SpscQueue, RefusesWhenFull) {
  SpscQueue<int, 4> queue;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(queue.try_push(i));
  EXPECT_FALSE(queue.try_push(9));
  EXPECT_EQ(queue.size(), 4u);
}

TEST(DurationHistogram, PercentilesAreRightToThreePerCent) {
  DurationHistogram histogram;
  for (int us = 1; us <= 10'000; ++us) histogram.record(std::chrono::microseconds(us));
  for (const double percent : {1.0, 50.0, 99.0, 99.9})
    EXPECT_NEAR(histogram.percentile_us(percent), 100.0 * percent, 3.0 * percent);
  EXPECT_DOUBLE_EQ(histogram.max_us(), 10'000.0);
  histogram.record(-5ns);
  EXPECT_EQ(histogram.count(), 10'001u);
  EXPECT_EQ(DurationHistogram{}.percentile_us(50), 0.0);
}

TEST(DurationHistogram, CountsAndAddsUpToThreePerCent) {
  DurationHistogram histogram;
  for (int us = 1; us <= 1000; ++us) histogram.record(std::chrono::microseconds(us));
  EXPECT_NEAR(static_cast<double>(histogram.count_up_to(500us)), 500, 16);
  EXPECT_EQ(histogram.count_up_to(0us), 0u);
  EXPECT_EQ(histogram.count_up_to(-1us), 0u);
  EXPECT_EQ(histogram.count_up_to(1h), 1000u);
  EXPECT_DOUBLE_EQ(histogram.sum_us(), 500'500.0);
  const DurationHistogram earlier = histogram;
  histogram.record(7us);
  EXPECT_DOUBLE_EQ(histogram.since(earlier).sum_us(), 7.0);
}

TEST(DurationHistogram, TellsWhatCameLater) {
  TickStats stats;
  for (int us = 1; us <= 1000; ++us) stats.work.record(std::chrono::microseconds(us));
  const TickStats earlier = stats;
  for (int us = 5001; us <= 6000; ++us) stats.work.record(std::chrono::microseconds(us));
  stats.missed = 3;
  const TickStats later = stats.since(earlier);
  EXPECT_EQ(later.work.count(), 1000u);
  EXPECT_EQ(later.missed, 3u);
  EXPECT_NEAR(later.work.percentile_us(50), 5500.0, 0.03 * 5500.0);
  EXPECT_NEAR(later.work.percentile_us(1), 5010.0, 0.03 * 5010.0);
}

TEST(PeriodicTimer, NeverTicksEarlyAndCountsWhatItMissed) {
  TickStats stats;
  const auto start = std::chrono::steady_clock::now();
  PeriodicTimer timer(2ms);
  int periods = 0;
  for (int i = 0; i < 20; ++i) {
    periods += timer.wait(stats);
    if (i == 10) std::this_thread::sleep_for(9ms);  // a stall longer than four periods
    timer.done(stats);
  }
  EXPECT_GE(std::chrono::steady_clock::now() - start, 2ms * periods);
  EXPECT_GE(stats.missed, 3u);
  EXPECT_EQ(stats.missed + 20u, static_cast<unsigned>(periods)) << "every period has either a tick or a miss";
  EXPECT_EQ(stats.lateness.count(), 20u);
  EXPECT_EQ(stats.work.count(), 20u);
}

TEST(StopSignal, IsRaisedBySigterm) {
  const pid_t child = ::fork();
  if (child == 0) {
    StopSignal stop;
    if (stop.requested()) ::_exit(2);
    ::kill(::getpid(), SIGTERM);
    ::_exit(stop.wait_for(10s) ? 0 : 3);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(StopSignal, IsRaisedByAHangUpIfAsked) {
  // Returns what ended a child that was hung up on: an exit code, or the signal.
  const auto hung_up = [](StopSignal::HangUp hang_up, void (*before)(int)) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::signal(SIGHUP, before);
      StopSignal stop(hang_up);
      ::kill(::getpid(), SIGHUP);
      ::_exit(stop.wait_for(100ms) ? 1 : 2);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 100 + WTERMSIG(status);
  };
  EXPECT_EQ(hung_up(StopSignal::HangUp::stops, SIG_DFL), 1);
  EXPECT_EQ(hung_up(StopSignal::HangUp::ends, SIG_DFL), 100 + SIGHUP);
  EXPECT_EQ(hung_up(StopSignal::HangUp::stops, SIG_IGN), 2) << "nohup started it";
}

// If somebody presses Ctrl-C again, the program must still write everything before it ends.
TEST(StopSignal, ASecondSigintCutsNothingOff) {
  const pid_t child = ::fork();
  if (child == 0) {
    StopSignal stop;
    for (int i = 0; i < 3; ++i) ::kill(::getpid(), SIGINT);
    ::_exit(stop.wait_for(10s) ? 0 : 3);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(Files, AreWrittenWholeAndReadBack) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "a", "first"));
  ASSERT_TRUE(write_file(temp / "a", "second"));
  EXPECT_EQ(*read_file(temp / "a"), "second");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp.path()), {}), 1);
  const auto missing = read_file(temp / "b");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("b"), std::string::npos);
  EXPECT_FALSE(write_file(temp / "no-folder" / "c", "x"));

  // A rename cannot replace a folder.
  std::filesystem::create_directory(temp / "folder");
  EXPECT_FALSE(write_file(temp / "folder", "x"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp.path()), {}), 2) << "a partial file was left";
}

// Asked before hours of work: the answer is the same as that of writing, and no file is left.
TEST(Files, SayBeforehandWhetherTheyCanBeWritten) {
  const osteon::test::TempDir temp;
  EXPECT_TRUE(check_writable({}, "the log", "--log"));
  EXPECT_TRUE(check_writable(temp / "new", "the log", "--log"));
  EXPECT_FALSE(std::filesystem::exists(temp / "new"));
  ASSERT_TRUE(write_file(temp / "old", "kept"));
  EXPECT_TRUE(check_writable(temp / "old", "the log", "--log"));
  EXPECT_EQ(*read_file(temp / "old"), "kept");
  // Root may write into /proc, but even root cannot create a file there.
  for (const std::filesystem::path& wrong :
       {temp / "no-folder" / "a", temp.path(), std::filesystem::path("/proc/a.log")}) {
    const Result<void> answer = check_writable(wrong, "the log", "--log");
    ASSERT_FALSE(answer) << wrong;
    EXPECT_NE(answer.error().message.find("give --log a file in a folder"), std::string::npos)
        << answer.error().message;
  }
}

TEST(Log, LinesHaveKeysAndQuotesWhereNeeded) {
  log::open("runtime-test");
  testing::internal::CaptureStderr();
  log::warn("case_loaded", {{"path", "a b"}, {"voxels", 12}, {"pitch_mm", 0.5}, {"ok", true}});
  const std::string line = testing::internal::GetCapturedStderr();
  EXPECT_NE(line.find("warning runtime-test case_loaded path=\"a b\" voxels=12 pitch_mm=0.5 ok=true"),
            std::string::npos)
      << line;
}

}  // namespace
}  // namespace osteon
