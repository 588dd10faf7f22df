// Radiographs and slices by VTK, as a program without a caster of its own would make them. One thread.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/radiology/bone_hu.hpp"
#include "common/radiology/c_arm.hpp"

namespace osteon::baselines {

// vtkFixedPointVolumeRayCastMapper: the only mapper of VTK that casts rays through a volume without a graphics card. It
// composites black matter in front of white, with the opacity of one pitch, so a pixel is 255 exp(−∫ μ dl). Needs
// a display. VTK looks from the source, and a radiograph is as from the detector, so picture() mirrors the frame.
class VtkRadiograph {
 public:
  VtkRadiograph(const radiology::BoneHu& bone, const radiology::ConeBeam& beam);
  ~VtkRadiograph();

  double cast_ms();                                         // of a frame, less that of an empty one
  [[nodiscard]] std::vector<std::uint8_t> picture() const;  // of the last frame, as the detector's pixels

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// vtkImageReslice, linear: what VTK's slice mapper runs before it draws.
class VtkSlices {
 public:
  explicit VtkSlices(const radiology::BoneHu& bone);
  ~VtkSlices();

  // Steps of attenuation at the pixels of a plane.
  std::span<const std::uint16_t> slice(const radiology::PixelGrid& plane);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace osteon::baselines
