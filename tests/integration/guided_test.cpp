// Tests guided drilling with all programs. A trembling hand drills through a guide's sleeve that it has set on the
// bone, and leaves a pin and a screw. Checks what the server saved: the hole by what is solid, the scene by its items.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>

#include "common/geometry/mesh_file.hpp"
#include "common/tools/guide.hpp"
#include "common/volume/field_file.hpp"
#include "osteon/v1/people.grpc.pb.h"
#include "tests/integration/stage.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

json entry_at(double x_mm, double y_mm) { return {{"point_mm", {x_mm, y_mm, 0.0}}, {"axis", {0.0, 0.0, -1.0}}}; }

CutField field_of(const Case& bone, const SavedFields& saved) {
  CutField field(bone, BodyId{0});
  for (const FieldLeaf& leaf : saved.leaves)
    if (leaf.body == BodyId{0}) field.restore(leaf);
  return field;
}

TEST(Guided, ATremblingHandDrillsWhereTheGuideSays) {
  constexpr double kLimit_mm = 0.15;  // an eighth of a voxel of the case, and what the field resolves
  const TempDir kept;
  const auto screen = Xvfb::start("640x480");
  ASSERT_TRUE(screen) << "Xvfb is needed; deploy/install installs it";
  Stage stage(30.0, {"--plain", "--save", kept / "bone.vdb"});
  ScriptedViewer viewer(stage.address(), *screen, {"--plain", "--summary", stage / "viewer.json"});
  ASSERT_TRUE(viewer.tell("wait surface"));
  const json drill{{"action", "drill"}, {"tool", "drill-3.2"}, {"guide", true},        {"tremor_mm", 1.2},
                   {"hand", "expert"},  {"spindle_rpm", 1000}, {"feed_mm_per_s", 2.0}, {"beyond_mm", 3.0}};
  const json pin{{"action", "drill"}, {"tool", "pin-1"},    {"to_mm", 10.0},
                 {"leave", true},     {"spindle_rpm", 800}, {"entry", entry_at(9, 6)}};
  const json screw{{"action", "screw"}, {"tool", "screw-1"}, {"spindle_rpm", 240}, {"entry", entry_at(-9, 6)}};
  Process haptic = stage.start_haptic(
      "hand", {{"steps", json::array({json{{"action", "place"}, {"tool", "guide-1"}, {"entry", entry_at(2, -3)}}, drill,
                                      pin, screw})}});
  ASSERT_EQ(haptic.wait(180s), 0) << haptic.err();
  ASSERT_TRUE(viewer.tell("wait items 3"));
  const json summary = read_json(stage / "hand.json");
  ASSERT_TRUE(viewer.tell("wait seq " + std::to_string(summary.at("room_seq").get<std::uint64_t>())));
  EXPECT_EQ(viewer.process().terminate(), 0);
  ASSERT_EQ(stage.server().terminate(), 0);
  const json server = read_json(stage / "server.json");
  EXPECT_EQ(summary.at("field_hash"), server.at("field_hash"));
  EXPECT_EQ(read_json(stage / "viewer.json").at("scene_mesh_hash"), server.at("mesh_hash"));

  const auto bone = Case::load(stage / "case");
  ASSERT_TRUE(bone) << bone.error().message;
  const auto saved = load_fields(kept / "bone.vdb", *bone);
  ASSERT_TRUE(saved) << saved.error().message;
  ASSERT_EQ(saved->items.size(), 3u);
  EXPECT_EQ(saved->items[0].tool, find_tool("guide-1")->hash());
  EXPECT_LT((saved->items[0].pose_bone_item.position_mm - Vec3(2, -3, 0)).norm(), 0.5);
  EXPECT_EQ(saved->items[1].tool, find_tool("pin-1")->hash());
  EXPECT_NEAR(saved->items[1].pose_bone_item.position_mm.z(), -10.0, 0.5);
  EXPECT_EQ(saved->items[2].tool, find_tool("screw-1")->hash());
  EXPECT_GT(saved->items[2].turns, 1.0);

  // Beyond a bore of length L the drill's axis stays within c (1 + 2 l / L) of the middle, where c is the play. All its
  // paths together make the hole, so the hole stays within that distance plus the drill's radius.
  const GuideBore bore = guide_shape(*find_tool("guide-1")).bores.at(0);
  const double radius = 1.6, play = 0.5 * (bore.diameter_mm - 2.0 * radius);
  ASSERT_GT(play, 0.0);
  const CutField field = field_of(*bone, *saved);
  const Pose guide = saved->items[0].pose_bone_item;
  for (double depth = 2.0; depth < 28.0; depth += 2.0) {
    SCOPED_TRACE(depth);
    const double bound = play * (1.0 + 2.0 * depth / bore.length_mm);
    EXPECT_GT(field.solid_mm(guide.point({0, 0, depth})), 0.0);
    for (int i = 0; i < 24; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / 24.0;
      const Vec3 out{std::cos(angle), std::sin(angle), 0};
      EXPECT_LT(field.solid_mm(guide.point((radius + bound + kLimit_mm) * out + Vec3(0, 0, depth))), 0.0);
    }
  }
}

