// Targets for triangle meshes: an STL as a bone and as a tool.
#include <algorithm>
#include <cmath>
#include <string>

#include "common/core/check.hpp"
#include "common/geometry/mesh_file.hpp"
#include "common/volume/mesh_distance.hpp"
#include "tests/fuzz/import_files.hpp"
#include "tests/fuzz/import_targets.hpp"

namespace osteon::fuzz {
namespace {

constexpr double kSide_mm = 10.0;

TriangleMesh a_cube() {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](int axis) { return corner >> axis & 1 ? static_cast<float>(kSide_mm) : 0.0f; };
    mesh.positions_mm.push_back({at(0), at(1), at(2)});
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

Bytes an_ascii_cube() {
  const TriangleMesh mesh = a_cube();
  std::string text = "solid cube\n";
  for (const auto& triangle : mesh.triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t corner : triangle) {
      text += "vertex";
      for (const float value : mesh.positions_mm[corner]) text += ' ' + std::to_string(value);
      text += '\n';
    }
    text += "endloop\nendfacet\n";
  }
  return bytes_of_text(text + "endsolid cube\n");
}

void read_mesh(std::span<const std::uint8_t> data) {
  static const InputFile file("mesh.stl");
  const auto mesh = read_stl(file.write(data));
  if (!mesh) return expect_bounded(mesh.error());
  for (const auto& triangle : mesh->triangles)
    for (const std::uint32_t vertex : triangle) OSTEON_CHECK(vertex < mesh->positions_mm.size());
  // Gives every mesh about the same number of samples, whatever its size.
  const double pitch_mm = std::max(0.5, bounds(*mesh).size_mm().maxCoeff() / 16.0);
  CaseInfo info;
  info.title = "Mesh";
  info.pitch_mm = pitch_mm;
  const auto bone = case_of_mesh(info, *mesh, 1.9, [](double) { return true; });
  if (bone) OSTEON_CHECK(bone->volume_mm3() > 0.0 && std::isfinite(bone->volume_mm3()));
  if (!bone) expect_bounded(bone.error());
  const auto tool = sampled_distance(*mesh, pitch_mm);
  if (!tool) expect_bounded(tool.error());
}

}  // namespace

Target mesh_target() {
  const InputFile file("cube.stl");
  const auto path = file.write({});
  OSTEON_CHECK(write_stl(a_cube(), path));
  Target target{"stl", read_mesh, {bytes_of_file(path), an_ascii_cube()}};
  target.mutations = 100;
  return target;
}

}  // namespace osteon::fuzz
