#include "common/surface/contour.hpp"

namespace osteon {
namespace {

constexpr int kN = kBlockSamples;

// Cells of row (x, y) that no finer level draws.
std::uint32_t drawn_cells(CoveredGroups covered, int x, int y) {
  const auto groups = static_cast<unsigned>(covered >> ((x / 4 * 4 + y / 4) * 4)) & 15u;
  std::uint32_t drawn = 0;
  for (unsigned g = 0; g < 4; ++g)
    if ((groups >> g & 1u) == 0) drawn |= 15u << (4 * g);
  return drawn;
}

}  // namespace

const std::array<Contour::CaseTriangles, 256>& Contour::case_triangles() {
  static const auto made = [] {
    const MarchingCubesTable& table = marching_cubes_table();
    std::array<CaseTriangles, 256> all{};
    for (std::size_t c = 0; c < all.size(); ++c) {
      all[c].corners = table.cases[c].corners;
      for (std::size_t i = 0; i < table.cases[c].corners; ++i) {
        const CellEdge edge = table.edges[table.cases[c].edges[i]];
        all[c].offsets[i] = static_cast<std::int16_t>(
            edge.axis * kBlockSampleCount + sample_number(edge.corner >> 2 & 1, edge.corner >> 1 & 1, edge.corner & 1));
      }
    }
    return all;
  }();
  return made;
}

bool Contour::used(int edge) const {
  const int sample = edge % kBlockSampleCount;
  return (edges_[edge / kBlockSampleCount][sample / kSampleStride[0]][sample / kN % kN] >> (sample % kN) & 1) != 0;
}

void Contour::build(const SolidRows& solid, CoveredGroups covered, const SeamRule& seams) {
  for (int x = 0; x < kN; ++x)
    for (int y = 0; y < kN; ++y) solid_[x][y] = solid[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)];
  const std::uint32_t all_cells = (1u << kBlockCells) - 1;
  for (int x = 0; x < kBlockCells; ++x)
    for (int y = 0; y < kBlockCells; ++y) {
      const std::uint32_t a = solid_[x][y], b = solid_[x][y + 1], c = solid_[x + 1][y], d = solid_[x + 1][y + 1];
      const std::uint32_t any = a | b | c | d, all = a & b & c & d;
      cells_[x][y] = (any | any >> 1) & ~(all & all >> 1) & all_cells;
      if (covered != 0) cells_[x][y] &= drawn_cells(covered, x, y);
    }
  for (int x = 0; x < kN; ++x)
    for (int y = 0; y < kN; ++y) {
      const std::uint32_t row = solid_[x][y];
      edges_[0][x][y] = x + 1 < kN ? row ^ solid_[x + 1][y] : 0;
      edges_[1][x][y] = y + 1 < kN ? row ^ solid_[x][y + 1] : 0;
      edges_[2][x][y] = (row ^ row >> 1) & all_cells;
    }
  if (covered != 0) {
    // Only edges of drawn cells. The cells of a crossed edge are crossed, so testing crossed cells is enough.
    const auto cells = [&](int x, int y) {
      return x >= 0 && y >= 0 && x < kBlockCells && y < kBlockCells ? cells_[x][y] : 0u;
    };
    const auto both = [](std::uint32_t row) { return row | row << 1; };  // samples of the cells in a row
    for (int x = 0; x < kN; ++x)
      for (int y = 0; y < kN; ++y) {
        edges_[0][x][y] &= both(cells(x, y) | cells(x, y - 1));
        edges_[1][x][y] &= both(cells(x, y) | cells(x - 1, y));
        edges_[2][x][y] &= cells(x, y) | cells(x - 1, y) | cells(x, y - 1) | cells(x - 1, y - 1);
      }
  }

  moved_count_ = 0;
  collapsed_ = seams.any();
  if (collapsed_) collapse(seams);
  vertices_ = 0;
  for (int x = 0; x < kN; ++x)
    for (int y = 0; y < kN; ++y)
      for (int axis = 0; axis < 3; ++axis) {
        const int first = axis * kBlockSampleCount + sample_number(x, y, 0);
        for (std::uint32_t left = edges_[axis][x][y]; left != 0; left &= left - 1) {
          const int edge = first + std::countr_zero(left);
          vertex_of_edge_[static_cast<std::size_t>(edge)] = static_cast<std::uint16_t>(vertices_);
          edge_of_vertex_[vertices_++] = static_cast<std::uint16_t>(edge);
        }
      }
  for (std::size_t i = 0; i < moved_count_; ++i) vertex_of_edge_[moved_[i].edge] = vertex_of_edge_[moved_[i].to];
}

