// Bones with a closed form, for tests, benchmarks and figures. They are built from their exact distance and density.
#pragma once
#include <functional>
#include <vector>

#include "common/field/cut.hpp"
#include "common/volume/case.hpp"

namespace osteon::test {

// Any bone from its signed distance (mm, negative inside) and density (g/cm³) over a box. `tissue`: what its importer
// knows: metal, enamel or none.
[[nodiscard]] Case make_bone(const Box& extent, double pitch_mm, const std::function<double(const Vec3&)>& distance_mm,
                             const std::function<double(const Vec3&)>& density_g_cm3,
                             const std::function<Tissue(const Vec3&)>& tissue = {});

struct Layer {
  double thickness_mm;
  double density_g_cm3;
};

// Layers stacked along z below z = 0, each `width_mm` square about the z axis. A density sample on the face between two
// layers belongs to the lower one.
[[nodiscard]] Case layered_block(const std::vector<Layer>& layers, double width_mm, double pitch_mm);

// Constant density, z from -thickness to 0.
[[nodiscard]] Case plain_block(double width_mm, double thickness_mm, double pitch_mm, double density_g_cm3 = 1.9);

// A plain block in which some of the bone is metal or enamel, of 2.1 g/cm³ as importers have both.
[[nodiscard]] Case marked_block(double width_mm, double thickness_mm, double pitch_mm,
                                const std::function<Tissue(const Vec3&)>& tissue);

// A ball about the origin, made part by part. Only its surface takes memory, however large it is.
[[nodiscard]] Case large_ball(double radius_mm, double pitch_mm, double density_g_cm3 = 1.9);

// A drill or burr path as one cut. The tool's axis is along `axis`.
[[nodiscard]] Cut straight_cut(const Tool& tool, const Vec3& from_tip_mm, const Vec3& to_tip_mm, const Vec3& axis,
                               std::uint64_t author_seq = 1);

}  // namespace osteon::test
