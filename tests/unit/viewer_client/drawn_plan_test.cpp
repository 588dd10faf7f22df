// What a person draws, moves and takes back as a plan, with a room that answers late.
#include "viewer_client/scene/drawn_plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
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
  plan_.answered(failure(ErrorCode::denied, "no"));
  EXPECT_TRUE(plan_.shown().empty());
  EXPECT_FALSE(plan_.undo());
}

TEST_F(Planning, ASecondPointWaitsForTheLastChange) {
  draw(AnnotationKind::axis, {0, 0, 0}, {0, 0, -20});
  const auto wiped = plan_.wipe();
  EXPECT_TRUE(plan_.waits());
  plan_.begin(AnnotationKind::axis);
  ASSERT_TRUE(plan_.add_point({5, 0, 0}, Vec3::UnitZ(), "b"));
  EXPECT_FALSE(plan_.add_point({5, 0, -9}, Vec3::UnitZ(), "b"));
  EXPECT_TRUE(plan_.draws()) << "it is not lost";
  take(wiped);
  EXPECT_FALSE(plan_.waits());
  const auto drawn = plan_.add_point({5, 0, -9}, Vec3::UnitZ(), "b");
  EXPECT_TRUE(drawn && *drawn);
}

TEST_F(Planning, UndoIsAskedAgainAfterALostConnection) {
  draw(AnnotationKind::axis, {0, 0, 0}, {0, 0, -20});
  ASSERT_TRUE(plan_.undo());
  plan_.answered(failure(ErrorCode::unavailable, "no answer"));
  EXPECT_EQ(plan_.shown(), room_);
  ASSERT_TRUE(plan_.undo());
  plan_.answered(failure(ErrorCode::not_found, "the room has no annotation 11"));
  EXPECT_FALSE(plan_.undo()) << "another has changed it";
}

// A room that writes down what it is asked for.
TEST(CarryOut, NothingIsWipedBeforeItsReplacementIsThere) {
  static constexpr AuthorId kSelf{3}, kOther{4};
  static constexpr std::uint32_t kOld = 7, kNew = 12;
  const Annotation old{.id = kOld, .author = kOther, .kind = AnnotationKind::axis};
  const Change move{old, old}, wipe{old, std::nullopt};
  const auto asked = [](const Change& change, const std::vector<Annotation>& now, std::uint32_t refused_draw = 99,
                        std::uint32_t refused_wipe = 99) {
    std::vector<std::string> calls;
    const PlanRequests room{[&](const Annotation& drawn) -> Result<std::uint32_t> {
                              calls.push_back("draw " + std::to_string(drawn.id));
                              if (drawn.id == refused_draw) return failure(ErrorCode::unavailable, "no answer");
                              return drawn.id == 0 ? kNew : drawn.id;
                            },
                            [&](std::uint32_t id) -> Result<void> {
                              calls.push_back("wipe " + std::to_string(id));
                              if (id == refused_wipe) return failure(ErrorCode::not_found, "it is gone");
                              return {};
                            }};
    const Result<std::uint32_t> id = carry_out(change, now, kSelf, room);
    calls.push_back(id ? std::to_string(*id) : id.error().message);
    return calls;
  };
  using Calls = std::vector<std::string>;
  EXPECT_EQ(asked(move, {old}), (Calls{"draw 0", "wipe 7", "12"}));
  EXPECT_EQ(asked(move, {old}, 0), (Calls{"draw 0", "no answer"})) << "the old one stays";
  EXPECT_EQ(asked(move, {old}, 99, kOld), (Calls{"draw 0", "wipe 7", "wipe 12", "it is gone"}));
  EXPECT_EQ(asked(wipe, {old}), (Calls{"wipe 7", "0"}));
  Annotation own = old;
  own.author = kSelf;
  EXPECT_EQ(asked(move, {own}), (Calls{"draw 7", "7"}));
  EXPECT_EQ(asked({std::nullopt, old}, {}), (Calls{"draw 0", "12"}));
  EXPECT_EQ(asked(move, std::vector<Annotation>(kMostAnnotations, old)), (Calls{"wipe 7", "draw 0", "12"}))
      << "the room takes no more";
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
  EXPECT_EQ(plan.at("steps"), nlohmann::json::parse(R"([{"action": "drill", "tool": "drill-3.5",
    "entry": {"point_mm": [1.0, 2.0, 0.0], "target_mm": [1.0, 2.5, -20.0]}}])"));
  // Its line goes along x and its depth along z, so it is across y.
  const auto& planes = plan.at("planes");
  ASSERT_EQ(planes.size(), 1u);
  EXPECT_EQ(planes[0].at("name"), "one");
  EXPECT_EQ(planes[0].at("point_mm"), (std::vector<double>{0.0, 0.0, 0.0}));
  EXPECT_EQ(planes[0].at("end_mm"), (std::vector<double>{10.0, 0.0, 0.0}));
  const auto normal = planes[0].at("normal").get<std::vector<double>>();
  EXPECT_NEAR(normal.at(0), 0.0, 1e-9);
  EXPECT_NEAR(std::abs(normal.at(1)), 1.0, 1e-9);
  EXPECT_NEAR(normal.at(2), 0.0, 1e-9);
}

}  // namespace
}  // namespace osteon
