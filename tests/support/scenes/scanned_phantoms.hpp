// Phantom bones through a simulated CT scanner, DICOM files and the ordinary import, compared with the phantoms. Slices
// are 3 mm thick and tilted by 12 degrees; pixels are 0.8 mm, noise is 30 HU, and the blur has a sigma of 0.5 mm.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "common/phantoms/phantom_bone.hpp"
#include "server/import/ct_import.hpp"

namespace osteon::test {

// Scans what is around a bone, writes the slices into a new folder, and imports them. `shown` is what the scanner
// sees: `around` itself, or a bone that goes on beyond it. Errors: those of scanner, reader and import.
[[nodiscard]] Result<import::CtImport> scanned_and_imported(const phantoms::PhantomBone& shown,
                                                            const phantoms::PhantomBone& around,
                                                            const import::CtOptions& options,
                                                            const std::filesystem::path& folder);

// Dice of the volumes, and errors of the mean density, percent, of the interiors of cortex and of cancellous bone. What
// is nearer to a face than 1 mm in cortex, and 2.5 mm in cancellous bone, a scan of such slices blurs.
struct PhantomAgreement {
  double dice = 0.0, cortical_percent = 0.0, cancellous_percent = 0.0;
};
// The case was saved into the folder, and loaded again. `compared_mm`: between two compared samples.
[[nodiscard]] Result<PhantomAgreement> agreement_of_scan(const phantoms::PhantomBone& bone,
                                                         const import::CtOptions& options,
                                                         const std::filesystem::path& folder, double compared_mm = 1.0);

// A point deep in the cortex of a bone, far from the ends of a tilted scan. `number`: of the bone.
[[nodiscard]] Vec3 cortex_of(const phantoms::PhantomBone& bone, int number);

struct BoneSeed {
  Vec3 at_mm = Vec3::Zero();
  int bone = 0;  // its number
};
struct BoneDice {
  std::string bone;
  double dice = 0.0;
};
// Dice of each bone of a joint, if each grows from a seed in its cortex, and from those given. The scan ends in bones.
// Error: internal, if a bone grew that has no seed; and those of the import.
[[nodiscard]] Result<std::vector<BoneDice>> dice_of_bones(const phantoms::PhantomBone& joint,
                                                          const std::vector<BoneSeed>& more,
                                                          const std::filesystem::path& folder);

}  // namespace osteon::test
