// Carving without a room: volumes against closed forms, closed surfaces, pieces that come apart, and faulty scripts.
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/geometry/mesh_file.hpp"
#include "common/geometry/pose_across.hpp"
#include "common/tools/tool_file.hpp"
#include "server/import/bone_surface.hpp"
#include "server/import/carving.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// 12 x 12 x 8 mm, its top face at z = 0.
Case block(double pitch_mm = 0.5) {
  const Phantom phantom{.kind = PhantomKind::block, .layers = {{8.0, 1.5}}, .width_mm = 12.0};
  return *build_phantom_case(phantom, pitch_mm, "Block", keep_going);
}

CarveStep step(const char* tool, std::vector<Pose> path, std::optional<int> level = {}) {
  return {*find_tool(tool), std::move(path), level};
}
Pose down(double x, double y, double z) { return pose_along({x, y, z}, {0, 0, -1}); }

TEST(Carving, ABurrsGrooveHasItsVolume) {
  Carving carving(block(), 1.0);
  const auto report = carving.run(step("burr-round-5", {down(-8, 0, -2), down(8, 0, -2)}), keep_going);
  ASSERT_TRUE(report);
  // A burr of radius r whose tip goes at depth d < r sweeps the segment of a circle over the block's width.
  const double r = 2.5, d = 2.0;
  const double segment = r * r * std::acos((r - d) / r) - (r - d) * std::sqrt(2 * r * d - d * d);
  EXPECT_NEAR(report->removed_mm3, 12.0 * segment, 0.01 * 12.0 * segment);
  EXPECT_EQ(report->cuts, 16);  // of a millimetre each
  EXPECT_EQ(report->level, 2);
  EXPECT_GE(report->visited, report->computed);
  EXPECT_GE(report->computed, report->modified);
  EXPECT_GT(report->modified, 0);
  EXPECT_EQ(report->pieces + report->debris, 0);
}

