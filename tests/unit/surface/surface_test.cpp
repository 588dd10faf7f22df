#include <gtest/gtest.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <span>

#include "common/surface/block_source.hpp"
#include "common/surface/weld.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

constexpr double kPi = std::numbers::pi;
using Point = std::array<float, 3>;

// Blocks of one level that cover a box of ±`reach` blocks, from a distance in mm.
template <class Distance>
std::map<BlockKey, BlockPayload> blocks_of(Distance distance, double pitch, int reach) {
  std::map<BlockKey, BlockPayload> blocks;
  for (int x = -reach; x < reach; ++x)
    for (int y = -reach; y < reach; ++y)
      for (int z = -reach; z < reach; ++z) {
        const BlockKey key{{}, 0, {x, y, z}};
        const CoordBox box = block_samples(key);
        std::vector<float> f;
        for (std::int32_t i = box.min.x; i <= box.max.x; ++i)
          for (std::int32_t j = box.min.y; j <= box.max.y; ++j)
            for (std::int32_t k = box.min.z; k <= box.max.z; ++k)
              f.push_back(static_cast<float>(distance(position_mm({i, j, k}, pitch))));
        blocks[key] = encode_block(f, f, 0, pitch);
      }
  return blocks;
}

double sphere(const Vec3& p) { return (p - Vec3{0.21, -0.13, 0.07}).norm() - 5.0; }

struct Welded {
  std::map<Point, int> points;
  std::map<std::pair<int, int>, int> edges;  // directed
  int triangles = 0;
  double area = 0.0, volume = 0.0;
};

// Joins vertices only if their bits are equal, because the surface must be closed exactly.
Welded weld(const std::map<BlockKey, BlockPayload>& blocks, double pitch) {
  Welded all;
  for (const auto& [key, payload] : blocks) {
    const auto mesh = decode_block(key, payload, level_pitch_mm(pitch, key.level));
    EXPECT_TRUE(mesh);
    for (const auto& t : mesh->triangles) {
      int id[3];
      Vec3 p[3];
      for (int i = 0; i < 3; ++i) {
        const Point& q = mesh->positions_mm[t[static_cast<std::size_t>(i)]];
        id[i] = all.points.try_emplace(q, static_cast<int>(all.points.size())).first->second;
        p[i] = {static_cast<double>(q[0]), static_cast<double>(q[1]), static_cast<double>(q[2])};
      }
      ++all.triangles;
      all.area += 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
      all.volume += p[0].dot(p[1].cross(p[2])) / 6.0;
      if (id[0] == id[1] || id[1] == id[2] || id[0] == id[2]) {
        --all.triangles;  // shrunk to a line by quantisation; its edges cancel
        continue;
      }
      for (int i = 0; i < 3; ++i) ++all.edges[{id[i], id[(i + 1) % 3]}];
    }
  }
  return all;
}

TEST(MarchingCubes, ASphereAcrossBlocksIsOneClosedSurface) {
  const double pitch = 0.4;
  const Welded mesh = weld(blocks_of(sphere, pitch, 1), pitch);
  for (const auto& [edge, times] : mesh.edges) {
    const auto back = mesh.edges.find({edge.second, edge.first});
    ASSERT_TRUE(back != mesh.edges.end() && back->second == times);
  }
  const int edges = static_cast<int>(mesh.edges.size()) / 2;
  EXPECT_EQ(static_cast<int>(mesh.points.size()) - edges + mesh.triangles, 2);  // Euler characteristic of a sphere
  EXPECT_NEAR(mesh.area, 4.0 * kPi * 25.0, 0.01 * 4.0 * kPi * 25.0);
  // Positive if triangles are counter-clockwise as seen from outside.
  EXPECT_NEAR(mesh.volume, 4.0 / 3.0 * kPi * 125.0, 0.01 * 4.0 / 3.0 * kPi * 125.0);
}

