// Tests a bone with a metal plate, with real processes. A rig drills onto the plate and stops there. The room rejects
// the cuts of a client that sends any cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "tests/integration/stage.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/unit/rooms/members.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr double kPitch_mm = 0.5, kPlate_mm = 5.0;

Tissue plate(const Vec3& p) { return p.z() <= -kPlate_mm && p.z() >= -kPlate_mm - 2.0 ? Tissue::metal : Tissue::none; }

TEST(Metal, IsLeftByRigAndServer) {
  Stage stage([](const std::filesystem::path& folder) {
    const Result<void> saved = marked_block(20.0, 12.0, kPitch_mm, plate).save(folder);
    ASSERT_TRUE(saved) << saved.error().message;
  });
  nlohmann::json step = drill_at(0.1, -0.2, "rig");
  step["to_mm"] = kPlate_mm + 1.0;
  step["feed_mm_per_s"] = 4.0;
  const nlohmann::json plan{{"steps", nlohmann::json::array({step})}};
  std::ofstream(stage / "plan.json") << plan.dump(2);
  Process haptic = stage.start(
      "osteon-haptic", {"--server", stage.address(), "--plain", "--plan", stage / "plan.json", "--session-log",
                        stage / "rig.csv", "--summary", stage / "rig.json", "--cache", stage / "cache", "--status"});
  const auto code = haptic.wait(120s);
  ASSERT_TRUE(code);
  EXPECT_NE(*code, 0);
  EXPECT_THAT(haptic.err(), HasSubstr("step 1 (drill) did not finish: the tool stands on metal"));
  EXPECT_THAT(haptic.out(), HasSubstr("on metal, which it does not cut"));
  // Once for the whole contact.
  const std::string said = "drill-3.2 stands on metal, which it does not cut: draw it back and go around the metal";
  const std::string all = haptic.out() + haptic.err();
  const auto first = all.find(said);
  ASSERT_NE(first, std::string::npos) << all;
  EXPECT_EQ(all.find(said, first + 1), std::string::npos);

  const auto summary = read_json(stage / "rig.json"), done = summary["steps"][0];
  EXPECT_EQ(done["completed"], false);
  EXPECT_EQ(done["gave_up_in"], "feed");
  EXPECT_THAT(done["gave_up_because"].get<std::string>(), HasSubstr("metal"));
  EXPECT_GT(done["on_metal_s"].get<double>(), 5.0);
  EXPECT_GT(done["deepest_mm"].get<double>(), kPlate_mm - kPitch_mm);
  EXPECT_LT(done["deepest_mm"].get<double>(), kPlate_mm);
  EXPECT_EQ(summary["rejected"], 0);
  // The force rises to what the rig pushes: far above any thrust of the cut, up to what the device can display.
  const Table log = read_table(stage / "rig.csv");
  EXPECT_GT(std::ranges::max(log["force_physical_n"]), 55.0);

  Surgeon hostile(stage.address(), stage / "hostile");
  ASSERT_TRUE(wait_until([&] { return hostile.complete(); }, kPatience));
  const Digest before = hostile.hash();
  EXPECT_EQ(to_hex(before), summary["field_hash"]);
  Cut cut = straight_cut(find_tool("burr-round-5").value(), {5, 5, -3}, {5, 5, -9}, {0, 0, -1});
  cut.author = hostile.author();
  cut.lease_epoch = hostile.lease();
  ASSERT_TRUE(hostile.session().send(cut));
  ASSERT_TRUE(wait_until([&] { return !hostile.rejected().empty(); }, kPatience));
  EXPECT_EQ(hostile.rejected(), sentence(Rejection::metal));
  EXPECT_EQ(hostile.hash(), before);
  EXPECT_EQ(hostile.own(), 0u);

  EXPECT_EQ(stage.server().terminate(), 0);
  const auto server = read_json(stage / "server.json");
  EXPECT_EQ(server["rejected"], 1);
  EXPECT_EQ(server["field_hash"], summary["field_hash"]);
}

}  // namespace
}  // namespace osteon::test
