// Checks in the pixels what people draw and say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "picture.hpp"
#include "viewer_client/scene/stroke.hpp"

namespace osteon {
namespace {

using test::differing_pixels;
using test::from_front;
using test::kFrom_mm;
using test::kHeight;
using test::kRadius_mm;
using test::kWidth;
using test::on_front;

constexpr std::uint32_t kGreen = 0x10e040;

bool greenish(const Vec3& colour) { return colour.y() > 1.25 * colour.x() && colour.y() > 1.25 * colour.z(); }

Annotation mark(std::uint32_t id, AnnotationKind kind, const std::vector<Vec3>& points_mm,
                const std::string& words = {}) {
  Annotation one{.id = id, .author = AuthorId{3}, .kind = kind, .words = words, .colour = kGreen};
  for (const Vec3& point : points_mm) one.points.push_back(in_steps(point));
  return one;
}

class PeoplePicture : public test::SpherePicture {
 protected:
  Image with(const std::vector<Annotation>& all) {
    window_->scene().show_annotations(all);
    return drawn();
  }
  static int green_pixels(const Image& image) {
    return static_cast<int>(
        std::ranges::count_if(image.rgb, [](const auto& c) { return greenish(Vec3(c[0], c[1], c[2])); }));
  }
};

TEST_F(PeoplePicture, ALineIsSeenInItsColourAlongItsPointsAndVanishes) {
  std::vector<Vec3> points;
  for (int i = -10; i <= 10; ++i) points.push_back(on_front(0.06 * i, 0.0));
  const Image image = with({mark(1, AnnotationKind::line, points)});
  for (const int i : {-9, -4, 0, 5, 9}) EXPECT_TRUE(greenish(at(image, on_front(0.06 * i, 0.0)))) << i;
  // Above and below it the bone looks as before.
  for (const double off : {0.3, -0.3}) EXPECT_EQ(at(image, on_front(0.0, off)), at(bare_, on_front(0.0, off)));
  EXPECT_EQ(differing_pixels(with({}), bare_), 0);
}

// Seen from the front: an axis from left to right, with a ball at its target.
TEST_F(PeoplePicture, AnAxisIsALineWithAMarkAtItsTarget) {
  const double before_mm = -kRadius_mm - 2.0;
  const Vec3 entry(-8, before_mm, 0), target(8, before_mm, 0);
  const Image image = with({mark(1, AnnotationKind::axis, {entry, target})});
  for (const double x : {-7.0, 0.0, 7.0}) EXPECT_TRUE(greenish(at(image, {x, before_mm, 0}))) << x;
  const auto height_px = [&](const Vec3& point) {
    const auto [x, y] = seen(point);
    int green = 0;
    for (int row = y - 20; row <= y + 20; ++row) {
      const auto& c = image.at(x, row);
      green += greenish(Vec3(c[0], c[1], c[2])) ? 1 : 0;
    }
    return green;
  };
  EXPECT_GT(height_px(target), 1.5 * height_px({0, before_mm, 0}));
  EXPECT_LE(height_px(entry), height_px({0, before_mm, 0}));
  EXPECT_EQ(differing_pixels(with({}), bare_), 0);
}

// Its words stand beside its target, whatever side it comes from.
TEST_F(PeoplePicture, TheWordsOfAnAxisDoNotCoverIt) {
  const double before_mm = -kRadius_mm - 2.0;
  for (const double side : {1.0, -1.0}) {
    const Vec3 entry(-9 * side, before_mm, 0), target(3 * side, before_mm, 0);
    const Image plain = with({mark(1, AnnotationKind::axis, {entry, target})});
    const Image named = with({mark(1, AnnotationKind::axis, {entry, target}, "Axis 1")});
    EXPECT_GT(differing_pixels(plain, named), 100) << "the words";
    for (double x = -9.0; x <= 3.0; x += 0.5)
      EXPECT_EQ(at(named, {x * side, before_mm, 0}), at(plain, {x * side, before_mm, 0})) << side << " at " << x;
  }
}

TEST_F(PeoplePicture, APlaneIsATranslucentRectangleFromBothSides) {
  const double before_mm = -kRadius_mm - 2.0;
  const Vec3 first(-15, before_mm, 0), second(15, before_mm, 0), up(-15, before_mm, 20), down(-15, before_mm, -20);
  const Vec3 inside(5, before_mm, 5), outside(0, before_mm, 16);
  for (const Vec3& third : {up, down}) {
    const Image image = with({mark(1, AnnotationKind::plane, {first, second, third})});
    const Vec3 tinted = at(image, inside), bone = at(bare_, inside);
    EXPECT_GT(tinted.y() - tinted.x(), bone.y() - bone.x() + 10.0);
    EXPECT_GT(tinted.x(), 0.5 * bone.x()) << "the bone, which has more red than the plane, is seen through it";
    EXPECT_EQ(at(image, outside), at(bare_, outside)) << "30 mm high, about its line";
  }
}

TEST_F(PeoplePicture, WhatLiesBehindTheBoneShowsThroughItALittle) {
  const auto line_at = [](double y) { return mark(1, AnnotationKind::line, {{-5, y, 0}, {5, y, 0}}); };
  const double in_front_mm = -kRadius_mm - 1.0, behind_mm = 40.0;
  const Vec3 before = at(with({line_at(in_front_mm)}), {0, in_front_mm, 0}),
             behind = at(with({line_at(behind_mm)}), {0, behind_mm, 0});
  const Vec3 bone = at(bare_, Vec3::Zero());
  EXPECT_GT((behind - bone).norm(), 10.0);
  EXPECT_LT((behind - bone).norm(), 0.5 * (before - bone).norm());
}

TEST_F(PeoplePicture, AnArrowEndsAtItsPointAndComesFromOutside) {
  const Vec3 point = on_front(0.9, 0.0);  // on the right
  const Image image = with({mark(4, AnnotationKind::pointer, {point})});
  const auto [x, y] = seen(point);
  int left = 0, right = 0, near = 0;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const auto& c = image.at(column, row);
      if (!greenish(Vec3(c[0], c[1], c[2]))) continue;
      (column < x - 6 ? left : right) += 1;
      near += std::hypot(column - x, row - y) < 6.0 ? 1 : 0;
    }
  EXPECT_GT(near, 5);
  EXPECT_GT(right, 150) << "the shaft, out of the bone";
  EXPECT_EQ(left, 0);
  EXPECT_EQ(differing_pixels(with({}), bare_), 0);
}

TEST_F(PeoplePicture, AnArrowIsAsLongOnTheScreenFromFarAway) {
  const std::vector<Annotation> arrow{mark(4, AnnotationKind::pointer, {on_front(0.9, 0.0)})};
  const int near = green_pixels(with(arrow));
  window_->scene().look(from_front(5.0 * kFrom_mm));
  const int far = green_pixels(drawn());
  EXPECT_GT(far, near / 2);
  EXPECT_LT(far, 2 * near);
}

TEST_F(PeoplePicture, ALabelSaysItsWordsBesideItsDot) {
  const Vec3 point = on_front(-0.4, 0.3);
  const Image dot = with({mark(2, AnnotationKind::label, {point}, "a")});
  const Image words = with({mark(2, AnnotationKind::label, {point}, "a nerve")});
  EXPECT_TRUE(greenish(at(dot, point)));
  EXPECT_TRUE(greenish(at(words, point)));
  const auto [x, y] = seen(point);
  int beyond = 0, elsewhere = 0;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      if (dot.at(column, row) == words.at(column, row)) continue;
      (column > x && std::abs(row - y) < 24 ? beyond : elsewhere) += 1;
    }
  EXPECT_GT(beyond, 200) << "the longer words";
  EXPECT_EQ(elsewhere, 0);
}

