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

// A block is square, `width_mm` wide and centred on the z axis. The first layer's top face is z = 0, and the others
// follow downwards. A tube is a cylinder along z, `width_mm` long and centred on the origin. Its first layer is the
// outer shell and its last the core, so its radius is the sum of the layers.
struct Phantom {
  PhantomKind kind = PhantomKind::block;
  std::vector<Layer> layers;
  double width_mm = 20.0;

  [[nodiscard]] double thickness_mm() const;  // of all layers
  [[nodiscard]] Box bounds() const;
  [[nodiscard]] double volume_mm3() const;
  // Exact Euclidean distance to the outer surface, negative inside.
  [[nodiscard]] double surface_mm(const Vec3& point_mm) const;
  // Depth below the layered face, where the first layer begins.
  [[nodiscard]] double depth_mm(const Vec3& point_mm) const;
  // Mean of the density over `blur_mm` of depth. With blur_mm equal to the pitch, samples preserve each layer's mass
  // and each interface's position. The outer layers continue beyond the surface: only the surface says where bone ends.
  [[nodiscard]] double density_g_cm3(const Vec3& point_mm, double blur_mm) const;
};

// Errors: invalid_input (a size that makes no sense with this pitch), cancelled.
[[nodiscard]] Result<Case> build_phantom_case(const Phantom& phantom, double pitch_mm, const std::string& title,
                                              const KeepGoing& keep_going);

// What a CT scanner without noise and with box-shaped voxels sees of it in air: the mean HU of each voxel.
[[nodiscard]] Result<imaging::HuVolume> scan_phantom(const Phantom& phantom, double spacing_mm,
                                                     const KeepGoing& keep_going);

// The threshold with the smallest error for all layers that reach the surface. A layer's half value is midway between
// the HU of air and of the layer; there, a blurred edge keeps its position. The threshold is midway between the half
// values of the lightest and the densest layer.
[[nodiscard]] double suitable_threshold_hu(const Phantom& phantom);

}  // namespace osteon::import
