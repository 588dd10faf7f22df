// A C-arm: an X-ray tube and a detector on an arc, turned about the patient, and the cone beam between them.
#pragma once
#include <optional>

#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/radiology/pixel_grid.hpp"

namespace osteon::radiology {

// Rays from a point to each pixel of a flat detector.
struct ConeBeam {
  Vec3 source_mm = Vec3::Zero();  // focal spot, in the bone's frame
  PixelGrid detector;
};

// The pixels that the rays through a box may reach. All pixels if the box is not wholly in front of the source. May be
// empty.
[[nodiscard]] PixelBox shadow_of(const Box& box, const ConeBeam& beam);

// [A] Dimensions of a usual mobile C-arm with a detector of 30 cm.
struct CArm {
  Vec3 isocentre_mm = Vec3::Zero();  // what both rotations are about, in the bone's frame (LPS)
  // Both as DICOM has them for a positioner (PS3.3 C.8.7.5), but in radians. The detector lies in the direction
  // (sin orbit · cos tilt, −cos orbit · cos tilt, sin tilt) from the isocentre. So the orbit is about the patient's
  // long axis, and the tilt about an axis that the orbit has turned. At 0 the tube is under the table, behind the
  // patient, and the detector in front of the patient.
  double orbit_rad = 0.0;  // Positioner Primary Angle: moves the detector to the patient's left (LAO is positive)
  double tilt_rad = 0.0;   // Positioner Secondary Angle: moves the detector towards the head (CRA is positive)
  Vec3 translation_mm = Vec3::Zero();
  double source_detector_mm = 1000.0;
  double source_isocentre_mm = 600.0;
  double detector_mm = 300.0;  // width; the height follows from the pixels, which are square
  int columns = 800, rows = 600;
};

// Three usual positions about an isocentre. In all of them the image is as from the detector towards the tube.
enum class View { anteroposterior, lateral, axial };
[[nodiscard]] CArm c_arm_at(View view, const Vec3& isocentre_mm);

// Error: invalid_input, naming the field: a length or an angle that is no number, a distance or a width that is not
// above zero, or a side of the image that is not from 1 to kMostPixelsOfSide.
[[nodiscard]] Result<ConeBeam> beam_of(const CArm& arm);
inline constexpr int kMostPixelsOfSide = 8192;
inline constexpr double kMostOfCArm_mm = 1e6;  // of any length

}  // namespace osteon::radiology
