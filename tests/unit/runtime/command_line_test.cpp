#include "common/runtime/command_line.hpp"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

namespace osteon {
namespace {

TEST(Wrapped, BreaksAtBlanksWithinTheColumns) {
  EXPECT_EQ(wrapped("one two three", 7, 0, 0), "one two\nthree");
  EXPECT_EQ(wrapped("one two three", 8, 2, 0), "one two\n  three");
}

TEST(Wrapped, CountsWhatStandsInFront) { EXPECT_EQ(wrapped("one two", 9, 4, 4), "one\n    two"); }

TEST(Wrapped, KeepsLineBreaksAndLongWords) {
  EXPECT_EQ(wrapped("a\nb", 10, 2, 0), "a\n  b");
  EXPECT_EQ(wrapped("unbreakable", 4, 0, 0), "unbreakable");
  EXPECT_EQ(wrapped("", 4, 0, 0), "");
}

TEST(Wrapped, CountsCharactersAndNotBytes) { EXPECT_EQ(wrapped("ä ö ü", 5, 0, 0), "ä ö ü"); }

// For any text: the same words in the same order, and no line is too wide unless it is a single word.
TEST(Wrapped, LosesNoWord) {
  std::string text;
  for (int i = 0; i < 200; ++i) text += std::string(static_cast<std::size_t>(i * 7 % 13 + 1), 'x') + " ";
  for (std::size_t columns = 5; columns < 60; ++columns) {
    std::istringstream lines(wrapped(text, columns, 3, 0)), before(text);
    std::string line, word;
    while (std::getline(lines, line)) {
      EXPECT_TRUE(line.size() <= columns || line.find(' ', 3) == std::string::npos) << line;
      std::istringstream words(line);
      for (std::string found; words >> found;) {
        before >> word;
        EXPECT_EQ(found, word);
      }
    }
    EXPECT_FALSE(before >> word);
  }
}

}  // namespace
}  // namespace osteon
