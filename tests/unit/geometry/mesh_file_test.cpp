#include "common/geometry/mesh_file.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

#include "common/geometry/mesh_edges.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

// A box from the origin, with triangles that face outwards.
TriangleMesh box_mesh(float x, float y, float z) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.positions_mm.push_back({i & 1 ? x : 0.0f, i & 2 ? y : 0.0f, i & 4 ? z : 0.0f});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
void put(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

TEST(TriangleMesh, ABoxIsClosedAndHasItsVolumeAndArea) {
  const TriangleMesh mesh = box_mesh(2, 3, 4);
  EXPECT_EQ(open_edges(mesh), 0u);
  EXPECT_DOUBLE_EQ(enclosed_mm3(mesh), 24.0);
  EXPECT_DOUBLE_EQ(area_mm2(mesh), 2.0 * (6 + 8 + 12));
  TriangleMesh holed = mesh;
  holed.triangles.pop_back();
  EXPECT_EQ(open_edges(holed), 3u);
  TriangleMesh turned = mesh;
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_EQ(open_edges(turned), 3u);
}

// Two boxes that touch only in an edge. The edge has four triangles.
TEST(TriangleMesh, AnEdgeOfFourTrianglesIsClosedAndNotManifold) {
  TriangleMesh mesh = box_mesh(1, 1, 1);
  EXPECT_EQ(to_text(edge_faults(mesh)), "0 open edges");
  // The second box is turned by half a turn about the edge x = y = 1 of the first, whose corners 3 and 7 it shares.
  const std::array<std::uint32_t, 8> corner = {8, 9, 10, 3, 11, 12, 13, 7};
  for (const float z : {0.0f, 1.0f})
    for (const auto& [x, y] : {std::pair(2.0f, 2.0f), std::pair(1.0f, 2.0f), std::pair(2.0f, 1.0f)})
      mesh.positions_mm.push_back({x, y, z});
  for (const auto& t : box_mesh(1, 1, 1).triangles)
    mesh.triangles.push_back({corner[t[0]], corner[t[1]], corner[t[2]]});
  EXPECT_DOUBLE_EQ(enclosed_mm3(mesh), 2.0);
  EXPECT_EQ(edge_faults(mesh).open, 0u);
  EXPECT_EQ(edge_faults(mesh).non_manifold, 1u);
  EXPECT_EQ(to_text(edge_faults(mesh)), "0 open edges, 1 non-manifold edge");
  // Without one of the four triangles the mesh is open, and no longer counts as non-manifold only.
  mesh.triangles.erase(mesh.triangles.begin() + 11);
  EXPECT_EQ(edge_faults(mesh).open, 3u);
  EXPECT_EQ(edge_faults(mesh).non_manifold, 0u);
  EXPECT_EQ(to_text({1, 2}), "1 open edge, 2 non-manifold edges");
}

TEST(MeshFile, BinaryStlComesBackWithItsVerticesShared) {
  const test::TempDir folder;
  ASSERT_TRUE(write_stl(box_mesh(2, 3, 4), folder / "box.stl"));
  EXPECT_EQ(fs::file_size(folder / "box.stl"), 84u + 50u * 12u);
  const auto back = read_stl(folder / "box.stl");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->positions_mm.size(), 8u);
  EXPECT_EQ(back->triangles.size(), 12u);
  EXPECT_EQ(open_edges(*back), 0u);
  EXPECT_DOUBLE_EQ(enclosed_mm3(*back), 24.0);
  // Nothing else is left in the folder.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(MeshFile, AsciiStlIsReadEvenWithOddBlanks) {
  const test::TempDir folder;
  put(folder / "t.stl",
      "solid a name of several words\r\n facet normal 0 0 -1\r\n  outer loop\n vertex 0 0 0\n vertex 0 +1e0 "
      "0\n\tvertex 1 0 -0\n "
      "endloop\n endfacet\n"
      "facet normal 0 -1 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 0 1 endloop endfacet\n"
      "facet normal -1 0 0 outer loop vertex 0 0 0 vertex 0 0 1 vertex 0 1 0 endloop endfacet\n"
      "facet normal 1 1 1 outer loop vertex 1 0 0 vertex 0 1 0 vertex 0 0 1 endloop endfacet\nendsolid a name of "
      "several "
      "words\n");
  const auto mesh = read_stl(folder / "t.stl");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->positions_mm.size(), 4u);
  EXPECT_EQ(open_edges(*mesh), 0u);
  EXPECT_NEAR(enclosed_mm3(*mesh), 1.0 / 6.0, 1e-12);
}

