// Joins the blocks of a surface to one mesh.
#pragma once
#include <span>

#include "common/surface/mesh_block.hpp"

namespace osteon {

// Joins vertices whose positions have the same bits, such as those on the faces between blocks. The normal and cut face
// of the first one are kept. Triangles stay in the order of the blocks.
[[nodiscard]] Mesh weld(std::span<const Mesh> blocks);

}  // namespace osteon
