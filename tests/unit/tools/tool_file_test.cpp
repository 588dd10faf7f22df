#include "common/tools/tool_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

// A tool file with one line changed, removed (new line "") or added (if the field does not exist yet).
std::string with(const std::string& text, const std::string& field, const std::string& line) {
  std::string changed;
  std::istringstream lines(text);
  bool found = false;
  for (std::string old; std::getline(lines, old);) {
    const bool here = old.starts_with(field + ":");
    found = found || here;
    if (!here)
      changed += old + "\n";
    else if (!line.empty())
      changed += line + "\n";
  }
  return found ? changed : changed + line + "\n";
}

std::string good(const char* name) { return to_yaml(*find_tool(name)); }

TEST(ToolFile, EveryBuiltinToolComesBackWithTheSameHash) {
  for (const Tool& tool : builtin_tools()) {
    const auto back = parse_tool(to_yaml(tool), tool.name);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->hash(), tool.hash()) << tool.name << "\n" << to_yaml(tool);
    EXPECT_EQ(to_yaml(*back), to_yaml(tool));
  }
}

TEST(ToolFile, AnglesThatNoNumberOfDegreesGivesComeBackToo) {
  Tool drill = *find_tool("drill-3.2");
  for (int i = 0; i < 1500; ++i) {
    drill.point_angle_rad = 0.7 + 0.001 * std::sqrt(2.0) * i;
    const auto back = parse_tool(to_yaml(drill), "drill");
    ASSERT_TRUE(back) << back.error().message;
    ASSERT_EQ(back->point_angle_rad, drill.point_angle_rad);
  }
}

TEST(ToolFile, AMeshGoesAlongAsItsSamples) {
  auto samples = std::make_shared<SampledDistance>();
  samples->box = {{-3, -2, -4}, {3, 2, 1}};
  samples->pitch = 512;
  for (int i = 0; i < 7 * 5 * 6; ++i) samples->values.push_back(static_cast<std::int16_t>(i * 311 - 30000));
  const auto loader = [&](const std::string& file, double pitch_mm) -> Result<std::shared_ptr<const SampledDistance>> {
    if (file != "rasp.stl") return failure(ErrorCode::not_found, file + " is not there; copy it beside the tool file");
    EXPECT_EQ(pitch_mm, 0.5);
    return samples;
  };
  const std::string text =
      "name: rasp\nkind: mesh\nmesh: rasp.stl\nmesh_pitch_mm: 0.5\nspindle_rpm: 60\nteeth: 10\nfeed_mm_per_rev: "
      "1\ncut_level: "
      "1\n";
  const auto tool = parse_tool(text, "rasp.yaml", loader);
  ASSERT_TRUE(tool) << tool.error().message;
  EXPECT_EQ(tool->mesh, samples);
  EXPECT_EQ(tool->title, "rasp");
  EXPECT_EQ(tool->cut_body().kind, CutKind::sampled);
  // Four cells of half a millimetre behind the tip, three to each side.
  EXPECT_DOUBLE_EQ(tool->cutting_length_mm, 2.0);
  EXPECT_DOUBLE_EQ(tool->diameter_mm, 3.0);
  const auto back = parse_tool(to_yaml(*tool), "again");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->hash(), tool->hash());
  EXPECT_EQ(*back->mesh, *samples);

  EXPECT_NE(parse_tool(text, "rasp.yaml").error().message.find("this program reads none"), std::string::npos);
  EXPECT_NE(parse_tool(with(text, "mesh", "mesh: other.stl"), "rasp.yaml", loader)
                .error()
                .message.find("other.stl is not there"),
            std::string::npos);
  EXPECT_NE(parse_tool(with(text, "mesh", ""), "rasp.yaml", loader).error().message.find("name the STL file"),
            std::string::npos);
  EXPECT_NE(parse_tool(with(text, "mesh_pitch_mm", "mesh_pitch_mm: 50"), "rasp.yaml", loader)
                .error()
                .message.find("from 0.05 to 5"),
            std::string::npos);
}

