// What a person draws, moves and takes back as a plan, with a room that answers late.
#include "viewer_client/scene/drawn_plan.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace osteon {
namespace {

using Change = DrawnPlan::Change;

// A room that takes whatever it is asked for.
class Planning : public testing::Test {
 protected:
  // The room's answer, then its new state.
  void take(const std::optional<Change>& change) {
    ASSERT_TRUE(change);
    if (change->after) {
      Annotation drawn = *change->after;
      drawn.id = change->before ? change->before->id : ++last_;
      drawn.author = AuthorId{3};
      std::erase_if(room_, [&](const Annotation& one) { return one.id == drawn.id; });
      room_.push_back(drawn);
      plan_.answered(drawn.id);
    } else {
      std::erase_if(room_, [&](const Annotation& one) { return one.id == change->before->id; });
      plan_.answered(0);
    }
    plan_.take(room_);
    EXPECT_EQ(plan_.shown(), room_);
  }
  void draw(AnnotationKind kind, const Vec3& first_mm, const Vec3& second_mm, const std::string& name = "one") {
    plan_.begin(kind);
    const auto begun = plan_.add_point(first_mm, Vec3::UnitZ(), name);
    ASSERT_TRUE(begun);
    EXPECT_FALSE(*begun) << "a point is still to come";
    EXPECT_TRUE(plan_.draws());
    const auto drawn = plan_.add_point(second_mm, Vec3::UnitZ(), name);
    ASSERT_TRUE(drawn) << drawn.error().message;
    EXPECT_FALSE(plan_.draws());
    take(*drawn);
  }
  [[nodiscard]] Vec3 point(std::size_t which, std::size_t end) const {
    return from_steps(plan_.shown().at(which).points.at(end));
  }

