// A tool to look at, made from its definition: a surface of revolution whose cutting part is carved by flutes.
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

// Nowhere outside the tool's solid; the flutes' lands lie on it.
[[nodiscard]] ToolMesh tool_mesh(const Tool& tool);

}  // namespace osteon