TEST(ToolFile, EveryBadInputIsNamedWithFileFieldAndRemedy) {
  const std::string drill = good("drill-3.2"), burr = good("burr-round-5"), saw = good("saw-oscillating-1");
  const struct {
    std::string text;
    std::vector<std::string> says;
  } cases[] = {
      {"", {"field: value"}},
      {"just words", {"field: value"}},
      {"- a\n- b\n", {"field: value"}},
      {"name: [a\n", {"line", "not YAML"}},
      {with(drill, "kind", ""), {"\"kind\" is missing", "choose one of drill"}},
      {with(drill, "kind", "kind: drilll"), {"\"kind\" is \"drilll\"", "choose one of drill, round-burr"}},
      {with(drill, "kind", "kind: [drill]"), {"\"kind\" must be a single value"}},
      {with(drill, "name", ""), {"\"name\" is missing"}},
      {with(drill, "name", "name: Drill 3"), {"\"name\" is \"Drill 3\"", "lower-case"}},
      {with(drill, "name", "name: ../x"), {"\"name\"", "lower-case"}},
      {with(drill, "title", "title: \"\""), {"\"title\""}},
      {with(drill, "title", "title: \"\\t\""), {"\"title\"", "control characters"}},
      {with(drill, "title", "title: Bohrer\xe4\xf6"), {"\"title\"", "UTF-8"}},
      {with(drill, "diameter_mm", ""), {"\"diameter_mm\" is missing", "from 0.5 to 25"}},
      {with(drill, "diameter_mm", "diameter_mm: 0"), {"\"diameter_mm\" is 0", "from 0.5 to 25"}},
      {with(drill, "diameter_mm", "diameter_mm: -3"), {"\"diameter_mm\" is -3", "from 0.5 to 25"}},
      {with(drill, "diameter_mm", "diameter_mm: 3,2"), {"\"diameter_mm\" is \"3,2\"", "not a number"}},
      {with(drill, "diameter_mm", "diameter_mm: 3.2 mm"), {"not a number"}},
      {with(drill, "diameter_mm", "diameter_mm: .nan"), {"not a number"}},
      {with(drill, "diameter_mm", "diameter_mm: inf"), {"not a number"}},
      {with(drill, "diameter_mm", "diameter_mm: {a: 1}"), {"single value"}},
      {with(drill, "diameter_mm", "diameter_mm: 3.2\ndiameter_mm: 3.2"), {"\"diameter_mm\" is there twice"}},
      {with(drill, "colour", "colour: red"), {"\"colour\" is not a field of a drill", "diameter_mm"}},
      {with(drill, "swing_deg", "swing_deg: 5"), {"\"swing_deg\" is not a field of a drill"}},
      {with(drill, "point_angle_deg", "point_angle_deg: 5"), {"\"point_angle_deg\" is 5", "from 15 to 175"}},
      {with(drill, "point_angle_deg", "point_angle_deg: 118\npoint_angle_rad: 2"), {"there twice"}},
      {with(drill, "shank_diameter_mm", "shank_diameter_mm: 8"),
       {"\"shank_diameter_mm\" is 8", "wider than the cutting part", "narrower"}},
      {with(drill, "teeth", "teeth: 2.5"), {"\"teeth\"", "from 1 to 8"}},
      {with(drill, "teeth", "teeth: 99999999999999"), {"\"teeth\""}},
      {with(drill, "spindle_rpm", "spindle_rpm: 1e9"), {"\"spindle_rpm\"", "from 1 to"}},
      {with(drill, "cut_level", ""), {"\"cut_level\" is missing", "choose 0"}},
      {with(drill, "cut_level", "cut_level: 3"), {"\"cut_level\" is 3", "from 0 to 2"}},
      {with(drill, "cut_level", "cut_level: 1.5"), {"\"cut_level\" is 1.5", "whole number"}},
      {with(with(drill, "cutting_length_mm", "cutting_length_mm: 2"), "point_angle_deg", "point_angle_deg: 20"),
       {"\"point_angle_deg\"", "wider"}},
      {with(burr, "cutting_length_mm", "cutting_length_mm: 5"),
       {"\"cutting_length_mm\" is not a field of a round-burr"}},
      {with(burr, "mesh", "mesh: a.stl"), {"\"mesh\" is not a field of a round-burr"}},
      {with(burr, "shank_diameter_mm", "shank_diameter_mm: 5.1"), {"wider than the cutting part"}},
      {with(saw, "pivot_mm", "pivot_mm: 20"), {"\"pivot_mm\"", "width_mm"}},
      {with(saw, "pivot_mm", "pivot_mm: 80"), {"\"pivot_mm\" is 80", "shorter"}},
      {with(saw, "cutting_length_mm", "cutting_length_mm: 1"), {"\"cutting_length_mm\" is 1", "at least"}},
      {with(good("burr-barrel"), "corner_mm", "corner_mm: 3"), {"\"corner_mm\" is 3", "at least 4"}},
      {with(good("burr-barrel"), "shank_diameter_mm", "shank_diameter_mm: 5.9"), {"\"shank_diameter_mm\"", "narrower"}},
      {with(good("burr-contoured"), "taper_deg", "taper_deg: 30"), {"\"taper_deg\"", "smaller"}},
      {with(good("burr-contoured"), "cutting_length_mm", "cutting_length_mm: 0.8"),
       {"\"cutting_length_mm\"", "longer"}},
      {with(good("reamer-sphere"), "diameter_mm", "diameter_mm: 34"), {"\"diameter_mm\" is 34", "from 36 to 64"}},
      {with(good("reamer-sphere"), "diameter_mm", "diameter_mm: 66"), {"from 36 to 64"}},
      {with(good("reamer-cylinder"), "corner_mm", "corner_mm: 7"), {"\"corner_mm\" is 7", "smaller"}},
      {with(good("reamer-outside"), "bore_mm", "bore_mm: 51"), {"\"bore_mm\" is 51", "no wall"}},
      {with(good("broach-1"), "taper_deg", "taper_deg: 10"), {"\"taper_deg\"", "smaller"}},
      {with(good("broach-1"), "corner_mm", "corner_mm: 15"), {"\"corner_mm\"", "smaller"}},
      {with(good("guide-1"), "bore_mm", "bore_mm: 8"), {"\"bore_mm\"", "no wall"}},
      {with(good("guide-1"), "cut_level", "cut_level: 1"), {"\"cut_level\" is not a field of a drill-sleeve"}},
      {with(good("guide-2"), "diameter_mm", "diameter_mm: 9"), {"\"diameter_mm\"", "eighth"}},
      {with(good("guide-3"), "bore_mm", "bore_mm: 6.1"), {"\"bore_mm\"", "from 0.2 to 6"}},
      {with(good("screw-1"), "core_diameter_mm", "core_diameter_mm: 3.5"), {"\"core_diameter_mm\"", "no thread"}},
      {with(good("trial-cup-50"), "thickness_mm", "thickness_mm: 21"), {"\"thickness_mm\" is 21", "from 1 to 20"}},
      {with(good("screw-1"), "thread_pitch_mm", ""), {"\"thread_pitch_mm\" is missing", "the kind screw needs it"}},
  };
  for (const auto& bad : cases) {
    const auto tool = parse_tool(bad.text, "mine.yaml");
    ASSERT_FALSE(tool) << bad.text;
    EXPECT_EQ(tool.error().code, ErrorCode::invalid_input);
    EXPECT_TRUE(tool.error().message.starts_with("mine.yaml")) << tool.error().message;
    for (const std::string& part : bad.says)
      EXPECT_NE(tool.error().message.find(part), std::string::npos) << tool.error().message;
    EXPECT_EQ(tool.error().message.find('\n'), std::string::npos);
  }
}

