#include "common/phantoms/implicit_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/core/check.hpp"

namespace osteon::phantoms {
namespace {

// A number from -1 to 1 that depends on a lattice point alone: three multiplications and shifts of its coordinates.
double lattice_noise(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u +
                    static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu +
                    static_cast<std::uint64_t>(z) * 0x165667b19e3779f9u;
  h = (h ^ (h >> 31)) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 29)) * 0x94d049bb133111ebu;
  h ^= h >> 32;
  return 2.0 * static_cast<double>(h >> 11) / 9007199254740992.0 - 1.0;
}

}  // namespace

double smooth_min(double a, double b, double blend_mm) {
  const double near = std::max(0.0, blend_mm - std::abs(a - b));
  return std::min(a, b) - 0.25 * near * near / blend_mm;
}

double ball_mm(const Vec3& at, const Vec3& centre, double radius_mm) { return (at - centre).norm() - radius_mm; }

double round_cone_mm(const Vec3& at, const Vec3& a, double radius_a_mm, const Vec3& b, double radius_b_mm) {
  const Vec3 along = b - a;
  const double length = along.norm();
  // The outline's tangent to both circles has the normal (sine, cosine), along and across the axis.
  const double sine = (radius_a_mm - radius_b_mm) / length, cosine = std::sqrt(1.0 - sine * sine);
  const double x = (at - a).dot(along) / length;
  const double y = std::sqrt(std::max(0.0, (at - a).squaredNorm() - x * x));
  const double tangential = cosine * x - sine * y;
  if (tangential < 0.0) return (at - a).norm() - radius_a_mm;
  if (tangential > cosine * length) return (at - b).norm() - radius_b_mm;
  return sine * x + cosine * y - radius_a_mm;
}

double ellipse_mm(double x, double y, double a, double b) {
  // k0 is 1 on the ellipse, and k1 / k0 is the length of its gradient.
  // std::hypot takes several times as long, and its last bit depends on the C library.
  const auto length = [](double u, double v) { return std::sqrt(u * u + v * v); };
  const double k0 = length(x / a, y / b), k1 = length(x / (a * a), y / (b * b));
  if (k1 < 1e-9) return -std::min(a, b);
  return k0 * (k0 - 1.0) / k1;
}

Profile::Profile(std::vector<Point> points) : points_(std::move(points)), slopes_(points_.size(), 0.0) {
  OSTEON_CHECK(!points_.empty());
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
    OSTEON_CHECK(points_[i].x < points_[i + 1].x);
    steps.push_back((points_[i + 1].y - points_[i].y) / (points_[i + 1].x - points_[i].x));
  }
  // The harmonic mean of the steps on both sides keeps the curve monotone; 0 at turns and at the ends.
  for (std::size_t i = 1; i + 1 < points_.size(); ++i)
    if (steps[i - 1] * steps[i] > 0.0) slopes_[i] = 2.0 * steps[i - 1] * steps[i] / (steps[i - 1] + steps[i]);
}

double Profile::operator()(double x) const {
  if (x <= points_.front().x) return points_.front().y;
  if (x >= points_.back().x) return points_.back().y;
  std::size_t i = 0;
  while (x > points_[i + 1].x) ++i;
  const double width = points_[i + 1].x - points_[i].x, t = (x - points_[i].x) / width;
  const double s = 1.0 - t;
  return points_[i].y * s * s * (1.0 + 2.0 * t) + points_[i + 1].y * t * t * (1.0 + 2.0 * s) +
         width * s * t * (slopes_[i] * s - slopes_[i + 1] * t);
}

double smooth_step(double x, double from, double to) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

double grain_noise(const Vec3& at_mm, double grain_mm) {
  const Vec3 cell = at_mm / grain_mm;
  const Vec3 first(std::floor(cell.x()), std::floor(cell.y()), std::floor(cell.z()));
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::int64_t at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int beyond = corner >> axis & 1;
      const double t = smooth_step(cell[axis] - first[axis], 0.0, 1.0);
      weight *= beyond == 1 ? t : 1.0 - t;
      at[axis] = static_cast<std::int64_t>(first[axis]) + beyond;
    }
    sum += weight * lattice_noise(at[0], at[1], at[2]);
  }
  return sum;
}

}  // namespace osteon::phantoms
