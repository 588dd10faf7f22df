// Distance from a point to a triangle. The triangle may have no area.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

namespace osteon {

// Squared distance from p to the segment from a to b. If a and b are one point, the distance to a.
template <class Scalar>
[[nodiscard]] Scalar squared_distance_to_segment(const Eigen::Matrix<Scalar, 3, 1>& p,
                                                 const Eigen::Matrix<Scalar, 3, 1>& a,
                                                 const Eigen::Matrix<Scalar, 3, 1>& b) {
  const Eigen::Matrix<Scalar, 3, 1> ab = b - a, ap = p - a;
  const Scalar squared = ab.squaredNorm();
  if (!(squared > 0)) return ap.squaredNorm();
  return (ap - ab * std::clamp(ab.dot(ap) / squared, Scalar(0), Scalar(1))).squaredNorm();
}

template <class Scalar>
struct TriangleDistance {
  Scalar squared = 0;
  // bits of the corners that span the nearest part: one bit for a corner, two for a side, three for the face
  unsigned corners = 0;
};

// Squared distance from p to the triangle a, b, c, in the square of their unit. Finite for finite corners: for a
// triangle without area, the nearest side counts. Regions of the plane as in Ericson 2005, section 5.1.5.
template <class Scalar>
[[nodiscard]] TriangleDistance<Scalar> distance_to_triangle(const Eigen::Matrix<Scalar, 3, 1>& p,
                                                            const Eigen::Matrix<Scalar, 3, 1>& a,
                                                            const Eigen::Matrix<Scalar, 3, 1>& b,
                                                            const Eigen::Matrix<Scalar, 3, 1>& c) {
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  constexpr unsigned kA = 1, kB = 2, kC = 4;
  const Vector ab = b - a, ac = c - a, ap = p - a;
  const Scalar d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {ap.squaredNorm(), kA};
  const Vector bp = p - b;
  const Scalar d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {bp.squaredNorm(), kB};
  const Vector cp = p - c;
  const Scalar d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {cp.squaredNorm(), kC};
  const Scalar vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return {(ap - ab * (d1 / (d1 - d3))).squaredNorm(), kA | kB};
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return {(ap - ac * (d2 / (d2 - d6))).squaredNorm(), kA | kC};
  const Scalar along = d4 - d3, beyond = d5 - d6;
  if (va <= 0 && along >= 0 && beyond >= 0 && along + beyond > 0)
    return {(bp - (c - b) * (along / (along + beyond))).squaredNorm(), kB | kC};
  // va + vb + vc is four times the squared area. For corners on a line, rounding can give it any value.
  const Scalar sum = va + vb + vc;
  if (!(sum > std::sqrt(std::numeric_limits<Scalar>::epsilon()) * ab.squaredNorm() * ac.squaredNorm()))
    return {std::min({squared_distance_to_segment<Scalar>(p, a, b), squared_distance_to_segment<Scalar>(p, a, c),
                      squared_distance_to_segment<Scalar>(p, b, c)}),
            kA | kB | kC};
  return {(ap - ab * (vb / sum) - ac * (vc / sum)).squaredNorm(), kA | kB | kC};
}

}  // namespace osteon
