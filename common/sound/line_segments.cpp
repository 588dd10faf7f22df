#include "common/sound/line_segments.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon::sound {
namespace {

constexpr double kQuietest = 1e-9;  // amplitude, -180 dB

Knot between(const Knot& a, const Knot& b, std::size_t frame) {
  const double part = static_cast<double>(frame - a.frame) / static_cast<double>(b.frame - a.frame);
  return {frame, a.hz + part * (b.hz - a.hz), a.level_db + part * (b.level_db - a.level_db)};
}

// How far a point is from the line, 1 = as far as it may.
double distance(const Knot& point, const Knot& line, const SegmentTolerance& tolerance) {
  return std::max(std::abs(point.level_db - line.level_db) / tolerance.level_db,
                  std::abs(point.hz - line.hz) / std::max(tolerance.hz, tolerance.part * point.hz));
}

}  // namespace

std::vector<Knot> knots_of(const Partial& partial, const SegmentTolerance& tolerance) {
  OSTEON_CHECK(tolerance.level_db > 0 && tolerance.hz > 0);
  std::vector<Knot> all;
  for (const Sinusoid& point : partial.points)
    all.push_back({partial.first + all.size(), point.hz, 20.0 * std::log10(std::max(point.amplitude, kQuietest))});
  if (all.size() < 3) return all;
  std::vector<Knot> knots{all.front()};
  std::vector<std::size_t> ends{all.size() - 1};  // of the segments to come, the nearest last
  std::size_t begin = 0;
  while (!ends.empty()) {
    const std::size_t end = ends.back();
    std::size_t farthest = begin;
    double most = 1.0;
    for (std::size_t i = begin + 1; i < end; ++i) {
      const double far = distance(all[i], between(all[begin], all[end], all[i].frame), tolerance);
      if (far > most) most = far, farthest = i;
    }
    if (farthest != begin) {
      ends.push_back(farthest);
      continue;
    }
    knots.push_back(all[end]);
    begin = end;
    ends.pop_back();
  }
  return knots;
}

Partial partial_of(std::span<const Knot> knots) {
  Partial partial;
  if (knots.empty()) return partial;
  partial.first = knots.front().frame;
  const auto add = [&](const Knot& knot) {
    partial.points.push_back({.hz = knot.hz, .amplitude = std::pow(10.0, knot.level_db / 20.0), .phase = 0});
  };
  add(knots.front());
  for (std::size_t i = 1; i < knots.size(); ++i) {
    OSTEON_CHECK(knots[i].frame > knots[i - 1].frame);
    for (std::size_t frame = knots[i - 1].frame + 1; frame <= knots[i].frame; ++frame)
      add(between(knots[i - 1], knots[i], frame));
  }
  return partial;
}

}  // namespace osteon::sound
