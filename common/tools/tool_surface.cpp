#include "common/tools/tool_surface.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "common/core/check.hpp"
#include "common/geometry/coord_map.hpp"
#include "common/tools/tool_solid.hpp"

namespace osteon {
namespace {

// Where parts touch face to face, the distance is zero inside. Points this near still count as inside.
constexpr double kInside_mm = 1e-7;
// An edge or corner whose planes differ by less than this fraction counts as smooth (relative eigenvalue).
constexpr double kFlat = 0.02;
constexpr double kEverywhere_mm = 1e12;

// A cell's edge or vertex that has none.
constexpr std::uint32_t kNone = ~0u;
constexpr int kBlockShift = 3, kBlockCells = 1 << kBlockShift;

// What is known at the lower corners of 8³ cells: neighbours are read together, so they lie together.
struct CellBlock {
  static constexpr std::size_t kCount = kBlockCells * kBlockCells * kBlockCells;
  std::array<double, kCount> distance;                        // NaN: not computed yet
  std::array<std::array<std::uint32_t, kCount>, 3> crossing;  // of the surface with the edge along each axis
  std::array<std::uint32_t, kCount> vertex;                   // in this cell
  CellBlock() {
    distance.fill(std::numeric_limits<double>::quiet_NaN());
    for (auto& along : crossing) along.fill(kNone);
    vertex.fill(kNone);
  }
};

// The cells near the surface, found by bisecting a box. With a 1-Lipschitz distance, a box is skipped if the distance
// at its middle exceeds half its diagonal.
class Grid {
 public:
  Grid(const Implicit& solid, double cell_mm, const std::optional<Box>& within) : solid_(solid), cell_(cell_mm) {
    // Shifted from the origin by an irrational fraction, so that faces of a tool do not lie in the grid's planes.
    origin_ = solid.bounds.min_mm - Vec3(1.317, 1.271, 1.413) * cell_mm;
    const Vec3 size = solid.bounds.max_mm - origin_;
    int largest = 1;
    for (int k = 0; k < 3; ++k) largest = std::max(largest, static_cast<int>(std::ceil(size[k] / cell_mm)) + 2);
    int span = 1;
    while (span < largest) span *= 2;
    limit_ = Coord{static_cast<std::int32_t>(size.x() / cell_mm) + 2, static_cast<std::int32_t>(size.y() / cell_mm) + 2,
                   static_cast<std::int32_t>(size.z() / cell_mm) + 2};
    if (within) wanted_ = *within;
    halve({0, 0, 0}, span);
  }

  [[nodiscard]] const std::vector<Coord>& cells() const { return cells_; }
  [[nodiscard]] Vec3 place(Coord c) const { return origin_ + cell_ * Vec3(c.x, c.y, c.z); }
  double value(Coord c) {
    double& value = block(c).distance[within_block(c)];
    if (std::isnan(value)) value = solid_(place(c)) - kInside_mm;
    return value;
  }
  // Of the cell with this lower corner: the number of the crossing along an axis, and of the vertex.
  std::uint32_t& crossing_at(Coord c, std::size_t axis) { return block(c).crossing[axis][within_block(c)]; }
  std::uint32_t& vertex_at(Coord c) { return block(c).vertex[within_block(c)]; }
  bool inside(Coord c) { return value(c) < 0.0; }
  [[nodiscard]] double cell_mm() const { return cell_; }

  // The crossing of the surface with the edge between two corners.
  Vec3 crossing(Coord a, Coord b) {
    Vec3 pa = place(a), pb = place(b);
    double fa = value(a), fb = value(b);
    for (int i = 0; i < 40 && (pb - pa).norm() > 1e-7 * cell_; ++i) {
      // Secant and bisection alternate: one is fast, the other reliable.
      const double t = i % 2 == 0 ? std::clamp(fa / (fa - fb), 0.02, 0.98) : 0.5;
      Vec3 p = pa + t * (pb - pa);  // not constant, so that it is moved out
      const double f = solid_(p) - kInside_mm;
      if (std::abs(f) < 1e-9) return p;
      if ((f < 0.0) == (fa < 0.0)) {
        pa = p;
        fa = f;
      } else {
        pb = p;
        fb = f;
      }
    }
    return 0.5 * (pa + pb);
  }

