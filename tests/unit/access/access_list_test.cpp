#include "common/access/access_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using testing::HasSubstr;

AccessList list_of(const std::string& text) {
  const Result<AccessList> list = AccessList::parse(text, "access");
  EXPECT_TRUE(list.has_value()) << list.error().message;
  return list.value_or(AccessList{});
}

TEST(AccessList, RefusesWhatWasRevokedAndNothingElse) {
  const AccessList list = list_of(
      "# who left\n\nrevoke certificate 0A:1f\n  revoke user ben \nrevoke ticket 00ff00ff00ff00ff00ff00ff00ff00ff\r\n");
  EXPECT_EQ(list.size(), 3u);
  for (const char* serial : {"A1F", "0a1f", "00:0A:1F"})
    EXPECT_THAT(list.refuses(serial, "x", "1").value_or(""), HasSubstr("certificate")) << serial;
  EXPECT_THAT(list.refuses("1", "ben", "1").value_or(""), HasSubstr("ben"));
  EXPECT_THAT(list.refuses("1", "x", "00FF00FF00FF00FF00FF00FF00FF00FF").value_or(""), HasSubstr("ticket"));
  EXPECT_FALSE(list.refuses("A1F0", "Ben", "ff"));
  EXPECT_FALSE(list.refuses("", "", ""));
}

TEST(AccessList, ChangesRolesInOneRoomOrInAll) {
  const AccessList list = list_of("role ben observer\nrole ben instructor my room\nrole eve collaborator other\n");
  EXPECT_EQ(list.role("ben", "my room", Role::trainee), Role::instructor);
  EXPECT_EQ(list.role("ben", "other", Role::trainee), Role::observer);
  EXPECT_EQ(list.role("eve", "other", Role::trainee), Role::collaborator);
  EXPECT_EQ(list.role("eve", "my room", Role::trainee), Role::trainee);
  EXPECT_EQ(list.role("ann", "other", Role::trainee), Role::trainee);
}

TEST(AccessList, NamesTheLineThatIsWrong) {
  for (const char* line :
       {"revoke", "revoke user", "revoke user a b", "revoke user a/b", "revoke room x", "revoke certificate xyz",
        "role ben", "role ben king", "role b/n observer", "allow ben", "Revoke user ben"}) {
    const Result<AccessList> list = AccessList::parse(std::string("# one\n") + line + "\n", "access.txt");
    ASSERT_FALSE(list) << line;
    EXPECT_EQ(list.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(list.error().message, HasSubstr("access.txt:2: ")) << line;
  }
}

class AccessFileTest : public ::testing::Test {
 protected:
  void write(const std::string& text) { std::ofstream(file_, std::ios::trunc) << text; }
  bool refuses_ben() const { return access_.list().refuses("1", "ben", "1").has_value(); }
  test::TempDir dir_;
  std::filesystem::path file_ = dir_ / "access.txt";
  AccessFile access_{file_};
};

TEST_F(AccessFileTest, IsReadAgainWhenItChanges) {
  EXPECT_EQ(access_.refresh().value(), false);
  EXPECT_FALSE(refuses_ben());
  write("revoke user ben\n");
  EXPECT_EQ(access_.refresh().value(), true);
  EXPECT_TRUE(refuses_ben());
  EXPECT_EQ(access_.refresh().value(), false);
  // The new text has the same length and perhaps the same time.
  write("revoke user bon\n");
  EXPECT_EQ(access_.refresh().value(), true);
  EXPECT_FALSE(refuses_ben());
}

TEST_F(AccessFileTest, LetsNobodyInAgainByAMistake) {
  write("revoke user ben\n");
  ASSERT_TRUE(access_.refresh().has_value());
  write("rvoke user ann\n");
  ASSERT_FALSE(access_.refresh().has_value());
  EXPECT_TRUE(refuses_ben());
  EXPECT_EQ(access_.refresh().value(), false) << "a mistake is reported once";
  std::filesystem::remove(file_);
  EXPECT_FALSE(access_.refresh().has_value());
  EXPECT_TRUE(refuses_ben());
  write("");
  EXPECT_EQ(access_.refresh().value(), true);
  EXPECT_FALSE(refuses_ben());
}

}  // namespace
}  // namespace osteon
