#include "server/import/label_import.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/import/import_steps.hpp"
#include "server/import/kept_scan.hpp"
#include "server/import/label_surface.hpp"

namespace osteon::import {
namespace {

constexpr int kMargin = 5;  // samples beyond the bone: the band and the cell around it
// Shares of the stages in the total time.
constexpr double kKeepEnd = 0.05;
constexpr double kLabelSmoothEnd = 0.35;
constexpr double kResampleEnd = 0.4;
constexpr double kLabelSurfaceEnd = 0.85;

DenseVolume<std::uint8_t> cropped(const DenseVolume<std::uint8_t>& from, const CoordBox& box) {
  DenseVolume<std::uint8_t> out;
  out.box = box;
  out.values.reserve(static_cast<std::size_t>(box.dims().x) * static_cast<std::size_t>(box.dims().y) *
                     static_cast<std::size_t>(box.dims().z));
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      const auto line = from.values.begin() + static_cast<std::ptrdiff_t>(from.index({x, y, box.min.z}));
      out.values.insert(out.values.end(), line, line + box.dims().z);
    }
  return out;
}

// Bone ends where the volume ends, half a voxel beyond the outer centres: the intersection of two solids is the maximum
// of their distances.
void cap_at_volume(const imaging::LabelVolume& volume, double pitch_mm, DenseVolume<float>& surface_mm) {
  const CoordBox& box = surface_mm.box;
  const auto beyond = [&](int first, int last, int axis) {
    std::vector<float> out;
    const double spacing = volume.spacing_mm[axis], half = 0.5 * volume.dims[static_cast<std::size_t>(axis)] * spacing;
    for (int i = first; i <= last; ++i)
      out.push_back(static_cast<float>(std::abs(i * pitch_mm + 0.5 * spacing - half) - half));
    return out;
  };
  const auto xs = beyond(box.min.x, box.max.x, 0), ys = beyond(box.min.y, box.max.y, 1),
             zs = beyond(box.min.z, box.max.z, 2);
  const auto band = static_cast<float>(4.0 * pitch_mm);
  float* value = surface_mm.values.data();
  for (const float x : xs)
    for (const float y : ys)
      for (const float z : zs) {
        *value = std::min(band, std::max({*value, x, y, z}));
        ++value;
      }
}

}  // namespace

Result<LabelImport> import_labels(LabelStack stack, const LabelLegend& legend, const LabelOptions& options,
                                  const KeepGoing& keep_going) {
  imaging::LabelVolume& volume = stack.volume;
  const Vec3 spacing = volume.spacing_mm;
  const double pitch_mm = options.pitch_mm.value_or(spacing.minCoeff());
  double labelled_mm3 = 0;
  for (const ColourCount& colour : stack.colours)
    if (colour.label != 0) labelled_mm3 += static_cast<double>(colour.voxels) * spacing.prod();

  // Only the bone's box, and the reach of the filter and the band beyond it.
  const CoordBox all = volume.labels.box;
  CoordBox voxels = imaging::bone_voxels(volume).grown(kMargin);
  voxels.min = {std::max(voxels.min.x, all.min.x), std::max(voxels.min.y, all.min.y),
                std::max(voxels.min.z, all.min.z)};
  voxels.max = {std::min(voxels.max.x, all.max.x), std::min(voxels.max.y, all.max.y),
                std::min(voxels.max.z, all.max.z)};
  if (voxels != all) volume.labels = cropped(volume.labels, voxels);
  const Box bone{position_mm(voxels.min, 1.0).cwiseProduct(spacing),
                 position_mm(voxels.max, 1.0).cwiseProduct(spacing)};
  const CoordBox box = covering_samples(bone.grown(kMargin * pitch_mm), pitch_mm);
  if (Result<void> fits = check_lattice(box, pitch_mm); !fits) return tl::unexpected(fits.error());
  auto kept = kept_scan(volume, part(keep_going, 0.0, 0.5 * kKeepEnd));
  if (!kept) return tl::unexpected(kept.error());
  const auto described = describe_scan(*kept, part(keep_going, 0.5 * kKeepEnd, kKeepEnd));
  if (!described) return tl::unexpected(described.error());

  auto smooth = imaging::smooth_labels(volume, options.smoothing, part(keep_going, kKeepEnd, kLabelSmoothEnd));
  if (!smooth) return tl::unexpected(smooth.error());
  auto field = imaging::resample(*smooth, spacing, box, pitch_mm, part(keep_going, kLabelSmoothEnd, kResampleEnd));
  if (!field) return tl::unexpected(field.error());
  smooth->values = {};
  auto surface_mm = signed_distance_mm(*field, 0.0f, pitch_mm, part(keep_going, kResampleEnd, kLabelSurfaceEnd));
  if (!surface_mm) return tl::unexpected(surface_mm.error());
  field->values = {};
  cap_at_volume(volume, pitch_mm, *surface_mm);
  restore_volume(labelled_mm3, pitch_mm, *surface_mm);
  cap_at_volume(volume, pitch_mm, *surface_mm);

  std::vector<float> densities{0.0f};
  for (const BoneColour& colour : legend.bones) densities.push_back(static_cast<float>(colour.density_g_cm3));
  auto density = imaging::label_density(volume, densities, box, pitch_mm, part(keep_going, kLabelSurfaceEnd, 0.9));
  if (!density) return tl::unexpected(density.error());
  volume.labels = {};

  char source[160];
  std::snprintf(source, sizeof source, "label volume, %dx%dx%d, %.4gx%.4gx%.4g mm", volume.dims[0], volume.dims[1],
                volume.dims[2], spacing.x(), spacing.y(), spacing.z());
  CaseInfo info;
  info.title = options.title;
  info.source = source;
  info.pitch_mm = pitch_mm;  // densities are given by label, so there is neither a calibration nor a threshold
  info.scan = *described;
  list_labels(legend, info);
  auto built = Case::build(std::move(info), *surface_mm, *density, {}, part(keep_going, 0.9, 1.0));
  if (!built) return tl::unexpected(built.error());
  return LabelImport{std::move(*built), labelled_mm3, std::move(*kept)};
}

}  // namespace osteon::import
