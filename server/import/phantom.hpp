// Layered test bones whose surface and density are known exactly.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "common/imaging/hu_volume.hpp"
#include "common/volume/case.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::import {

enum class PhantomKind { block, tube };

struct Layer {
  double thickness_mm = 0.0;
  double density_g_cm3 = 0.0;
};

// "5:1.9,20:0.3,5:1.9": thickness in mm and density in g/cm³ of each layer, outermost first.
[[nodiscard]] Result<std::vector<Layer>> parse_layers(std::string_view text);

// A block: the first layer's top face is z = 0, the others follow downwards; square, `width_mm` wide, centred on the
// z axis. A tube: a cylinder along z whose first layer is the outer shell and whose last is the core, so its radius is
// the sum of the layers; `width_mm` long, centred on the origin.
struct Phantom {
  PhantomKind kind = PhantomKind::block;
  std::vector<Layer> layers;
  double width_mm = 20.0;

  [[nodiscard]] double thickness_mm() const;  // of all layers
  [[nodiscard]] Box bounds() const;
  [[nodiscard]] double volume_mm3() const;
  // Exact Euclidean distance to the outer surface, negative inside.
  [[nodiscard]] double surface_mm(const Vec3& point_mm) const;
  // Depth below the layered face: where the layers are counted from.
  [[nodiscard]] double depth_mm(const Vec3& point_mm) const;
  // Mean over `blur_mm` of depth, so that samples a pitch apart keep each layer's mass and each interface's place.
  // Outer layers go on beyond the surface, which alone says where the bone ends.
  [[nodiscard]] double density_g_cm3(const Vec3& point_mm, double blur_mm) const;
};

// Errors: invalid_input (a size that makes no sense with this pitch), cancelled.
[[nodiscard]] Result<Case> build_phantom_case(const Phantom& phantom, double pitch_mm, const std::string& title,
                                              const KeepGoing& keep_going);

// What a CT scanner without noise and with box-shaped voxels sees of it, in air: the mean HU of each voxel.
[[nodiscard]] Result<imaging::HuVolume> scan_phantom(const Phantom& phantom, double spacing_mm,
                                                     const KeepGoing& keep_going);

// The threshold that is least wrong for all layers that reach the surface: half way between air and bone puts the
// edge of a blurred step where it was, so this is the middle between the halves of the lightest and the densest.
[[nodiscard]] double suitable_threshold_hu(const Phantom& phantom);

}  // namespace osteon::import