TEST(MeshFile, PlyAndObjHoldWhatTheMeshHolds) {
  const test::TempDir folder;
  TriangleMesh mesh = box_mesh(1, 1, 1);
  ASSERT_TRUE(write_ply(mesh, folder / "a.ply"));
  const std::string plain = text_of(folder / "a.ply");
  EXPECT_EQ(plain.size() - plain.find("end_header\n") - 11, 8u * 12u + 12u * 13u);
  mesh.normals.assign(8, {0.0f, 0.0f, 1.0f});
  ASSERT_TRUE(write_mesh(mesh, folder / "b.ply"));
  const std::string shaded = text_of(folder / "b.ply");
  EXPECT_EQ(shaded.size() - shaded.find("end_header\n") - 11, 8u * 24u + 12u * 13u);
  // The last vertex, (1, 1, 1), is before its normal and the faces.
  float last[3];
  std::memcpy(last, shaded.data() + shaded.size() - 12 * 13 - 24, sizeof last);
  EXPECT_EQ(last[0] + last[1] + last[2], 3.0f);

  ASSERT_TRUE(write_mesh(mesh, folder / "a.obj"));
  const std::string obj = text_of(folder / "a.obj");
  EXPECT_NE(obj.find("v 1 1 1\n"), std::string::npos);
  EXPECT_NE(obj.find("vn 0 0 1\n"), std::string::npos);
  EXPECT_NE(obj.find("f 1//1 3//3 2//2\n"), std::string::npos);

  const auto other = write_mesh(mesh, folder / "a.doc");
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().message.find(".stl, .ply or .obj"), std::string::npos);
}

TEST(MeshFile, WhatCannotBeWrittenLeavesNothing) {
  const test::TempDir folder;
  fs::create_directory(folder / "taken.stl");
  put(folder / "taken.stl" / "file", "x");
  EXPECT_FALSE(write_stl(box_mesh(1, 1, 1), folder / "taken.stl"));
  EXPECT_FALSE(write_stl(box_mesh(1, 1, 1), folder / "missing" / "a.stl"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(MeshFile, EveryBadStlIsRefusedWithItsNameAndARemedy) {
  const test::TempDir folder;
  ASSERT_TRUE(write_stl(box_mesh(1, 1, 1), folder / "box.stl"));
  const std::string good = text_of(folder / "box.stl");
  std::string nan = good;
  const float not_a_number = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(nan.data() + 84 + 12, &not_a_number, 4);
  std::string none = good.substr(0, 84);
  std::memset(none.data() + 80, 0, 4);
  const struct {
    std::string bytes, says;
  } cases[] = {
      {"", "empty"},
      {good.substr(0, good.size() - 7), "cut off"},
      {good.substr(0, 40), "not an STL"},
      {"PK\x03\x04 a zip file of some kind or other, longer than the head of a binary STL file is, so that it is "
       "looked at",
       "not an STL"},
      {nan, "not a number"},
      {none, "no triangles"},
      {"solid x\nendsolid x\n", "no triangles"},
      {"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "line 5"},
      {"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 zero 0\n", "line 4"},
      {"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e99 "
       "0\nendloop\nendfacet\nendsolid\n",
       "not a number"},
      {"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 1 1\n",
       "three vertices"},
  };
  for (const auto& bad : cases) {
    put(folder / "bad.stl", bad.bytes);
    const auto mesh = read_stl(folder / "bad.stl");
    ASSERT_FALSE(mesh) << bad.says;
    EXPECT_NE(mesh.error().message.find("bad.stl"), std::string::npos);
    EXPECT_NE(mesh.error().message.find(bad.says), std::string::npos) << mesh.error().message;
    EXPECT_NE(mesh.error().message.find("export"), std::string::npos) << mesh.error().message;
  }
  EXPECT_FALSE(read_stl(folder / "missing.stl"));
  EXPECT_FALSE(read_stl(folder.path()));
}

}  // namespace
}  // namespace osteon