TEST(MarchingCubes, NormalsPointOutOfTheBone) {
  for (const auto& [key, payload] : blocks_of(sphere, 0.4, 1)) {
    const Mesh mesh = *decode_block(key, payload, 0.4);
    for (std::size_t v = 0; v < mesh.positions_mm.size(); ++v) {
      const Point& p = mesh.positions_mm[v];
      const Vec3 out = Vec3(p[0] - 0.21, p[1] + 0.13, p[2] - 0.07).normalized();
      ASSERT_GT(out.dot(Vec3(mesh.normals[v][0], mesh.normals[v][1], mesh.normals[v][2])), 0.99);
      ASSERT_EQ(mesh.cut_face[v], 0);
    }
  }
}

vtkIdType flying_edges_triangles(const std::vector<float>& values, int n) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(n, n, n);
  image->AllocateScalars(VTK_FLOAT, 1);
  // VTK's x is fastest. Which axis is called x does not change the count.
  std::ranges::copy(values, static_cast<float*>(image->GetScalarPointer()));
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputData(image);
  contour->SetValue(0, 0.0);
  contour->Update();
  return contour->GetOutput()->GetNumberOfPolys();
}

std::vector<float> inner_samples(const std::vector<float>& gathered) {
  std::vector<float> inner;
  for (int x = 1; x <= kBlockSamples; ++x)
    for (int y = 1; y <= kBlockSamples; ++y)
      for (int z = 1; z <= kBlockSamples; ++z)
        inner.push_back(gathered[static_cast<std::size_t>((x * kBlockApron + y) * kBlockApron + z)]);
  return inner;
}

TEST(MarchingCubes, HasAsManyTrianglesAsFlyingEdgesOnSmoothSurfaces) {
  for (const double radius : {2.0, 3.3, 5.0}) {
    std::vector<float> gathered;
    for (int x = 0; x < kBlockApron; ++x)
      for (int y = 0; y < kBlockApron; ++y)
        for (int z = 0; z < kBlockApron; ++z)
          gathered.push_back(static_cast<float>(std::hypot(x - 9.1, y - 8.7, z - 9.4) - radius));
    const Mesh mesh = *decode_block({}, encode_block(gathered, gathered, 0, 1.0), 1.0);
    EXPECT_EQ(static_cast<vtkIdType>(mesh.triangles.size()),
              flying_edges_triangles(inner_samples(gathered), kBlockSamples));
  }
}

TEST(MarchingCubes, NoiseToo) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise;
  std::vector<float> gathered(static_cast<std::size_t>(kBlockApron * kBlockApron * kBlockApron));
  for (float& v : gathered) v = noise(random);
  const Mesh mesh = *decode_block({}, encode_block(gathered, gathered, 0, 1.0), 1.0);
  // Every crossed edge has its vertex, however irregular the field is.
  std::size_t crossings = 0;
  const std::vector<float> f = inner_samples(gathered);
  const auto at = [&](int x, int y, int z) {
    return f[static_cast<std::size_t>((x * kBlockSamples + y) * kBlockSamples + z)] < 0.0f;
  };
  for (int x = 0; x < kBlockSamples; ++x)
    for (int y = 0; y < kBlockSamples; ++y)
      for (int z = 0; z < kBlockSamples; ++z) {
        crossings += x + 1 < kBlockSamples && at(x, y, z) != at(x + 1, y, z);
        crossings += y + 1 < kBlockSamples && at(x, y, z) != at(x, y + 1, z);
        crossings += z + 1 < kBlockSamples && at(x, y, z) != at(x, y, z + 1);
      }
  EXPECT_EQ(mesh.positions_mm.size(), crossings);
}

