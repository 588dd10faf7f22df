// The letters of the patient's sides at the edges of a picture, as radiologists write them.
#pragma once
#include <string>

#include "common/geometry/lattice.hpp"

namespace osteon {

// The letters of the patient's sides towards which a direction points: R, L, A, P, H and F (LPS). Up to two, the nearer
// one first: the second is there from 22.5° [A] between direction and the first axis.
[[nodiscard]] std::string patient_letters(const Vec3& direction);

struct EdgeLetters {
  std::string left, right, top, bottom;
  friend bool operator==(const EdgeLetters&, const EdgeLetters&) = default;
};
// Of a picture whose columns go to `right`, and its rows to `down`.
[[nodiscard]] EdgeLetters edge_letters(const Vec3& right, const Vec3& down);

}  // namespace osteon
