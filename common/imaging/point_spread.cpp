#include "common/imaging/point_spread.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "common/imaging/cortex_profile.hpp"
#include "common/imaging/resample.hpp"

namespace osteon::imaging {
namespace {

constexpr double kLeastEdge_hu = 400.0;                 // [A] of a step: skin in air has 1000
constexpr double kLeastSlope = 0.15;                    // of that, from voxel to voxel, where the search begins
constexpr double kReach_voxels = 4.0, kReach_mm = 3.5;  // to either side of an edge, the larger of both
constexpr int kSteps = 16;                              // to either side
constexpr double kFlat = 0.05;                          // most deviation of a plateau, as a part of the step
constexpr double kMostEdgeRest = 0.03;                  // of the fit, as a part of the step
constexpr double kAssumed = 0.5;                        // sigma of an axis without edges, in voxels
// Rows of a slice are read in so many passes, so that the edges of a slice come from everywhere in it.
constexpr int kPasses = 16;
constexpr std::size_t kMostInSlice = 300, kLeastEdges = 20;
constexpr double kLeastShown = 0.25;  // of n², summed over edges and divided by kLeastEdges, that show an axis

struct Edge {
  Vec3 normal_squares;
  double variance_mm2;
};

struct Plateau {
  double mean = 0.0, deviation = 0.0;
};
Plateau plateau_of(std::span<const double> hu) {
  Plateau p;
  for (const double h : hu) p.mean += h / static_cast<double>(hu.size());
  for (const double h : hu) p.deviation += (h - p.mean) * (h - p.mean) / static_cast<double>(hu.size());
  p.deviation = std::sqrt(p.deviation);
  return p;
}

// The edge at a voxel, if there is a clean one. `line`: memory.
std::optional<Edge> edge_at(const HuVolume& volume, const std::array<int, 3>& voxel, std::vector<double>& line) {
  const auto at = [&](int axis, int step) {
    std::array<int, 3> v = voxel;
    v[static_cast<std::size_t>(axis)] += step;
    return static_cast<double>(volume.at(v[0], v[1], v[2]));
  };
  Vec3 slope;  // HU per mm
  for (int axis = 0; axis < 3; ++axis) slope[axis] = (at(axis, 1) - at(axis, -1)) / (2.0 * volume.spacing_mm[axis]);
  const double steepness = slope.norm();
  if (!(steepness > 0.0)) return {};
  const Vec3 normal = slope / steepness;
  const double voxel_mm = volume.spacing_mm.cwiseProduct(normal).norm();
  if (steepness * voxel_mm < kLeastSlope * kLeastEdge_hu) return {};
  const double reach_mm = std::max(kReach_mm, kReach_voxels * voxel_mm), step_mm = reach_mm / kSteps;
  line.clear();
  for (int i = 0; i <= 2 * kSteps; ++i) {
    const Vec3 p =
        Vec3(voxel[0], voxel[1], voxel[2]) + (normal * (i * step_mm - reach_mm)).cwiseQuotient(volume.spacing_mm);
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] < 0.0 || p[axis] > volume.dims[static_cast<std::size_t>(axis)] - 1) return {};
    line.push_back(hu_at(volume, p));
  }
  const auto quarter = line.size() / 4;
  const Plateau low = plateau_of(std::span(line).first(quarter)), high = plateau_of(std::span(line).last(quarter));
  const double edge_hu = high.mean - low.mean;
  if (edge_hu < kLeastEdge_hu || std::max(low.deviation, high.deviation) > kFlat * edge_hu) return {};
  const auto fit = fit_edge({-reach_mm, step_mm, line}, 0.6 * voxel_mm);
  // The edge must be that of this voxel, so that each is measured once or twice.
  if (!fit || fit->rest_hu > kMostEdgeRest * edge_hu || std::abs(fit->at_mm) > 0.5 * voxel_mm) return {};
  return Edge{normal.cwiseProduct(normal), fit->sigma_mm * fit->sigma_mm};
}

