#include "common/tools/cut_body.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace osteon {

double CutBody::reach_mm() const {
  double squared = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double farthest = kQuantum_mm * std::max(std::abs(lowest[axis]), std::abs(highest[axis]));
    squared += farthest * farthest;
  }
  return std::sqrt(squared);
}

bool operator==(const CutBody& a, const CutBody& b) {
  const bool same_samples = a.sampled == b.sampled || (a.sampled && b.sampled && *a.sampled == *b.sampled);
  return a.kind == b.kind && a.radius == b.radius && a.profile == b.profile && a.dome == b.dome &&
         a.planes == b.planes && a.lowest == b.lowest && a.highest == b.highest && same_samples;
}

}  // namespace osteon
