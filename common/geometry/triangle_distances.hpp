// Distances of eight points to a triangle each, at once: no branches, which a processor would often guess wrongly.
#pragma once
#include <array>
#include <cstddef>

#include <Eigen/Core>

namespace osteon {

// Eight points, or the same corner of eight triangles: x, y and z of all.
struct Points8 {
  static constexpr std::size_t kCount = 8;
  alignas(32) std::array<std::array<float, kCount>, 3> axes{};

  void set(std::size_t lane, const Eigen::Vector3f& point) {
    for (std::size_t axis = 0; axis < 3; ++axis) axes[axis][lane] = point[static_cast<Eigen::Index>(axis)];
  }
};

// The squared distances of distance_to_triangle<float>() from each p to the triangle a, b, c, with the same bytes.
// Takes half the time where the processor has AVX2. Any thread.
[[nodiscard]] std::array<float, Points8::kCount> squared_distances_to_triangles(const Points8& p, const Points8& a,
                                                                                const Points8& b, const Points8& c);

}  // namespace osteon
