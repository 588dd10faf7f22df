// The surface of an implicit solid as triangles: to draw a tool, to write it as STL, and to spread points on it.
#pragma once
#include <optional>

#include "common/geometry/triangle_mesh.hpp"
#include "common/tools/implicit.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// Dual contouring on cells of `cell_mm`. The result is closed and oriented outwards. It has one vertex in each cell
// that the surface crosses, also on sharp edges and corners. Parts thinner than a cell may be lost.
// T. Ju, F. Losasso, S. Schaefer, J. Warren: Dual contouring of Hermite data. SIGGRAPH 2002.
// `within`: only the triangles in this box, and some beside it. They are the same as without it.
[[nodiscard]] TriangleMesh surface_of(const Implicit& solid, double cell_mm,
                                      const std::optional<Box>& within = std::nullopt);

// The surface of any tool, cutting part and shank. Cells of `resolution_mm`, or smaller if the tool is thin.
[[nodiscard]] TriangleMesh tool_surface(const Tool& tool, double resolution_mm);
// Those of its triangles that lie at the cutting part, and some beside them: for a saw a tenth of them.
[[nodiscard]] TriangleMesh cutting_surface(const Tool& tool, double resolution_mm);
// The largest cell that loses no part of this tool: half of its thinnest wall, plate or thread.
[[nodiscard]] double thinnest_cell_mm(const Tool& tool);

}  // namespace osteon
