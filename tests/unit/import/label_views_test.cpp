// Pictures of balls and boxes, whose outlines and silhouettes have a closed form, on scans that lie obliquely.
#include "server/import/label_views.hpp"

#include <png.h>

#include <cmath>
#include <numbers>

#include "server/import/report_pictures.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

constexpr double kBallRadius_mm = 9.0;
const Vec3 kBallCentre(4.0, -3.0, 60.0);

// Oblique voxels of 0.6 x 0.6 x 1.5 mm around a ball of label 3 with 1000 HU; a box of label 7 in its middle, if asked.
struct BallScan {
  ScanGeometry geometry;
  std::vector<std::int16_t> hu;
  std::vector<std::uint8_t> labels;

  explicit BallScan(double core_mm = 0.0) {
    const Eigen::Matrix3d turned =
        (Eigen::AngleAxisd(0.3, Vec3::UnitX()) * Eigen::AngleAxisd(-0.2, Vec3::UnitZ())).toRotationMatrix();
    geometry.dims = {48, 48, 22};
    geometry.axes_mm = turned * Vec3(0.6, 0.6, 1.5).asDiagonal();
    geometry.origin_mm = kBallCentre - geometry.axes_mm * Vec3(23.5, 23.5, 10.5);
    for (int k = 0; k < geometry.dims[2]; ++k)
      for (int j = 0; j < geometry.dims[1]; ++j)
        for (int i = 0; i < geometry.dims[0]; ++i) {
          const Vec3 from = geometry.position_mm(Vec3(i, j, k)) - kBallCentre;
          const bool ball = from.norm() <= kBallRadius_mm,
                     core = from.cwiseAbs().maxCoeff() <= core_mm && core_mm > 0.0;
          labels.push_back(core ? 7 : ball ? 3 : 0);
          hu.push_back(ball ? 1000 : 0);
        }
  }
  [[nodiscard]] LabelledVoxels voxels() const { return {geometry, hu, labels}; }
};

constexpr Colour kRed{255, 0, 0}, kBlue{0, 0, 255};

LabelColours colours(int label, Colour colour) {
  LabelColours of;
  of[static_cast<std::size_t>(label)] = colour;
  return of;
}

// A PNG file, read by libpng alone.
std::vector<std::uint8_t> decoded(const std::string& bytes, int& width, int& height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()), 0) << image.message;
  image.format = PNG_FORMAT_RGB;
  width = static_cast<int>(image.width);
  height = static_cast<int>(image.height);
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
  EXPECT_NE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr), 0) << image.message;
  return pixels;
}

TEST(Picture, ComesBackFromItsFile) {
  Picture picture(37, 21, {1, 2, 3});
  picture.fill(30, 15, 20, 20, {200, 100, 50});  // beyond the edge
  picture.text(2, 3, "A1 mm", {9, 250, 7});
  const auto png = picture.png();
  ASSERT_TRUE(png) << png.error().message;
  int width = 0, height = 0;
  const auto pixels = decoded(*png, width, height);
  ASSERT_EQ(width, 37);
  ASSERT_EQ(height, 21);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::uint8_t* p = pixels.data() + 3 * (y * width + x);
      ASSERT_EQ((Colour{p[0], p[1], p[2]}), picture.at(x, y)) << x << " " << y;
    }
  EXPECT_EQ(picture.at(29, 15), (Colour{1, 2, 3}));
  EXPECT_EQ(picture.at(30, 15), (Colour{200, 100, 50}));
}

TEST(Picture, TextIsAsWideAsItSays) {
  for (const char* text : {"8", "HU 226", "MM"})
    for (const int scale : {1, 2}) {
      Picture picture(120, 24, {});
      picture.text(0, 0, text, kWhiteInk, scale);
      int last = -1, lowest = -1;
      for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
          if (picture.at(x, y) == kWhiteInk) last = std::max(last, x), lowest = std::max(lowest, y);
      EXPECT_EQ(last + 1, text_width(text, scale)) << text;
      EXPECT_EQ(lowest + 1, 7 * scale) << text;
    }
}

