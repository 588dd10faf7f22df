// The combinatorial part of a block's mesh: from solid samples and seams to vertices and triangles, without positions.
// Server and viewer both compute it, so only what is not in it is sent.
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "common/surface/marching_cubes.hpp"
#include "common/surface/seams.hpp"

namespace osteon {

using SolidRows = std::array<std::array<std::uint32_t, kBlockSamples>, kBlockSamples>;  // [x][y], bit z

// Too large for a stack frame in a loop. Keep one and reuse it.
class Contour {
 public:
  // Vertices are in the order of samples, x slowest, and of axes within a row of samples. Vertices inside a coarse face
  // of a seam are not included: they have moved to the nearer end of their part of the contour.
  void build(const SolidRows& solid, CoveredGroups covered, const SeamRule& seams);

  [[nodiscard]] std::span<const std::uint16_t> vertex_edges() const { return {edge_of_vertex_.data(), vertices_}; }

  // Calls visit(number, x, y, z, axis) for every vertex in that order. Its edge goes from the sample along the axis.
  template <class Visit>
  void for_vertices(Visit visit) const {
    std::size_t vertex = 0;
    for (unsigned x = 0; x < kBlockSamples; ++x)
      for (unsigned y = 0; y < kBlockSamples; ++y)
        for (unsigned axis = 0; axis < 3; ++axis)
          for (std::uint32_t left = edges_[axis][x][y]; left != 0; left &= left - 1)
            visit(vertex++, x, y, static_cast<unsigned>(std::countr_zero(left)), axis);
  }

  // Calls visit(a, b, c) for every triangle that is not collapsed to a line.
  template <class Visit>
  void for_triangles(Visit visit) const {
    const auto& cases = case_triangles();
    for (int x = 0; x < kBlockCells; ++x)
      for (int y = 0; y < kBlockCells; ++y) {
        const std::uint32_t row00 = solid_[x][y], row01 = solid_[x][y + 1];
        const std::uint32_t row10 = solid_[x + 1][y], row11 = solid_[x + 1][y + 1];
        for (std::uint32_t left = cells_[x][y]; left != 0; left &= left - 1) {
          const int z = std::countr_zero(left);
          const unsigned corners =
              (row00 >> z & 3) | (row01 >> z & 3) << 2 | (row10 >> z & 3) << 4 | (row11 >> z & 3) << 6;
          const CaseTriangles& cell = cases[corners];
          const std::uint16_t* at = vertex_of_edge_.data() + sample_number(x, y, z);
          for (std::size_t i = 0; i < cell.corners; i += 3) {
            const std::uint32_t a = at[cell.offsets[i]], b = at[cell.offsets[i + 1]], c = at[cell.offsets[i + 2]];
            if (!collapsed_ || (a != b && b != c && c != a)) visit(a, b, c);
          }
        }
      }
  }

 private:
  using Rows = std::uint32_t[kBlockSamples][kBlockSamples];
  // The triangles of a case. Corners are given as offsets in vertex_of_edge_ from the cell's first sample.
  struct CaseTriangles {
    std::uint16_t corners = 0;
    std::array<std::int16_t, 3 * kCaseTriangles> offsets{};
  };
  static const std::array<CaseTriangles, 256>& case_triangles();
  [[nodiscard]] bool used(int edge) const;
  void collapse(const SeamRule& seams);
  void collapse_face(const std::array<int, 3>& origin, int axis, int cells);

  Rows solid_;
  Rows cells_;     // crossed and drawn cells
  Rows edges_[3];  // crossed edges of drawn cells
  bool collapsed_ = false;
  struct Moved {
    std::uint16_t edge, to;
  };
  std::array<Moved, 6 * 2 * kBlockSamples * kBlockSamples> moved_;  // at most every edge of the six faces
  std::size_t moved_count_ = 0;
  std::size_t vertices_ = 0;
  std::array<std::uint16_t, 3 * kBlockSampleCount> vertex_of_edge_;  // valid where edges_ or moved_ contain the edge
  std::array<std::uint16_t, 3 * kBlockSampleCount> edge_of_vertex_;
};

}  // namespace osteon
