// A digitally reconstructed radiograph: for each pixel, how much the bone as it is now weakens the ray to it. Or a
// maximum intensity projection by the same rays.
//
// Each ray is summed plane by plane across the axis along which it is the longest, bilinear in the plane (Joseph 1982).
// A ray does not depend on its neighbours. So rays that are cast again after a cut, and only those through what the cut
// changed, give the same image as all rays, to the last bit.
#pragma once
#include <span>
#include <vector>

#include "common/radiology/bone_hu.hpp"
#include "common/radiology/c_arm.hpp"

namespace osteon::radiology {

enum class Projection {
  attenuation,  // ∫ μ dl of each ray. The part exp(−∫ μ dl) of the photons gets through.
  most,  // the largest HU on the planes that a ray meets: a maximum intensity projection. Air where it meets none
};

// Not synchronised: one thread. Casting uses as many threads as oneTBB allows (tbb::global_control); the image is the
// same for any number.
class Radiograph {
 public:
  explicit Radiograph(const ConeBeam& beam, Projection projection = Projection::attenuation);

  // All rays.
  void cast(const BoneHu& bone);
  // Only the rays that meet samples of these boxes, as BoneHu::update() returns them. Everything else must be as when
  // the rays were cast before. Returns what was cast: rectangles that do not overlap.
  std::vector<PixelBox> recast(const BoneHu& bone, std::span<const CoordBox> changed);

  [[nodiscard]] const ConeBeam& beam() const { return beam_; }
  [[nodiscard]] Projection projection() const { return projection_; }
  // What the projection is of, row by row.
  [[nodiscard]] std::span<const float> values() const { return values_; }
  // The same, of an attenuation.
  [[nodiscard]] std::span<const float> attenuation() const;

 private:
  void cast_box(const BoneHu& bone, const PixelBox& box);

  ConeBeam beam_;
  Projection projection_;
  std::vector<float> values_;
};

}  // namespace osteon::radiology
