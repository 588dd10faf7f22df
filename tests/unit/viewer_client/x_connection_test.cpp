#include "viewer_client/render/x_connection.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace osteon {
namespace {

TEST(NoScreen, IsSaidInOneSentence) {
  ::unsetenv("DISPLAY");
  const auto without = XConnection::open();
  ASSERT_FALSE(without);
  EXPECT_NE(without.error().message.find("DISPLAY"), std::string::npos);
  EXPECT_NE(without.error().message.find("xvfb-run"), std::string::npos);

  ::setenv("DISPLAY", "nowhere.invalid:99", 1);
  const auto unreachable = XConnection::open();
  ASSERT_FALSE(unreachable);
  EXPECT_NE(unreachable.error().message.find("nowhere.invalid:99"), std::string::npos);
  ::unsetenv("DISPLAY");
}

}  // namespace
}  // namespace osteon
