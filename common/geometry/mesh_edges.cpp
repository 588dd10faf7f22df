#include "common/geometry/mesh_edges.hpp"

#include <algorithm>
#include <utility>

namespace osteon {

EdgeFaults edge_faults(const TriangleMesh& mesh) {
  // (lower vertex, upper vertex), and the direction in which a triangle runs along the edge.
  std::vector<std::pair<std::uint64_t, int>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = t[k], b = t[(k + 1) % 3];
      edges.emplace_back(std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1);
    }
  std::ranges::sort(edges);
  EdgeFaults faults;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    int balance = 0;
    for (; end < edges.size() && edges[end].first == edges[i].first; ++end) balance += edges[end].second;
    // Two solids may touch in an edge, which then has four balanced sides.
    if (balance != 0)
      ++faults.open;
    else if (end - i > 2)
      ++faults.non_manifold;
    i = end;
  }
  return faults;
}

std::string to_text(const EdgeFaults& faults) {
  const auto edges = [](std::size_t count, const char* kind) {
    return std::to_string(count) + " " + kind + (count == 1 ? " edge" : " edges");
  };
  std::string text = edges(faults.open, "open");
  if (faults.non_manifold > 0) text += ", " + edges(faults.non_manifold, "non-manifold");
  return text;
}

}  // namespace osteon