TEST_F(PeoplePicture, TwoLabelsAtOnePlaceDoNotCoverEachOther) {
  const Vec3 point = on_front(0.0, 0.2);
  const Annotation first = mark(2, AnnotationKind::label, {point}, "first"),
                   same = mark(3, AnnotationKind::label, {point}, "first");
  const int one = green_pixels(with({first})), two = green_pixels(with({first, same}));
  const int other = green_pixels(with({first, mark(3, AnnotationKind::label, {on_front(0.0, -0.6)}, "first")}));
  EXPECT_GT(two, 1.3 * one) << "the second frame is visible too";
  EXPECT_GT(two, 0.8 * other - 60);
}

TEST_F(PeoplePicture, AToolIsNamedByItsPerson) {
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "burr-round-5";
  state.pose_bone_tool = state.pose_bone_device = pose_along(Vec3(0, -20, 0), -Vec3::UnitZ());
  const Image before = with({mark(1, AnnotationKind::label, {on_front(-0.5, -0.5)}, "x")});
  window_->scene().show_tools(std::span(&state, 1));
  const Image nameless = drawn();
  window_->scene().show_names({{AuthorId{8}, "somebody else"}});
  EXPECT_EQ(differing_pixels(drawn(), nameless), 0);
  window_->scene().show_names({{AuthorId{7}, "Ada"}});
  EXPECT_GT(differing_pixels(drawn(), nameless), 100);
  window_->scene().show_tools({});
  EXPECT_EQ(differing_pixels(drawn(), before), 0);
}

TEST_F(PeoplePicture, AnEmptyHandHasNeitherToolNorName) {
  const Image before = drawn();
  CuttingState state;
  state.author = AuthorId{7};
  state.pose_bone_tool = state.pose_bone_device = pose_along(Vec3::Zero(), -Vec3::UnitZ());
  window_->scene().show_names({{AuthorId{7}, "Ada"}});
  window_->scene().show_tools(std::span(&state, 1));
  EXPECT_EQ(differing_pixels(drawn(), before), 0);
}

TEST_F(PeoplePicture, WordsStandBelowAndWhatHoldsAbove) {
  const auto changed_rows = [&](const Image& image) {
    std::pair<int, int> rows{kHeight, -1};
    for (int row = 0; row < kHeight; ++row)
      for (int column = 0; column < kWidth; ++column)
        if (image.at(column, row) != bare_.at(column, row))
          rows = {std::min(rows.first, row), std::max(rows.second, row)};
    return rows;
  };
  window_->scene().show_words({"Ada: done", "Dr. Berg: thank you"}, "");
  const auto said = changed_rows(drawn());
  EXPECT_GT(said.first, kHeight / 2);
  EXPECT_GT(said.second - said.first, 30) << "two lines";
  window_->scene().show_words({}, "Your hand is stopped");
  const auto holding = changed_rows(drawn());
  EXPECT_LT(holding.second, kHeight / 2);
  EXPECT_GE(holding.second, holding.first);
  window_->scene().show_words({}, "");
  EXPECT_EQ(differing_pixels(drawn(), bare_), 0);
}

}  // namespace
}  // namespace osteon