TEST(BlockCodec, RefusesBytesThatNoEncoderWrote) {
  auto payload = blocks_of(sphere, 0.4, 1).begin()->second;
  ASSERT_FALSE(payload.bytes.empty());
  const std::vector<std::uint8_t> whole = payload.bytes;
  payload.bytes.pop_back();
  EXPECT_FALSE(decode_block({}, payload, 0.4));
  payload.bytes = whole;
  payload.bytes[0] = 255;
  EXPECT_FALSE(decode_block({}, payload, 0.4));
  payload.bytes = whole;
  payload.bytes.resize(10);
  EXPECT_FALSE(decode_block({}, payload, 0.4));
}

TEST(BlockCodec, LeavesOutCoveredCells) {
  std::vector<float> plane;
  for (int x = 0; x < kBlockApron; ++x)
    for (int y = 0; y < kBlockApron; ++y)
      for (int z = 0; z < kBlockApron; ++z) plane.push_back(static_cast<float>(z) - 7.5f);
  const auto triangles = [&](CoveredGroups covered) {
    return decode_block({}, encode_block(plane, plane, covered, 1.0), 1.0)->triangles.size();
  };
  EXPECT_EQ(triangles(0), 512u);                                 // 16 · 16 cells, two triangles each
  EXPECT_EQ(triangles(CoveredGroups{1} << 1), 512u - 2u * 16u);  // the group with cells z = 4 to 7 at x = y = 0
  EXPECT_EQ(triangles(CoveredGroups{1} << 0), 512u);             // no triangle crosses z = 0 to 3
  EXPECT_EQ(triangles(~CoveredGroups{0}), 0u);
}

struct DrawnSurface {
  CutField field;
  SurfaceBlocks blocks{BodyId{}};

  BlockPayload make(const BlockKey& key) const {
    BlockSamples samples;
    gather_block(field, blocks, key, field.bone().pitch_mm(), samples);
    return encode_block(samples);
  }
  std::map<BlockKey, BlockPayload> all() const {
    std::map<BlockKey, BlockPayload> made;
    const CoordBox b = field.bone().bounds_samples();
    for (int x = (b.min.x >> 4) - 1; x <= (b.max.x >> 4) + 1; ++x)
      for (int y = (b.min.y >> 4) - 1; y <= (b.max.y >> 4) + 1; ++y)
        for (int z = (b.min.z >> 4) - 1; z <= (b.max.z >> 4) + 1; ++z)
          made[{{}, 0, {x, y, z}}] = make({{}, 0, {x, y, z}});
    for (const BlockKey& key : blocks.fine_blocks()) made[key] = make(key);
    for (const BlockKey& key : blocks.coarse_blocks()) made[key] = make(key);
    return made;
  }
  void cut(const Cut& c) {
    const CutReport report = field.apply(c);
    (void)blocks.touch(report.level, report.changed_leaves);
  }
};

TEST(SurfaceBlocks, NameEveryBlockThatACutChanges) {
  DrawnSurface surface{CutField(test::plain_block(20.0, 10.0, 0.5), {})};
  const Tool drill = *find_tool("drill-3.2"), burr = *find_tool("burr-round-5");
  std::vector<Cut> cuts{test::straight_cut(drill, {1, 1, 1}, {1, 1, -4}, {0, 0, -1}),
                        test::straight_cut(burr, {-6, 0, -1}, {4, 2, -1.5}, {0, 0, -1}),
                        test::straight_cut(drill, {4, 4, 1}, {4, 4, -12}, {0, 0, -1}),
                        test::straight_cut(burr, {3, 3, -1}, {5, 5, -1}, {0, 0, -1})};
  cuts[2].level = 1;
  cuts[3].level = 0;
  for (const Cut& cut : cuts) {
    const auto before = surface.all();
    const CutReport report = surface.field.apply(cut);
    const auto named = surface.blocks.touch(report.level, report.changed_leaves);
    const std::set<BlockKey> stale(named.begin(), named.end());
    EXPECT_EQ(stale.size(), named.size());
    for (const auto& [key, payload] : surface.all()) {
      const auto old = before.find(key);
      if (old == before.end() ? !payload.bytes.empty() : old->second != payload) {
        EXPECT_TRUE(stale.contains(key)) << key.level << ": " << key.index.x << ' ' << key.index.y << ' '
                                         << key.index.z;
      }
    }
  }
}