// In every plane, pixels of the outline lie on the circle in which the plane meets the ball, within a voxel's half
// diagonal and the outline's width; and every direction has some.
TEST(LabelViews, TheOutlineLiesOnTheBallsEdge) {
  const BallScan scan;
  for (const View view : {View::axial, View::coronal, View::sagittal})
    for (const double off_mm : {0.0, 4.0}) {
      Frame frame{view, kBallCentre + off_mm * direction_of(view), 0.15, 200};
      const Picture picture = draw_plane(scan.voxels(), colours(3, kRed), frame);
      const double radius = std::sqrt(kBallRadius_mm * kBallRadius_mm - off_mm * off_mm);
      const double bound_mm = 0.5 * Vec3(0.6, 0.6, 1.5).norm() * kBallRadius_mm / radius + 3.0 * 0.15;
      std::array<int, 16> around{};
      for (int y = 0; y < frame.pixels; ++y)
        for (int x = 0; x < frame.pixels; ++x) {
          if (picture.at(x, y) != kRed) continue;
          const Vec3 from = frame.position_mm(x, y) - frame.centre_mm;
          EXPECT_NEAR(from.norm(), radius, bound_mm);
          const double angle = std::atan2(y - 99.5, x - 99.5) + std::numbers::pi;
          ++around[static_cast<std::size_t>(angle / (2.0 * std::numbers::pi) * 15.999)];
        }
      for (const int count : around) EXPECT_GT(count, 8);
    }
}

// The grey within is that of the window, 400 +- 900 HU: 1000 HU are (1000 - 400) / 1800 + 1/2 of white.
TEST(LabelViews, APlaneShowsTheHuInTheirPlace) {
  const BallScan scan;
  const Picture picture = draw_plane(scan.voxels(), colours(3, kRed), {View::coronal, kBallCentre, 0.15, 200});
  const auto grey = [](double hu) { return ((hu - 400.0) / 1800.0 + 0.5) * 255.0; };
  EXPECT_NEAR(picture.at(100, 100).red, grey(1000.0), 1.0);
  EXPECT_NEAR(picture.at(100, 100 - 70).green, grey(0.0), 1.0) << "10.5 mm above the centre there is no ball";
}

// A patient's left is on the right of the picture, and the head at its top.
TEST(LabelViews, APictureHasThePatientsSides) {
  for (const View view : {View::axial, View::coronal, View::sagittal}) {
    const Frame frame{view, kBallCentre, 0.5, 101};
    const auto [x, y] = frame.pixel_of(kBallCentre + Vec3(5.0, 7.0, 9.0));  // to the left, to the back, to the head
    EXPECT_DOUBLE_EQ(x, 50.0 + (view == View::sagittal ? 14.0 : 10.0));
    EXPECT_DOUBLE_EQ(y, 50.0 + (view == View::axial ? 14.0 : -18.0));
    EXPECT_NEAR((frame.position_mm(x, y) - kBallCentre).dot(direction_of(view)), 0.0, 1e-12);
  }
}

// From every side a ball is a disc of its own radius, brightest where it faces the lamp.
TEST(LabelViews, ABallIsALitDisc) {
  const BallScan scan;
  for (const View view : {View::axial, View::coronal, View::sagittal}) {
    const Frame frame{view, kBallCentre, 0.2, 120};
    const auto picture = draw_surface(scan.voxels(), colours(3, {250, 250, 250}), {}, frame, keep_going);
    ASSERT_TRUE(picture);
    int covered = 0, wrong = 0;
    for (int y = 0; y < frame.pixels; ++y)
      for (int x = 0; x < frame.pixels; ++x) {
        const double from = (frame.position_mm(x, y) - kBallCentre).norm();
        const bool drawn = picture->picture.at(x, y) != kBlackInk;
        covered += drawn ? 1 : 0;
        wrong += (drawn && from > kBallRadius_mm + 1.0) || (!drawn && from < kBallRadius_mm - 1.0) ? 1 : 0;
      }
    EXPECT_EQ(wrong, 0);
    const double area = std::numbers::pi * kBallRadius_mm * kBallRadius_mm / (0.2 * 0.2);
    // A silhouette shows the outermost of all voxels, which are up to 1.5 mm wide.
    EXPECT_GT(covered, area);
    EXPECT_LT(covered, 1.08 * area);
    // Lambert's law, with the lamp to the left of the eye and above it: of two points beside the middle the one that
    // is nearer to the lamp has more light, and the one opposite has less.
    const auto lit = [&](int right, int down) {
      return static_cast<int>(picture->picture.at(60 + right, 60 + down).red);
    };
    EXPECT_GT(lit(-14, -14), lit(14, 14) + 60);
    EXPECT_GT(lit(0, 0), lit(14, 14) + 20);
    EXPECT_NEAR(lit(16, -16), lit(-16, 16), 12) << "both are equally far from the lamp";
    EXPECT_EQ(picture->labels[60 * 120 + 60], 3);
    EXPECT_EQ(picture->labels[0], 0);
  }
}