// Down through bone into a metal plate: cuts that would take metal are left out, and this is reported.
TEST(Carving, LeavesMetalWhereItIs) {
  const auto plate = [](const Vec3& p) { return p.z() < -4.0 ? Tissue::metal : Tissue::none; };
  Carving carving(osteon::test::marked_block(12.0, 8.0, 0.5, plate), 0.5),
      bone(osteon::test::plain_block(12.0, 8.0, 0.5), 0.5);
  const CarveStep through = step("burr-round-5", {down(0, 0, 0), down(0, 0, -8)});
  const auto report = carving.run(through, keep_going), all = bone.run(through, keep_going);
  ASSERT_TRUE(report && all);
  // The first sample of metal is at 4.5 mm, and the tip may be half a millimetre deep in it.
  EXPECT_EQ(report->cuts, 10);
  EXPECT_EQ(report->metal_refused, 6);
  EXPECT_EQ(all->metal_refused, 0);
  EXPECT_EQ(all->cuts, 16);
  EXPECT_LT(report->removed_mm3, all->removed_mm3);
  EXPECT_NE(line(1, *report).find("metal refused 6 more cuts"), std::string::npos);
  EXPECT_EQ(line(1, *all).find("metal"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(to_json({*report}, carving.fields()))["steps"][0]["metal_refused"], 6);
}

TEST(Carving, TheWayIsTheSameInAnyParts) {
  // Translations are swept exactly, so one long cut and sixteen short ones leave the same field.
  Carving fine(block(), 1.0), coarse(block(), 16.0);
  ASSERT_TRUE(fine.run(step("burr-round-5", {down(-8, 0, -2), down(8, 0, -2)}), keep_going));
  ASSERT_TRUE(coarse.run(step("burr-round-5", {down(-8, 0, -2), down(8, 0, -2)}), keep_going));
  EXPECT_EQ(fine.field(0).hash(), coarse.field(0).hash());
}

TEST(Carving, ACutStartsWhereTheLastOneEnded) {
  const auto cuts = cuts_of(step("drill-3.2", {down(0, 0, 5), down(0, 0, -5), down(3, 0, -5)}), {}, 1, 2.0);
  ASSERT_EQ(cuts.size(), 7u);
  for (std::size_t i = 1; i < cuts.size(); ++i) EXPECT_EQ(cuts[i].path.front(), cuts[i - 1].path.back());
  EXPECT_EQ(cuts.back().path.back(), quantise(down(3, 0, -5)));
  EXPECT_EQ(cuts_of(step("drill-3.2", {down(0, 0, 5)}), {}, 1, 2.0).size(), 1u);
}

TEST(Carving, SawingThroughTakesAPieceOff) {
  Carving carving(block(), 1.0);
  // A blade stands upright across y and goes from above through the block at x = 2, in two plunges beside each other.
  const Vec3 in(0, 0, -1), across(0, 1, 0);
  const double volume = carving.field(0).bone().volume_mm3();
  const auto report = carving.run(
      step("saw-oscillating-1", {pose_across({2, 0, 2}, in, across), pose_across({2, 0, -10}, in, across)}, 1),
      keep_going);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->pieces, 1);
  ASSERT_EQ(carving.bodies(), 2u);
  // Kerf 1.27 mm wide; the smaller side, x from 2.635 to 6, is the piece.
  EXPECT_NEAR(report->removed_mm3, 1.27 * 12.0 * 8.0, 0.03 * 1.27 * 96.0);
  EXPECT_NEAR(report->pieces_mm3, (6.0 - 2.635) * 96.0, 0.03 * 323.0);
  EXPECT_NEAR(carving.field(1).removed_mm3(), volume - report->pieces_mm3, 0.03 * volume);
  // Both halves are closed. Together they are what the saw left.
  const auto kept = bone_surface(carving.field(0), keep_going), piece = bone_surface(carving.field(1), keep_going);
  ASSERT_TRUE(kept && piece);
  EXPECT_EQ(open_edges(*kept), 0u);
  EXPECT_EQ(open_edges(*piece), 0u);
  EXPECT_NEAR(enclosed_mm3(*kept) + enclosed_mm3(*piece), volume - report->removed_mm3, 0.02 * volume);
  // A later cut through both is made in both.
  const auto again = carving.run(step("drill-3.2", {down(5.6, 0, 1), down(5.6, 0, -10)}), keep_going);
  ASSERT_TRUE(again);
  // The drill's circle less its segment beyond the face at x = 6.
  const double r = 1.6,
               in_bone = std::numbers::pi * r * r - (r * r * std::acos(0.4 / r) - 0.4 * std::sqrt(r * r - 0.16)),
               hole = in_bone * 8.0;
  EXPECT_NEAR(again->removed_mm3, hole, 0.05 * hole) << "from the piece alone";
  EXPECT_LT(enclosed_mm3(*bone_surface(carving.field(1), keep_going)), enclosed_mm3(*piece) - 0.9 * hole);
  const SavedFields fields = carving.fields();
  EXPECT_EQ(fields.bodies.size(), 2u);
  EXPECT_EQ(fields.case_hash, carving.field(0).bone().hash());
}