void Contour::collapse(const SeamRule& seams) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const int side : {0, kBlockCells})
      for (int i = 0; i < 4; ++i) {
        // A quarter of the face. If the coarse cell is as large as the block, its first quarter represents all.
        std::array<int, 3> place{};
        place[static_cast<std::size_t>(axis)] = side / 4;
        place[static_cast<std::size_t>(u)] = 1 + 2 * (i / 2);
        place[static_cast<std::size_t>(v)] = 1 + 2 * (i % 2);
        const int steps = seams.steps(place[0], place[1], place[2]);
        if (steps == 0) continue;
        const int cells = 1 << steps;
        for (int a = i / 2 * 8; a < i / 2 * 8 + 8; a += cells)
          for (int b = i % 2 * 8; b < i % 2 * 8 + 8; b += cells) {
            if (a % cells != 0 || b % cells != 0) continue;
            std::array<int, 3> origin{};
            origin[static_cast<std::size_t>(axis)] = side;
            origin[static_cast<std::size_t>(u)] = a;
            origin[static_cast<std::size_t>(v)] = b;
            collapse_face(origin, axis, cells);
          }
      }
  }
}

// Follows the contour through the fine faces of one coarse face from each of its ends. Moves the vertices in between to
// the nearer end.
void Contour::collapse_face(const std::array<int, 3>& origin, int axis, int cells) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const int first = sample_number(origin[0], origin[1], origin[2]);
  const int du = kSampleStride[static_cast<std::size_t>(u)], dv = kSampleStride[static_cast<std::size_t>(v)];
  const auto solid = [&](int i, int j) {
    const int s = first + i * du + j * dv;
    return (solid_[s / kSampleStride[0]][s / kN % kN] >> (s % kN) & 1) != 0;
  };
  // Edge k of fine face (i, j) lies between its corners k and k + 1: below, right, above, left.
  const auto corner = [&](int i, int j, int k) { return solid(i + (k == 1 || k == 2), j + (k == 2 || k == 3)); };
  const auto crossed = [&](int i, int j, int k) { return corner(i, j, k) != corner(i, j, (k + 1) & 3); };
  const auto number = [&](int i, int j, int k) {
    const int at = first + (i + (k == 1)) * du + (j + (k == 2)) * dv;
    return at + (k % 2 == 0 ? u : v) * kBlockSampleCount;
  };
  std::array<std::uint16_t, 2 * kN * kN> path;  // more than the number of edges in a face

  const auto follow = [&](int i, int j, int k) {
    std::size_t length = 0;
    while (true) {
      path[length++] = static_cast<std::uint16_t>(number(i, j, k));
      int out = -1;
      if (crossed(i, j, 0) && crossed(i, j, 1) && crossed(i, j, 2) && crossed(i, j, 3))
        out = corner(i, j, k) ? (k + 3) & 3 : (k + 1) & 3;  // the other edge of the solid corner
      else
        for (int other = 0; other < 4; ++other)
          if (other != k && crossed(i, j, other)) out = other;
      i += (out == 1) - (out == 3);
      j += (out == 2) - (out == 0);
      k = (out + 2) & 3;
      if (i < 0 || j < 0 || i >= cells || j >= cells) {
        // The same edge, seen from the fine face on the other side.
        path[length++] = static_cast<std::uint16_t>(number(i, j, k));
        return length;
      }
    }
  };
  const auto start = [&](int i, int j, int k) {
    if (!crossed(i, j, k)) return;
    const std::size_t length = follow(i, j, k);
    if (path[0] > path[length - 1]) return;  // the path was already followed from its other end
    for (std::size_t p = 1; p + 1 < length; ++p) {
      const int edge = path[p], to = 2 * p < length ? path[0] : path[length - 1];
      if (!used(edge) || !used(to)) continue;
      const int s = edge % kBlockSampleCount;
      edges_[edge / kBlockSampleCount][s / kSampleStride[0]][s / kN % kN] &= ~(1u << (s % kN));
      moved_[moved_count_++] = {static_cast<std::uint16_t>(edge), static_cast<std::uint16_t>(to)};
    }
  };
  for (int i = 0; i < cells; ++i) {
    start(i, 0, 0);
    start(i, cells - 1, 2);
    start(0, i, 3);
    start(cells - 1, i, 1);
  }
}

}  // namespace osteon