// A block of 8 mm in full ends at x = 0, where blocks at 2 h begin. Its seam has the normals of the coarser side:
// central differences of samples that are 2 h apart. So it uses the sample at x = 2 h, one beyond those of its own
// cells. A cut changes the leaf that begins with that sample. Where nothing is coarser, the block uses no sample beyond
// x = h.
TEST(SurfaceBlocks, ACutChangesTheSeamsThatUseItsSamples) {
  const BlockKey beside{BodyId{0}, 0, {-1, 0, 0}};
  const Coord leaf{8, 24, 24};  // of h/4: from x = 2 h on
  for (const bool coarse : {true, false}) {
    SurfaceBlocks blocks(BodyId{0});
    const Focus focus{.position_mm = {-16, 8, 8}, .full_mm = 8.0, .half_mm = 40.0};
    if (coarse) (void)blocks.focus(std::span(&focus, 1), {{-64, -64, -64}, {63, 63, 63}}, 0.5);
    ASSERT_TRUE(blocks.drawn(beside));
    ASSERT_EQ(blocks.drawn({BodyId{0}, -1, {0, 0, 0}}), coarse);
    const std::vector<BlockKey> stale = blocks.touch(2, {leaf});
    EXPECT_EQ(std::ranges::count(stale, beside), coarse ? 1 : 0);
  }
}

TEST(SurfaceBlocks, FineAndCoarseTogetherDrawEveryFaceOnce) {
  DrawnSurface surface{CutField(test::plain_block(20.0, 10.0, 0.5), {})};
  const Welded before = weld(surface.all(), 0.5);
  const CutReport report =
      surface.field.apply(test::straight_cut(*find_tool("drill-3.2"), {1, 1, 1}, {1, 1, -14}, {0, 0, -1}));
  (void)surface.blocks.touch(report.level, report.changed_leaves);
  const Welded after = weld(surface.all(), 0.5);
  // The hole's wall is added and its two mouths are removed. A fine block drawn twice or not at all would cause an
  // error of its 2 mm by 2 mm of face. The rims, rounded by the pitch, cause less than half of that.
  const double wall = 2.0 * kPi * 1.6 * 10.0, mouths = 2.0 * kPi * 1.6 * 1.6;
  EXPECT_NEAR(after.area - before.area, wall - mouths, 2.0);
}

