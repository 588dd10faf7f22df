// Blocks of different levels side by side: the surface stays closed, exact to the bits of its vertices.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "common/surface/block_source.hpp"
#include "common/surface/weld.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

constexpr double kPitch_mm = 0.4;

struct Drawn {
  CutField field;
  SurfaceBlocks blocks{BodyId{}};

  void cut(const Cut& c) {
    const CutReport report = field.apply(c);
    (void)blocks.touch(report.level, report.changed_leaves);
  }
  std::vector<BlockKey> keys() const {
    std::vector<BlockKey> all = blocks.fine_blocks();
    for (const BlockKey& key : blocks.coarse_blocks()) all.push_back(key);
    const CoordBox b = field.bone().bounds_samples();
    for (int x = (b.min.x - 1) >> 4; x <= b.max.x >> 4; ++x)
      for (int y = (b.min.y - 1) >> 4; y <= b.max.y >> 4; ++y)
        for (int z = (b.min.z - 1) >> 4; z <= b.max.z >> 4; ++z) all.push_back({{}, 0, {x, y, z}});
    return all;
  }
  // Encoded and decoded again.
  std::vector<Mesh> meshes(bool seams = true) const {
    std::vector<Mesh> all;
    BlockSamples samples;
    for (const BlockKey& key : keys()) {
      gather_block(field, blocks, key, field.bone().pitch_mm(), samples);
      if (!seams) samples.seams = {};
      auto mesh = decode_block(key, encode_block(samples), level_pitch_mm(field.bone().pitch_mm(), key.level));
      EXPECT_TRUE(mesh);
      all.push_back(std::move(*mesh));
    }
    return all;
  }
};

struct Check {
  int open = 0;     // edges without as many edges in the other direction
  int pinched = 0;  // edges with more than two triangles
  int shrunk = 0;   // triangles lost by welding
  int euler = 0;
  double volume_mm3 = 0;
};

Check check(const std::vector<Mesh>& blocks) {
  Check result;
  const Mesh whole = weld(blocks);
  std::size_t triangles = 0;
  for (const Mesh& block : blocks) triangles += block.triangles.size();
  result.shrunk = static_cast<int>(triangles - whole.triangles.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  std::set<std::uint32_t> used;
  for (const auto& t : whole.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      ++edges[{t[i], t[(i + 1) % 3]}];
      used.insert(t[i]);
    }
    const auto at = [&](std::size_t i) {
      const auto& p = whole.positions_mm[t[i]];
      return Vec3(p[0], p[1], p[2]);
    };
    result.volume_mm3 += at(0).dot(at(1).cross(at(2))) / 6.0;
  }
  int undirected = 0;
  for (const auto& [edge, times] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (back == edges.end() || back->second != times) ++result.open;
    if (times > 1) ++result.pinched;
    if (edge.first < edge.second || back == edges.end()) ++undirected;
  }
  result.euler = static_cast<int>(used.size()) - undirected + static_cast<int>(whole.triangles.size());
  return result;
}

Drawn ball(double radius_mm, double pitch_mm = kPitch_mm) {
  const Vec3 centre(0.21, -0.13, 0.07);
  const double r = radius_mm + 3;
  return {CutField(test::make_bone(
                       {Vec3(-r, -r, -r), Vec3(r, r, r)}, pitch_mm,
                       [=](const Vec3& p) { return (p - centre).norm() - radius_mm; }, [](const Vec3&) { return 1.9; }),
                   {})};
}

Cut cut_at_level(const char* tool, int level, const Vec3& from, const Vec3& to, const Vec3& axis) {
  Cut cut = test::straight_cut(*find_tool(tool), from, to, axis);
  cut.level = level;
  return cut;
}

TEST(Seams, AGrooveInABallLeavesASphere) {
  for (const int level : {1, 2}) {
    Drawn drawn = ball(8.0);
    drawn.cut(cut_at_level("burr-round-5", level, {-3, 0, 8}, {3, 1, 8}, {0, 0, -1}));
    const Check result = check(drawn.meshes());
    EXPECT_EQ(result.open, 0);
    EXPECT_EQ(result.pinched, 0);
    EXPECT_EQ(result.shrunk, 0);
    EXPECT_EQ(result.euler, 2);
    // Without the rule the same blocks do not fit.
    EXPECT_GT(check(drawn.meshes(false)).open, 20);
  }
}

TEST(Seams, AHoleThroughABallMakesATorus) {
  Drawn drawn = ball(8.0);
  drawn.cut(cut_at_level("drill-3.2", 2, {0.3, 0.2, 10}, {0.3, 0.2, -12}, {0, 0, -1}));
  const Check result = check(drawn.meshes());
  EXPECT_EQ(result.open, 0);
  EXPECT_EQ(result.pinched, 0);
  EXPECT_EQ(result.euler, 0);
}

TEST(Seams, ThreeLevelsMeet) {
  Drawn drawn = ball(10.0);
  drawn.cut(cut_at_level("drill-3.2", 1, {1, 1, 12}, {1, 1, -14}, {0, 0, -1}));
  drawn.cut(cut_at_level("burr-round-5", 2, {2, 2, 10}, {5, 4, 8}, {0, 0, -1}));
  drawn.cut(cut_at_level("burr-round-5", 0, {-4, -2, 9}, {2, -3, 9}, {0, 0, -1}));
  const Check result = check(drawn.meshes());
  EXPECT_EQ(result.open, 0);
  EXPECT_EQ(result.pinched, 0);
  EXPECT_EQ(result.euler, 0);
}