// A tool may name the force law by which it resists. Without a law its hash is as before this choice existed.
TEST(ToolFile, ALawIsPartOfTheDefinitionWhereItIsNamed) {
  const Tool plain = *find_tool("burr-round-5");
  EXPECT_TRUE(plain.law.empty());
  EXPECT_EQ(to_yaml(plain).find("law"), std::string::npos);
  const auto chosen = parse_tool(with(to_yaml(plain), "law", "law: agus"), "mine.yaml");
  ASSERT_TRUE(chosen) << chosen.error().message;
  EXPECT_EQ(chosen->law, "agus");
  EXPECT_NE(chosen->hash(), plain.hash());
  const auto back = parse_tool(to_yaml(*chosen), "mine.yaml");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->hash(), chosen->hash());

  const auto empty = parse_tool(with(to_yaml(plain), "law", "law: \"\""), "mine.yaml");
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().message.find("\"law\" is empty"), std::string::npos) << empty.error().message;
  const auto odd = parse_tool(with(to_yaml(plain), "law", "law: Hertz & co"), "mine.yaml");
  ASSERT_FALSE(odd);
  EXPECT_NE(odd.error().message.find("name of a force law"), std::string::npos) << odd.error().message;
  // A guide does not cut.
  EXPECT_FALSE(parse_tool(with(to_yaml(*find_tool("guide-1")), "law", "law: chi"), "mine.yaml"));
}

