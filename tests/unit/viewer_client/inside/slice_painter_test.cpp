// Slices as they are sampled on request, and again after a cut.
#include "viewer_client/inside/slice_painter.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "common/tools/tool.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

constexpr double kPitch_mm = 0.5;

std::array<radiology::PixelGrid, kSlices> planes_at(const Vec3& point_mm) {
  LinkedSlices view;
  view.point_mm = view.centre_mm = point_mm;
  view.pixel_mm = 0.25;
  view.images = {{{40, 30}, {40, 30}, {40, 30}}};
  return planes_of(view);
}

class Painter : public testing::Test {
 protected:
  void paint(const InsideChange& change) {
    painter_.paint(bone_, change, [](double) { return true; });
  }
  const Case case_ = test::plain_block(24.0, 12.0, kPitch_mm);
  radiology::BoneHu bone_ = std::move(*radiology::BoneHu::make(case_));
  int painted_ = 0;
  SlicePainter painter_{[this] { ++painted_; }};
};

TEST_F(Painter, SamplesWhatIsWantedAndNothingTwice) {
  paint({.all = true});
  EXPECT_EQ(painted_, 0) << "nobody wants a plane";
  painter_.ask(planes_at({0, 0, -6}));
  paint({});
  EXPECT_EQ(painted_, 1);
  const SliceImages first = painter_.newest();
  for (const auto& image : first) {
    ASSERT_TRUE(image);
    EXPECT_EQ(image->hu.size(), image->plane.count());
  }
  // The point lies in all three. The nearest pixel is at most half a diagonal of a pixel away, in even bone.
  for (const auto& image : first) {
    const Pixel at = pixel_at(image->plane, {0, 0, -6});
    const float hu = image->hu[image->plane.index(static_cast<int>(at.x()), static_cast<int>(at.y()))];
    EXPECT_EQ(hu, bone_.hu({0, 0, -12}));
  }
  paint({});
  EXPECT_EQ(painted_, 1) << "nothing is new";
  auto moved = planes_at({0, 0, -6});
  moved[1] = planes_at({0, 2, -6})[1];
  painter_.ask(moved);
  paint({});
  EXPECT_EQ(painted_, 2);
  const SliceImages second = painter_.newest();
  EXPECT_EQ(second[0], first[0]) << "as it was";
  EXPECT_NE(second[1], first[1]);
  EXPECT_EQ(second[2], first[2]);
  painter_.clear();
  EXPECT_FALSE(painter_.newest()[0]);
}

TEST_F(Painter, SamplesAgainOnlyWhatACutReaches) {
  painter_.ask(planes_at({0, 0, -6}));
  paint({.all = true});
  const SliceImages before = painter_.newest();
  // Its near side is 1.4 mm behind the coronal plane. It lies in the two others.
  CutField field(case_, BodyId{1});
  const CutReport cut = field.apply(test::straight_cut(*find_tool("drill-3.2"), {0, 3, 2}, {0, 3, -8}, {0, 0, -1}));
  const std::vector<const CutField*> bodies{&field};
  const std::vector<ChangedLeaves> leaves{{cut.level, cut.changed_leaves}};
  const std::vector<CoordBox> boxes = bone_.update(bodies, leaves);
  ASSERT_FALSE(boxes.empty());
  paint({.boxes = boxes});
  const SliceImages after = painter_.newest();
  EXPECT_NE(after[0], before[0]);
  EXPECT_EQ(after[1], before[1]) << "the hole does not reach it";
  EXPECT_NE(after[2], before[2]);
  // The axis of the hole is air.
  const Pixel axis = pixel_at(after[0]->plane, {0, 3, -6});
  const auto column = static_cast<int>(std::lround(axis.x())), row = static_cast<int>(std::lround(axis.y()));
  EXPECT_LT(after[0]->hu[after[0]->plane.index(column, row)], -900.0f);
}

TEST_F(Painter, StopsWhenItIsNotWanted) {
  painter_.ask(planes_at({0, 0, -6}));
  painter_.paint(bone_, {.all = true}, [](double) { return false; });
  EXPECT_EQ(painted_, 0);
  EXPECT_FALSE(painter_.newest()[0]);
}

TEST(Reaches, CountsAPitchOnBothSides) {
  const radiology::PixelGrid plane = planes_at({0, 0, 0})[0];  // z = 0
  EXPECT_TRUE(reaches({{0, 0, -2}, {0, 0, -2}}, 1.0, planes_at({0, 0, -1.0})[0]));
  EXPECT_TRUE(reaches({{50, 50, -1}, {50, 50, 4}}, 0.5, plane));
  EXPECT_TRUE(reaches({{0, 0, 1}, {0, 0, 4}}, 0.5, plane));
  EXPECT_FALSE(reaches({{0, 0, 2}, {0, 0, 4}}, 0.5, plane)) << "its lowest sample is at 1 mm";
  EXPECT_FALSE(reaches({{0, 0, -4}, {0, 0, -2}}, 0.5, plane));
}

}  // namespace
}  // namespace osteon
