// Runs every program in one room, for more than plain drilling. A block is sawn in two, a piece is removed and brought
// back, tools and guides are added, and the bone is saved and resumed. The hands are clients in this process that hold
// replicas.
#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include <array>
#include <fstream>

#include "common/tools/tool_file.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/content.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

constexpr double kWidth_mm = 12.0, kDepth_mm = 30.0;

constexpr const char* kBurrOfTheFolder = R"(name: burr-of-the-folder
title: Round bur from a tool file
kind: round-burr
diameter_mm: 4
shank_diameter_mm: 2.4
shank_length_mm: 40
spindle_rpm: 20000
teeth: 8
feed_mm_per_rev: 0.01
cut_level: 1
)";

// Strokes that leave a slot right through the block.
std::vector<Cut> slot(AuthorId author, const Tool& burr, double x_mm) {
  std::vector<Cut> cuts;
  for (double z = 1.0; z > -kDepth_mm - 3.0; z -= 1.5) {
    Cut cut = straight_cut(burr, {x_mm, -9, z}, {x_mm, 9, z}, {0, 0, -1}, cuts.size() + 1);
    cut.author = author;
    cuts.push_back(cut);
  }
  return cuts;
}

// Seen from (60, -80, 60), the shank of a tool that points down at the origin goes straight up from the picture's
// middle. It is 20 pixels wide. The gauges are to the left of it.
constexpr int kShankLeft = 316, kShankRight = 324, kShankTop = 100, kShankBottom = 150;
constexpr int kShankPixels = (kShankRight - kShankLeft) * (kShankBottom - kShankTop);

int differing_on_the_shank(const std::filesystem::path& one, const std::filesystem::path& other) {
  std::array<vtkNew<vtkPNGReader>, 2> readers;
  readers[0]->SetFileName(one.c_str());
  readers[1]->SetFileName(other.c_str());
  for (const auto& reader : readers) reader->Update();
  int differing = 0;
  for (int x = kShankLeft; x < kShankRight; ++x)
    for (int y = kShankTop; y < kShankBottom; ++y) {
      // Rows of pixels from below.
      const auto at = [&](std::size_t i, int channel) {
        return readers[i]->GetOutput()->GetScalarComponentAsDouble(x, 479 - y, 0, channel);
      };
      bool same = true;
      for (int channel = 0; channel < 3; ++channel) same &= at(0, channel) == at(1, channel);
      differing += same ? 0 : 1;
    }
  return differing;
}