// A rod of metal and a cap of enamel in a block. Each vertex has the tissue below it, on the imported surface and on
// faces of cuts. Blocks without metal and enamel keep their bytes.
TEST(SurfaceBlocks, MetalAndEnamelAreMarked) {
  const auto tissue = [](const Vec3& p) {
    if (std::hypot(p.x() - 3.0, p.y()) < 1.0) return Tissue::metal;
    return p.x() < -6.0 && p.z() > -3.0 ? Tissue::enamel : Tissue::none;
  };
  DrawnSurface plain{CutField(test::plain_block(20.0, 10.0, 0.5), {})};
  DrawnSurface marked{CutField(test::marked_block(20.0, 10.0, 0.5, tissue), {})};
  // Cuts on two levels: past the rod, where the groove lays metal bare, and into the enamel. Far away also in coarse
  // blocks.
  Cut groove = test::straight_cut(*find_tool("burr-round-5"), {3, -8, -1}, {3, -2.4, -1}, {0, 0, -1});
  const Cut across = test::straight_cut(*find_tool("drill-3.2"), {-8, 0, 1}, {-8, 0, -6}, {0, 0, -1});
  for (DrawnSurface* surface : {&plain, &marked})
    for (int level : {1, 2}) {
      Cut cut = level == 1 ? groove : across;
      cut.level = level;
      surface->cut(cut);
      const Focus focus{{0, 9, 0}, 3.0, 6.0};
      (void)surface->blocks.focus({&focus, 1}, surface->field.bone().bounds_samples(), 0.5);
    }
  const auto before = plain.all(), after = marked.all();
  ASSERT_EQ(before.size(), after.size());
  int same = 0, metal = 0, enamel = 0, cut_enamel = 0, bone = 0;
  std::set<int> levels;
  for (const auto& [key, payload] : after) {
    const double pitch_mm = level_pitch_mm(0.5, key.level);
    const auto mesh = decode_block(key, payload, pitch_mm);
    ASSERT_TRUE(mesh) << mesh.error().message;
    same += payload == before.at(key);
    EXPECT_EQ(payload == before.at(key), mesh->tissue.empty());
    if (mesh->tissue.empty()) continue;
    const auto without = decode_block(key, before.at(key), pitch_mm);
    EXPECT_EQ(without->positions_mm, mesh->positions_mm);
    EXPECT_EQ(without->cut_face, mesh->cut_face);
    EXPECT_EQ(payload.bytes.size(), before.at(key).bytes.size() + (mesh->positions_mm.size() + 3) / 4)
        << "two bits a vertex";
    ASSERT_EQ(mesh->tissue.size(), mesh->positions_mm.size());
    levels.insert(key.level);
    for (std::size_t v = 0; v < mesh->tissue.size(); ++v) {
      const Point& at = mesh->positions_mm[v];
      const Vec3 p(at[0], at[1], at[2]);
      metal += mesh->tissue[v] == Tissue::metal;
      enamel += mesh->tissue[v] == Tissue::enamel;
      cut_enamel += mesh->tissue[v] == Tissue::enamel && mesh->cut_face[v] != 0;
      // Where the tissue is the same in a whole sample round it, no other tissue may be shown.
      const double reach_mm = std::max(0.5, pitch_mm);
      bool alike = true;
      for (int i = 0; i < 27; ++i)
        alike &= tissue(p + reach_mm * Vec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)) == tissue(p);
      if (!alike) continue;
      ASSERT_EQ(mesh->tissue[v], tissue(p)) << key.level << ": " << p.transpose();
      bone += mesh->tissue[v] == Tissue::none;
    }
    // No block has a pair of bits without a meaning.
    BlockPayload broken = payload;
    broken.bytes.back() |= 3;
    EXPECT_FALSE(decode_block(key, broken, pitch_mm));
  }
  EXPECT_GT(same, 20);
  EXPECT_GT(metal, 20);
  EXPECT_GT(enamel, 200);
  EXPECT_GT(cut_enamel, 50);
  EXPECT_GT(bone, 50);
  EXPECT_GE(levels.size(), 3u);
}

TEST(SurfaceBlocks, CutFacesAreMarked) {
  DrawnSurface surface{CutField(test::plain_block(20.0, 10.0, 0.5), {})};
  const CutReport report =
      surface.field.apply(test::straight_cut(*find_tool("drill-3.2"), {1, 1, 1}, {1, 1, -14}, {0, 0, -1}));
  (void)surface.blocks.touch(report.level, report.changed_leaves);
  for (const auto& [key, payload] : surface.all()) {
    const Mesh mesh = *decode_block(key, payload, level_pitch_mm(0.5, key.level));
    for (std::size_t v = 0; v < mesh.positions_mm.size(); ++v) {
      const Point& p = mesh.positions_mm[v];
      const double from_axis = std::hypot(p[0] - 1.0f, p[1] - 1.0f);
      if (p[2] < -1.0f && p[2] > -9.0f && from_axis < 3.0) {
        ASSERT_EQ(mesh.cut_face[v], 1) << from_axis << ' ' << p[2];
      }
      if (from_axis > 3.0) {
        ASSERT_EQ(mesh.cut_face[v], 0);
      }
    }
  }
}

}  // namespace
}  // namespace osteon
