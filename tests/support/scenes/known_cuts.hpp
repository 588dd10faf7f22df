// Cuts whose removed volume and surface have a closed form, at a random pose on the lattice.
#pragma once
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {

struct KnownCut {
  Case bone;
  Cut cut;
  double removed_mm3;  // closed form
  // Signed distance of a point on the cut face from the exact face. None near an edge of the cut, where two faces meet
  // and marching cubes rounds the corner.
  std::function<std::optional<double>(const Vec3&)> deviation_mm;
};

// `pitch_mm` is the pitch of the cut, at level 2. The pitch of the bone is four times as large, as in a real case.
// A round bur held wholly inside bone: a sphere.
[[nodiscard]] KnownCut sphere_in_bone(const Tool& burr, double pitch_mm, Random& random);
// A drill through a slab of 5 mm, up to 30 degrees oblique: π r² t / cos θ.
[[nodiscard]] KnownCut hole_through_slab(const Tool& drill, double pitch_mm, Random& random);
// A saw through a round shaft of radius R, up to 25 degrees oblique: π R² (thickness + set) / cos θ.
[[nodiscard]] KnownCut kerf_through_shaft(const Tool& saw, double pitch_mm, Random& random);

// The tools for these cuts: the round bur and the drill nearest to a diameter, the widest oscillating saw. None if
// there is no such tool.
[[nodiscard]] std::optional<Tool> nearest_tool(ToolKind kind, double diameter_mm);
[[nodiscard]] std::optional<Tool> widest_saw();

struct CutAccuracy {
  double volume_error = 0;                // relative to the closed form, signed
  std::vector<double> deviation_pitches;  // of every vertex on the cut face away from edges, absolute
};
[[nodiscard]] CutAccuracy accuracy_of(const KnownCut& known);

}  // namespace osteon::test
