#include "common/tools/spread_points.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

namespace osteon {
namespace {

constexpr int kCandidatesPerPoint = 12;
constexpr int kMostCandidates = 200'000;
// Distance from an edge: a point this much deeper must still be clearly inside.
constexpr double kProbe_mm = 0.05;
// Normals that differ by more than this are on different sides of something thin.
constexpr double kOtherSide = -0.3;

struct Candidate {
  Vec3 point, outward;
  bool on_edge;
};

// Moves a point of the mesh onto the solid. Nothing if that does not converge, as beside a sharp inner corner.
std::optional<Candidate> settled(const Implicit& solid, Vec3 p) {
  Vec3 outward = gradient(solid, p);
  double off = solid(p);
  for (int i = 0; i < 8 && std::abs(off) > 1e-10; ++i) {
    p -= off * outward;
    off = solid(p);
    outward = gradient(solid, p);
  }
  if (std::abs(off) > 1e-10) return std::nullopt;
  const bool on_edge =
      solid(p - kProbe_mm * outward) > -0.6 * kProbe_mm || solid(p + kProbe_mm * outward) < 0.6 * kProbe_mm;
  return Candidate{p, outward, on_edge};
}

// Finds candidates near a place: a box of cells at least as wide as the reach. What is within reach of a place lies in
// the 27 cells around it.
class NearCandidates {
 public:
  NearCandidates(const std::vector<Candidate>& all, double reach_mm) : all_(all), cell_mm_(reach_mm) {
    Vec3 most = all.front().point;
    least_ = most;
    for (const Candidate& candidate : all) {
      least_ = least_.cwiseMin(candidate.point);
      most = most.cwiseMax(candidate.point);
    }
    const Vec3 size = most - least_;
    // A long thin tool with a small reach must not need more memory than this.
    constexpr double kMostCells = 1 << 20;
    const auto cells = [&](int axis) { return std::floor(size[axis] / cell_mm_) + 3.0; };
    while (cells(0) * cells(1) * cells(2) > kMostCells) cell_mm_ *= 1.25;
    // A margin of one cell on either side, so that each cell of a candidate has 26 neighbours.
    for (int axis = 0; axis < 3; ++axis) cells_[static_cast<std::size_t>(axis)] = static_cast<std::size_t>(cells(axis));
    first_.assign(cells_[0] * cells_[1] * cells_[2], kNone);
    next_.assign(all.size(), kNone);
  }
  void add(std::uint32_t index) {
    std::uint32_t& first = first_[cell_of(all_[index].point)];
    next_[index] = std::exchange(first, index);
  }
  // Calls `visit(index)` for each added candidate in the 27 cells until it returns true. Returns whether it did. The
  // middle cell comes first, because it holds most of what is within reach.
  template <class Visit>
  bool any(const Vec3& p, const Visit& visit) const {
    const std::size_t corner = cell_of(p) - (cells_[1] + 1) * cells_[2] - 1;
    constexpr std::size_t kMiddleFirst[] = {1, 0, 2};
    for (const std::size_t x : kMiddleFirst)
      for (const std::size_t y : kMiddleFirst)
        for (const std::size_t z : kMiddleFirst)
          for (std::uint32_t i = first_[corner + (x * cells_[1] + y) * cells_[2] + z]; i != kNone; i = next_[i])
            if (visit(i)) return true;
    return false;
  }
  [[nodiscard]] double reach_mm() const { return cell_mm_; }

 private:
  static constexpr std::uint32_t kNone = ~0u;
  [[nodiscard]] std::size_t cell_of(const Vec3& p) const {
    const Vec3 at = (p - least_) / cell_mm_;
    const auto along = [&](int axis) { return static_cast<std::size_t>(at[axis]) + 1; };
    return (along(0) * cells_[1] + along(1)) * cells_[2] + along(2);
  }

