// What a process that has confined itself can still do. A child process makes each attempt, with the system's own
// calls.
#include "server/upload_validation/confine.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "server/upload_validation/case_archive.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

class ConfineTest : public ::testing::Test {
 protected:
  ConfineTest() {
    fs::create_directory(own_);
    std::ofstream(own_ / "given") << "x";
    std::ofstream(other_) << "x";
    // Only the kernel decides whether it supports Landlock. The code is not asked.
    can_hold_files_ = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, 1u) >= 1;
  }
  // Result of an attempt in a child process: 0 if it worked, otherwise errno; -1 if the child was killed.
  static int in_child(const std::function<int()>& attempt, const fs::path* confined) {
    const pid_t child = ::fork();
    if (child == 0) {
      if (confined) (void)confine_to(*confined);
      errno = 0;
      const int result = attempt();
      ::_exit(result >= 0 ? 0 : errno);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  // The attempt works in any process, and fails in a confined one.
  void expect_taken_away(const char* what, const std::function<int()>& attempt) const {
    EXPECT_EQ(in_child(attempt, nullptr), 0) << what << " does not work without confinement either";
    EXPECT_GT(in_child(attempt, &own_), 0) << what;
  }
  void expect_left(const char* what, const std::function<int()>& attempt) const {
    EXPECT_EQ(in_child(attempt, &own_), 0) << what;
  }

  test::TempDir temp_;
  const fs::path own_ = temp_ / "own", other_ = temp_ / "other";
  bool can_hold_files_ = false;
};

int open_to(const fs::path& file, int how) { return ::open(file.c_str(), how | O_CLOEXEC, 0600); }

TEST_F(ConfineTest, ItsOwnFolderIsAllThatItHas) {
  expect_left("reading", [&] { return open_to(own_ / "given", O_RDONLY); });
  expect_left("writing", [&] { return open_to(own_ / "given", O_WRONLY | O_TRUNC); });
  expect_left("making a file", [&] { return open_to(own_ / "new", O_WRONLY | O_CREAT); });
  expect_left("a folder in it, and files there", [&] {
    const bool made =
        ::mkdir((own_ / "sub").c_str(), 0700) == 0 && open_to(own_ / "sub" / "new", O_WRONLY | O_CREAT) >= 0;
    return made && ::rename((own_ / "sub" / "new").c_str(), (own_ / "sub" / "newer").c_str()) == 0 ? 0 : -1;
  });
  if (!can_hold_files_) GTEST_SKIP() << "this kernel has no Landlock";
  expect_taken_away("reading elsewhere", [&] { return open_to(other_, O_RDONLY); });
  expect_taken_away("reading what the system has", [] { return open_to("/etc/passwd", O_RDONLY); });
  expect_taken_away("looking at processes", [] { return open_to("/proc/self/status", O_RDONLY); });
  expect_taken_away("writing elsewhere", [&] { return open_to(other_, O_WRONLY); });
  expect_taken_away("making a file beside it", [&] { return open_to(temp_ / "beside", O_WRONLY | O_CREAT); });
}

TEST_F(ConfineTest, ItMakesNoLinksAndDeletesNothingElsewhere) {
  if (!can_hold_files_) GTEST_SKIP() << "this kernel has no Landlock";
  EXPECT_GT(in_child([&] { return ::unlink(other_.c_str()); }, &own_), 0);
  EXPECT_TRUE(fs::exists(other_));
  expect_taken_away("a symbolic link", [&] { return ::symlink(other_.c_str(), (own_ / "link").c_str()); });
  EXPECT_GT(in_child([&] { return ::link(other_.c_str(), (own_ / "hard").c_str()); }, &own_), 0);
}

TEST_F(ConfineTest, NobodyElseIsReached) {
  const pid_t me = ::getpid();
  for (const int family : {AF_INET, AF_UNIX})
    expect_taken_away("a socket", [=] { return ::socket(family, SOCK_DGRAM, 0); });
  expect_taken_away("a signal", [=] { return ::kill(me, 0); });
  expect_taken_away("a signal to a thread", [=] { return static_cast<int>(::syscall(SYS_tgkill, me, me, 0)); });
  expect_taken_away("another's limits", [=] {
    rlimit now{};
    return ::prlimit(me, RLIMIT_CORE, nullptr, &now);
  });
  expect_taken_away("another program", [] { return ::execl("/bin/true", "true", nullptr); });
}

TEST_F(ConfineTest, WhatItNeedsIsLeft) {
  expect_left("threads", [] {
    int done = 0;
    std::thread([&] { done = 1; }).join();
    return done - 1;
  });
  expect_left("memory", [] { return std::string(64 << 20, 'x').size() > 0 ? 0 : -1; });
  expect_left("its limits", [] {
    rlimit now{};
    return ::getrlimit(RLIMIT_AS, &now);
  });
  // It can abort, as a library does that detects an inconsistency.
  EXPECT_EQ(in_child([]() -> int { std::abort(); }, &own_), -1);
}

TEST_F(ConfineTest, SaysWhatHolds) {
  EXPECT_EQ(in_child([&] { return confine_to(own_).files == can_hold_files_ ? 0 : (errno = 1, -1); }, nullptr), 0);
  EXPECT_EQ(in_child([&] { return confine_to(own_).calls ? 0 : (errno = 1, -1); }, nullptr), 0);
  if (can_hold_files_) {
    EXPECT_EQ(in_child([&] { return !confine_to(own_ / "not there").files ? 0 : (errno = 1, -1); }, nullptr), 0);
  }
}

// The process that validates cases cannot reach an archive that is not in its folder.
TEST_F(ConfineTest, TheProcessThatLooksCasesThroughIsConfined) {
  ASSERT_TRUE(test::plain_block(6, 3, 0.5).save(temp_ / "case"));
  ASSERT_TRUE(pack_case(temp_ / "case", own_ / "upload.zip"));
  fs::copy_file(own_ / "upload.zip", temp_ / "elsewhere.zip");
  const std::string quota = R"({"archive_bytes":1000000000,"unpacked_bytes":1000000000,"entries":16,"ratio":200.0,)"
                            R"("ratio_free_bytes":1000000})";
  const auto looked = [&](const fs::path& archive) {
    fs::remove_all(own_ / "sent");
    return test::run(test::program("osteon-server"), {"check-case", archive, own_, quota}, std::chrono::seconds(60));
  };
  const auto sound = looked(own_ / "upload.zip");
  EXPECT_EQ(sound.exit_code, 0) << sound.out << sound.err;
  EXPECT_TRUE(fs::exists(own_ / "sound" / "bone.vdb"));
  EXPECT_NE(sound.out.find("\"calls_held\":true"), std::string::npos) << sound.out;
  const auto beyond = looked(temp_ / "elsewhere.zip");
  EXPECT_EQ(beyond.exit_code == 0, !can_hold_files_) << beyond.out;
}

}  // namespace
}  // namespace osteon
