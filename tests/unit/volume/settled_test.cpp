// What a set of cuts leaves of a bone is the same in every order, though debris and fragments are separated on the way.
#include "common/volume/settled.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "common/field/kernel.hpp"
#include "common/geometry/pose_across.hpp"
#include "common/volume/cut_history.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random_cuts.hpp"
#include "tests/support/trials.hpp"

namespace osteon {
namespace {

using test::plain_block;

const Vec3 kDownward(0.0, 0.0, -1.0);

Cut swept(const Tool& tool, const Pose& from, const Pose& to, int level) {
  Cut cut;
  cut.author = {1};
  cut.tool = tool.hash();
  cut.level = level;
  cut.path = {quantise(from), quantise(to)};
  return cut;
}

// A blade's cut straight down at x or y = `at`, to the depth `deep`. It reaches beyond the block on both sides.
Cut kerf(const Vec3& across, const Vec3& at, double deep) {
  return swept(*find_tool("saw-oscillating-1"), pose_across(at + Vec3(0, 0, 1), kDownward, across),
               pose_across(at - Vec3(0, 0, deep), kDownward, across), 2);
}
Cut kerf_at_x(double x, double deep) { return kerf(Vec3::UnitY(), {x, 0, 0}, deep); }
Cut kerf_at_y(double y, double deep) { return kerf(Vec3::UnitX(), {0, y, 0}, deep); }

// Eight tools go across a block of 9 x 9 x 4 mm. Blades saw a net of kerfs, which leaves small fragments. Sooner or
// later the other tools take some of the fragments away, or what holds them.
std::vector<Cut> crossing_cuts(std::size_t count, const std::array<int, 3>& levels) {
  constexpr std::array kTools = {"saw-oscillating-3", "burr-round-3.2", "saw-oscillating-1", "drill-1-8in",
                                 "saw-reciprocating", "burr-barrel",    "saw-oscillating-2", "drill-3.2"};
  test::Random random(14);
  std::vector<Cut> cuts;
  for (std::size_t i = 0; i < count; ++i) {
    const Tool tool = *find_tool(kTools[i % kTools.size()]);
    const bool blade = tool.kind == ToolKind::oscillating_saw || tool.kind == ToolKind::reciprocating_saw;
    const double x = random.between(-4.5, 4.5), y = random.between(-4.5, 4.5), turn = random.between(0.0, 3.1);
    const double deep = blade ? random.between(1.2, 2.6) : random.between(0.1, 0.6);
    const int level = levels[i % levels.size()];
    // Some blades enter from the side, under what others have sawn.
    if (blade && i % 3 == 0) {
      const auto at = [&](double tip) { return pose_across({tip, y, -deep}, Vec3::UnitX(), Vec3::UnitY()); };
      cuts.push_back(swept(tool, at(-15.0), at(0.5 * x), level));
      continue;
    }
    const auto at = [&](double z) { return pose_across({x, y, z}, kDownward, {std::cos(turn), std::sin(turn), 0.0}); };
    cuts.push_back(swept(tool, at(1.0), at(-deep), level));
  }
  return cuts;
}

std::string name_of(const Settled& settled, double pitch_mm) {
  std::vector<FieldLeaf> leaves;
  for (const CutField& body : settled.bodies)
    for (FieldLeaf& leaf : body.leaves()) leaves.push_back(std::move(leaf));
  return to_hex(field_hash(std::move(leaves), pitch_mm));
}

// A bone as in a room: a separated part leaves at once, in its state at that moment.
struct Cutting {
  CutField field;
  FragmentFinder finder;
  CutHistory history;
  std::vector<RoomSeq> taken;
  std::uint64_t seq = 0;
  int debris = 0, pieces = 0;
  explicit Cutting(const Case& bone) : field(bone, {}), finder(field) {}

