// Finds and describes faults in the edges of a surface.
#pragma once
#include <string>

#include "common/geometry/triangle_mesh.hpp"

namespace osteon {

struct EdgeFaults {
  std::size_t open = 0;          // open_edges()
  std::size_t non_manifold = 0;  // edges of more than two triangles that are not open: parts of the surface touch there
  friend bool operator==(const EdgeFaults&, const EdgeFaults&) = default;
};

[[nodiscard]] EdgeFaults edge_faults(const TriangleMesh& mesh);
// "0 open edges", or "0 open edges, 1 non-manifold edge" if there are any.
[[nodiscard]] std::string to_text(const EdgeFaults& faults);

}  // namespace osteon