TEST(Carving, APieceIsSawnInTwoAgain) {
  Carving carving(block(), 1.0);
  const Vec3 in(0, 0, -1);
  const auto sawn = [&](const Vec3& at, const Vec3& across) {
    return carving.run(
        step("saw-oscillating-1", {pose_across(at, in, across), pose_across(at - Vec3(0, 0, 12), in, across)}, 1),
        keep_going);
  };
  const double whole = carving.field(0).bone().volume_mm3(), kerf = 1.27;
  const auto first = sawn({2, 0, 2}, Vec3::UnitY());
  ASSERT_TRUE(first);
  ASSERT_EQ(carving.bodies(), 2u);
  // Across the piece, which reaches from x = 2.635 to 6; the blade's stroke notches the rest.
  const double width = find_tool("saw-oscillating-1")->width_mm;
  const auto again = sawn({2.0 + 0.5 * width, -1, 2}, Vec3::UnitX());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->pieces, 1);
  ASSERT_EQ(carving.bodies(), 3u);
  const double side = 6.0 - 2.0 - 0.5 * kerf;
  // The part towards −y is the smaller one: from y = −6 to −1.635.
  EXPECT_NEAR(again->pieces_mm3, side * (5.0 - 0.5 * kerf) * 8.0, 0.05 * whole / 8.0);
  double solid = 0;
  for (std::size_t body = 0; body < 3; ++body) {
    const auto mesh = bone_surface(carving.field(body), keep_going);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(open_edges(*mesh), 0u) << body;
    const auto vertices = static_cast<std::int64_t>(mesh->positions_mm.size()),
               faces = static_cast<std::int64_t>(mesh->triangles.size());
    EXPECT_EQ(vertices - faces / 2, 2) << "one ball each; body " << body;
    solid += enclosed_mm3(*mesh);
  }
  EXPECT_NEAR(solid, whole - first->removed_mm3 - again->removed_mm3, 0.02 * whole);
  EXPECT_EQ(carving.fields().bodies.size(), 3u);
}

TEST(BoneSurface, ABlockIsClosedAndHasItsVolume) {
  const CutField field(block(), BodyId{0});
  const auto mesh = bone_surface(field, keep_going);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(open_edges(*mesh), 0u);
  EXPECT_NEAR(enclosed_mm3(*mesh), 12.0 * 12.0 * 8.0, 0.02 * 1152.0);
  // Euler characteristic of a ball: 2.
  const auto vertices = static_cast<std::int64_t>(mesh->positions_mm.size()),
             faces = static_cast<std::int64_t>(mesh->triangles.size());
  EXPECT_EQ(vertices - faces / 2, 2);
}

TEST(BoneSurface, ADrilledBlockIsARing) {
  for (const int level : {0, 1, 2}) {
    Carving carving(block(), 1.0);
    ASSERT_TRUE(carving.run(step("drill-3.2", {down(0, 0, 2), down(0, 0, -12)}, level), keep_going));
    const auto mesh = bone_surface(carving.field(0), keep_going);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(open_edges(*mesh), 0u);
    const auto vertices = static_cast<std::int64_t>(mesh->positions_mm.size()),
               faces = static_cast<std::int64_t>(mesh->triangles.size());
    EXPECT_EQ(vertices - faces / 2, 0);  // one hole
  }
}

TEST(BoneSurface, StopsWhenAsked) {
  const auto mesh = bone_surface(CutField(block(), BodyId{0}), [](double) { return false; });
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, ErrorCode::cancelled);
}

class Scripts : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path write(const std::string& text) {
    std::ofstream(folder_ / "script.yaml", std::ios::trunc) << text;
    return folder_ / "script.yaml";
  }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  test::TempDir folder_;
};

