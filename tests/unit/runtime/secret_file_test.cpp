#include "common/runtime/secret_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <system_error>

#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

TEST(SecretFile, IsForItsOwnerAlone) {
  const test::TempDir dir;
  const fs::path file = dir / "a.key";
  EXPECT_FALSE(who_else_reads(file)) << "a file that does not exist has no readers";
  std::ofstream(file) << "secret";
  for (const int mode : {0600, 0400, 0700}) {
    fs::permissions(file, fs::perms(mode));
    EXPECT_FALSE(who_else_reads(file)) << std::oct << mode;
  }
  for (const int mode : {0640, 0620}) {
    fs::permissions(file, fs::perms(mode));
    EXPECT_EQ(who_else_reads(file), file.string() + " is secret, and its group may read or write it; chmod 600 " +
                                        file.string() + ", and make the key anew if anybody may have read it");
  }
  for (const int mode : {0604, 0602, 0644}) {
    fs::permissions(file, fs::perms(mode));
    EXPECT_NE(who_else_reads(file).value_or("").find("everybody on this machine"), std::string::npos)
        << std::oct << mode;
  }
}

// The unit of deploy/systemd reads certificates through its group. A warning would be about a permission that it needs.
TEST(SecretFile, MayBeReadByTheGroupThroughWhichThisProcessReadsIt) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root, to become another user";
  const test::TempDir dir;
  const fs::path file = dir / "a.key";
  std::ofstream(file) << "secret";
  fs::permissions(dir.path(), fs::perms(0755));
  fs::permissions(file, fs::perms(0640));
  ASSERT_EQ(::seteuid(64123), 0);
  std::error_code closed;  // a folder above may be closed to others, as in a container
  const bool reached = fs::exists(file, closed);
  const auto of_group = who_else_reads(file);
  ASSERT_EQ(::seteuid(0), 0);
  EXPECT_FALSE(of_group);
  fs::permissions(file, fs::perms(0644));
  ASSERT_EQ(::seteuid(64123), 0);
  const auto of_all = who_else_reads(file);
  ASSERT_EQ(::seteuid(0), 0);
  if (reached) {
    EXPECT_NE(of_all.value_or("").find("chmod o= "), std::string::npos);
  }
}

}  // namespace
}  // namespace osteon