 private:
  void halve(Coord at, int span) {
    if (at.x > limit_.x || at.y > limit_.y || at.z > limit_.z) return;
    const double half = 0.5 * span * cell_;
    const Vec3 middle = place(at) + Vec3::Constant(half);
    if (((middle - wanted_.max_mm).array() > half).any() || ((wanted_.min_mm - middle).array() > half).any()) return;
    if (std::abs(solid_(middle)) > 1.7321 * half + 1e-6) return;
    if (span == 1) {
      cells_.push_back(at);
      return;
    }
    const int next = span / 2;
    for (int i = 0; i < 8; ++i) halve(at + Coord{(i >> 2) * next, ((i >> 1) & 1) * next, (i & 1) * next}, next);
  }

  static std::size_t within_block(Coord c) {
    const auto along = [](std::int32_t at) { return static_cast<std::size_t>(at & (kBlockCells - 1)); };
    return (along(c.x) * kBlockCells + along(c.y)) * kBlockCells + along(c.z);
  }
  CellBlock& block(Coord c) {
    const Coord index = shift_down(c, kBlockShift);
    if (last_ && index == last_index_) return *last_;
    std::unique_ptr<CellBlock>& found = blocks_[index];
    if (!found) found = std::make_unique<CellBlock>();
    last_index_ = index;
    last_ = found.get();
    return *last_;
  }

  const Implicit& solid_;
  double cell_;
  Vec3 origin_;
  Coord limit_;
  Box wanted_{Vec3::Constant(-kEverywhere_mm), Vec3::Constant(kEverywhere_mm)};
  std::vector<Coord> cells_;
  CoordMap<std::unique_ptr<CellBlock>> blocks_;
  Coord last_index_;
  CellBlock* last_ = nullptr;
};

constexpr std::array<Coord, 3> kSteps{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

// The corners of a cell by number: one bit for each axis.
constexpr std::size_t bit_of_axis(std::size_t axis) { return std::size_t{1} << axis; }
constexpr Coord corner_of_cell(std::size_t number) {
  const auto along = [number](std::size_t axis) { return number & bit_of_axis(axis) ? 1 : 0; };
  return {along(0), along(1), along(2)};
}

// The point nearest to all planes through the crossings, starting from their middle. It does not move along directions
// that the planes do not determine.
Vec3 feature(const std::vector<Vec3>& points, const std::vector<Vec3>& normals) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : points) middle += p / static_cast<double>(points.size());
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Vec3 right = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    squares += normals[i] * normals[i].transpose();
    right += normals[i] * normals[i].dot(points[i] - middle);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(squares);
  const double largest = solver.eigenvalues()[2];
  Vec3 shift = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    if (solver.eigenvalues()[k] > kFlat * largest) {
      const Vec3 along = solver.eigenvectors().col(k);
      shift += along * (along.dot(right) / solver.eigenvalues()[k]);
    }
  return middle + shift;
}

}  // namespace