TEST_F(Scripts, PosesAreWhatTheySay) {
  const auto steps =
      read_carve_script(write("steps:\n"
                              "  - {tool: drill-3.2, from: [1, 2, 3], to: [1, 2, -3], axis: [0, 0, -2]}\n"
                              "  - tool: saw-oscillating-3\n    level: 1\n    axis: [0, 1, 0]\n    across: [1, 1, 0]\n"
                              "    path: [{at: [0, 0, 0]}, {at: [0, 5, 0], axis: [1, 0, 0], across: [0, 0, 1]}]\n"));
  ASSERT_TRUE(steps) << steps.error().message;
  ASSERT_EQ(steps->size(), 2u);
  const CarveStep& drill = (*steps)[0];
  EXPECT_EQ(drill.tool.name, "drill-3.2");
  EXPECT_FALSE(drill.level);
  EXPECT_EQ(drill.path[1].position_mm, Vec3(1, 2, -3));
  EXPECT_LT((drill.path[0].direction(Vec3::UnitZ()) - Vec3(0, 0, -1)).norm(), 1e-12);
  const CarveStep& saw = (*steps)[1];
  EXPECT_EQ(saw.level, 1);
  EXPECT_LT((saw.path[0].direction(Vec3::UnitZ()) - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_LT((saw.path[0].direction(Vec3::UnitX()) - Vec3::UnitX()).norm(), 1e-12);  // made square to the axis
  EXPECT_LT((saw.path[1].direction(Vec3::UnitX()) - Vec3::UnitZ()).norm(), 1e-12);
}

// A scanner may count its table's way from far off.
TEST_F(Scripts, ReachABoneFarFromTheOrigin) {
  const auto steps = read_carve_script(write("steps: [{tool: drill-3.2, at: [0, 0, -1450], axis: [0, 0, 1]}]"));
  ASSERT_TRUE(steps) << steps.error().message;
  EXPECT_EQ(steps->front().path.front().position_mm.z(), -1450.0);
}

TEST_F(Scripts, WrongOnesAreOneSentence) {
  const auto refused = [&](const std::string& text, const std::string& named) {
    const auto steps = read_carve_script(write(text));
    ASSERT_FALSE(steps) << text;
    EXPECT_NE(steps.error().message.find(named), std::string::npos) << steps.error().message;
    EXPECT_NE(steps.error().message.find("script.yaml"), std::string::npos) << steps.error().message;
    EXPECT_EQ(steps.error().message.find('\n'), std::string::npos);
  };
  refused("[", "YAML");
  refused("steps: 3", "steps");
  refused("steps: []", "steps");
  refused("steps: [{from: [0, 0, 0]}]", "step 1: tool is missing");
  refused("steps: [{tool: spoon, at: [0, 0, 0], axis: [0, 0, 1]}]", "spoon");
  refused("steps: [{tool: drill-3.2, at: [0, 0, 0]}]", "axis is missing");
  refused("steps: [{tool: drill-3.2, at: [0, 0], axis: [0, 0, 1]}]", "three numbers");
  refused("steps: [{tool: drill-3.2, at: [0, 0, .nan], axis: [0, 0, 1]}]", "three numbers");
  refused("steps: [{tool: drill-3.2, at: [0, 0, 1e9], axis: [0, 0, 1]}]", "10 m");
  refused("steps: [{tool: drill-3.2, at: [0, 0, -10001], axis: [0, 0, 1]}]", "10 m");
  refused("steps: [{tool: drill-3.2, at: [0, 0, 0], axis: [0, 0, 0]}]", "no length");
  refused("steps: [{tool: drill-3.2, at: [0, 0, 0], axis: [0, 0, 1], across: [0, 0, 2]}]", "along axis");
  refused("steps: [{tool: drill-3.2, from: [0, 0, 0], axis: [0, 0, 1]}]", "to is missing");
  refused("steps: [{tool: drill-3.2, axis: [0, 0, 1]}]", "from and to, or at, or path");
  refused("steps: [{tool: drill-3.2, at: [0, 0, 0], axis: [0, 0, 1], level: 7}]", "level");
  refused("steps: [{tool: drill-3.2, at: [0, 0, 0], axis: [0, 0, 1], depth: 7}]", "depth");
  refused("steps: [{tool: drill-3.2, at: [0, 0, 0], axis: [0, 0, 1]}, {tool: guide-1, at: [0, 0, 0], axis: [0, 0, 1]}]",
          "step 2: guide-1 does not cut");
  EXPECT_EQ(read_carve_script(folder_ / "absent.yaml").error().code, ErrorCode::not_found);
}

TEST_F(Scripts, TheProgramsAgree) {
  const std::string program = OSTEON_IMPORT_PROGRAM;
  ASSERT_EQ(test::run(program, {"phantom", "block", "--layers", "8:1.5", "--width", "12", "--pitch", "0.5", "--out",
                                path("case")})
                .exit_code,
            0);
  const auto script =
      write("steps: [{tool: burr-round-5, from: [-8, 0, -2], to: [8, 0, -2], axis: [0, 0, -1]}]").string();
  const auto carved = test::run(program, {"carve", path("case"), script, "--out", path("f.vdb"), "--surface",
                                          path("f.stl"), "--report", path("f.json")});
  ASSERT_EQ(carved.exit_code, 0) << carved.err;
  const auto hash = test::run(program, {"hash", path("f.vdb")});
  ASSERT_EQ(hash.exit_code, 0) << hash.err;
  EXPECT_NE(carved.out.find("hash       " + hash.out), std::string::npos) << carved.out;
  nlohmann::json report;
  std::ifstream(folder_ / "f.json") >> report;
  EXPECT_EQ(report.at("field_hash").get<std::string>() + "\n", hash.out);
  EXPECT_EQ(report.at("steps").size(), 1u);
  EXPECT_GT(report.at("steps")[0].at("removed_mm3").get<double>(), 50.0);

  // The surface from the saved fields is the one that carving wrote. It is also closed when read back from the file.
  for (const char* name : {"g.stl", "g.ply", "g.obj"}) {
    const auto surface = test::run(program, {"surface", path("case"), "--fields", path("f.vdb"), "--out", path(name)});
    ASSERT_EQ(surface.exit_code, 0) << surface.err;
    EXPECT_NE(surface.out.find(" 0 open edges"), std::string::npos) << surface.out;
  }
  const auto first = read_stl(folder_ / "f.stl"), second = read_stl(folder_ / "g.stl");
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->triangles, second->triangles);
  EXPECT_EQ(open_edges(*first), 0u);

  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& named) {
    const auto result = test::run(program, arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find(named), std::string::npos) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  };
  refused({"carve", path("case"), script, "--out", path("f.vdb")}, "already there");
  refused({"carve", path("absent"), script, "--out", path("n.vdb")}, path("absent"));
  refused({"surface", path("case"), "--out", path("n.txt")}, ".stl");
  refused({"surface", path("case"), "--fields", path("f.stl"), "--out", path("n.stl")}, "f.stl");
  refused({"surface", path("case"), "--fields", path("f.vdb"), "--body", "3", "--out", path("n.stl")}, "no body 3");
  refused({"hash", path("absent.vdb")}, path("absent.vdb"));
  ASSERT_EQ(test::run(program, {"phantom", "block", "--layers", "6:1.5", "--width", "12", "--pitch", "0.5", "--out",
                                path("other")})
                .exit_code,
            0);
  refused({"surface", path("other"), "--fields", path("f.vdb"), "--out", path("n.stl")}, "f.vdb");
}

