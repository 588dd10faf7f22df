#include "viewer_client/app/script.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

namespace osteon {
namespace {

template <class T>
T parsed(std::string_view line) {
  const auto command = parse_command(line);
  EXPECT_TRUE(command && *command && std::holds_alternative<T>(**command)) << line;
  if (!command || !*command || !std::holds_alternative<T>(**command)) return T{};
  return std::get<T>(**command);
}

TEST(Script, ReadsEveryCommand) {
  parsed<WaitForSurface>("wait surface");
  EXPECT_EQ(parsed<WaitForSeq>("  wait seq 18446744073709551615").room_seq.value, 18446744073709551615u);
  parsed<LookAtWhole>("look overview\r");
  const CameraView view = parsed<LookFrom>("look at 1 2 3 from -4.5 1e2 6 up 0 0 2").view;
  EXPECT_EQ(view.target_mm, Vec3(1, 2, 3));
  EXPECT_EQ(view.eye_mm, Vec3(-4.5, 100, 6));
  EXPECT_EQ(view.up, Vec3(0, 0, 1));
  EXPECT_EQ(parsed<LookAtTool>("look tool 80").distance_mm, 80.0);
  EXPECT_TRUE(parsed<ShowTool>("tool on").on);
  EXPECT_FALSE(parsed<ShowTool>("tool off").on);
  EXPECT_EQ(parsed<SaveScreenshot>("screenshot  a picture.png ").file, "a picture.png");
  EXPECT_EQ(parsed<SaveStatus>("status now.json").file, "now.json");
  EXPECT_EQ(parsed<WaitForBodies>("wait bodies 2").count, 2u);
  EXPECT_EQ(parsed<WaitForItems>("wait items 0").count, 0u);
  parsed<Quit>("quit");
}

TEST(Script, ReadsWhatIsAskedOfTheRoom) {
  const auto asked = [](std::string_view line) { return parsed<RoomRequest>(line); };
  EXPECT_EQ(std::get<UndoLast>(asked("undo 3")).count, 3u);
  EXPECT_EQ(std::get<RedoLast>(asked("redo 1")).count, 1u);
  EXPECT_EQ(std::get<TakeAway>(asked("take-away 2")).body, BodyId{2});
  EXPECT_EQ(std::get<SaveBone>(asked("save")).file_name, "");
  EXPECT_EQ(std::get<SaveBone>(asked("save half way.vdb")).file_name, "half way.vdb");
  const auto placed = std::get<PlaceTool>(asked("place guide-1 at 1 2 3 along 0 0 -2 on 4"));
  EXPECT_EQ(placed.tool, "guide-1");
  EXPECT_EQ(placed.body, BodyId{4});
  EXPECT_FALSE(placed.where.on_bone);
  const Pose pose = pose_of(placed.where);
  EXPECT_EQ(pose.position_mm, Vec3(1, 2, 3));
  EXPECT_LT((pose.rotation * Vec3::UnitZ() - Vec3(0, 0, -1)).norm(), 1e-12) << "+z is out of its tip";
  EXPECT_EQ(std::get<PlaceTool>(asked("place pin-2 at 0 0 0 along 1 0 0")).body, BodyId{0});
}

TEST(Script, ReadsWhereAnItemGoes) {
  const auto asked = [](std::string_view line) { return parsed<RoomRequest>(line); };
  const auto on_bone = std::get<PlaceTool>(asked("place guide-1 near 1 2 3"));
  EXPECT_TRUE(on_bone.where.on_bone);
  EXPECT_EQ(on_bone.where.point_mm, Vec3(1, 2, 3));
  EXPECT_FALSE(on_bone.where.along || on_bone.where.across);
  const auto all = std::get<PlaceTool>(asked("place guide-2 near 1 2 3 along 0 0 -1 across 0 1 1 on 2"));
  EXPECT_EQ(all.where.along, Vec3(0, 0, -1));
  EXPECT_EQ(all.where.across, Vec3(0, 1, 1));
  EXPECT_EQ(all.body, BodyId{2});
  const auto moved = std::get<MoveItem>(asked("move 4 at 1 2 3 along 0 0 -2 across 0 3 1"));
  EXPECT_EQ(moved.item, 4u);
  const Pose pose = pose_of(moved.where);
  EXPECT_LT((pose.direction(Vec3::UnitZ()) - Vec3(0, 0, -1)).norm(), 1e-12);
  EXPECT_LT((pose.direction(Vec3::UnitX()) - Vec3(0, 1, 0)).norm(), 1e-12) << "as near to across as the axis allows";
  EXPECT_TRUE(std::get<MoveItem>(asked("move 4 near 1 2 3")).where.on_bone);
  EXPECT_EQ(std::get<TurnItem>(asked("turn 3 -2.5")).turns, -2.5);
  EXPECT_EQ(std::get<TurnItem>(asked("turn 3 -2.5")).item, 3u);
  EXPECT_EQ(std::get<SeatItem>(asked("seat 5")).item, 5u);
  EXPECT_EQ(std::get<SeatItem>(asked("seat 5 7")).most_mm, 7.0);
  EXPECT_EQ(std::get<RemoveItem>(asked("remove 6")).item, 6u);
}

TEST(Script, AMovedItemKeepsItsSides) {
  ItemPlace place;
  place.along = Vec3(0, 0, 1);
  EXPECT_LT((pose_of(place, Vec3(0, 5, 5)).direction(Vec3::UnitX()) - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_LT((pose_of(place, Vec3(0, 0, 1)).direction(Vec3::UnitZ()) - Vec3::UnitZ()).norm(), 1e-12) << "no way across";
}

TEST(Script, AnswersSayWhereAnItemStands) {
  SceneItem item;
  item.id = 3;
  item.pose_bone_item = pose_along({1, -2.5, 3}, {0, 0, -1});
  EXPECT_EQ(standing_text(item), "item 3 at 1.00 -2.50 3.00 along 0.000 0.000 -1.000");
  item.turns = 4.5;
  item.seated = true;
  EXPECT_EQ(standing_text(item), "item 3 at 1.00 -2.50 3.00 along 0.000 0.000 -1.000, 4.50 turns in, seated");
}

TEST(Script, ReadsWhatConcernsThePeople) {
  EXPECT_EQ(parsed<LookAs>("look as Dr. Berg ").who, "Dr. Berg");
  EXPECT_EQ(parsed<LookAs>("look as \"Ada\"").who, "Ada");
  EXPECT_EQ(parsed<Follow>("follow #12").who, "#12");
  EXPECT_EQ(parsed<Follow>("follow off").who, "");
  EXPECT_EQ(parsed<WaitForDrawn>("wait drawn 3").count, 3u);
  const Draw pointer = parsed<Draw>("point 1 -2 3.5  here,  now");
  EXPECT_EQ(pointer.kind, AnnotationKind::pointer);
  EXPECT_EQ(pointer.points_mm, std::vector<Vec3>{Vec3(1, -2, 3.5)});
  EXPECT_EQ(pointer.words, "here,  now");
  EXPECT_EQ(parsed<Draw>("point 1 2 3").words, "");
  const Draw line = parsed<Draw>("draw 0 0 0 1 2 3 4 5 6");
  EXPECT_EQ(line.kind, AnnotationKind::line);
  EXPECT_EQ(line.points_mm, (std::vector<Vec3>{Vec3(0, 0, 0), Vec3(1, 2, 3), Vec3(4, 5, 6)}));
  const Draw label = parsed<Draw>("label 1 2 3 facial nerve");
  EXPECT_EQ(label.kind, AnnotationKind::label);
  EXPECT_EQ(label.words, "facial nerve");
  EXPECT_EQ(parsed<WipeOff>("wipe 7").annotation, 7u);
  EXPECT_EQ(parsed<WipeOff>("wipe all").annotation, 0u);
  EXPECT_EQ(parsed<Say>("say all good morning").who, "all");
  EXPECT_EQ(parsed<Say>("say all good morning").words, "good morning");
  EXPECT_EQ(parsed<Say>("say \"Dr. Berg\" may I?").who, "Dr. Berg");
  EXPECT_EQ(parsed<Say>("say \"Dr. Berg\" may I?").words, "may I?");
  EXPECT_EQ(parsed<Say>("say hello").words, "");
  for (const char* wrong : {"look as", "follow", "point", "point 1 2", "point 1 2 x", "draw", "draw 1 2 3",
                            "draw 1 2 3 4", "draw 1 2 3 4 5", "draw 1 2 3 4 5 x", "label 1 2 3", "label 1 2", "wipe",
                            "wipe 0", "wipe x", "wipe 1 2", "say", "say \"Ada", "wait drawn"}) {
    const auto command = parse_command(wrong);
    ASSERT_FALSE(command) << wrong;
    EXPECT_NE(command.error().message.find('`'), std::string::npos) << command.error().message;
  }
}

TEST(Script, SkipsEmptyLinesAndComments) {
  for (const char* line : {"", "   ", "\t\r", "# look overview", "#"}) {
    const auto command = parse_command(line);
    ASSERT_TRUE(command) << line;
    EXPECT_FALSE(*command) << line;
  }
}

TEST(Script, SaysWhatItExpected) {
  for (const char* line : {"wait",
                           "wait seq",
                           "wait seq -1",
                           "wait seq 1x",
                           "look",
                           "look tool 0",
                           "look tool nan",
                           "look at 1 2 3 from 1 2 3 up 0 0 1",
                           "look at 0 0 0 from 0 0 5 up 0 0 1",
                           "look at 0 0 0 from 0 0 5 up 0 0 0",
                           "tool",
                           "tool maybe",
                           "screenshot",
                           "status ",
                           "quit now",
                           "dance",
                           "wait bodies",
                           "wait items -1",
                           "undo",
                           "undo 0",
                           "undo -1",
                           "undo all",
                           "redo",
                           "redo 1 2",
                           "take-away",
                           "take-away x",
                           "place",
                           "place pin-1 at 0 0 0",
                           "place pin-1 at 0 0 0 along 0 0 0",
                           "place pin-1 at 0 0 x along 0 0 1",
                           "place pin-1 at 0 0 0 along 0 0 1 on",
                           "place pin-1 at 0 0 0 along 0 0 1 in 2",
                           "place pin-1 near",
                           "place pin-1 near 0 0 nan",
                           "place pin-1 near 0 0 0 along 0 0 0",
                           "place pin-1 near 0 0 0 along 0 0 1 across 0 0 2",
                           "place pin-1 near 0 0 0 at 0 0 0",
                           "place pin-1 near 0 0 0 on",
                           "move",
                           "move 1",
                           "move 0 near 0 0 0",
                           "move 1 at 0 0 0",
                           "move 1 near 0 0 0 on 2",
                           "turn 1",
                           "turn 1 2 3",
                           "turn 1 inf",
                           "turn x 1",
                           "seat",
                           "seat 1 0",
                           "seat 1 -2",
                           "seat 1 x",
                           "seat 1 2 3",
                           "remove",
                           "remove 0",
                           "remove 1 2"}) {
    const auto command = parse_command(line);
    ASSERT_FALSE(command) << line;
    EXPECT_EQ(command.error().code, ErrorCode::invalid_input);
    EXPECT_NE(command.error().message.find('`'), std::string::npos) << command.error().message;
  }
}

TEST(Script, LinesComeWithoutWaitingForThem) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const int standard_input = ::dup(STDIN_FILENO);
  ::dup2(ends[0], STDIN_FILENO);
  auto reader = ScriptReader::open("-");
  ::dup2(standard_input, STDIN_FILENO);
  ASSERT_TRUE(reader);

  EXPECT_EQ(reader->next(), std::nullopt);
  ASSERT_EQ(::write(ends[1], "wait sur", 8), 8);
  EXPECT_EQ(reader->next(), std::nullopt);
  ASSERT_EQ(::write(ends[1], "face\nquit", 9), 9);
  EXPECT_EQ(reader->next(), "wait surface");
  EXPECT_EQ(reader->next(), std::nullopt);
  EXPECT_FALSE(reader->ended());
  ::close(ends[1]);
  EXPECT_EQ(reader->next(), "quit");  // a last line without an end
  EXPECT_EQ(reader->next(), std::nullopt);
  EXPECT_TRUE(reader->ended());
  ::close(ends[0]);
  ::close(standard_input);
}

TEST(Script, NamesAFileThatIsNotThere) {
  const auto reader = ScriptReader::open("/nowhere/at-all.script");
  ASSERT_FALSE(reader);
  EXPECT_NE(reader.error().message.find("/nowhere/at-all.script"), std::string::npos);
}

}  // namespace
}  // namespace osteon
