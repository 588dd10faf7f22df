// A tool to look at, made from its definition: drills and round burs as surfaces of revolution carved by flutes, every
// other by its implicit solid.
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

// On the tool's solid or, in flutes, inside of it. Closed; corners on sharp edges are there once for each face.
[[nodiscard]] ToolMesh tool_mesh(const Tool& tool);

}  // namespace osteon