TEST_F(Scripts, TheToolBoxIsListedAndWritten) {
  const std::string program = OSTEON_IMPORT_PROGRAM;
  const auto listed = test::run(program, {"tools", "--stl", path("tools")});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  for (const Tool& tool : builtin_tools()) {
    EXPECT_NE(listed.out.find(tool.name), std::string::npos);
    EXPECT_NE(listed.out.find(to_hex(tool.hash()).substr(0, 16)), std::string::npos) << tool.name;
    const auto mesh = read_stl(folder_ / "tools" / (tool.name + ".stl"));
    ASSERT_TRUE(mesh) << tool.name;
    EXPECT_EQ(open_edges(*mesh), 0u) << tool.name;
    EXPECT_GT(enclosed_mm3(*mesh), 0.0) << tool.name;
  }
  std::ofstream(folder_ / "mine.yaml")
      << "name: my-burr\ntitle: My bur\nkind: round-burr\ndiameter_mm: 4\nshank_diameter_mm: 2\nshank_length_mm: 50\n"
         "spindle_rpm: 20000\nteeth: 8\nfeed_mm_per_rev: 0.02\ncut_level: 1\n";
  const auto own = test::run(program, {"tools", "--file", path("mine.yaml")});
  ASSERT_EQ(own.exit_code, 0) << own.err;
  EXPECT_NE(own.out.find("my-burr"), std::string::npos);
  EXPECT_NE(own.out.find("level 1"), std::string::npos) << own.out;
  EXPECT_EQ(std::ranges::count(own.out, '\n'), 1);
}