// The numbers of an answer such as "ok ...: item 3 at 1.00 2.00 3.00 along 0.000 0.000 -1.000, seated".
struct Answer {
  unsigned item = 0;
  Vec3 at{0, 0, 0}, along{0, 0, 0};
  bool seated = false;
};
Answer standing_of(const std::string& line) {
  Answer answer;
  const std::size_t from = line.find(": item ");
  EXPECT_TRUE(line.starts_with("ok ") && from != std::string::npos) << line;
  if (from == std::string::npos) return answer;
  EXPECT_EQ(std::sscanf(line.c_str() + from, ": item %u at %lf %lf %lf along %lf %lf %lf", &answer.item, &answer.at.x(),
                        &answer.at.y(), &answer.at.z(), &answer.along.x(), &answer.along.y(), &answer.along.z()),
            7)
      << line;
  answer.seated = line.find(", seated") != std::string::npos;
  return answer;
}

// A demonstration is a session of the server's own, so nobody could ask it to leave.
TEST(Demonstration, IsOverWhenTheServerIsToStop) {
  const TempDir kept;
  Stage stage(16.0, {"--plain", "--journal", kept / "room.journal", "--drain-seconds", "300"});
  constexpr std::uint64_t kCuts = 10;
  {
    Surgeon hand(stage.address(), stage / "cache");
    ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
    for (std::uint64_t i = 1; i <= kCuts; ++i) {
      const double x_mm = static_cast<double>(i) - 5.0;
      Cut cut = straight_cut(find_tool("burr-round-5").value(), {x_mm, 0, 0}, {x_mm, 1, 0}, {0, 0, -1}, i);
      cut.author = hand.author();
      ASSERT_TRUE(hand.session().send(cut));
      ASSERT_TRUE(wait_until([&] { return hand.own() == i; }, kPatience)) << hand.rejected();
    }
  }
  const wire::JoinedRoom instructor = join(stage.address(), wire::ClientKind::viewer);
  v1::DemonstrateRequest request;
  request.set_author(instructor.author.value);
  request.set_speed(0.001);  // far longer than the test waits
  v1::DemonstrateResponse response;
  grpc::ClientContext context;
  const grpc::Status shown = v1::PeopleService::NewStub(instructor.channel)->Demonstrate(&context, request, &response);
  ASSERT_TRUE(shown.ok()) << shown.error_message();
  ASSERT_EQ(response.cuts(), kCuts);
  ASSERT_EQ(stage.server().terminate(60s), 0) << stage.server().err();
  EXPECT_NE(stage.server().err().find("drained sessions_left=0"), std::string::npos) << stage.server().err();
}

