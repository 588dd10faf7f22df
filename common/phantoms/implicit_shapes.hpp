// Shapes that blend into one another, from which phantom bones are made. Each gives a signed distance, mm, negative
// inside.
#pragma once
#include <vector>

#include "common/geometry/pose.hpp"

namespace osteon::phantoms {

// The smaller of two distances, rounded where they differ by less than `blend_mm`: there the solids grow together.
// Where they differ by more, it is exactly the smaller one. Where both are equal, it is lower by a quarter of
// `blend_mm`.
[[nodiscard]] double smooth_min(double a, double b, double blend_mm);
[[nodiscard]] inline double smooth_max(double a, double b, double blend_mm) { return -smooth_min(-a, -b, blend_mm); }

// The exact distance.
[[nodiscard]] double ball_mm(const Vec3& at, const Vec3& centre, double radius_mm);
// The hull of two balls, none of which contains the other: the exact distance.
[[nodiscard]] double round_cone_mm(const Vec3& at, const Vec3& a, double radius_a_mm, const Vec3& b,
                                   double radius_b_mm);

// Distance to an ellipse with half axes a and b, in its plane. Exact on both axes, and everywhere if a = b. Elsewhere
// it is exact to first order beside the ellipse.
[[nodiscard]] double ellipse_mm(double x, double y, double a, double b);

// A curve y(x) through given points, which rises only where they rise: monotone cubic interpolation (Fritsch 1980).
// Constant beyond the first and the last point.
class Profile {
 public:
  struct Point {
    double x = 0.0, y = 0.0;
  };
  Profile() = default;  // 0 everywhere
  // At least one point, in the order of x, which differ.
  explicit Profile(std::vector<Point> points);
  [[nodiscard]] double operator()(double x) const;

 private:
  std::vector<Point> points_ = std::vector<Point>(1);
  std::vector<double> slopes_ = {0.0};
};

// 0 up to `from`, 1 beyond `to`, and a smooth rise between them.
[[nodiscard]] double smooth_step(double x, double from, double to);

// A texture without period: smooth noise from -1 to 1, the same on every machine. Its grains are about `grain_mm` wide.
[[nodiscard]] double grain_noise(const Vec3& at_mm, double grain_mm);

}  // namespace osteon::phantoms