// Beside a seam the finer block follows the coarser contour, which lies below the imported surface where that is round.
TEST(Seams, OnlyTheCutIsACutFace) {
  for (const int level : {1, 2}) {
    Drawn drawn = ball(6.0, 0.8);
    const Vec3 from(-2, 0, 5), to(2, 1, 5);
    drawn.cut(cut_at_level("burr-round-5", level, from, to, {0, 0, -1}));
    int on_cut = 0, off_cut = 0;
    for (const Mesh& mesh : drawn.meshes())
      for (std::size_t v = 0; v < mesh.positions_mm.size(); ++v) {
        const auto& p = mesh.positions_mm[v];
        // The burr is a ball of 2.5 mm radius, whose tip is its lowest point.
        const Vec3 centre = Vec3(p[0], p[1], p[2]) - Vec3(0, 0, 2.5) - from, along = to - from;
        const double away = (centre - std::clamp(centre.dot(along) / along.squaredNorm(), 0.0, 1.0) * along).norm();
        if (mesh.cut_face[v] != 0) ++(away < 2.5 + 0.8 ? on_cut : off_cut);
      }
    EXPECT_GT(on_cut, 100) << level;
    EXPECT_EQ(off_cut, 0) << level;
  }
}

// A surface is closed whatever was cut.
TEST(Seams, RandomCutsOfAllLevelsLeaveAClosedSurface) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto direction = [&] { return Vec3(unit(random), unit(random), unit(random)).normalized(); };
  Drawn drawn = ball(7.0);
  for (int i = 0; i < 24; ++i) {
    const Vec3 at = 7.0 * direction();
    drawn.cut(cut_at_level(i % 2 ? "burr-round-5" : "drill-3.2", i % 3, at, at + 2.0 * direction(), -at.normalized()));
    const Check result = check(drawn.meshes());
    ASSERT_EQ(result.open, 0) << "after cut " << i;
    ASSERT_EQ(result.pinched, 0) << "after cut " << i;
    ASSERT_EQ(result.shrunk, 0) << "after cut " << i;
  }
}

TEST(Seams, FarBlocksAreCoarseAndTheSurfaceStaysClosed) {
  Drawn drawn = ball(60.0, 0.8);
  drawn.cut(cut_at_level("burr-round-5", 2, {-3, 0, 60}, {3, 1, 60}, {0, 0, -1}));
  drawn.cut(cut_at_level("drill-3.2", 1, {20, 0, 58}, {10, 0, 40}, {0, 0, -1}));
  const CoordBox bone = drawn.field.bone().bounds_samples();
  std::size_t full = 0;
  for (const Mesh& mesh : drawn.meshes()) full += mesh.triangles.size();
  for (const Focus& focus : {Focus{{0, 0, 60}, 5, 20}, Focus{{0, 0, 60}, 3, 3}, Focus{{40, 0, 40}, 1, 30}}) {
    (void)drawn.blocks.focus({&focus, 1}, bone, 0.8);
    EXPECT_GT(drawn.blocks.coarse_blocks().size(), 3u);
    const std::vector<Mesh> meshes = drawn.meshes();
    const Check result = check(meshes);
    EXPECT_EQ(result.open, 0);
    std::size_t triangles = 0;
    for (const Mesh& mesh : meshes) triangles += mesh.triangles.size();
    EXPECT_LT(triangles, 2 * full / 3);
  }
  (void)drawn.blocks.focus({}, bone, 0.8);
  EXPECT_TRUE(drawn.blocks.coarse_blocks().empty());
  EXPECT_EQ(check(drawn.meshes()).open, 0);
}

// Compares the loops for whole blocks with the code for any box of samples: the same bits, on every level, below and
// above zero.
TEST(BlockSource, GathersWhatTheFieldGathers) {
  Drawn drawn = ball(7.0);
  for (int i = 0; i < 6; ++i) {
    const Vec3 at = 7.0 * Vec3(i < 3 ? 1 : -1, i % 2 ? 0.3 : -0.4, 0.2 * i).normalized();
    drawn.cut(cut_at_level("burr-round-5", i % 3, at, at + Vec3(0, 1.5, 1), -at.normalized()));
  }
  BlockSamples samples;
  int uncut = 0, both = 0, skipped = 0;
  for (int level = 0; level < kLevels; ++level) {
    const CoordBox bone = drawn.field.bone().bounds_samples();
    const Coord first = shift_down((1 << level) * bone.min, 4), last = shift_down((1 << level) * bone.max, 4);
    for (int x = first.x; x <= last.x; ++x)
      for (int y = first.y; y <= last.y; ++y)
        for (int z = first.z; z <= last.z; ++z) {
          const CoordBox box = block_samples({{}, level, {x, y, z}});
          const Coord d = box.dims();
          std::vector<float> solid(static_cast<std::size_t>(d.x * d.y * d.z)), surface = solid, f = solid, s = solid;
          drawn.field.gather_solid(level, box, f);
          drawn.field.gather_surface(level, box, s);
          const auto gathered = drawn.field.gather_block(level, box, solid, surface);
          if (gathered == CutField::Gathered::nothing) {
            ++skipped;
            EXPECT_EQ(std::ranges::count_if(f, [](float v) { return v < 0; }) % static_cast<std::ptrdiff_t>(f.size()),
                      0);
            continue;
          }
          (gathered == CutField::Gathered::solid ? uncut : both) += 1;
          ASSERT_EQ(solid, f) << level << ": " << x << ' ' << y << ' ' << z;
          ASSERT_EQ(gathered == CutField::Gathered::solid ? solid : surface, s)
              << level << ": " << x << ' ' << y << ' ' << z;
        }
  }
  EXPECT_GT(uncut, 10);
  EXPECT_GT(both, 10);
  EXPECT_GT(skipped, 0);
}

}  // namespace
}  // namespace osteon