  DrawnPlan plan_;
  std::vector<Annotation> room_;
  std::uint32_t last_ = 10;
};

TEST_F(Planning, TwoPointsMakeAnAxisAndThreeAPlane) {
  draw(AnnotationKind::axis, {1, 2, 3}, {1, 2, -20}, "screw");
  ASSERT_EQ(plan_.planned().size(), 1u);
  EXPECT_EQ(point(0, 0), Vec3(1, 2, 3));
  EXPECT_EQ(point(0, 1), Vec3(1, 2, -20));
  EXPECT_EQ(plan_.shown()[0].words, "screw");
  ASSERT_NE(plan_.selected(), nullptr) << "what was drawn is selected";
  EXPECT_EQ(plan_.selected()->id, 11u);
  // The plane contains its line and the way into the image, z.
  draw(AnnotationKind::plane, {0, 0, 0}, {10, 10, 0});
  const Vec3 normal = planned_direction(plan_.shown()[1]);
  EXPECT_NEAR(normal.z(), 0.0, 1e-12);
  EXPECT_NEAR(normal.dot(Vec3(1, 1, 0)), 0.0, 1e-12);
}

TEST_F(Planning, AChangeIsSeenBeforeTheRoomHasTakenIt) {
  plan_.begin(AnnotationKind::axis);
  ASSERT_TRUE(plan_.add_point({0, 0, 0}, Vec3::UnitZ(), "a"));
  const auto drawn = plan_.add_point({0, 0, -9}, Vec3::UnitZ(), "a");
  ASSERT_TRUE(drawn && *drawn);
  EXPECT_EQ(plan_.shown().size(), 1u);
  EXPECT_FALSE(plan_.undo()) << "one after the other";
  plan_.answered(4);
  EXPECT_EQ(plan_.shown().size(), 1u) << "its new state is still to come";
  room_.push_back(*(*drawn)->after);
  room_.back().id = 4;
  plan_.take(room_);
  EXPECT_EQ(plan_.shown(), room_) << "and it is not there twice";
}

TEST_F(Planning, WhatTheRoomRefusesVanishes) {
  plan_.begin(AnnotationKind::axis);
  ASSERT_TRUE(plan_.add_point({0, 0, 0}, Vec3::UnitZ(), "a"));
  ASSERT_TRUE(plan_.add_point({0, 0, -9}, Vec3::UnitZ(), "a"));
  plan_.answered(std::nullopt);
  EXPECT_TRUE(plan_.shown().empty());
  EXPECT_FALSE(plan_.undo());
}

TEST_F(Planning, APointAtTheFirstOneMayBeGivenAgain) {
  plan_.begin(AnnotationKind::axis);
  ASSERT_TRUE(plan_.add_point({0, 0, 0}, Vec3::UnitZ(), "a"));
  EXPECT_FALSE(plan_.add_point({0, 0, 0.01}, Vec3::UnitZ(), "a"));
  EXPECT_TRUE(plan_.draws());
  const auto drawn = plan_.add_point({0, 0, 5}, Vec3::UnitZ(), "a");
  EXPECT_TRUE(drawn && *drawn);
}

TEST_F(Planning, ADragMovesAnEndAndAPlaneKeepsItsDirection) {
  draw(AnnotationKind::axis, {0, 0, 0}, {0, 0, -20});
  plan_.drag(11, 1, {3, 0, -19});
  plan_.drag(11, 1, {4, 0, -18});
  EXPECT_EQ(point(0, 1), Vec3(4, 0, -18)) << "seen while it is dragged";
  EXPECT_EQ(from_steps(room_[0].points[1]), Vec3(0, 0, -20));
  plan_.drag(11, 1, {0, 0, 0});
  EXPECT_EQ(point(0, 1), Vec3(4, 0, -18)) << "an axis has a length";
  take(plan_.drop());
  EXPECT_EQ(point(0, 1), Vec3(4, 0, -18));
  EXPECT_EQ(plan_.shown()[0].id, 11u);
  EXPECT_FALSE(plan_.drop()) << "nothing is dragged";
  plan_.drag(11, 1, {4, 0, -18});
  EXPECT_FALSE(plan_.drop()) << "nothing has moved";
  plan_.drag(11, 0, {1, 1, 1});
  plan_.give_up();
  EXPECT_EQ(point(0, 0), Vec3(0, 0, 0));

  draw(AnnotationKind::plane, {0, 0, 0}, {10, 0, 0});
  plan_.drag(12, 0, {0, 5, 0});
  EXPECT_EQ(point(1, 2) - point(1, 0), Vec3(0, 0, 20)) << "straight into the image as before";
}

TEST_F(Planning, UndoTakesBackEachChangeThoughNumbersChange) {
  draw(AnnotationKind::axis, {0, 0, 0}, {0, 0, -20}, "a");
  plan_.drag(11, 1, {0, 0, -25});
  take(plan_.drop());
  take(plan_.rename("b"));
  take(plan_.wipe());
  EXPECT_TRUE(plan_.planned().empty());
  take(plan_.undo());  // the room numbers it anew
  ASSERT_EQ(plan_.planned().size(), 1u);
  EXPECT_EQ(plan_.shown()[0].words, "b");
  EXPECT_EQ(plan_.shown()[0].id, 12u);
  take(plan_.undo());
  EXPECT_EQ(plan_.shown()[0].words, "a");
  EXPECT_EQ(point(0, 1), Vec3(0, 0, -25));
  take(plan_.undo());
  EXPECT_EQ(point(0, 1), Vec3(0, 0, -20));
  take(plan_.undo());
  EXPECT_TRUE(plan_.planned().empty());
  EXPECT_FALSE(plan_.undo());
}

TEST_F(Planning, TheToolIsComparedWithWhatSuitsIt) {
  EXPECT_EQ(plan_.for_tool(ToolKind::drill), nullptr);
  draw(AnnotationKind::axis, {0, 0, 0}, {0, 0, -20}, "first");
  draw(AnnotationKind::axis, {5, 0, 0}, {5, 0, -20}, "second");
  draw(AnnotationKind::plane, {0, 0, 0}, {10, 0, 0}, "cut");
  EXPECT_EQ(plan_.for_tool(ToolKind::drill)->words, "second") << "the newest";
  EXPECT_EQ(plan_.for_tool(ToolKind::oscillating_saw)->words, "cut");
  plan_.select(11);
  EXPECT_EQ(plan_.for_tool(ToolKind::drill)->words, "first");
  EXPECT_EQ(plan_.for_tool(ToolKind::oscillating_saw)->words, "cut") << "an axis does not suit a saw";
}

TEST_F(Planning, DrawingsOfOtherKindsAreShownAndNotPlanned) {
  room_ = {{.id = 1, .kind = AnnotationKind::line, .points = {{0, 0, 0}, {1024, 0, 0}}}};
  EXPECT_TRUE(plan_.take(room_));
  EXPECT_FALSE(plan_.take(room_));
  EXPECT_EQ(plan_.shown(), room_);
  EXPECT_TRUE(plan_.planned().empty());
  plan_.select(1);
  EXPECT_EQ(plan_.selected(), nullptr);
  EXPECT_FALSE(plan_.wipe());
}

TEST_F(Planning, AxesAreStepsOfASimulatedSurgeon) {
  draw(AnnotationKind::axis, {1, 2, 0}, {1, 2.5, -20});
  draw(AnnotationKind::plane, {0, 0, 0}, {10, 0, 0});
  const auto plan = nlohmann::json::parse(plan_text(plan_.planned(), "drill-3.5"));
  EXPECT_EQ(plan, nlohmann::json::parse(R"({"steps": [{"action": "drill", "tool": "drill-3.5",
    "entry": {"point_mm": [1.0, 2.0, 0.0], "target_mm": [1.0, 2.5, -20.0]}}]})"));
}

}  // namespace
}  // namespace osteon