TEST(Pieces, AreSawnOffTakenAwayBroughtBackSavedAndResumed) {
  const TempDir tools;
  std::ofstream(tools / "burr.yaml") << kBurrOfTheFolder;
  const TempDir kept;
  const auto screen = Xvfb::start("640x480");
  ASSERT_TRUE(screen) << "Xvfb is needed; deploy/install installs it";
  Stage stage(kWidth_mm, {"--plain", "--tools", tools / "", "--save", kept / "bone.vdb"});
  ScriptedViewer viewer(stage.address(), *screen);
  ASSERT_TRUE(viewer.tell("wait surface"));
  ASSERT_TRUE(viewer.tell("look at 0 0 0 from 60 -80 60 up 0 0 1"));
  const auto picture = [&](const std::string& name) {
    EXPECT_TRUE(viewer.tell("screenshot " + (stage / name).string()));
    return content(stage / name);
  };
  const auto viewed = [&] {
    EXPECT_TRUE(viewer.tell("status " + (stage / "viewer.json").string()));
    return read_json(stage / "viewer.json");
  };
  const std::string whole_hash = viewed().at("scene_mesh_hash");

  Surgeon hand(stage.address(), stage / "cache"), other(stage.address(), stage / "cache");
  ASSERT_TRUE(wait_until([&] { return hand.complete() && other.complete(); }, kPatience));
  const auto agree = [&](RoomSeq seq) {
    ASSERT_TRUE(wait_until([&] { return hand.seq() >= seq && other.seq() >= seq; }, kPatience));
    const auto status = status_of(hand.session().room());
    EXPECT_EQ(wire::to_wire(hand.hash()), status.field_hash());
    EXPECT_EQ(wire::to_wire(other.hash()), status.field_hash());
  };

  // A tool of the server's folder saws the block in two.
  const ToolBox::Entry* burr = nullptr;
  for (const ToolBox::Entry* entry : hand.session().tools()->entries())
    if (entry->tool.name == "burr-of-the-folder") burr = entry;
  ASSERT_NE(burr, nullptr);
  const auto cuts = slot(hand.author(), burr->tool, 1.0);
  for (const Cut& cut : cuts) ASSERT_TRUE(wait_until([&] { return hand.session().send(cut); }, kPatience));
  ASSERT_TRUE(viewer.tell("wait bodies 2"));
  ASSERT_TRUE(wait_until([&] { return hand.bodies().size() == 2 && other.bodies().size() == 2; }, kPatience));
  agree(hand.seq());
  ASSERT_TRUE(viewer.tell("wait seq " + std::to_string(hand.seq().value)));
  const std::string parted_hash = viewed().at("scene_mesh_hash");
  EXPECT_EQ(viewed().at("bodies"), nlohmann::json::array({0, 1}));
  const std::string parted = picture("parted.png");

  // The viewer draws a tool that it did not know before.
  CuttingState state;
  state.author = hand.author();
  state.state_seq = 1;
  state.tool_name = "tool-of-nobody";
  state.phase = CuttingPhase::free;
  state.pose_bone_tool = state.pose_bone_device = pose_along({0, 0, 10}, {0, 0, -1});
  hand.session().send(state);
  ASSERT_TRUE(viewer.tell("wait surface"));
  // The gauges of a tool of unknown force are in the picture, but no item is on the bone.
  ASSERT_TRUE(wait_until([&] { return picture("gauges.png") != parted; }, kPatience));
  EXPECT_EQ(differing_on_the_shank(stage / "gauges.png", stage / "parted.png"), 0);
  ++state.state_seq;
  state.tool_name = burr->tool.name;
  hand.session().send(state);
  EXPECT_TRUE(wait_until(
      [&] {
        (void)picture("tool.png");
        return differing_on_the_shank(stage / "tool.png", stage / "parted.png") > kShankPixels * 9 / 10;
      },
      kPatience))
      << "the tool is in the picture";
  ASSERT_TRUE(viewer.tell("tool off"));

  // Another person removes the piece, brings it back, and undoes everything.
  ASSERT_TRUE(viewer.tell("take-away 1"));
  ASSERT_TRUE(viewer.tell("wait bodies 1"));
  EXPECT_NE(picture("taken.png"), parted);
  EXPECT_EQ(viewer.ask("undo 1"), "ok undo 1: 1 event");
  ASSERT_TRUE(viewer.tell("wait bodies 2"));
  EXPECT_EQ(viewed().at("scene_mesh_hash"), parted_hash);
  EXPECT_EQ(picture("back.png"), parted);
  ASSERT_TRUE(viewer.tell("undo " + std::to_string(cuts.size())));
  ASSERT_TRUE(viewer.tell("wait bodies 1"));
  const RoomSeq undone{viewed().at("room_seq").get<std::uint64_t>()};
  agree(undone);
  EXPECT_EQ(hand.bodies().size(), 1u);
  EXPECT_NE(viewed().at("scene_mesh_hash"), parted_hash);
  ASSERT_TRUE(viewer.tell("redo 1"));
  const std::string all = ": " + std::to_string(cuts.size() + 1) + " events";
  EXPECT_EQ(viewer.ask("undo 5000"), "ok undo 5000" + all) << "the cuts and the fragments that they separated";
  EXPECT_EQ(viewer.ask("redo 1"), "ok redo 1" + all);
  ASSERT_TRUE(viewer.tell("wait bodies 2"));
  EXPECT_FALSE(viewer.tell("redo 9 times"));
  EXPECT_FALSE(viewer.tell("take-away 7")) << "no such body";
  EXPECT_EQ(viewed().at("scene_mesh_hash"), parted_hash);

  // A guide is visible to everyone, also to those who join later.
  const std::string without_guide = picture("without-guide.png");
  ASSERT_TRUE(viewer.tell("place guide-1 at 0 0 2 along 0 0 -1"));
  ASSERT_TRUE(viewer.tell("wait items 1"));
  EXPECT_NE(picture("guide.png"), without_guide);
  EXPECT_FALSE(viewer.tell("place spoon at 0 0 2 along 0 0 -1"));
  ASSERT_TRUE(wait_until([&] { return other.items().size() == 1; }, kPatience));
  Surgeon late(stage.address(), stage / "cache");
  ASSERT_TRUE(
      wait_until([&] { return late.complete() && late.items().size() == 1 && late.bodies().size() == 2; }, kPatience));
  // By the server: a viewer that draws seldom may not have drawn the last join yet.
  const RoomSeq last{status_of(hand.session().room()).room_seq()};
  agree(last);
  EXPECT_EQ(late.hash(), hand.hash());
  ASSERT_TRUE(viewer.tell("save asked-for.vdb"));
  EXPECT_FALSE(viewer.tell("save ../asked-for.vdb"));

  // A clean stop saves the bone. The next server continues from there.
  EXPECT_EQ(viewer.process().terminate(), 0);
  const Digest at_the_end = hand.hash();
  ASSERT_EQ(stage.server().terminate(), 0);
  const auto first_run = read_json(stage / "server.json");
  EXPECT_EQ(first_run.at("field_hash"), to_hex(at_the_end));
  EXPECT_EQ(first_run.at("mesh_hash"), parted_hash);
  for (const char* file : {"bone.vdb", "asked-for.vdb"}) {
    stage.start_server({"--plain", "--tools", tools / "", "--resume", kept / file});
    Surgeon resumed(stage.address(), stage / "cache");
    ASSERT_TRUE(wait_until([&] { return resumed.complete(); }, kPatience));
    EXPECT_EQ(resumed.hash(), at_the_end) << file;
    EXPECT_EQ(resumed.bodies().size(), 2u);
    EXPECT_EQ(resumed.seq().value, last.value + 1) << "a join has a sequence number too";
    ASSERT_EQ(stage.server().terminate(), 0);
    EXPECT_EQ(read_json(stage / "server.json").at("field_hash"), to_hex(at_the_end));
  }
  EXPECT_NE(whole_hash, parted_hash);

  // A case other than the saved one is refused with one sentence.
  ASSERT_EQ(run(program("osteon-import"),
                {"phantom", "block", "--layers", "5:1.9", "--width", "8", "--pitch", "1", "--out", stage / "other"})
                .exit_code,
            0);
  const RunResult refused =
      run(program("osteon-server"), {"--case", stage / "other", "--plain", "--resume", kept / "bone.vdb"});
  EXPECT_GT(refused.exit_code, 0);
  EXPECT_NE(refused.err.find("bone.vdb"), std::string::npos) << refused.err;
  std::ofstream(tools / "broken.yaml") << "name: broken\n";
  const RunResult broken = run(program("osteon-server"), {"--case", stage / "case", "--plain", "--tools", tools / ""});
  EXPECT_GT(broken.exit_code, 0);
  EXPECT_NE(broken.err.find("broken.yaml"), std::string::npos) << broken.err;
  // A folder is also refused if a tool names a force law that does not exist, or does not fit the tool.
  std::filesystem::remove(tools / "broken.yaml");
  Tool lawless = *find_tool("drill-3.2");
  lawless.name = "lawless";
  lawless.law = "saw";
  std::ofstream(tools / "lawless.yaml") << to_yaml(lawless);
  const RunResult unlawful =
      run(program("osteon-server"), {"--case", stage / "case", "--plain", "--tools", tools / ""});
  EXPECT_GT(unlawful.exit_code, 0);
  for (const char* part : {"lawless.yaml", "\"law\"", "\"saw\" is not for a drill", "choose one of chi"})
    EXPECT_NE(unlawful.err.find(part), std::string::npos) << unlawful.err;
}

}  // namespace
}  // namespace osteon::test
