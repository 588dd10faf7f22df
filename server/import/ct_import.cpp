#include "server/import/ct_import.hpp"

#include <algorithm>
#include <cmath>

#include "common/imaging/islands.hpp"
#include "common/imaging/resample.hpp"
#include "server/import/import_steps.hpp"

namespace osteon::import {
namespace {

// Shares of the time that the stages take, for one bar over all of them.
constexpr double kIslandsEnd = 0.1;
constexpr double kResampleEnd = 0.4;
constexpr double kSurfaceEnd = 0.85;

// The bone's voxels, the cell around each, and the band beyond.
CoordBox lattice_box(const imaging::HuVolume& volume, const imaging::IslandReport& bone, double pitch_mm) {
  const Vec3 first(bone.first[0], bone.first[1], bone.first[2]);
  const Vec3 last(bone.last[0], bone.last[1], bone.last[2]);
  const Box cells = imaging::enclosing_box(volume, first - Vec3::Ones(), last + Vec3::Ones());
  return covering_samples(cells.grown(5.0 * pitch_mm), pitch_mm);
}

// Bone ends where the scan does: the intersection of two solids is the maximum of their distances.
void cap_at_scan(const imaging::HuVolume& volume, double pitch_mm, DenseVolume<float>& surface_mm) {
  const float band = static_cast<float>(4.0 * pitch_mm);
  const CoordBox& box = surface_mm.box;
  float* value = surface_mm.values.data();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z, ++value) {
        const auto outside = static_cast<float>(imaging::outside_scan_mm(volume, position_mm({x, y, z}, pitch_mm)));
        *value = std::min(band, std::max(*value, outside));
      }
}

}  // namespace

Result<Case> import_ct(CtScan scan, const CtOptions& options, const KeepGoing& keep_going) {
  imaging::HuVolume& volume = scan.volume;
  const double pitch_mm = options.pitch_mm.value_or(volume.spacing_mm.minCoeff());
  const auto bone = imaging::keep_largest_island(volume, options.threshold_hu, part(keep_going, 0.0, kIslandsEnd));
  if (!bone) return tl::unexpected(bone.error());

  const CoordBox box = lattice_box(volume, *bone, pitch_mm);
  if (Result<void> fits = check_lattice(box, pitch_mm); !fits) return tl::unexpected(fits.error());

  auto hu = imaging::resample(volume, box, pitch_mm, part(keep_going, kIslandsEnd, kResampleEnd));
  if (!hu) return tl::unexpected(hu.error());
  volume.values = {};  // no longer needed, and large
  auto surface_mm = signed_distance_mm(*hu, static_cast<float>(options.threshold_hu), pitch_mm, part(keep_going, kResampleEnd, kSurfaceEnd));
  if (!surface_mm) return tl::unexpected(surface_mm.error());
  cap_at_scan(volume, pitch_mm, *surface_mm);

  DenseVolume<float> density = std::move(*hu);
  for (float& value : density.values) value = static_cast<float>(imaging::density_g_cm3(options.calibration, static_cast<double>(value)));
  if (!keep_going(kSurfaceEnd)) return failure(ErrorCode::cancelled, "stopped before building the case");

  CaseInfo info;
  info.title = options.title;
  info.source = scan.source;
  info.pitch_mm = pitch_mm;
  info.calibration = options.calibration;
  info.threshold_hu = options.threshold_hu;
  return Case::build(std::move(info), *surface_mm, density);
}

}  // namespace osteon::import
