// One mesh from the blocks of a surface.
#pragma once
#include <span>

#include "common/surface/mesh_block.hpp"

namespace osteon {

// Joins vertices whose positions have the same bits, as those on the faces between blocks have; the first one's normal
// and cut face are kept. Triangles stay in the order of the blocks.
[[nodiscard]] Mesh weld(std::span<const Mesh> blocks);

}  // namespace osteon
