#include "common/tools/tool.hpp"

#include <gtest/gtest.h>

#include "common/tools/tool_box.hpp"

#include <algorithm>
#include <functional>
#include <set>

namespace osteon {
namespace {

// A tool box finds Osteon's own tools and added ones. It does not choose between two tools of the same name.
TEST(ToolBox, FindsToolsByName) {
  const auto box = builtin_tool_box();
  EXPECT_EQ(box->find("drill-3.2")->hash(), find_tool("drill-3.2")->hash());
  Tool own = *find_tool("drill-3.2");
  own.name = "my-drill";
  own.diameter_mm = 4.0;
  EXPECT_EQ(box->find("my-drill").error().code, ErrorCode::not_found);
  EXPECT_NE(box->find("my-drill").error().message.find("burr-round-5"), std::string::npos);
  box->add(own);
  EXPECT_EQ(box->find("my-drill")->diameter_mm, 4.0);
  own.diameter_mm = 4.5;
  box->add(own);
  EXPECT_EQ(box->find("my-drill").error().code, ErrorCode::invalid_input);
}

// Table B.1 of the dissertation with its eight groups.
TEST(Tools, AllOfAppendixBAreThereInTheirGroups) {
  const std::vector<std::vector<std::string>> groups{
      {"drill-1-8in", "drill-5-16in", "end-drill"},
      {"burr-round", "burr-barrel", "burr-contoured"},
      {"saw-oscillating-1", "saw-oscillating-2", "saw-oscillating-3", "saw-reciprocating"},
      {"reamer-sphere", "reamer-cylinder", "reamer-outside"},
      {"broach-1", "broach-2"},
      {"guide-1", "guide-2", "guide-3"},
      {"pin-1", "pin-2", "pin-3"},
      {"screw-1", "screw-2", "screw-3"},
  };
  const std::vector<std::size_t> counts{3, 3, 4, 3, 2, 3, 3, 3};
  std::set<std::string> names;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    EXPECT_EQ(groups[i].size(), counts[i]);
    for (const std::string& name : groups[i]) {
      const auto tool = find_tool(name);
      ASSERT_TRUE(tool) << name;
      // Guides do not cut. Pins and screws make their own holes.
      EXPECT_EQ(tool->cuts(), i != 5) << name;
      names.insert(name);
    }
  }
  EXPECT_EQ(names.size(), 24u);
  std::set<std::string> all;
  for (const Tool& tool : builtin_tools()) all.insert(tool.name);
  EXPECT_EQ(all.size(), builtin_tools().size()) << "two tools have one name";
}

TEST(Tools, TheDrillsInInchesAreThat) {
  EXPECT_DOUBLE_EQ(find_tool("drill-1-8in")->diameter_mm, 25.4 / 8.0);
  EXPECT_DOUBLE_EQ(find_tool("drill-5-16in")->diameter_mm, 25.4 * 5.0 / 16.0);
}

TEST(Tools, SmallToolsAndBladesCutFinestReamersAndBroachesAtTheCasesPitch) {
  for (const Tool& tool : builtin_tools()) {
    if (!tool.cuts()) continue;
    const bool large = tool.name.starts_with("reamer") || tool.name.starts_with("broach");
    EXPECT_EQ(tool.cut_level, large ? 0 : 2) << tool.name;
  }
}

TEST(Tools, AnUnknownNameListsTheKnownOnes) {
  const auto tool = find_tool("drill-9");
  ASSERT_FALSE(tool);
  EXPECT_NE(tool.error().message.find("drill-9"), std::string::npos);
  EXPECT_NE(tool.error().message.find("drill-3.2"), std::string::npos);
}

TEST(Tools, EveryFieldIsPartOfTheHash) {
  const Tool drill = *find_tool("drill-3.2");
  EXPECT_EQ(drill.hash(), find_tool("drill-3.2")->hash());
  const std::vector<std::function<void(Tool&)>> changes{
      [](Tool& t) { t.name += "x"; },
      [](Tool& t) { t.title += "x"; },
      [](Tool& t) { t.kind = ToolKind::pin; },
      [](Tool& t) { t.diameter_mm += 1e-9; },
      [](Tool& t) { t.cutting_length_mm += 1e-9; },
      [](Tool& t) { t.point_angle_rad += 1e-9; },
      [](Tool& t) { t.shank_diameter_mm += 1e-9; },
      [](Tool& t) { t.shank_length_mm += 1e-9; },
      [](Tool& t) { t.width_mm += 1e-9; },
      [](Tool& t) { t.thickness_mm += 1e-9; },
      [](Tool& t) { t.set_mm += 1e-9; },
      [](Tool& t) { t.swing_rad += 1e-9; },
      [](Tool& t) { t.stroke_mm += 1e-9; },
      [](Tool& t) { t.pivot_mm += 1e-9; },
      [](Tool& t) { t.taper_rad += 1e-9; },
      [](Tool& t) { t.corner_mm += 1e-9; },
      [](Tool& t) { t.bore_mm += 1e-9; },
      [](Tool& t) { t.thread_pitch_mm += 1e-9; },
      [](Tool& t) { t.core_diameter_mm += 1e-9; },
      [](Tool& t) { t.spindle_rpm += 1e-9; },
      [](Tool& t) { t.teeth += 1; },
      [](Tool& t) { t.feed_mm_per_rev += 1e-9; },
      [](Tool& t) { t.cut_level -= 1; },
      [](Tool& t) {
        t.mesh = std::make_shared<SampledDistance>(
            SampledDistance{{{0, 0, 0}, {1, 1, 1}}, 512, std::vector<std::int16_t>(8, 5)});
      },
      [](Tool& t) {
        t.mesh = std::make_shared<SampledDistance>(
            SampledDistance{{{0, 0, 0}, {1, 1, 1}}, 512, std::vector<std::int16_t>(8, 6)});
      },
      [](Tool& t) {
        t.mesh = std::make_shared<SampledDistance>(
            SampledDistance{{{0, 0, 0}, {1, 1, 1}}, 513, std::vector<std::int16_t>(8, 6)});
      },
      [](Tool& t) {
        t.mesh = std::make_shared<SampledDistance>(
            SampledDistance{{{0, 0, 1}, {1, 1, 2}}, 513, std::vector<std::int16_t>(8, 6)});
      },
  };
  std::set<Digest> hashes{drill.hash()};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Tool other = drill;
    changes[i](other);
    EXPECT_TRUE(hashes.insert(other.hash()).second) << "change " << i;
  }
}

}  // namespace
}  // namespace osteon
