#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "common/geometry/mesh_file.hpp"
#include "common/volume/cut_field.hpp"
#include "common/volume/mesh_distance.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

// An octahedron whose triangles are divided and moved out to the sphere.
TriangleMesh sphere_mesh(double radius, const Vec3& centre, int divisions) {
  std::vector<Vec3> points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<std::uint32_t, 3>> triangles{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int i = 0; i < divisions; ++i) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, added] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (added) points.push_back((points[a] + points[b]).normalized());
      return found->second;
    };
    std::vector<std::array<std::uint32_t, 3>> next;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      next.insert(next.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(next);
  }
  TriangleMesh mesh;
  for (const Vec3& p : points) {
    const Vec3 q = centre + radius * p;
    mesh.positions_mm.push_back({static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())});
  }
  mesh.triangles = triangles;
  return mesh;
}

TEST(MeshDistance, OfASphereIsTheDistanceToIt) {
  const Vec3 centre{0.3, -0.2, -4.0};
  const double radius = 5.0, pitch = 0.25;
  const TriangleMesh mesh = sphere_mesh(radius, centre, 5);
  const auto sampled = sampled_distance(mesh, pitch);
  ASSERT_TRUE(sampled) << sampled.error().message;
  const SampledDistance& d = **sampled;
  // The triangles lie within the sphere, each at most as deep as its plane.
  double chord = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vec3 corner = position(mesh, t[0]) - centre;
    const Vec3 across = (position(mesh, t[1]) - centre - corner).cross(position(mesh, t[2]) - centre - corner);
    chord = std::max(chord, radius - std::abs(across.normalized().dot(corner)));
  }
  EXPECT_LT(chord, 0.02);
  double worst = 0.0;
  std::size_t i = 0;
  for (std::int32_t x = d.box.min.x; x <= d.box.max.x; ++x)
    for (std::int32_t y = d.box.min.y; y <= d.box.max.y; ++y)
      for (std::int32_t z = d.box.min.z; z <= d.box.max.z; ++z, ++i) {
        const double exact = (position_mm({x, y, z}, pitch) - centre).norm() - radius;
        const double stored = d.values[i] * kQuantum_mm;
        if (std::abs(exact) > 0.05) {
          ASSERT_EQ(exact < 0, stored < 0);
        }
        worst = std::max(worst, std::abs(stored - std::clamp(exact, -kMeshBand_mm, kMeshBand_mm)));
      }
  EXPECT_EQ(i, d.values.size());
  // The triangle that is found as the nearest may be a neighbour of it.
  EXPECT_LT(worst, chord + 0.5 * kQuantum_mm + 0.06 * pitch) << "chord " << chord;
  EXPECT_GE(d.box.max.x * pitch, centre.x() + radius + kMeshBand_mm - pitch);
}

TEST(MeshDistance, DoesNotMindWhichWayTheTrianglesTurn) {
  TriangleMesh mesh = sphere_mesh(4.0, {0, 0, 0}, 3);
  const auto out = sampled_distance(mesh, 0.5);
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  const auto in = sampled_distance(mesh, 0.5);
  ASSERT_TRUE(out && in);
  EXPECT_EQ((*out)->values, (*in)->values);
}

TEST(MeshDistance, RefusesWhatIsNoSolidOrTooLarge) {
  const auto refused = [](const TriangleMesh& mesh, double pitch, const char* word) {
    const auto made = sampled_distance(mesh, pitch);
    ASSERT_FALSE(made) << word;
    EXPECT_EQ(made.error().code, ErrorCode::invalid_input);
    EXPECT_NE(made.error().message.find(word), std::string::npos) << made.error().message;
  };
  TriangleMesh open = sphere_mesh(4.0, {0, 0, 0}, 2);
  open.triangles.pop_back();
  refused(open, 0.5, "closed");
  refused({}, 0.5, "no triangles");
  refused(sphere_mesh(400.0, {0, 0, 0}, 1), 0.5, "millimetre");
  refused(sphere_mesh(100.0, {0, 0, 0}, 1), 0.1, "million");
  refused(sphere_mesh(0.01, {0, 0, 0}, 1), 0.5, "less than one sample");
  refused(sphere_mesh(4.0, {0, 0, 0}, 1), 0.0, "pitch");
  refused(sphere_mesh(200.0, {1e10, 0, 0}, 1), 1.0, "mm from the origin");  // its samples have no 32-bit indices
  TriangleMesh broken = sphere_mesh(4.0, {0, 0, 0}, 1);
  broken.positions_mm[0][1] = std::nanf("");
  refused(broken, 0.5, "not numbers");
  broken = sphere_mesh(4.0, {0, 0, 0}, 1);
  broken.triangles[0][1] = 1u << 30;
  refused(broken, 0.5, "corners");
}

// A ball from an STL file cuts like a ball.
TEST(MeshDistance, AToolFromAnStlFileCutsItsShape) {
  const test::TempDir temp;
  const double radius = 2.5;
  ASSERT_TRUE(write_stl(sphere_mesh(radius, {0, 0, -radius}, 5), temp / "ball.stl"));
  std::ofstream(temp / "ball.yaml") << "name: ball-from-mesh\ntitle: Ball\nkind: mesh\nmesh: ball.stl\nmesh_pitch_mm: "
                                       "0.25\nspindle_rpm: 1000\nteeth: 4\nfeed_mm_per_rev: 1\ncut_level: 2\n";
  const auto tool = load_tool_file(temp / "ball.yaml");
  ASSERT_TRUE(tool) << tool.error().message;
  const auto box = builtin_tool_box();
  box->add(*tool);
  CutField field(test::plain_block(16.0, 8.0, 0.5), {}, box);
  const Vec3 tip{0.013, 0.027, -4.0};
  field.apply(test::straight_cut(*tool, tip, tip, {0, 0, -1}));
  const double cap = radius - 1.5;
  const double exact =
      4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3) - std::numbers::pi * cap * cap * (3.0 * radius - cap) / 3.0;
  // The triangles' chords and the lattice of 0.25 mm, trilinear, both make it a little smaller.
  EXPECT_NEAR(field.removed_mm3(), exact, 0.02 * exact);
}

TEST(MeshDistance, ReadsNoFilesElsewhere) {
  const test::TempDir temp;
  ASSERT_TRUE(write_stl(sphere_mesh(2.0, {0, 0, -2}, 2), temp / "ball.stl"));
  std::filesystem::create_directory(temp / "tools");
  const MeshLoader load = stl_beside(temp / "tools");
  for (const char* name : {"../ball.stl", "", "..", "a/b.stl", "/ball.stl"}) EXPECT_FALSE(load(name, 0.25)) << name;
  EXPECT_FALSE(load("ball.stl", 0.25));
  EXPECT_TRUE(stl_beside(temp.path())("ball.stl", 0.25));
}

}  // namespace
}  // namespace osteon
