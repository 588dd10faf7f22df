#include "common/geometry/triangle_distances.hpp"

#include <cmath>
#include <limits>

#include "common/geometry/triangle_distance.hpp"

// Everything is inlined into functions for different processors, so that no vector is passed between them.
#define OSTEON_INLINE inline __attribute__((always_inline))

namespace osteon {
namespace {

using Distances = std::array<float, Points8::kCount>;
using Lanes = float __attribute__((vector_size(32)));
using Choice = int __attribute__((vector_size(32)));

struct Vectors {
  Lanes x, y, z;
};

OSTEON_INLINE void load(const Points8& from, Vectors& to) {
  __builtin_memcpy(&to.x, from.axes[0].data(), sizeof to.x);
  __builtin_memcpy(&to.y, from.axes[1].data(), sizeof to.y);
  __builtin_memcpy(&to.z, from.axes[2].data(), sizeof to.z);
}
OSTEON_INLINE void subtract(const Vectors& a, const Vectors& b, Vectors& to) {
  to.x = a.x - b.x;
  to.y = a.y - b.y;
  to.z = a.z - b.z;
}
// In the order in which Eigen adds, so that rounding is the same.
OSTEON_INLINE void dot(const Vectors& a, const Vectors& b, Lanes& to) { to = a.x * b.x + (a.y * b.y + a.z * b.z); }

// `no_area`: lanes whose triangle has none, so that their distance is not known.
OSTEON_INLINE void measure(const Points8& p_of, const Points8& a_of, const Points8& b_of, const Points8& c_of,
                           Distances& found, std::array<int, Points8::kCount>& no_area) {
  Vectors p, a, b, c, ab, ac, bc, ap, bp, cp;
  load(p_of, p);
  load(a_of, a);
  load(b_of, b);
  load(c_of, c);
  subtract(b, a, ab);
  subtract(c, a, ac);
  subtract(c, b, bc);
  subtract(p, a, ap);
  subtract(p, b, bp);
  subtract(p, c, cp);
  Lanes d1, d2, d3, d4, d5, d6;
  dot(ab, ap, d1);
  dot(ac, ap, d2);
  dot(ab, bp, d3);
  dot(ac, bp, d4);
  dot(ab, cp, d5);
  dot(ac, cp, d6);
  const Lanes vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  const Lanes along = d4 - d3, beyond = d5 - d6, sum = va + vb + vc;
  const Choice at_a = (d1 <= 0) & (d2 <= 0);
  const Choice at_b = ~at_a & (d3 >= 0) & (d4 <= d3);
  const Choice at_c = ~at_a & ~at_b & (d6 >= 0) & (d5 <= d6);
  Choice rest = ~at_a & ~at_b & ~at_c;
  const Choice at_ab = rest & (vc <= 0) & (d1 >= 0) & (d3 <= 0) & (d1 > d3);
  rest &= ~at_ab;
  const Choice at_ac = rest & (vb <= 0) & (d2 >= 0) & (d6 <= 0) & (d2 > d6);
  rest &= ~at_ac;
  const Choice at_bc = rest & (va <= 0) & (along >= 0) & (beyond >= 0) & (along + beyond > 0);
  rest &= ~at_bc;
  // The nearest point is from - u · side - v · ac. A factor of 0 changes no bit.
  const Lanes zero{}, one = zero + 1.0f;
  const Lanes u_over = at_ab ? d1 : (at_bc ? along : (rest ? vb : zero)),
              u_under = at_ab ? d1 - d3 : (at_bc ? along + beyond : (rest ? sum : one)),
              v_over = at_ac ? d2 : (rest ? vc : zero), v_under = at_ac ? d2 - d6 : (rest ? sum : one);
  const Lanes u = u_over / u_under, v = v_over / v_under;
  const Choice from_b = at_b | at_bc;
  Vectors left;
  left.x = (from_b ? bp.x : (at_c ? cp.x : ap.x)) - (at_bc ? bc.x : ab.x) * u - ac.x * v;
  left.y = (from_b ? bp.y : (at_c ? cp.y : ap.y)) - (at_bc ? bc.y : ab.y) * u - ac.y * v;
  left.z = (from_b ? bp.z : (at_c ? cp.z : ap.z)) - (at_bc ? bc.z : ab.z) * u - ac.z * v;
  Lanes squared, ab_squared, ac_squared;
  dot(left, left, squared);
  dot(ab, ab, ab_squared);
  dot(ac, ac, ac_squared);
  const float least = std::sqrt(std::numeric_limits<float>::epsilon());
  const Choice unknown = rest & ~(sum > least * ab_squared * ac_squared);
  __builtin_memcpy(found.data(), &squared, sizeof squared);
  __builtin_memcpy(no_area.data(), &unknown, sizeof unknown);
}

using Measure = void (*)(const Points8&, const Points8&, const Points8&, const Points8&, Distances&,
                         std::array<int, Points8::kCount>&);

void measure_anywhere(const Points8& p, const Points8& a, const Points8& b, const Points8& c, Distances& found,
                      std::array<int, Points8::kCount>& no_area) {
  measure(p, a, b, c, found, no_area);
}

#ifdef __x86_64__
__attribute__((target("avx2"))) void measure_wide(const Points8& p, const Points8& a, const Points8& b,
                                                  const Points8& c, Distances& found,
                                                  std::array<int, Points8::kCount>& no_area) {
  measure(p, a, b, c, found, no_area);
}
const Measure kMeasure = __builtin_cpu_supports("avx2") ? measure_wide : measure_anywhere;
#else
const Measure kMeasure = measure_anywhere;
#endif

}  // namespace

std::array<float, Points8::kCount> squared_distances_to_triangles(const Points8& p, const Points8& a, const Points8& b,
                                                                  const Points8& c) {
  Distances found;
  std::array<int, Points8::kCount> no_area;
  kMeasure(p, a, b, c, found, no_area);
  for (std::size_t lane = 0; lane < Points8::kCount; ++lane) {
    if (no_area[lane] == 0) continue;
    const auto corner = [lane](const Points8& of) {
      return Eigen::Vector3f(of.axes[0][lane], of.axes[1][lane], of.axes[2][lane]);
    };
    found[lane] = distance_to_triangle<float>(corner(p), corner(a), corner(b), corner(c)).squared;
  }
  return found;
}

}  // namespace osteon
