#include "viewer_client/scene/stroke.hpp"

#include <algorithm>

namespace osteon {

namespace {

double distance_mm(const Vec3& point, const Vec3& from, const Vec3& to) {
  const Vec3 way = to - from;
  const double square = way.squaredNorm();
  const double part = square > 0.0 ? std::clamp((point - from).dot(way) / square, 0.0, 1.0) : 0.0;
  return (point - from - part * way).norm();
}

// Marks the points to keep between two points that are kept.
void keep_between(const std::vector<Vec3>& points, std::size_t first, std::size_t last, double tolerance_mm,
                  std::vector<bool>& kept) {
  double most_mm = tolerance_mm;
  std::size_t farthest = first;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double off_mm = distance_mm(points[i], points[first], points[last]);
    if (off_mm > most_mm) {
      most_mm = off_mm;
      farthest = i;
    }
  }
  if (farthest == first) return;
  kept[farthest] = true;
  keep_between(points, first, farthest, tolerance_mm, kept);
  keep_between(points, farthest, last, tolerance_mm, kept);
}

}  // namespace

std::vector<Vec3> simplified(const std::vector<Vec3>& points, double tolerance_mm) {
  if (points.size() < 3) return points;
  std::vector<bool> kept(points.size(), false);
  kept.front() = kept.back() = true;
  keep_between(points, 0, points.size() - 1, tolerance_mm, kept);
  std::vector<Vec3> line;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (kept[i]) line.push_back(points[i]);
  return line;
}

void Stroke::add(const Vec3& point_mm) {
  if (points_.empty() || (point_mm - points_.back()).norm() >= kApart_mm) points_.push_back(point_mm);
  last_ = point_mm;
}

std::vector<Vec3> Stroke::line(std::size_t most) const {
  std::vector<Vec3> all = points_;
  if (!all.empty() && last_ != all.back()) all.push_back(last_);
  if (all.size() < 2) return {};
  // A line on a curved surface must not dive into it visibly.
  double tolerance_mm = 0.05;
  std::vector<Vec3> line = simplified(all, tolerance_mm);
  while (line.size() > most) line = simplified(all, tolerance_mm *= 2.0);
  return line;
}

}  // namespace osteon