// Variances along the axes by least squares, over the axes that edges show.
Vec3 variances_of(const std::vector<Edge>& edges, const std::array<bool, 3>& shown, const Vec3& assumed_mm2) {
  std::vector<int> axes;
  for (int axis = 0; axis < 3; ++axis)
    if (shown[static_cast<std::size_t>(axis)]) axes.push_back(axis);
  const auto n = static_cast<Eigen::Index>(axes.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (const Edge& e : edges) {
    double rest = e.variance_mm2;
    for (int axis = 0; axis < 3; ++axis)
      if (!shown[static_cast<std::size_t>(axis)]) rest -= e.normal_squares[axis] * assumed_mm2[axis];
    for (Eigen::Index i = 0; i < n; ++i) {
      right[i] += e.normal_squares[axes[static_cast<std::size_t>(i)]] * rest;
      for (Eigen::Index j = 0; j < n; ++j)
        normal(i, j) +=
            e.normal_squares[axes[static_cast<std::size_t>(i)]] * e.normal_squares[axes[static_cast<std::size_t>(j)]];
    }
  }
  const Eigen::VectorXd solved = normal.ldlt().solve(right);
  Vec3 variances = assumed_mm2;
  for (Eigen::Index i = 0; i < n; ++i) variances[axes[static_cast<std::size_t>(i)]] = solved[i];
  return variances;
}

// The same without edges that differ much from the rest, as those of round or soft things do.
Vec3 robust_variances(std::vector<Edge> edges, const std::array<bool, 3>& shown, const Vec3& assumed_mm2) {
  constexpr int kRounds = 5;
  constexpr double kMostDeviations = 2.0;
  Vec3 variances = variances_of(edges, shown, assumed_mm2);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> apart;
    for (const Edge& e : edges) apart.push_back(std::abs(e.variance_mm2 - e.normal_squares.dot(variances)));
    std::vector<double> sorted = apart;
    std::ranges::sort(sorted);
    const double limit = kMostDeviations * 1.4826 * sorted[sorted.size() / 2];
    std::vector<Edge> kept;
    for (std::size_t i = 0; i < edges.size(); ++i)
      if (apart[i] <= limit) kept.push_back(edges[i]);
    if (kept.size() < kLeastEdges) break;
    edges = std::move(kept);
    variances = variances_of(edges, shown, assumed_mm2);
  }
  return variances;
}

}  // namespace

Result<PointSpread> measure_point_spread(const HuVolume& volume, const KeepGoing& keep_going) {
  const auto [columns, rows, slices] = volume.dims;
  std::vector<Edge> edges;
  std::vector<double> line;
  for (int slice = 1; slice + 1 < slices; ++slice) {
    if (!keep_going(static_cast<double>(slice) / slices)) return stopped_while("measuring the scan's blur");
    const std::size_t most = edges.size() + kMostInSlice;
    for (int pass = 0; pass < kPasses; ++pass)
      for (int row = 1 + pass; row + 1 < rows; row += kPasses)
        for (int column = 1; column + 1 < columns && edges.size() < most; ++column)
          if (const auto edge = edge_at(volume, {column, row, slice}, line)) edges.push_back(*edge);
  }
  PointSpread spread;
  spread.edges = static_cast<int>(edges.size());
  const Vec3 assumed_mm = kAssumed * volume.spacing_mm, assumed_mm2 = assumed_mm.cwiseProduct(assumed_mm);
  Vec3 shares = Vec3::Zero();
  for (const Edge& e : edges) shares += e.normal_squares.cwiseProduct(e.normal_squares);
  for (int axis = 0; axis < 3; ++axis)
    spread.measured[static_cast<std::size_t>(axis)] = shares[axis] >= kLeastShown * static_cast<double>(kLeastEdges);
  Vec3 variances = assumed_mm2;
  if (edges.size() >= kLeastEdges)
    variances = robust_variances(std::move(edges), spread.measured, assumed_mm2);
  else
    spread.measured = {};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(variances[axis] > 0.04 * assumed_mm2[axis])) {
      spread.measured[static_cast<std::size_t>(axis)] = false;
      variances[axis] = assumed_mm2[axis];
    }
    spread.sigma_mm[axis] = std::sqrt(variances[axis]);
  }
  return spread;
}

}  // namespace osteon::imaging
