// Triangle meshes in files: STL (binary, ASCII) in; STL, PLY and OBJ out. Millimetres.
#pragma once
#include <filesystem>

#include "common/core/result.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace osteon {

// Vertices at the same place become one; triangles that then have no area are left out.
[[nodiscard]] Result<TriangleMesh> read_stl(const std::filesystem::path& file);

// Binary STL and PLY (with normals where the mesh has them), OBJ as text. A file appears whole or not at all.
[[nodiscard]] Result<void> write_stl(const TriangleMesh& mesh, const std::filesystem::path& file);
[[nodiscard]] Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& file);
[[nodiscard]] Result<void> write_obj(const TriangleMesh& mesh, const std::filesystem::path& file);
// By the file's ending: .stl, .ply or .obj.
[[nodiscard]] Result<void> write_mesh(const TriangleMesh& mesh, const std::filesystem::path& file);

}  // namespace osteon
