#include "common/link/datagram.hpp"

#include <gtest/gtest.h>

namespace osteon {
namespace {

TEST(Endpoint, IsPrintedAsItsFamilyWritesIt) {
  EXPECT_EQ(to_string({0, 0xffff'7f00'0001, 50000}), "127.0.0.1:50000");
  EXPECT_EQ(to_string({0, 1, 443}), "[0:0:0:0:0:0:0:1]:443");
  EXPECT_FALSE(Endpoint{}.is_set());
}

}  // namespace
}  // namespace osteon
