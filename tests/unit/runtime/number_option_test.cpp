#include "common/runtime/number_option.hpp"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>

namespace osteon {
namespace {

// Empty: the option takes the value.
std::string said_to(std::string value) { return number_in(-2.5, 1e6)(value); }

TEST(NumberIn, TakesWhatIsWithinItsLimits) {
  for (const char* good : {"-2.5", "0", "-0", "1e3", "999999.5", "1000000"}) EXPECT_EQ(said_to(good), "") << good;
}

TEST(NumberIn, RefusesEverythingElseWithOneSentence) {
  for (const char* wrong : {"nan", "-nan", "NaN", "nan(1)", "inf", "-inf", "1000000.5", "-2.51", "1e400", "two", "2x"})
    EXPECT_EQ(said_to(wrong), std::string(wrong) + " is not a number from -2.5 to 1000000");
}

TEST(NumberIn, TheHelpSaysTheLimits) {
  EXPECT_EQ(number_in(0.001, 87600.0).get_description(), "NUMBER in [0.001 - 87600]");
}

}  // namespace
}  // namespace osteon