TriangleMesh surface_of(const Implicit& solid, double cell_mm, const std::optional<Box>& within) {
  OSTEON_CHECK(cell_mm > 0.0);
  Grid grid(solid, cell_mm, within);
  struct Crossing {
    Vec3 point, normal;
  };
  std::vector<Crossing> crossings;
  std::vector<Coord> crossed;
  TriangleMesh mesh;
  std::vector<Vec3> points, normals;
  for (const Coord& cell : grid.cells()) {
    std::array<bool, 8> inside{};
    for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = grid.inside(cell + corner_of_cell(i));
    if (std::ranges::count(inside, inside[0]) == 8) continue;
    crossed.push_back(cell);
    points.clear();
    normals.clear();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t along = bit_of_axis(k), u = bit_of_axis((k + 1) % 3), v = bit_of_axis((k + 2) % 3);
      for (const std::size_t from : {std::size_t{0}, u, v, u + v}) {
        if (inside[from] == inside[from + along]) continue;
        const Coord at = cell + corner_of_cell(from);
        if (grid.crossing_at(at, k) == kNone) {
          const Vec3 p = grid.crossing(at, at + kSteps[k]);
          grid.crossing_at(at, k) = static_cast<std::uint32_t>(crossings.size());
          crossings.push_back({p, gradient(solid, p)});
        }
        const Crossing& crossing = crossings[grid.crossing_at(at, k)];
        points.push_back(crossing.point);
        normals.push_back(crossing.normal);
      }
    }
    // A vertex outside its cell could fold the surface over.
    const Vec3 low = grid.place(cell), high = grid.place(cell + Coord{1, 1, 1});
    Vec3 p = feature(points, normals).cwiseMax(low).cwiseMin(high);
    // On a curved face the planes meet beside the surface, so the point is projected onto it again.
    if (const double off = solid(p); std::abs(off) > 1e-4 * cell_mm)
      p = (p - off * gradient(solid, p)).cwiseMax(low).cwiseMin(high);
    grid.vertex_at(cell) = static_cast<std::uint32_t>(mesh.positions_mm.size());
    mesh.positions_mm.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  }
  // Each crossed edge joins the vertices of its four cells, in the order of the cells, so that files are reproducible.
  for (const Coord& cell : crossed)
    for (std::size_t k = 0; k < 3; ++k) {
      if (grid.crossing_at(cell, k) == kNone) continue;
      const Coord u = kSteps[(k + 1) % 3], v = kSteps[(k + 2) % 3];
      const std::array<Coord, 4> around{cell - u - v, cell - v, cell, cell - u};
      std::array<std::uint32_t, 4> corner{};
      for (std::size_t i = 0; i < 4; ++i) corner[i] = grid.vertex_at(around[i]);
      if (std::ranges::find(corner, kNone) != corner.end()) {
        OSTEON_CHECK(within);  // only the edge of the box may cut cells off
        continue;
      }
      if (!grid.inside(cell)) std::swap(corner[1], corner[3]);
      // Along the shorter diagonal.
      const auto length2 = [&](std::size_t a, std::size_t b) {
        return (position(mesh, corner[a]) - position(mesh, corner[b])).squaredNorm();
      };
      if (length2(0, 2) <= length2(1, 3)) {
        mesh.triangles.push_back({corner[0], corner[1], corner[2]});
        mesh.triangles.push_back({corner[0], corner[2], corner[3]});
      } else {
        mesh.triangles.push_back({corner[0], corner[1], corner[3]});
        mesh.triangles.push_back({corner[1], corner[2], corner[3]});
      }
    }
  return mesh;
}

double thinnest_cell_mm(const Tool& tool) {
  double thinnest = std::numeric_limits<double>::infinity();
  const auto at_least = [&](double mm) { thinnest = std::min(thinnest, mm); };
  if (tool.kind != ToolKind::mesh) {
    const Vec3 size = local_bounds(tool).size_mm();
    at_least(size.minCoeff());
    if (tool.shank_diameter_mm > 0.0) at_least(tool.shank_diameter_mm);
  }
  switch (tool.kind) {
    case ToolKind::oscillating_saw:
    case ToolKind::reciprocating_saw:
    case ToolKind::trial_cup:
      at_least(tool.thickness_mm);
      break;
    case ToolKind::outside_reamer:
      at_least(0.5 * (tool.diameter_mm - tool.bore_mm));
      at_least(tool.thickness_mm);
      break;
    case ToolKind::drill_sleeve:
      at_least(0.5 * (tool.diameter_mm - tool.bore_mm));
      break;
    case ToolKind::distal_block:
    case ToolKind::four_in_one_block:
      at_least(tool.bore_mm);
      at_least(tool.diameter_mm);
      break;
    case ToolKind::screw:
      at_least(tool.core_diameter_mm);
      at_least(0.5 * tool.thread_pitch_mm);
      at_least(tool.diameter_mm - tool.core_diameter_mm);
      break;
    case ToolKind::broach:
    case ToolKind::trial_stem:
      at_least(std::min(tool.width_mm, tool.thickness_mm) - 2.0 * tool.cutting_length_mm * std::tan(tool.taper_rad));
      break;
    case ToolKind::contoured_burr:
      at_least(2.0 * end_radius_mm(tool));
      break;
    case ToolKind::mesh:
      at_least(2.0 * tool.mesh->pitch * kQuantum_mm);
      break;
    default:
      break;
  }
  return 0.5 * thinnest;
}

TriangleMesh tool_surface(const Tool& tool, double resolution_mm) {
  return surface_of(tool_solid(tool), std::min(resolution_mm, thinnest_cell_mm(tool)));
}

TriangleMesh cutting_surface(const Tool& tool, double resolution_mm) {
  const double cell_mm = std::min(resolution_mm, thinnest_cell_mm(tool));
  // A triangle and its neighbours' vertices lie in cells beside it.
  return surface_of(tool_solid(tool), cell_mm, cutting_part(tool).bounds.grown(4.0 * cell_mm));
}

}  // namespace osteon
