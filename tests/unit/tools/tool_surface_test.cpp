#include "common/tools/tool_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/geometry/mesh_file.hpp"
#include "common/tools/tool_solid.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using std::numbers::pi;

TEST(ToolSurface, KeepsSharpEdgesAndRoundFaces) {
  // Sharp edges: the volume and area of a box are right, whatever the cells are.
  const Implicit box = cuboid({Vec3(-1, -2, -3), Vec3(4, 3.3, 5)});
  const TriangleMesh mesh = surface_of(box, 0.7);
  EXPECT_EQ(open_edges(mesh), 0u);
  EXPECT_NEAR(enclosed_mm3(mesh), 5.0 * 5.3 * 8.0, 1e-3);
  EXPECT_NEAR(area_mm2(mesh), 2.0 * (5.0 * 5.3 + 5.3 * 8.0 + 8.0 * 5.0), 1e-3);
  // Round faces: the error falls with the square of the cell.
  const Implicit sphere = ball({0.1, 0.2, 0.3}, 3.0);
  const double volume = 4.0 / 3.0 * pi * 27.0;
  const double coarse = volume - enclosed_mm3(surface_of(sphere, 0.6)),
               fine = volume - enclosed_mm3(surface_of(sphere, 0.3));
  EXPECT_LT(std::abs(coarse), 0.03 * volume);
  EXPECT_LT(std::abs(fine), 0.35 * std::abs(coarse));
}

class ToolSurfaces : public testing::TestWithParam<Tool> {};

TEST_P(ToolSurfaces, IsClosedTurnsOutwardsAndLiesOnTheTool) {
  const Tool& tool = GetParam();
  const Implicit solid = tool_solid(tool);
  const double cell = std::min(0.5, thinnest_cell_mm(tool));
  const TriangleMesh mesh = tool_surface(tool, 0.5);
  EXPECT_EQ(open_edges(mesh), 0u);
  double off = 0.0, sum = 0.0;
  for (std::uint32_t i = 0; i < mesh.positions_mm.size(); ++i) {
    const double distance = std::abs(solid(position(mesh, i)));
    off = std::max(off, distance);
    sum += distance;
  }
  // A sharp point may be cut off within its cell; elsewhere vertices lie on the tool.
  EXPECT_LT(off, cell);
  EXPECT_LT(sum / static_cast<double>(mesh.positions_mm.size()), 0.01 * cell);
  // The volume by counting random positions, within three and a half standard deviations. Chords take the share (2/3)
  // (cell / d)² from a cylinder of diameter d. The cell is half of the thinnest part, or less.
  const Box box = solid.bounds;
  std::mt19937 random(9);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  constexpr int kPlaces = 100000;
  int inside = 0;
  for (int i = 0; i < kPlaces; ++i)
    inside += solid(box.min_mm + Vec3(share(random), share(random), share(random)).cwiseProduct(box.size_mm())) < 0.0;
  const double p = static_cast<double>(inside) / kPlaces, whole = box.size_mm().prod();
  const double deviation = std::sqrt(p * (1.0 - p) / kPlaces) * whole;
  const double thin = 0.5 * cell / thinnest_cell_mm(tool);
  EXPECT_NEAR(enclosed_mm3(mesh), p * whole, 3.5 * deviation + (0.005 + 0.667 * thin * thin) * p * whole);
  // No part of the tool is lost, and nothing protrudes.
  const Box drawn = bounds(mesh);
  // A point ends where it is narrower than a cell's diagonal.
  const double slope = tool.point_angle_rad > 0.0 ? std::tan(0.5 * tool.point_angle_rad) : 1.0;
  EXPECT_LT((drawn.min_mm - box.min_mm).cwiseAbs().maxCoeff(), 0.71 * cell);
  EXPECT_LT((drawn.max_mm - box.max_mm).cwiseAbs().maxCoeff(), 0.71 * cell / std::min(1.0, slope));
}

INSTANTIATE_TEST_SUITE_P(Builtin, ToolSurfaces, testing::ValuesIn(builtin_tools().begin(), builtin_tools().end()),
                         [](const auto& param) {
                           std::string name = param.param.name;
                           std::ranges::replace_if(
                               name, [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

TEST(ToolSurface, GoesOutAsStlAndComesBackClosed) {
  const test::TempDir folder;
  const TriangleMesh mesh = tool_surface(*find_tool("guide-1"), 1.0);
  ASSERT_TRUE(write_stl(mesh, folder / "guide.stl"));
  const auto back = read_stl(folder / "guide.stl");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(open_edges(*back), 0u);
  // A tube of 8 and 3.4 mm, 40 mm long.
  EXPECT_NEAR(enclosed_mm3(*back), pi * (16.0 - 1.7 * 1.7) * 40.0, 0.02 * pi * 16.0 * 40.0);
}

}  // namespace
}  // namespace osteon
