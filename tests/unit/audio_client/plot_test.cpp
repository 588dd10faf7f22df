// Plots: where curves, samples, bars and the grid lie on a picture whose axes are known.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "audio_client/analysis/plot.hpp"

namespace osteon::audio {
namespace {

using picture::Colour;
using picture::Picture;

constexpr Colour kCurve{200, 0, 0};
constexpr Frame kPlace{60, 20, 101, 51};  // a pixel for each hundredth of the axis, and each fiftieth

class PlotTest : public testing::Test {
 protected:
  [[nodiscard]] std::vector<int> rows_of(int column) const {
    std::vector<int> rows;
    for (int y = 0; y < page_.height(); ++y)
      if (page_.at(column, y) == kCurve) rows.push_back(y);
    return rows;
  }
  [[nodiscard]] int coloured() const {
    int count = 0;
    for (int x = 0; x < page_.width(); ++x) count += static_cast<int>(rows_of(x).size());
    return count;
  }

  Picture page_{200, 120, kPaper};
  Plot plot_{page_, kPlace, {0.0, 1.0, "x"}, {0.0, 1.0, "y"}};
};

TEST_F(PlotTest, ACurveGoesFromItsFirstToItsLastPoint) {
  plot_.curve(std::vector<double>{0, 1}, std::vector<double>{0, 1}, kCurve);
  EXPECT_EQ(rows_of(60).back(), 70);    // below on the left
  EXPECT_EQ(rows_of(160).front(), 20);  // above on the right
  EXPECT_EQ(rows_of(110).front(), 45);
  for (int x = 60; x <= 160; ++x) EXPECT_FALSE(rows_of(x).empty()) << x;
  EXPECT_TRUE(rows_of(59).empty());
  EXPECT_TRUE(rows_of(161).empty());
}

TEST_F(PlotTest, PointsInOneColumnShowTheirWholeRange) {
  plot_.curve(std::vector<double>{0.5, 0.501, 0.502}, std::vector<double>{0.2, 0.9, 0.4}, kCurve);
  EXPECT_EQ(rows_of(110).front(), 25);
  EXPECT_EQ(rows_of(110).back(), 60);
  EXPECT_EQ(coloured(), 36);
}

TEST_F(PlotTest, NothingIsDrawnBeyondTheFrame) {
  plot_.curve(std::vector<double>{-0.5, 0.2, 0.4, 1.5}, std::vector<double>{0.5, 3, -3, 0.5}, kCurve);
  EXPECT_GT(coloured(), 50);
  for (int x = 0; x < page_.width(); ++x)
    for (const int y : rows_of(x)) EXPECT_TRUE(x >= 60 && x <= 160 && y >= 20 && y <= 70) << x << "," << y;
}

TEST_F(PlotTest, EachSampleHasItsColumn) {
  // 505 samples in a second: five a pixel. One of them is a click.
  std::vector<float> samples(505, 0.5F);
  samples[152] = 1.0F;
  plot_.samples(samples, 505, kCurve);
  EXPECT_EQ(rows_of(88), (std::vector<int>{45}));
  EXPECT_EQ(rows_of(90).front(), 20);
  EXPECT_EQ(rows_of(90).back(), 45);
  EXPECT_EQ(rows_of(92), (std::vector<int>{45}));
}

TEST_F(PlotTest, AStepBetweenColumnsHasNoGap) {
  std::vector<float> samples(505, 0.2F);
  std::fill(samples.begin() + 250, samples.end(), 0.8F);
  plot_.samples(samples, 505, kCurve);
  int whole = 0;
  for (int x = 60; x <= 160; ++x) whole += rows_of(x).size() == 31;  // rows 30 to 60
  EXPECT_EQ(whole, 1);
}

TEST_F(PlotTest, ManySamplesInAColumnShowTheirRange) {
  std::vector<float> samples(10100, 0.5F);
  samples[5050] = 0.0F;
  plot_.samples(samples, 10100, kCurve);
  EXPECT_EQ(rows_of(110).back(), 70);
  EXPECT_EQ(rows_of(112), (std::vector<int>{45}));
}

TEST_F(PlotTest, ABarCoversItsRange) {
  plot_.bar(0.2, 0.3, 0.0, 0.5, kCurve);
  EXPECT_EQ(coloured(), 10 * 26);
  EXPECT_EQ(rows_of(80).front(), 45);
  EXPECT_EQ(rows_of(80).back(), 70);
}

TEST_F(PlotTest, TheGridIsAtRoundNumbers) {
  // A step of 1 for a width of 101 pixels, and of 0.5 for a height of 51.
  const auto grid = [&](int x, int y) { return page_.at(x, y) == kGrid; };
  EXPECT_TRUE(grid(60, 30));
  EXPECT_TRUE(grid(160, 30));
  EXPECT_FALSE(grid(110, 30));
  EXPECT_TRUE(grid(110, 45));
  EXPECT_FALSE(grid(110, 50));
}

// From 0 below to 20 above, on 51 rows. 101 pixels wide, the frame ends at column 161.
TEST_F(PlotTest, ASecondAxisHasItsNumbersAtTheRight) {
  plot_.right_axis({0.0, 20.0, "mm"}, kCurve);
  for (int y = 20; y <= 70; ++y) EXPECT_EQ(page_.at(161, y), kCurve) << y;
  for (const int tick : {20, 45, 70}) EXPECT_EQ(page_.at(164, tick), kCurve) << "0, 10 and 20: " << tick;
  for (const int between : {30, 57}) EXPECT_NE(page_.at(164, between), kCurve) << between;
  const auto inked = [&](int from_x, int to_x, int from_y, int to_y) {
    for (int x = from_x; x < to_x; ++x)
      for (int y = from_y; y < to_y; ++y)
        if (page_.at(x, y) == kCurve) return true;
    return false;
  };
  EXPECT_TRUE(inked(168, 173, 67, 74)) << "0";
  EXPECT_TRUE(inked(174, 179, 17, 24)) << "the second digit of 20";
  EXPECT_TRUE(inked(190, 200, 8, 15) && !inked(161, 190, 8, 15)) << "the label ends 44 pixels behind the frame";
}

// A unit is another one in capitals: mm and Mm, s and S.
TEST(PictureText, SmallLettersAreNoCapitals) {
  const auto drawn = [](const std::string& text) {
    Picture page(12, 9, kPaper);
    page.text(0, 0, text, kInk);
    std::vector<int> dots;
    for (int y = 0; y < page.height(); ++y)
      for (int x = 0; x < page.width(); ++x) dots.push_back(page.at(x, y) == kInk ? 1 : 0);
    return dots;
  };
  std::set<std::vector<int>> seen{drawn("?")};
  for (char letter = 'a'; letter <= 'z'; ++letter) {
    EXPECT_TRUE(seen.insert(drawn({letter})).second) << letter;
    EXPECT_TRUE(seen.insert(drawn({static_cast<char>(letter - 'a' + 'A')})).second) << letter << " as a capital";
  }
}

TEST(Heat, RisesInBrightness) {
  int before = -1;
  for (int i = 0; i <= 20; ++i) {
    const Colour colour = heat(i / 20.0);
    const int brightness = 299 * colour.red + 587 * colour.green + 114 * colour.blue;
    EXPECT_GT(brightness, before) << i;
    before = brightness;
  }
  EXPECT_EQ(heat(-3), heat(0));
  EXPECT_EQ(heat(7), heat(1));
}

}  // namespace
}  // namespace osteon::audio