  void apply(const Cut& cut) {
    const CutReport report = field.apply(cut);
    history.add({++seq}, cut, report.reached_leaves);
    finder.touch(field, cut.level, report.changed_leaves);
    for (Fragment& fragment : finder.take_fragments(field)) {
      ++(fragment.debris() ? debris : pieces);
      std::map<int, std::vector<Coord>> changed;
      for (const FieldLeaf& leaf : fragment.taken)
        if (field.merge(leaf)) changed[leaf.level].push_back(leaf.origin);
      for (const auto& [level, origins] : changed) finder.touch(field, level, origins);
      taken.push_back({++seq});
      history.add_mask({seq}, std::move(fragment.taken));
    }
  }
  // The bone with only its cuts, settled.
  [[nodiscard]] Settled settled() {
    history.undo(field, taken);
    return settle(std::move(field));
  }
};

TEST(Settled, AnyOrderOfFortyCutsWithDebrisLeavesOneBone) {
  constexpr std::size_t kCuts = 40;
  const int orders = static_cast<int>(test::trials(100));
  const Case bone = plain_block(9.0, 4.0, 0.8);
  const std::vector<Cut> cuts = crossing_cuts(kCuts, {1, 1, 0});
  test::Random random(15);
  std::set<std::string> fallen, settled;
  int debris = 0, pieces = 0, orders_without = 0;
  for (int order = 0; order < orders; ++order) {
    Cutting cutting(bone);
    for (const std::size_t i : test::order_with_repeats(kCuts, 0, random)) cutting.apply(cuts[i]);
    debris += cutting.debris;
    pieces += cutting.pieces;
    orders_without += cutting.debris == 0 ? 1 : 0;
    fallen.insert(to_hex(cutting.field.hash()));
    const Settled one = cutting.settled();
    EXPECT_GT(one.debris, 0);
    settled.insert(name_of(one, bone.pitch_mm()));
  }
  RecordProperty("debris", debris);
  RecordProperty("pieces", pieces);
  RecordProperty("bones_as_they_fell", static_cast<int>(fallen.size()));
  EXPECT_GE(debris, 2 * orders) << "otherwise this does not test debris";
  EXPECT_LT(orders_without, orders / 10);
  EXPECT_GT(fallen.size(), 1u) << "otherwise there is nothing to settle";
  EXPECT_EQ(settled.size(), 1u);
}

// Another way to find what is solid: distances of every sample to every tool, and a flood fill over one dense lattice.
TEST(Settled, HoldsWhatDistancesAndAFloodSay) {
  const Case bone = plain_block(9.0, 4.0, 0.8);
  const double pitch = level_pitch_mm(bone.pitch_mm(), 2);
  const std::vector<Cut> cuts = crossing_cuts(40, {2, 2, 2});
  const CoordBox box = covering_samples(bone.bounds().grown(1.0), pitch);
  const Coord d = box.dims();
  const auto index = [&](Coord c) {
    return static_cast<std::size_t>(((c.x - box.min.x) * d.y + c.y - box.min.y) * d.z + c.z - box.min.z);
  };
  std::vector<SweptTool> tools;
  for (const Cut& cut : cuts) tools.emplace_back(cut, builtin_tool_box()->find(cut.tool)->body, bone.pitch_mm());
  std::vector<int> solid(index(box.max) + 1, 0);  // 1: by the case and every cut, rounded as a field is
  std::vector<Coord> all;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 p = position_mm(Coord{x, y, z}, pitch);
        all.push_back({x, y, z});
        bool in = bone.surface_mm(p) < 0.0;
        for (std::size_t i = 0; i < tools.size() && in; ++i) in = std::lround(tools[i].distance_mm(p) * 1024.0f) > 0;
        solid[index({x, y, z})] = in ? 1 : 0;
      }
  std::vector<int> part(solid.size(), -1);
  std::vector<std::size_t> sizes;
  for (const Coord seed : all) {
    if (!solid[index(seed)] || part[index(seed)] >= 0) continue;
    const int name = static_cast<int>(sizes.size());
    std::vector<Coord> open{seed};
    part[index(seed)] = name;
    std::size_t size = 0;
    while (!open.empty()) {
      const Coord c = open.back();
      open.pop_back();
      ++size;
      constexpr Coord kSix[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
      for (const Coord step : kSix) {
        const Coord to = c + step;
        if (!box.contains(to) || !solid[index(to)] || part[index(to)] >= 0) continue;
        part[index(to)] = name;
        open.push_back(to);
      }
    }
    sizes.push_back(size);
  }
  const std::size_t largest = static_cast<std::size_t>(std::ranges::max_element(sizes) - sizes.begin());

  CutField whole(bone, {});
  for (const Cut& cut : cuts) whole.apply(cut);
  const Settled settled = settle(std::move(whole));
  EXPECT_EQ(settled.bodies.size() + static_cast<std::size_t>(settled.debris), sizes.size());
  // Each part is in one body, or in none if it is small. Samples give a volume only to the accuracy of the part's
  // surface.
  std::vector<std::set<int>> in_bodies(sizes.size());
  std::size_t differing = 0;
  for (std::size_t b = 0; b < settled.bodies.size(); ++b) {
    std::vector<float> f(solid.size());
    settled.bodies[b].gather_solid(2, box, f);
    for (const Coord c : all) {
      if (!(f[index(c)] < 0.0f)) continue;
      if (solid[index(c)])
        in_bodies[static_cast<std::size_t>(part[index(c)])].insert(static_cast<int>(b));
      else
        ++differing;
    }
  }
  EXPECT_EQ(differing, 0u);
  int gone = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double volume = static_cast<double>(sizes[i]) * pitch * pitch * pitch;
    EXPECT_LE(in_bodies[i].size(), 1u);
    if (i == largest) {
      EXPECT_EQ(in_bodies[i], std::set<int>{0});
    } else if (volume < 0.5 * kDebris_mm3) {
      EXPECT_TRUE(in_bodies[i].empty()) << volume;
    } else if (volume > 1.5 * kDebris_mm3) {
      EXPECT_FALSE(in_bodies[i].empty() || in_bodies[i].contains(0)) << volume;
    }
    gone += in_bodies[i].empty() ? 1 : 0;
  }
  EXPECT_GT(gone, 1);
}

// A column of 0.73 x 2.73 mm, 1 mm high, is sawn out of a corner: a fragment of 2 mm3. A kerf across it makes two
// halves of 0.53 mm3, which are debris. In this order the fragment is separated first. In the other order only debris
// is.
TEST(Settled, APieceThatIsCutUpIsDebrisInEveryOrder) {
  const Case bone = plain_block(12.0, 6.0, 0.5);
  const double half = 0.5 * 1.27, column_x = 6.0 - 0.73, column_y = 6.0 - 2.73, deep = 1.0;
  // From the side, under the column and no farther: 8 mm wide, with a kerf of 1.1 mm.
  const Tool blade = *find_tool("saw-reciprocating");
  const auto under = [&](double tip) {
    return pose_across({tip, column_y - half + 4.0, -deep - 0.55}, -Vec3::UnitX(), Vec3::UnitY());
  };
  const double depth = deep + half;
  const std::vector<Cut> sawn = {kerf_at_x(column_x - half, depth), kerf_at_y(column_y - half, depth),
                                 swept(blade, under(12.0), under(column_x - half), 2),
                                 kerf_at_y(6.0 - 0.73 - half, depth)};
  std::set<std::string> names;
  std::set<int> pieces;
  std::vector<int> order = {0, 1, 2, 3};
  do {
    Cutting cutting(bone);
    for (const int i : order) cutting.apply(sawn[static_cast<std::size_t>(i)]);
    pieces.insert(cutting.pieces);
    const Settled settled = cutting.settled();
    EXPECT_EQ(settled.bodies.size(), 1u);
    EXPECT_EQ(settled.debris, 2);
    EXPECT_GT(settled.bodies[0].solid_mm({5.6, 5.6, -0.5}), 0.0);
    EXPECT_GT(settled.bodies[0].solid_mm({5.6, 3.6, -0.5}), 0.0);
    EXPECT_LT(settled.bodies[0].solid_mm({5.6, 1.0, -0.5}), 0.0);
    EXPECT_LT(settled.bodies[0].solid_mm({5.6, 5.6, -3.0}), 0.0);
    names.insert(name_of(settled, bone.pitch_mm()));
  } while (std::ranges::next_permutation(order).found);
  EXPECT_EQ(pieces, (std::set<int>{0, 1}));
  EXPECT_EQ(names.size(), 1u);
}

}  // namespace
}  // namespace osteon