// A person with a viewer's script places, moves, turns, drives home and removes items on the bone. The block's top is z
// = 0. The cup and the reamer that makes its cavity are tools of the tool box, edited to 36 mm.
TEST(Scene, IsArrangedFromAViewersScript) {
  const TempDir tools;
  for (const auto& [tool, file] :
       {std::pair{"trial-cup-50", "cup-36.yaml"}, std::pair{"reamer-sphere", "reamer-36.yaml"}}) {
    const auto made = run(program("osteon-import"), {"tools", tool, "--set", "diameter_mm=36", "--out", tools / file});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  const auto screen = Xvfb::start("640x480");
  ASSERT_TRUE(screen) << "Xvfb is needed; deploy/install installs it";
  Stage stage(70.0, {"--plain", "--tools", tools / ""});
  ScriptedViewer viewer(stage.address(), *screen);
  ASSERT_TRUE(viewer.tell("wait surface"));
  const Vec3 into(0, 0, -1);
  const double on_surface_mm = 0.02;  // the last digit of the answers, and the field's rounding
  const auto refused = [&](const std::string& command, const std::string& named) {
    const std::string line = viewer.ask(command);
    EXPECT_TRUE(line.starts_with("error ")) << command << ": " << line;
    EXPECT_NE(line.find(named), std::string::npos) << line;
  };

  // A guide finds the surface by itself. When pins fix it, it stays.
  const Answer block = standing_of(viewer.ask("place guide-2 near 0 20 4 across 1 0 0"));
  EXPECT_EQ(block.item, 1u);
  EXPECT_LT((block.at - Vec3(0, 20, 0)).norm(), on_surface_mm);
  EXPECT_LT((block.along - into).norm(), 2e-3) << "against the surface's normal";
  const Answer leaning = standing_of(viewer.ask("move 1 near 1 19 3 along 0.1 0 -1"));
  EXPECT_LT((leaning.at - Vec3(1, 19, 0)).norm(), on_surface_mm);
  EXPECT_LT((leaning.along - Vec3(0.1, 0, -1).normalized()).norm(), 2e-3);
  EXPECT_EQ(standing_of(viewer.ask("move 1 at 0 20 0 along 0 0 -1")).item, 1u);
  for (const GuideBore& hole : guide_shape(*find_tool("guide-2")).pin_holes) {
    // The guide's x is the bone's x. Its z points down.
    const Vec3 tip = hole.entry_mm + (hole.length_mm + 15.0) * hole.direction;
    const auto line = viewer.ask("place pin-1 at " + std::to_string(tip.x()) + " " + std::to_string(20.0 - tip.y()) +
                                 " " + std::to_string(-tip.z()) + " along 0 0 -1");
    EXPECT_NEAR(standing_of(line).at.z(), -15.0, 0.01) << line;
  }
  refused("move 1 at 0 20 1 along 0 0 -1", "fixed by pins");
  refused("remove 1", "fixed by pins");
  EXPECT_EQ(viewer.ask("remove 3"), "ok remove 3");
  EXPECT_EQ(standing_of(viewer.ask("move 1 at 0 20 1 along 0 0 -1")).at, Vec3(0, 20, 1));
  EXPECT_EQ(viewer.ask("remove 1"), "ok remove 1");
  refused("remove 1", "does not stand");
  refused("turn 2 1", "no thread");

  // A screw of pitch 1.25 mm and length 30 mm.
  const Answer screw = standing_of(viewer.ask("place screw-1 near 25 -20 2"));
  EXPECT_LT((screw.at - Vec3(25, -20, 0)).norm(), on_surface_mm);
  const std::string number = std::to_string(screw.item);
  EXPECT_NEAR(standing_of(viewer.ask("turn " + number + " 4")).at.z(), -5.0, on_surface_mm);
  EXPECT_NEAR(standing_of(viewer.ask("turn " + number + " -1")).at.z(), -3.75, on_surface_mm);
  refused("move " + number + " at 25 -20 -9 along 0 0 -1", "thread");
  const std::string home = viewer.ask("turn " + number + " 50");
  EXPECT_NEAR(standing_of(home).at.z(), -30.0, 0.1) << home;
  EXPECT_NE(home.find(", 24.0"), std::string::npos) << "30 mm are 24 turns: " << home;
  EXPECT_TRUE(standing_of(home).seated) << home;
  refused("turn " + number + " 1000", "100 mm");

  // The cup fits into a hemisphere of its own size.
  {
    Surgeon hand(stage.address(), stage / "cache");
    ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
    const auto entries = hand.session().tools()->entries();
    const auto reamer =
        std::ranges::find(entries, "reamer-36", [](const ToolBox::Entry* entry) { return entry->tool.name; });
    ASSERT_NE(reamer, entries.end());
    // As a motor of 500 W could do: 0.2 mm in 60 ms. The room would reject more bone at once.
    constexpr std::uint64_t kCuts = 95;
    for (std::uint64_t i = 1; i <= kCuts; ++i) {
      const double from_mm = 1.0 - 0.2 * static_cast<double>(i - 1);
      Cut cut = straight_cut((*reamer)->tool, {-14, -13, from_mm}, {-14, -13, from_mm - 0.2}, into, i);
      cut.author = hand.author();
      cut.path_us = 60'000;
      ASSERT_TRUE(hand.session().send(cut));
      std::this_thread::sleep_for(std::chrono::milliseconds(52));
    }
    ASSERT_TRUE(wait_until([&] { return hand.own() == kCuts; }, kPatience)) << hand.rejected();
  }
  const Answer cup = standing_of(viewer.ask("place cup-36 at -14 -13 1 along 0 0 -1"));
  const std::string cup_number = std::to_string(cup.item);
  EXPECT_FALSE(cup.seated);
  const std::string short_way = viewer.ask("seat " + cup_number + " 3");
  EXPECT_NEAR(standing_of(short_way).at.z(), -2.0, 0.01) << short_way;
  EXPECT_FALSE(standing_of(short_way).seated) << short_way;
  const std::string seated = viewer.ask("seat " + cup_number);
  EXPECT_NEAR(standing_of(seated).at.z(), -18.0, 0.1) << seated;
  EXPECT_TRUE(standing_of(seated).seated) << seated;
  refused("seat " + number, "no implant");
  refused("seat 99", "99");

  // All of it can be undone, and everyone receives the undo.
  EXPECT_EQ(viewer.ask("undo 1"), "ok undo 1: 1 event");
  ASSERT_TRUE(viewer.tell("status " + (stage / "viewer.json").string()));
  const json standing = read_json(stage / "viewer.json").at("standing");
  ASSERT_EQ(standing.size(), 3u);
  EXPECT_NEAR(standing.at(2).at("at_mm").at(2).get<double>(), -2.0, 0.01);
  refused("place guide-1 near 0 0 30", "20 mm");
  refused("place drill-3.2 near 0 0 3", "hand-held");
}

// The shape of a tool of the tool box is written as triangles. It is loaded from a folder as a tool of its own.
TEST(ToolFolder, ABallOfTrianglesCutsAsABallDoes) {
  const TempDir tools, kept;
  constexpr double kRadius_mm = 2.5;
  Stage stage(16.0, {"--plain"});
  ASSERT_EQ(stage.server().terminate(), 0);
  TriangleMesh ball;
  constexpr int kAround = 96, kRows = 48;
  const auto corner = [&](int row, int i) {
    const double polar = std::numbers::pi * row / kRows, angle = 2.0 * std::numbers::pi * i / kAround;
    const Vec3 p =
        kRadius_mm * Vec3{std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle), std::cos(polar) - 1.0};
    return std::array<float, 3>{static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
  };
  ball.positions_mm.push_back(corner(0, 0));
  for (int row = 1; row < kRows; ++row)
    for (int i = 0; i < kAround; ++i) ball.positions_mm.push_back(corner(row, i));
  ball.positions_mm.push_back(corner(kRows, 0));
  const auto index = [&](int row, int i) {
    return static_cast<std::uint32_t>(row == 0       ? 0
                                      : row == kRows ? 1 + (kRows - 1) * kAround
                                                     : 1 + (row - 1) * kAround + i % kAround);
  };
  for (int row = 0; row < kRows; ++row)
    for (int i = 0; i < kAround; ++i) {
      if (row > 0) ball.triangles.push_back({index(row, i), index(row + 1, i), index(row, i + 1)});
      if (row < kRows - 1) ball.triangles.push_back({index(row, i + 1), index(row + 1, i), index(row + 1, i + 1)});
    }
  ASSERT_TRUE(write_stl(ball, tools / "ball.stl"));
  std::ofstream(tools / "ball.yaml")
      << "name: ball-of-the-folder\ntitle: Ball\nkind: mesh\nmesh: ball.stl\nmesh_pitch_mm: 0.25\n"
         "spindle_rpm: 1000\nteeth: 4\nfeed_mm_per_rev: 1\ncut_level: 2\n";
  stage.start_server({"--plain", "--tools", tools / "", "--save", kept / "bone.vdb"});
  {
    Surgeon hand(stage.address(), stage / "cache");
    ASSERT_TRUE(wait_until([&] { return hand.complete(); }, kPatience));
    const ToolBox::Entry* tool = nullptr;
    for (const ToolBox::Entry* entry : hand.session().tools()->entries())
      if (entry->tool.name == "ball-of-the-folder") tool = entry;
    ASSERT_NE(tool, nullptr);
    Cut cut = straight_cut(tool->tool, {0.013, 0.027, -10}, {0.013, 0.027, -10}, {0, 0, -1});
    cut.author = hand.author();
    ASSERT_TRUE(hand.session().send(cut));
    ASSERT_TRUE(wait_until([&] { return hand.own() == 1; }, kPatience)) << hand.rejected();
    EXPECT_EQ(wire::to_wire(hand.hash()), status_of(hand.session().room()).field_hash());
  }
  ASSERT_EQ(stage.server().terminate(), 0);
  const double whole = 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius_mm, 3);
  // The chords of the triangles and the lattice of 0.25 mm both make it a little smaller.
  EXPECT_NEAR(read_json(stage / "server.json").at("removed_mm3").get<double>(), whole, 0.02 * whole);

  // The file contains the tool. Without the tool's folder the bone is still usable, and the tool can cut it.
  stage.start_server({"--plain", "--resume", kept / "bone.vdb"});
  Surgeon resumed(stage.address(), stage / "cache");
  ASSERT_TRUE(wait_until([&] { return resumed.complete(); }, kPatience));
  EXPECT_TRUE(std::ranges::any_of(resumed.session().tools()->entries(),
                                  [](const auto* e) { return e->tool.name == "ball-of-the-folder"; }));
}

}  // namespace
}  // namespace osteon::test
