#include "common/tools/spread_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <unordered_map>

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

// Kept points in cells as wide as the radius. Near points are in the 27 cells around.
class Neighbours {
 public:
  Neighbours(const std::vector<Candidate>& all, double cell_mm) : all_(all), cell_(cell_mm) {}
  void add(std::uint32_t index) { cells_[cell_of(all_[index].point)].push_back(index); }
  [[nodiscard]] bool taken(const Candidate& candidate, double radius_mm) const {
    const Coord middle = cell_of(candidate.point);
    for (int i = 0; i < 27; ++i) {
      const auto found = cells_.find(middle + Coord{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1});
      if (found == cells_.end()) continue;
      for (const std::uint32_t index : found->second)
        if ((all_[index].point - candidate.point).squaredNorm() < radius_mm * radius_mm &&
            all_[index].outward.dot(candidate.outward) > kOtherSide)
          return true;
    }
    return false;
  }

 private:
  [[nodiscard]] Coord cell_of(const Vec3& p) const {
    return {static_cast<std::int32_t>(std::floor(p.x() / cell_)), static_cast<std::int32_t>(std::floor(p.y() / cell_)),
            static_cast<std::int32_t>(std::floor(p.z() / cell_))};
  }
  const std::vector<Candidate>& all_;
  double cell_;
  std::unordered_map<Coord, std::vector<std::uint32_t>, CoordHash> cells_;
};

std::vector<std::uint32_t> kept_at(const std::vector<Candidate>& candidates, const std::vector<std::uint32_t>& order,
                                   double radius_mm) {
  std::vector<std::uint32_t> kept;
  Neighbours near(candidates, radius_mm);
  for (const std::uint32_t index : order)
    if (!candidates[index].on_edge && !near.taken(candidates[index], radius_mm)) {
      near.add(index);
      kept.push_back(index);
    }
  return kept;
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
  for (const Candidate& candidate : candidates) {
    double nearest = std::numeric_limits<double>::infinity();
    SamplePoint* owner = nullptr;
    for (SamplePoint& point : points) {
      // A point on the other side does not represent this one while there is another.
      const bool other_side = -point.inward.dot(candidate.outward) <= kOtherSide;
      const double distance = (point.position_mm - candidate.point).squaredNorm() + (other_side ? 1e6 : 0.0);
      if (distance < nearest) {
        nearest = distance;
        owner = &point;
      }
    }
    owner->area_mm2 += share;
  }
  return points;
}

}  // namespace osteon