TEST(ToolFile, AFileAddsAToolWithoutCode) {
  const test::TempDir folder;
  std::ofstream(folder / "mine.yaml")
      << "name: drill-4.2\nkind: drill\ndiameter_mm: 4.2\ncutting_length_mm: 50\npoint_angle_deg: 90\n"
         "shank_diameter_mm: 4\nshank_length_mm: 30\nspindle_rpm: 900\nteeth: 2\nfeed_mm_per_rev: 0.08\ncut_level: 1\n";
  const auto tool = load_tool(folder / "mine.yaml");
  ASSERT_TRUE(tool) << tool.error().message;
  EXPECT_EQ(tool->diameter_mm, 4.2);
  EXPECT_EQ(tool->point_angle_rad, 90.0 * (std::numbers::pi / 180.0));
  EXPECT_EQ(tool->cut_level, 1);
  EXPECT_TRUE(tool->cut_body().cuts());
  const auto missing = load_tool(folder / "other.yaml");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("other.yaml"), std::string::npos);
  EXPECT_FALSE(load_tool(folder.path()));
}

TEST(Edited, ChangesWhatMayBeChangedAndChecksIt) {
  const Tool reamer = *find_tool("reamer-sphere");
  const auto larger = edited(reamer, "diameter_mm", 54);
  ASSERT_TRUE(larger) << larger.error().message;
  EXPECT_EQ(larger->diameter_mm, 54.0);
  EXPECT_EQ(larger->cutting_length_mm, 27.0);  // still half a sphere
  EXPECT_EQ(larger->cut_body().dome, 27 * 1024);
  EXPECT_NE(larger->hash(), reamer.hash());
  for (const double bad : {0.0, 35.9, 64.1, -50.0, std::nan(""), HUGE_VAL}) {
    const auto refused = edited(reamer, "diameter_mm", bad);
    ASSERT_FALSE(refused) << bad;
    EXPECT_NE(refused.error().message.find("from 36 to 64"), std::string::npos);
    EXPECT_NE(refused.error().message.find("reamer-sphere"), std::string::npos);
  }
  EXPECT_EQ(edited(*find_tool("burr-round-5"), "diameter_mm", 4)->cutting_length_mm, 4.0);
  EXPECT_EQ(edited(reamer, "teeth", 30)->teeth, 30);
  EXPECT_FALSE(edited(reamer, "teeth", 30.5));
  EXPECT_EQ(edited(reamer, "spindle_rpm", 300)->spindle_rpm, 300.0);
  EXPECT_EQ(edited(reamer, "feed_mm_per_rev", 0.1)->feed_mm_per_rev, 0.1);
  EXPECT_EQ(edited(*find_tool("drill-3.2"), "cutting_length_mm", 60)->cutting_length_mm, 60.0);
  EXPECT_FALSE(edited(*find_tool("drill-3.2"), "diameter_mm", 2.0)) << "its shank would be wider";
  const auto unknown = edited(reamer, "colour", 1);
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("diameter_mm, spindle_rpm, teeth, feed_mm_per_rev"), std::string::npos)
      << unknown.error().message;
  EXPECT_FALSE(edited(reamer, "shank_length_mm", 100));
}

TEST(Edited, EveryEditableFieldOfEveryToolTakesItsOwnValueAndRefusesBeyondItsLimits) {
  for (const Tool& tool : builtin_tools())
    for (const EditableField& field : editable_fields(tool.kind)) {
      EXPECT_FALSE(edited(tool, field.name, field.lowest - 1.0)) << tool.name << " " << field.name;
      EXPECT_FALSE(edited(tool, field.name, field.highest + 1.0)) << tool.name << " " << field.name;
    }
  // A broach comes in sizes.
  const auto size = edited(*edited(*find_tool("broach-1"), "width_mm", 32), "thickness_mm", 19);
  ASSERT_TRUE(size);
  EXPECT_EQ(size->cut_body().highest[0] / 1024, 16);
}

}  // namespace
}  // namespace osteon
