// Entry sites on bodies whose surface is known in closed form.
#include "haptic_client/simulation/entry_site.hpp"

#include <gtest/gtest.h>

#include "haptic_client/simulation/free_hand.hpp"
#include "haptic_client/simulation/surgeon.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

TEST(EntrySite, OfABlockIsItsFace) {
  const Case bone = block_case();
  const Result<EntrySite> site = find_site_toward(bone, Vec3(0, 0, -1));
  ASSERT_TRUE(site.has_value()) << site.error().message;
  EXPECT_NEAR(site->entry_mm.z(), 0.0, 0.02);
  EXPECT_NEAR(site->axis.z(), 1.0, 1e-4);
  EXPECT_NEAR(site->thickness_mm, 30.0, 0.15);
  EXPECT_LT(site->flatness_mm, 0.02);
}

// Shell of a sphere: the axis points to the centre. The thickness is the shell's, and the far side is not included.
TEST(EntrySite, OfAShellPointsToItsCentre) {
  CaseInfo info;
  info.title = info.source = "shell";
  info.pitch_mm = 0.5;
  const double outer = 20.0, thick = 6.0;
  const CoordBox box{{-48, -48, -48}, {48, 48, 48}};
  DenseVolume<float> surface(box, 0.0f), density(box, 1.5f);
  for (int x = -48; x <= 48; ++x)
    for (int y = -48; y <= 48; ++y)
      for (int z = -48; z <= 48; ++z) {
        const double r = 0.5 * Vec3(x, y, z).norm();
        surface.at({x, y, z}) = static_cast<float>(std::max(r - outer, outer - thick - r));
      }
  const Result<Case> bone = Case::build(info, surface, density);
  ASSERT_TRUE(bone.has_value());
  for (const Vec3& toward : {Vec3(0, 0, 1), Vec3(1, 1, 0.3), Vec3(-1, 0.2, 0.5)}) {
    const Result<EntrySite> site = find_site_toward(*bone, toward);
    ASSERT_TRUE(site.has_value());
    EXPECT_NEAR(site->entry_mm.norm(), outer, 0.05);
    EXPECT_NEAR(site->axis.dot(-toward.normalized()), 1.0, 1e-3);
    EXPECT_NEAR(site->thickness_mm, thick, 0.2);
    const Result<EntrySite> beside = find_site_beside(*bone, *site, 5, 0);
    ASSERT_TRUE(beside.has_value());
    EXPECT_NEAR(beside->entry_mm.norm(), outer, 0.05);
    EXPECT_NEAR(beside->axis.dot(-beside->entry_mm.normalized()), 1.0, 2e-3);
  }
}

// Two balls of 10 mm, 8 mm apart, as two legs of a scan. Between them is the middle of the case.
TEST(EntrySite, FacingAUserIsOnTheBoneNearestToAnEmptyMiddle) {
  const auto balls = [](const Vec3& p) {
    return std::min((p - Vec3(-14, 0, 0)).norm(), (p - Vec3(14, 0, 0)).norm()) - 10.0;
  };
  const Case bone =
      osteon::test::make_bone({{-24, -10, -10}, {24, 10, 10}}, 0.5, balls, [](const Vec3&) { return 1.5; });
  EXPECT_FALSE(find_site_toward(bone, Vec3::UnitY()));
  const Result<EntrySite> site = find_site_facing(bone, Vec3::UnitY());
  ASSERT_TRUE(site) << site.error().message;
  EXPECT_NEAR(balls(site->entry_mm), 0.0, 0.05);
  EXPECT_GT(site->entry_mm.y(), 0.0) << "on the side of the user";
  const double beside_mm = std::hypot(site->entry_mm.x(), site->entry_mm.z());
  EXPECT_GE(beside_mm, 4.0);
  EXPECT_LE(beside_mm, 4.0 + 2.0);

  const FreeHandOptions options{.tool = "drill-3.2", .toward = -Vec3::UnitY()};
  EXPECT_TRUE(make_free_hand(options, bone)) << "a person can practise on it";
  // Where the middle is bone, it is the middle.
  const Case block = block_case();
  EXPECT_EQ(find_site_facing(block, -Vec3::UnitZ())->entry_mm, find_site_toward(block, -Vec3::UnitZ())->entry_mm);
}

TEST(Plan, NamesWhatIsWrong) {
  const Case bone = block_case();
  const auto message = [&](const PlanStep& step) { return make_ready({step}, bone).error().message; };
  PlanStep step;
  step.action = Action::drill;
  step.tool = "chisel";
  EXPECT_NE(message(step).find("chisel"), std::string::npos);
  step.tool = "drill-3.2";
  EXPECT_NE(message(step).find("entry"), std::string::npos);
  step.entry.point_mm = Vec3(200, 0, 0);
  step.entry.axis = Vec3(0, 0, 1);
  EXPECT_NE(message(step).find("no bone"), std::string::npos);
  step.entry = {};
  step.entry.toward = Vec3(0, 0, -1);
  step.tool = "burr-round-5";
  EXPECT_NE(message(step).find("choose a drill"), std::string::npos);
}

// A tool whose file names a force law that does not exist or is for other tools is refused for every hand. The sentence
// names tool, law and remedy. Another law that fits can be chosen instead.
TEST(Plan, RefusesAToolWithALawThatDoesNotFit) {
  const Case bone = block_case();
  for (const char* law : {"hooke", "saw"}) {
    const ToolFinder find = [&](std::string_view name) -> Result<Tool> {
      Tool tool = *find_tool(name);
      tool.law = law;
      return tool;
    };
    PlanStep step;
    step.action = Action::drill;
    step.tool = "drill-3.2";
    step.entry.toward = Vec3(0, 0, -1);
    const auto planned = make_ready({step}, bone, find);
    const auto by_hand = make_free_hand({.tool = "drill-3.2", .at_mm = std::nullopt}, bone, find);
    ASSERT_FALSE(planned);
    ASSERT_FALSE(by_hand);
    for (const Error& error : {planned.error(), by_hand.error()}) {
      EXPECT_EQ(error.code, ErrorCode::invalid_input);
      for (const std::string& part :
           {std::string("drill-3.2"), '"' + std::string(law) + '"', std::string("choose one of chi")})
        EXPECT_NE(error.message.find(part), std::string::npos) << error.message;
    }
    step.law = "allotta";
    const auto instead = make_ready({step}, bone, find);
    ASSERT_TRUE(instead) << instead.error().message;
    EXPECT_EQ(instead->tools[0].law->name, "allotta");
  }
}

}  // namespace
}  // namespace osteon::haptic::test
