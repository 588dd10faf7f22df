// Cuts whose removed volume and surface have a closed form, at a random place and orientation on the lattice.
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
  // Signed distance of a point on the cut face to where that face must be; none near an edge of the cut, where two
  // faces meet and marching cubes rounds the corner.
  std::function<std::optional<double>(const Vec3&)> deviation_mm;
};

// `pitch_mm` is that of the cut, at level 2; the bone's is four times as much, as in a real case.
// A round bur held wholly inside bone: a sphere.
[[nodiscard]] KnownCut sphere_in_bone(const Tool& burr, double pitch_mm, Random& random);
// A drill through a slab of 5 mm, up to 30 degrees oblique: π r² t / cos θ.
[[nodiscard]] KnownCut hole_through_slab(const Tool& drill, double pitch_mm, Random& random);
// A saw through a round shaft of radius R, up to 25 degrees oblique: π R² (thickness + set) / cos θ.
[[nodiscard]] KnownCut kerf_through_shaft(const Tool& saw, double pitch_mm, Random& random);

// The tools that these need, by what they do: the round bur and the drill nearest to a diameter, the widest oscillating
// saw. None when there is no such tool.
[[nodiscard]] std::optional<Tool> nearest_tool(ToolKind kind, double diameter_mm);
[[nodiscard]] std::optional<Tool> widest_saw();

struct CutAccuracy {
  double volume_error = 0;                // of the closed form, signed
  std::vector<double> deviation_pitches;  // of every vertex on the cut face away from edges, absolute
};
[[nodiscard]] CutAccuracy accuracy_of(const KnownCut& known);

}  // namespace osteon::test
