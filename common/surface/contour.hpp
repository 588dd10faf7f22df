// The combinatorial half of a block's mesh: from solid samples and seams to vertices and triangles, without places.
// Both sides of the wire run it, so only what it cannot know is sent.
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "common/surface/marching_cubes.hpp"
#include "common/surface/seams.hpp"

namespace osteon {

using SolidRows = std::array<std::array<std::uint32_t, kBlockSamples>, kBlockSamples>;  // [x][y], bit z

// Too large for a stack frame in a loop: keep one and use it again.
class Contour {
 public:
  // In the order of samples, x slowest, and of axes within a row. Vertices inside a coarse face of a seam are not
  // among them: they have moved to the nearer end of their piece of the contour.
  void build(const SolidRows& solid, CoveredGroups covered, const SeamRule& seams);

  [[nodiscard]] std::span<const std::uint16_t> vertex_edges() const { return {edge_of_vertex_.data(), vertices_}; }

  // visit(a, b, c) for every triangle that is not shrunk to a line.
  template <class Visit>
  void for_triangles(Visit visit) const {
    const MarchingCubesTable& table = marching_cubes_table();
    for (int x = 0; x < kBlockCells; ++x)
      for (int y = 0; y < kBlockCells; ++y)
        for (std::uint32_t left = cells_[x][y]; left != 0; left &= left - 1) {
          const int z = std::countr_zero(left);
          const auto pair = [&](int dx, int dy) { return solid_[x + dx][y + dy] >> z & 3; };
          const CellCase& cell = table.cases[pair(0, 0) | pair(0, 1) << 2 | pair(1, 0) << 4 | pair(1, 1) << 6];
          const std::uint16_t* at = vertex_of_edge_.data() + sample_number(x, y, z);
          for (std::size_t i = 0; i < cell.corners; i += 3) {
            const std::uint32_t a = at[offsets()[cell.edges[i]]], b = at[offsets()[cell.edges[i + 1]]],
                                c = at[offsets()[cell.edges[i + 2]]];
            if (!collapsed_ || (a != b && b != c && c != a)) visit(a, b, c);
          }
        }
  }

 private:
  using Rows = std::uint32_t[kBlockSamples][kBlockSamples];
  static const std::array<std::int32_t, kCellEdges>& offsets();
  [[nodiscard]] bool used(int edge) const;
  void collapse(const SeamRule& seams);
  void collapse_face(const std::array<int, 3>& origin, int axis, int cells);

  Rows solid_;
  Rows cells_;     // crossed and drawn
  Rows edges_[3];  // crossed edges of drawn cells
  bool collapsed_ = false;
  struct Moved {
    std::uint16_t edge, to;
  };
  std::array<Moved, 6 * 2 * kBlockSamples * kBlockSamples> moved_;  // at most every edge of the six faces
  std::size_t moved_count_ = 0;
  std::size_t vertices_ = 0;
  std::array<std::uint16_t, 3 * kBlockSampleCount> vertex_of_edge_;  // where edges_ or moved_ name the edge
  std::array<std::uint16_t, 3 * kBlockSampleCount> edge_of_vertex_;
};

}  // namespace osteon
