// A mesh to draw a tool, made from its definition. Drills and round burs are surfaces of revolution with flutes. All
// other tools are made from their implicit solid.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon {

struct ToolMesh {
  std::vector<std::array<float, 3>> positions_mm;  // tool frame: tip at the origin, +z out of the tip
  std::vector<std::array<float, 3>> normals;       // out of the tool
  std::vector<std::uint8_t> cutting;               // 1 on the cutting part
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Vertices lie on the tool's solid or, in flutes, inside it. The mesh is closed. A corner on a sharp edge has one
// vertex for each face.
[[nodiscard]] ToolMesh tool_mesh(const Tool& tool);

}  // namespace osteon
