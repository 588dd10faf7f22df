// Bones of a known shape as a CT scanner sees them: blurred, noisy, in thick, tilted or uneven slices. They go through
// DICOM files and the ordinary import; the result is compared with the shape itself.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/import/ct_import.hpp"

namespace osteon::test {

// A shaft with rounded ends: everything within `radius_mm` of a straight line. A shell of cortex around cancellous
// bone.
struct Shaft {
  Vec3 from_mm = Vec3::Zero(), to_mm = Vec3::Zero();
  double radius_mm = 9.0, cortex_mm = 3.0;

  [[nodiscard]] double surface_mm(const Vec3& at_mm) const;  // exact signed distance, negative inside
  [[nodiscard]] double volume_mm3() const;                   // with the cortex
  [[nodiscard]] double cancellous_mm3() const;
};

struct BoneScan {
  std::string name;
  std::vector<Shaft> shafts;
  double pixel_mm = 0.7;
  std::vector<double> gaps_mm;         // between slices along their normal, the table's way
  double thickness_mm = 1.0;           // of a slice: HU are its mean
  double blur_mm = 0.4;                // sigma of the scanner's point spread function, the same along all axes
  double noise_hu = 25.0;              // standard deviation, independent for each voxel
  double tilt_degrees = 0.0;           // of the gantry, about x
  std::optional<double> skin_mm = {};  // radius of the limb, a cylinder along z in air; absent: soft tissue everywhere
  std::uint32_t seed = 1;

  [[nodiscard]] double surface_mm(const Vec3& at_mm) const;  // of the nearest shaft
};

// HU of what the scan consists of. Cortex and soft tissue are those of a real lower leg.
inline constexpr double kAir_hu = -1000.0, kSoftTissue_hu = 40.0, kCancellous_hu = 250.0, kCortex_hu = 1500.0;

// A long bone that is oblique to the slices, and two bones `gap_mm` apart.
[[nodiscard]] std::vector<Shaft> long_bone();
[[nodiscard]] std::vector<Shaft> two_bones(double gap_mm);

// How far the interior of a layer is from its faces: most of a face's blur is nearer.
inline constexpr double kInterior_mm = 1.0;

// The threshold at which a blurred edge of cortex in soft tissue stays where it is.
inline constexpr double kMidway_hu = 0.5 * (kSoftTissue_hu + kCortex_hu);

// The scans of the accuracy test: each bone in fine slices; with noise; with more blur; in slices of 3 mm; tilted by 20
// degrees; and in uneven slices.
[[nodiscard]] std::vector<BoneScan> accuracy_scans();

// Writes the slices as DICOM files, into a new folder. Error: internal (disk).
[[nodiscard]] Result<void> write_scan(const BoneScan& scan, const std::filesystem::path& folder);

struct Accuracy {
  double dice = 0.0;  // of the case's bone and the shape, on the case's own samples
  double mean_mm = 0.0,
         percentile95_mm = 0.0;  // distances of the surfaces, both ways; the percentile is the larger way's
  double offset_mm = 0.0;        // mean of the signed distance of the case's surface from the true one
  std::size_t islands = 0;       // that the threshold found, of at least 0.05 cm³
  double cortical_percent = 0.0, cancellous_percent = 0.0;                                // errors of the mean density
  double mass_percent = 0.0, cortical_mass_percent = 0.0, cancellous_mass_percent = 0.0;  // errors of the mass
};

// The bone of a case against the shape. An error of density or mass is what the case has more than the truth, as
// percent of the truth; the truth is what the case's calibration gives for the HU of the shape. Bone that the case
// lacks has no density.
// Density: the mean over the interior of the true cortex, at least kInterior_mm from both its faces, and over that of
// the true cancellous bone.
// Mass: the integral of density over all bone of the case that is less deep than the true cortex is thick, also outside
// of the true surface, and over all that is deeper; and their sum. The truth is density times the closed volume.
[[nodiscard]] Accuracy accuracy_of(const BoneScan& scan, const Case& bone);

// Writes the scan, imports it by the ordinary path with as many islands as there are bones, saves the case, loads it
// again and compares. `folder`: a new one, for both. Errors: those of all.
[[nodiscard]] Result<Accuracy> measure_accuracy(const BoneScan& scan, const import::CtOptions& options,
                                                const std::filesystem::path& folder);

}  // namespace osteon::test
