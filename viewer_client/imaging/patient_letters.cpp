#include "viewer_client/imaging/patient_letters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>

namespace osteon {

namespace {

constexpr double kSecondLetter = 0.3826834;  // sin 22.5°

}  // namespace

std::string patient_letters(const Vec3& direction) {
  constexpr std::array<std::array<char, 2>, 3> kLetters{{{'L', 'R'}, {'P', 'A'}, {'H', 'F'}}};
  const Vec3 unit = direction.normalized();
  std::array<std::size_t, 3> order{0, 1, 2};
  std::ranges::stable_sort(order, std::greater{},
                           [&](std::size_t axis) { return std::abs(unit[static_cast<Eigen::Index>(axis)]); });
  std::string letters;
  for (const std::size_t axis : {order[0], order[1]}) {
    const double part = unit[static_cast<Eigen::Index>(axis)];
    if (letters.empty() || std::abs(part) >= kSecondLetter) letters += kLetters[axis][part > 0.0 ? 0 : 1];
  }
  return letters;
}

EdgeLetters edge_letters(const Vec3& right, const Vec3& down) {
  return {patient_letters(-right), patient_letters(right), patient_letters(-down), patient_letters(down)};
}

}  // namespace osteon