// How many of the three ways of asking say that the tool meets bone.
std::ptrdiff_t meeting(const std::string& text) {
  std::ptrdiff_t count = 0;
  for (std::size_t at = text.find("meets bone"); at != std::string::npos; at = text.find("meets bone", at + 1)) ++count;
  return count;
}

TEST_F(Scripts, ContactIsAskedInThreeWays) {
  const std::string program = OSTEON_IMPORT_PROGRAM;
  ASSERT_EQ(test::run(program, {"phantom", "block", "--layers", "8:1.5", "--width", "12", "--pitch", "0.5", "--out",
                                path("case")})
                .exit_code,
            0);
  const auto asked = [&](const char* at, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"contact", path("case"), "burr-round-3.2", "--at", at, "--axis", "0,0,-1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto result = test::run(program, arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(std::ranges::count(result.out, '\n'), 3) << result.out;
    return meeting(result.out);
  };
  // The block's top is z = 0 and its samples are 0.5 mm apart. A millimetre above or below is clear to all ways of
  // asking.
  EXPECT_EQ(asked("0,0,1"), 0);
  EXPECT_EQ(asked("0,0,-1"), 3);
  // In a groove of a 5 mm bur, 3 mm deep, a 3.2 mm bur is free a millimetre above the bottom, but not at the wall.
  const auto script =
      write("steps: [{tool: burr-round-5, from: [-8, 0, -3], to: [8, 0, -3], axis: [0, 0, -1]}]").string();
  ASSERT_EQ(test::run(program, {"carve", path("case"), script, "--out", path("f.vdb")}).exit_code, 0);
  EXPECT_EQ(asked("0,0,-2", {"--fields", path("f.vdb"), "--level", "1"}), 0);
  EXPECT_EQ(asked("0,0,-2"), 3) << "before the cut";
  EXPECT_EQ(asked("0,2,-2", {"--fields", path("f.vdb"), "--level", "1"}), 3);
  const auto beyond =
      test::run(program, {"contact", path("case"), "burr-round-3.2", "--at", "0,0,500", "--axis", "0,0,-1"});
  EXPECT_NE(beyond.out.find("beyond the bone"), std::string::npos) << beyond.out;
  EXPECT_EQ(
      test::run(program, {"contact", path("case"), "burr-round-3.2", "--at", "0,0,0", "--axis", "0,0,0"}).exit_code, 1);
  for (const char* nowhere : {"nan,0,0", "0,0,inf"}) {
    const auto refused =
        test::run(program, {"contact", path("case"), "burr-round-3.2", "--at", nowhere, "--axis", "0,0,-1"});
    EXPECT_EQ(refused.exit_code, 1) << nowhere;
    EXPECT_NE(refused.err.find("--at"), std::string::npos) << refused.err;
  }
  EXPECT_EQ(
      test::run(program, {"contact", path("case"), "burr-round-3.2", "--at", "0,0,0", "--axis", "0,0,nan"}).exit_code,
      1);
}