// A structure within the ball is seen through it, where it is, and nowhere else.
TEST(LabelViews, AStructureAtRiskShinesThroughTheBone) {
  const BallScan scan(3.0);
  const Frame frame{View::coronal, kBallCentre, 0.2, 120};
  const auto picture = draw_surface(scan.voxels(), colours(3, {250, 250, 250}), colours(7, kBlue), frame, keep_going);
  ASSERT_TRUE(picture);
  const auto bluish = [&](double right_mm) {
    const Colour c = picture->picture.at(60 + static_cast<int>(right_mm / 0.2), 60);
    return c.blue > c.red + 40;
  };
  EXPECT_TRUE(bluish(0.0));
  EXPECT_TRUE(bluish(1.8));
  EXPECT_FALSE(bluish(5.0));
  EXPECT_FALSE(bluish(-5.0));
}

TEST(LabelViews, TheFullestPlaneIsWhereTheBoxIsWidest) {
  // A thin stem along z, and a wide plate at z of 7 mm.
  ScanGeometry geometry{.dims = {30, 30, 40}};
  geometry.axes_mm = Vec3(1.0, 1.0, 0.5).asDiagonal();
  std::vector<std::uint8_t> labels;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 30; ++i) {
        const bool plate = k == 14 && i > 3 && i < 26 && j > 8 && j < 21, stem = i == 11 && j == 17;
        labels.push_back(plate || stem ? 1 : 0);
      }
  const LabelledVoxels voxels{geometry, {}, labels};
  const LabelColours one = colours(1, kRed);
  EXPECT_NEAR(fullest_plane_mm(voxels, one, View::axial), 7.0, 0.26);
  EXPECT_NEAR(fullest_plane_mm(voxels, one, View::coronal), 17.0, 0.51);
  EXPECT_NEAR(fullest_plane_mm(voxels, one, View::sagittal), 11.0, 0.51);
}

TEST(LabelViews, DrawingStopsWhenAsked) {
  const BallScan scan;
  const auto stopped = draw_surface(scan.voxels(), colours(3, kRed), {}, {View::axial, kBallCentre, 0.2, 50},
                                    [](double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
}

// Bars of the histogram are where their HU are, and the threshold's line is at its own.
TEST(HistogramPicture, HasItsBarsAndTheThresholdInPlace) {
  ReportFacts facts;
  facts.of_scan.add(-1000, 1000);
  facts.of_scan.add(905, 100);
  facts.of_scan.add(-5000, 3);
  facts.of_scan.add(9000, 4);
  EXPECT_EQ(facts.of_scan.sum(), 1107);
  facts.threshold_hu = 226.0;
  const Picture picture = histogram_picture(facts);
  // The highest coloured pixel of each column above the axis.
  const auto is_white = [](Colour c) { return c == Colour{255, 255, 255}; };
  std::vector<int> columns;
  for (int x = 0; x < picture.width(); ++x)
    if (!is_white(picture.at(x, 295))) columns.push_back(x);
  // Two pixels for 10 HU from -1100 on: -1000, 226 (the line) and 905 HU.
  std::vector<int> expected;
  for (const double hu : {-1000.0, 226.0, 900.0}) {
    const int x = 20 + static_cast<int>(std::lround(2.0 * (hu + 1100.0) / 10.0));
    expected.push_back(x);
    expected.push_back(x + 1);
  }
  EXPECT_EQ(columns, expected);
}

}  // namespace
}  // namespace osteon::import
