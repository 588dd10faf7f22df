// Distances of four points to a triangle each, at once: no branches, which a processor would often guess wrongly.
#pragma once
#include <array>

#include "common/geometry/triangle_distance.hpp"

namespace osteon {

// Four points, or the same corner of four triangles: x, y and z of all.
class Points4 {
 public:
  using Lanes = float __attribute__((vector_size(16)));

  Points4() = default;
  Points4(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c, const Eigen::Vector3f& d)
      : lanes_{Lanes{a[0], b[0], c[0], d[0]}, Lanes{a[1], b[1], c[1], d[1]}, Lanes{a[2], b[2], c[2], d[2]}} {}

  [[nodiscard]] Eigen::Vector3f get(std::size_t lane) const {
    return {lanes_[0][lane], lanes_[1][lane], lanes_[2][lane]};
  }
  [[nodiscard]] const Lanes& operator[](std::size_t axis) const { return lanes_[axis]; }
  [[nodiscard]] Lanes& operator[](std::size_t axis) { return lanes_[axis]; }

  friend Points4 operator-(const Points4& a, const Points4& b) {
    Points4 difference;
    for (std::size_t axis = 0; axis < 3; ++axis) difference[axis] = a[axis] - b[axis];
    return difference;
  }
  // In the order in which Eigen adds, so that rounding is the same.
  [[nodiscard]] Lanes dot(const Points4& b) const { return lanes_[0] * b[0] + (lanes_[1] * b[1] + lanes_[2] * b[2]); }

 private:
  std::array<Lanes, 3> lanes_{};
};

// The squared distances of distance_to_triangle<float>(), with the same bytes.
[[nodiscard]] inline std::array<float, 4> squared_distances_to_triangles(const Points4& p, const Points4& a,
                                                                         const Points4& b, const Points4& c) {
  using Lanes = Points4::Lanes;
  const auto choose = [](auto condition, Lanes yes, Lanes no) -> Lanes { return condition ? yes : no; };
  const Points4 ab = b - a, ac = c - a, bc = c - b, ap = p - a, bp = p - b, cp = p - c;
  const Lanes d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  const Lanes vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  const Lanes along = d4 - d3, beyond = d5 - d6, sum = va + vb + vc;
  const auto at_a = (d1 <= 0) & (d2 <= 0);
  const auto at_b = ~at_a & (d3 >= 0) & (d4 <= d3);
  const auto at_c = ~at_a & ~at_b & (d6 >= 0) & (d5 <= d6);
  auto rest = ~at_a & ~at_b & ~at_c;
  const auto at_ab = rest & (vc <= 0) & (d1 >= 0) & (d3 <= 0) & (d1 > d3);
  rest &= ~at_ab;
  const auto at_ac = rest & (vb <= 0) & (d2 >= 0) & (d6 <= 0) & (d2 > d6);
  rest &= ~at_ac;
  const auto at_bc = rest & (va <= 0) & (along >= 0) & (beyond >= 0) & (along + beyond > 0);
  rest &= ~at_bc;
  // The nearest point is from - u · side - v · ac. A factor of 0 changes no bit.
  const Lanes zero{}, one = zero + 1.0f;
  const Lanes u_over = choose(at_ab, d1, choose(at_bc, along, choose(rest, vb, zero))),
              u_under = choose(at_ab, d1 - d3, choose(at_bc, along + beyond, choose(rest, sum, one))),
              v_over = choose(at_ac, d2, choose(rest, vc, zero)),
              v_under = choose(at_ac, d2 - d6, choose(rest, sum, one));
  const Lanes u = u_over / u_under, v = v_over / v_under;
  Points4 left;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Lanes from = choose(at_b | at_bc, bp[axis], choose(at_c, cp[axis], ap[axis]));
    left[axis] = from - choose(at_bc, bc[axis], ab[axis]) * u - ac[axis] * v;
  }
  const Lanes squared = left.dot(left);
  const float least = std::sqrt(std::numeric_limits<float>::epsilon());
  const auto no_area = rest & ~(sum > least * ab.dot(ab) * ac.dot(ac));
  std::array<float, 4> found;
  for (std::size_t lane = 0; lane < 4; ++lane)
    found[lane] = no_area[lane] == 0
                      ? squared[lane]
                      : distance_to_triangle<float>(p.get(lane), a.get(lane), b.get(lane), c.get(lane)).squared;
  return found;
}

}  // namespace osteon