  const std::vector<Candidate>& all_;
  double cell_mm_;
  Vec3 least_;
  std::array<std::size_t, 3> cells_{};
  std::vector<std::uint32_t> first_, next_;
};

bool same_side(const Candidate& a, const Candidate& b) { return a.outward.dot(b.outward) > kOtherSide; }

std::vector<std::uint32_t> kept_at(const std::vector<Candidate>& candidates, const std::vector<std::uint32_t>& order,
                                   double radius_mm) {
  std::vector<std::uint32_t> kept;
  NearCandidates near(candidates, radius_mm);
  for (const std::uint32_t index : order) {
    const Candidate& candidate = candidates[index];
    if (candidate.on_edge) continue;
    const bool taken = near.any(candidate.point, [&](std::uint32_t other) {
      return (candidates[other].point - candidate.point).squaredNorm() < radius_mm * radius_mm &&
             same_side(candidates[other], candidate);
    });
    if (taken) continue;
    near.add(index);
    kept.push_back(index);
  }
  return kept;
}

// The kept candidate that each candidate belongs to: the nearest one on its side of something thin, the first in `kept`
// of equals. One on the other side only where its own side has none.
std::vector<std::size_t> owners(const std::vector<Candidate>& candidates, const std::vector<std::uint32_t>& kept,
                                double radius_mm) {
  std::vector<std::size_t> rank(candidates.size());
  NearCandidates near(candidates, radius_mm);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    rank[kept[i]] = i;
    near.add(kept[i]);
  }
  std::vector<std::size_t> result;
  result.reserve(candidates.size());
  for (const Candidate& candidate : candidates) {
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t owner = 0;
    const auto consider = [&](std::size_t i, bool other_side) {
      constexpr double kFar_mm2 = 1e6;
      const double distance =
          (candidates[kept[i]].point - candidate.point).squaredNorm() + (other_side ? kFar_mm2 : 0.0);
      if (distance < nearest || (distance == nearest && i < owner)) {
        nearest = distance;
        owner = i;
      }
    };
    near.any(candidate.point, [&](std::uint32_t other) {
      if (same_side(candidates[other], candidate)) consider(rank[other], false);
      return false;
    });
    // A nearer one can only be in those cells if this one is within their reach.
    if (nearest >= near.reach_mm() * near.reach_mm())
      for (std::size_t i = 0; i < kept.size(); ++i) consider(i, !same_side(candidates[kept[i]], candidate));
    result.push_back(owner);
  }
  return result;
}

}  // namespace

std::vector<SamplePoint> spread_points(const Implicit& solid, const TriangleMesh& surface,
                                       const std::function<bool(const Vec3& p, const Vec3& outward)>& belongs,
                                       const Spread& spread) {
  struct Piece {
    Vec3 a, ab, ac;
    double until_mm2;  // area of this triangle and all before it
  };
  std::vector<Piece> pieces;
  double area = 0.0;
  for (const auto& [ia, ib, ic] : surface.triangles) {
    const Vec3 a = position(surface, ia), ab = position(surface, ib) - a, ac = position(surface, ic) - a;
    const Vec3 across = ab.cross(ac);
    const double twice = across.norm();
    if (twice <= 0.0 || !belongs(a + (ab + ac) / 3.0, across / twice)) continue;
    area += 0.5 * twice;
    pieces.push_back({a, ab, ac, area});
  }
  if (pieces.empty()) return {};

  // In the densest packing of equal circles, each covers sqrt(3)/2 of its spacing squared.
  const double wanted = spread.count > 0
                            ? spread.count
                            : std::max(1.0, area / (0.5 * std::sqrt(3.0) * spread.spacing_mm * spread.spacing_mm));
  const int number =
      std::min(kMostCandidates, kCandidatesPerPoint * static_cast<int>(std::ceil(std::min(wanted, 1e6))) + 64);
  std::vector<Candidate> candidates;
  std::size_t piece = 0;
  for (int i = 0; i < number; ++i) {
    const double at = (i + 0.5) / number * area;
    while (piece + 1 < pieces.size() && pieces[piece].until_mm2 < at) ++piece;
    // The additive sequence of the plastic number fills a triangle evenly.
    double u = std::fmod(0.5 + 0.7548776662466927 * i, 1.0), v = std::fmod(0.5 + 0.5698402909980532 * i, 1.0);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    if (const auto candidate = settled(solid, pieces[piece].a + u * pieces[piece].ab + v * pieces[piece].ac))
      candidates.push_back(*candidate);
  }
  if (candidates.empty()) return {};

  // A shuffled order over the surface, the same everywhere, by a multiplicative generator.
  std::vector<std::uint32_t> order(candidates.size());
  std::iota(order.begin(), order.end(), 0u);
  std::uint64_t state = 0x9e3779b97f4a7c15u;
  for (std::size_t i = order.size(); i > 1; --i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    std::swap(order[i - 1], order[(state >> 33) % i]);
  }
  double radius = spread.count > 0 ? std::sqrt(2.0 / std::sqrt(3.0) * area / spread.count) : spread.spacing_mm;
  std::vector<std::uint32_t> kept = kept_at(candidates, order, radius);
  const auto possible = static_cast<std::size_t>(std::ranges::count(candidates, false, &Candidate::on_edge));
  while (kept.size() < std::min(possible, static_cast<std::size_t>(spread.count))) {
    radius *= 0.97;
    kept = kept_at(candidates, order, radius);
  }
  if (kept.empty()) kept.push_back(order.front());  // all are on edges, and one point is better than none

  std::vector<SamplePoint> points;
  for (const std::uint32_t index : kept)
    points.push_back({candidates[index].point, -candidates[index].outward, 0.0, false});
  const double share = area / static_cast<double>(candidates.size());
  for (const std::size_t owner : owners(candidates, kept, radius)) points[owner].area_mm2 += share;
  return points;
}

}  // namespace osteon
