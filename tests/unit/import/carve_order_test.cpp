// The result of carving depends only on the set of steps. Their order does not change it, though fragments and debris
// are separated on the way.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <string>

#include "common/geometry/pose_across.hpp"
#include "common/tools/tool.hpp"
#include "server/import/carving.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random_cuts.hpp"
#include "tests/support/trials.hpp"

namespace osteon::import {
namespace {

constexpr auto kGoOn = [](double) { return true; };

// Eight tools go across a block of 9 x 9 x 4 mm. Blades saw a net of kerfs, which leaves small fragments. Sooner or
// later the other tools take some of the fragments away, or what holds them.
std::vector<CarveStep> crossing_steps(std::size_t count) {
  constexpr std::array kTools = {"saw-oscillating-3", "burr-round-3.2", "saw-oscillating-1", "drill-1-8in",
                                 "saw-reciprocating", "burr-barrel",    "saw-oscillating-2", "drill-3.2"};
  test::Random random(14);
  std::vector<CarveStep> steps;
  for (std::size_t i = 0; i < count; ++i) {
    const Tool tool = *find_tool(kTools[i % kTools.size()]);
    const bool blade = tool.kind == ToolKind::oscillating_saw || tool.kind == ToolKind::reciprocating_saw;
    const Vec3 at(random.between(-4.5, 4.5), random.between(-4.5, 4.5), 1.0);
    const double deep = blade ? random.between(1.2, 2.6) : random.between(0.1, 0.6);
    // Some blades enter from the side, under what others have sawn.
    if (blade && i % 3 == 0) {
      const Vec3 from(-15.0, at.y(), -deep), to(random.between(-4.0, 2.0), at.y(), -deep);
      const Vec3 in = Vec3::UnitX(), across = Vec3::UnitY();
      steps.push_back({tool, {pose_across(from, in, across), pose_across(to, in, across)}, 1});
      continue;
    }
    const double turn = random.between(0.0, 3.1);
    const Vec3 across(std::cos(turn), std::sin(turn), 0.0);
    const Vec3 down(0.0, 0.0, -1.0);
    const Vec3 to = at + (1.0 + deep) * down;
    steps.push_back({tool, {pose_across(at, down, across), pose_across(to, down, across)}, 1});
  }
  return steps;
}

TEST(CarveOrder, AnyOrderWithDebrisLeavesOneBone) {
  constexpr std::size_t kSteps = 40;
  const int orders = static_cast<int>(test::trials(12));
  const std::vector<CarveStep> steps = crossing_steps(kSteps);
  test::Random random(15);
  std::set<std::string> names;
  int debris = 0, without_debris = 0, pieces = 0;
  for (int order = 0; order < orders; ++order) {
    Carving carving(test::plain_block(9.0, 4.0, 0.8), 10.0);
    int of_order = 0, done = 0;
    for (const std::size_t i : test::order_with_repeats(kSteps, 0, random)) {
      // Asking for the fields on the way changes nothing.
      if (order % 2 == 1 && ++done == 30) (void)carving.fields();
      const auto report = carving.run(steps[i], kGoOn);
      ASSERT_TRUE(report);
      of_order += report->debris;
      pieces += report->pieces;
    }
    debris += of_order;
    without_debris += of_order == 0 ? 1 : 0;
    const SavedFields fields = carving.fields();
    names.insert(to_hex(field_hash(fields.leaves, fields.pitch_mm)));
  }
  RecordProperty("debris", debris);
  RecordProperty("pieces", pieces);
  EXPECT_EQ(without_debris, 0);
  EXPECT_GE(debris, 2 * orders);
  EXPECT_EQ(names.size(), 1u);
}

}  // namespace
}  // namespace osteon::import
