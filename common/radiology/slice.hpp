// Slices through the bone as it is now, as images of HU.
#pragma once
#include <array>
#include <span>

#include "common/radiology/bone_hu.hpp"
#include "common/radiology/pixel_grid.hpp"

namespace osteon::radiology {

// HU at the centre of each pixel, trilinear between samples of level 0. Outside the bone's box it is air. At the
// position of a sample it is that sample, to the last bit.
void sample_slice(const BoneHu& bone, const PixelGrid& plane, std::span<float> hu);

// Size of the images of planes about a point.
struct SliceView {
  double pixel_mm = 0.25;
  int columns = 512, rows = 512;
};

// Planes along the patient's axes (LPS), as radiologists look at them. The patient's left is at the right of the image.
// In the sagittal plane, the front of the patient is at the left.
struct PatientPlanes {
  PixelGrid axial, coronal, sagittal;
};
[[nodiscard]] PatientPlanes patient_planes(const Vec3& point_mm, const SliceView& view);

// Planes of a tool about its tip: two along its axis, of which `turned` is at right angles to `along`, and one across
// it. The tool points down in the first two.
struct ToolPlanes {
  PixelGrid along, turned, across;
};
[[nodiscard]] ToolPlanes tool_planes(const Pose& pose_bone_tool, const SliceView& view);

}  // namespace osteon::radiology
