// Tests of the test helpers: a helper that misses faults hides every fault from the tests that use it.
#include <gtest/gtest.h>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <new>
#include <thread>

#include "tests/support/allocation_counter.hpp"
#include "tests/support/process.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {
using namespace std::chrono_literals;

TEST(Process, GivesExitCodeAndBothOutputs) {
  const auto result = run("sh", {"-c", "echo out; echo err >&2; exit 3"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.out, "out\n");
  EXPECT_EQ(result.err, "err\n");
}

TEST(Process, NamesTheSignalThatEndedIt) {
  Process process("sleep", {"60"});
  EXPECT_TRUE(process.running());
  EXPECT_EQ(process.terminate(), 128 + SIGTERM);
  EXPECT_FALSE(process.running());
}

TEST(Process, EndsWithItsScope) {
  pid_t pid = 0;
  {
    const Process process("sleep", {"60"});
    pid = process.pid();
    EXPECT_EQ(::kill(pid, 0), 0);
  }
  EXPECT_NE(::kill(pid, 0), 0);
}

TEST(Process, IsKilledWhenItRunsTooLong) {
  const auto result = run("sleep", {"60"}, 100ms);
  EXPECT_TRUE(result.timed_out);
  EXPECT_EQ(result.exit_code, 128 + SIGKILL);
}

TEST(Process, AMissingProgramIsAnExitCode) { EXPECT_EQ(run("osteon-no-such-program", {}).exit_code, 127); }

TEST(Process, TalksLineByLine) {
  Process process("cat", {});
  process.write("one\ntwo\n");
  EXPECT_EQ(process.read_line(5s), "one");
  EXPECT_EQ(process.read_line(5s), "two");
  process.close_input();
  EXPECT_EQ(process.wait(5s), 0);
  EXPECT_EQ(process.read_line(5s), std::nullopt);
}

TEST(Process, ChildSeesTheEnvironmentAndFolderItWasGiven) {
  const TempDir folder;
  ProcessOptions options;
  options.environment = {{"OSTEON_TEST_VALUE", "7 8"}};
  options.without = {"HOME"};
  options.folder = folder.path();
  const auto result = run("sh", {"-c", "echo \"$OSTEON_TEST_VALUE|${HOME-none}\"; pwd"}, 10s, options);
  EXPECT_EQ(result.out, "7 8|none\n" + std::filesystem::canonical(folder.path()).string() + "\n");
}

TEST(Process, DoesNotWaitForWhatTheChildLeftBehind) {
  const auto result = run("sh", {"-c", "sleep 20 & echo started"}, 10s);
  EXPECT_FALSE(result.timed_out);
  EXPECT_EQ(result.out, "started\n");
}

TEST(Wait, AddressIsTakenOnlyWhenItsLineIsWhole) {
  const TempDir folder;
  const auto file = folder / "address";
  std::ofstream(file) << "127.0.0.1:4";
  EXPECT_EQ(wait_for_address(file, 50ms), std::nullopt);
  std::ofstream(file) << "127.0.0.1:4321\n";
  EXPECT_EQ(wait_for_address(file, 5s), "127.0.0.1:4321");
}

TEST(TempDir, RemovesItsContent) {
  std::filesystem::path path;
  {
    const TempDir folder;
    path = folder.path();
    std::ofstream(folder / "file") << "x";
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(AllocationCounter, CountsNewAndMallocOfThisThreadOnly) {
  const AllocationCounter heap;
  EXPECT_EQ(heap.count(), 0);
  ::operator delete(::operator new(64));
  EXPECT_EQ(heap.count(), 1);
  ::operator delete (::operator new (64, std::align_val_t{128}), std::align_val_t{128});
  EXPECT_EQ(heap.count(), 2);
  void* volatile block = std::malloc(64);
  std::free(block);
  EXPECT_EQ(heap.count(), 3);

  std::int64_t after_start = 0;
  std::atomic<bool> go = false;
  std::thread other([&] {
    while (!go) std::this_thread::yield();
    for (int i = 0; i < 100; ++i) ::operator delete(::operator new(64));
  });
  after_start = heap.count();
  go = true;
  other.join();
  EXPECT_EQ(heap.count(), after_start);
}

TEST(SharedData, SourceFolderIsTheCheckout) {
  EXPECT_TRUE(std::filesystem::exists(source_dir() / "CMakePresets.json"));
}

}  // namespace
}  // namespace osteon::test
