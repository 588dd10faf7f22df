// Triangle meshes in files. Reads STL (binary, ASCII). Writes STL, PLY and OBJ. Millimetres.
#pragma once
#include <filesystem>

#include "common/core/result.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace osteon {

// Vertices at the same position become one. Triangles that then have no area are left out.
[[nodiscard]] Result<TriangleMesh> read_stl(const std::filesystem::path& file);

// Binary STL and PLY (with normals if the mesh has them), OBJ as text. A file is written completely or not at all.
[[nodiscard]] Result<void> write_stl(const TriangleMesh& mesh, const std::filesystem::path& file);
[[nodiscard]] Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& file);
[[nodiscard]] Result<void> write_obj(const TriangleMesh& mesh, const std::filesystem::path& file);
// By the file name's extension: .stl, .ply or .obj.
[[nodiscard]] Result<void> write_mesh(const TriangleMesh& mesh, const std::filesystem::path& file);

}  // namespace osteon