TEST_F(Scripts, AToolOfTheBoxIsChangedWithoutWritingAFile) {
  const std::string program = OSTEON_IMPORT_PROGRAM;
  const auto limits = test::run(program, {"tools", "drill-3.2"});
  ASSERT_EQ(limits.exit_code, 0) << limits.err;
  for (const char* field : {"diameter_mm", "cutting_length_mm", "spindle_rpm", "teeth", "feed_mm_per_rev"})
    EXPECT_NE(limits.out.find(field), std::string::npos) << limits.out;
  const auto made = test::run(program, {"tools", "drill-3.2", "--set", "diameter_mm=4.5", "--set",
                                        "cutting_length_mm=90", "--set", "spindle_rpm=900", "--set", "teeth=3", "--set",
                                        "feed_mm_per_rev=0.07", "--out", path("drill-4.5.yaml")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(made.out.starts_with("drill-4.5 ")) << made.out;
  const auto tool = load_tool(path("drill-4.5.yaml"));
  ASSERT_TRUE(tool) << tool.error().message;
  EXPECT_EQ(tool->name, "drill-4.5");
  EXPECT_EQ(tool->diameter_mm, 4.5);
  EXPECT_EQ(tool->cutting_length_mm, 90.0);
  EXPECT_EQ(tool->spindle_rpm, 900.0);
  EXPECT_EQ(tool->teeth, 3);
  EXPECT_EQ(tool->feed_mm_per_rev, 0.07);
  EXPECT_EQ(tool->shank_length_mm, find_tool("drill-3.2")->shank_length_mm) << "the rest is as it was";
  const auto again = test::run(program, {"tools", "--file", path("drill-4.5.yaml"), "--set", "teeth=2", "--out",
                                         path("b.yaml"), "--name", "drill-b", "--title", "B"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const auto second = load_tool(path("b.yaml"));
  ASSERT_TRUE(second);
  EXPECT_EQ(second->name, "drill-b");
  EXPECT_EQ(second->title, "B");
  EXPECT_EQ(second->diameter_mm, 4.5);

  const auto refused = [&](std::vector<std::string> arguments, const std::string& named) {
    arguments.insert(arguments.begin(), "tools");
    const auto result = test::run(program, arguments);
    EXPECT_NE(result.exit_code, 0);
    EXPECT_NE(result.err.find(named), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(path("no.yaml")));
  };
  const std::string out = path("no.yaml");
  refused({"drill-3.2", "--set", "diameter_mm=400", "--out", out}, "diameter_mm");
  refused({"drill-3.2", "--set", "teeth=2.5", "--out", out}, "whole");
  refused({"drill-3.2", "--set", "colour=2", "--out", out}, "choose one of");
  refused({"drill-3.2", "--set", "teeth", "--out", out}, "FIELD=NUMBER");
  refused({"drill-3.2", "--set", "teeth=2x", "--out", out}, "FIELD=NUMBER");
  refused({"drill-3.2", "--set", "teeth=3"}, "--out");
  refused({"drill-3.2", "--out", out}, "--set");
  refused({"--set", "teeth=3", "--out", out}, "name it");
  refused({"spoon", "--set", "teeth=3", "--out", out}, "spoon");
  refused({"drill-3.2", "--set", "teeth=3", "--out", path("no.txt")}, ".yaml");
  refused({"drill-3.2", "--set", "teeth=3", "--out", out, "--name", "My Drill"}, "lower-case");
  refused({"drill-3.2", "--set", "teeth=3", "--out", path("drill-4.5.yaml")}, "already there");
}

// The script of deploy/docs/tools.md: both steps remove bone from the block that the page makes.
TEST(ScriptOfTheDocs, RemovesBone) {
  std::ifstream page(test::source_dir() / "deploy" / "docs" / "tools.md");
  std::string script, text;
  for (bool found = false; std::getline(page, text);) {
    found = found || text == "steps:";
    if (found && text.starts_with("```")) break;
    if (found) script += text + "\n";
  }
  ASSERT_NE(script.find("burr-round-5"), std::string::npos) << "deploy/docs/tools.md has no script";
  const test::TempDir folder;
  std::ofstream(folder / "script.yaml") << script;
  const auto steps = read_carve_script(folder / "script.yaml");
  ASSERT_TRUE(steps) << steps.error().message;
  const Result<std::vector<Layer>> layers = parse_layers("5:1.9,20:0.3,5:1.9");
  ASSERT_TRUE(layers);
  auto bone = build_phantom_case({.layers = *layers, .width_mm = 40.0}, 0.4, "block", keep_going);
  ASSERT_TRUE(bone);
  Carving carving(std::move(*bone), 1.0);
  ASSERT_EQ(steps->size(), 2u);
  for (const CarveStep& step : *steps) {
    const auto report = carving.run(step, keep_going);
    ASSERT_TRUE(report);
    EXPECT_GT(report->removed_mm3, 20.0) << report->tool;
  }
}

}  // namespace
}  // namespace osteon::import
