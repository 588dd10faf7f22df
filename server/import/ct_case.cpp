#include "server/import/ct_case.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

#include "common/core/freed_memory.hpp"
#include "common/imaging/bone_field.hpp"
#include "common/imaging/resample.hpp"
#include "common/imaging/slice_shapes.hpp"
#include "common/volume/narrow_band.hpp"
#include "server/import/case_samples.hpp"
#include "server/import/import_steps.hpp"

namespace osteon::import {
namespace {

constexpr double kLeastPitch_mm = 0.02, kMostPitch_mm = 10.0, kMostGaussian_mm = 10.0, kMostMargin_mm = 200.0;
constexpr double kLeastSpacing_mm = 0.01, kMostSpacing_mm = 20.0;  // of a CT's voxels
// Margin around the processed voxels, so that everything that the segmentation reads beside a bone is included.
constexpr double kMargin_mm = 5.0;

// The HU of a box.
std::vector<std::int16_t> hu_of(const imaging::HuVolume& volume, const imaging::VoxelBox& box) {
  std::vector<std::int16_t> hu;
  hu.reserve(box.count());
  for (int slice = box.first[2]; slice <= box.last[2]; ++slice)
    for (int row = box.first[1]; row <= box.last[1]; ++row) {
      const auto line = volume.values.begin() + static_cast<std::ptrdiff_t>(volume.index(box.first[0], row, slice));
      hu.insert(hu.end(), line, line + box.dim(0));
    }
  return hu;
}

}  // namespace

ScanRegion region_around(const std::array<int, 3>& first, const std::array<int, 3>& last,
                         const imaging::HuVolume& volume, const CtOptions& options) {
  const double margin_mm = std::max(kMargin_mm, options.margin_mm);
  ScanRegion region;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int margin = 2 + static_cast<int>(std::ceil(margin_mm / volume.spacing_mm[static_cast<int>(axis)]));
    region.first[axis] = std::max(0, first[axis] - margin);
    region.last[axis] = std::min(volume.dims[axis] - 1, last[axis] + margin);
    region.ends[axis] = {region.first[axis] == 0, region.last[axis] == volume.dims[axis] - 1};
  }
  return region;
}

imaging::HuVolume without_values(const imaging::HuVolume& volume) {
  return {.dims = volume.dims,
          .spacing_mm = volume.spacing_mm,
          .origin_mm = volume.origin_mm,
          .directions = volume.directions,
          .values = {}};
}

double pitch_mm_of(const imaging::HuVolume& geometry, const CtOptions& options) {
  return options.pitch_mm.value_or(std::max(kLeastPitch_mm, geometry.spacing_mm.minCoeff()));
}

Result<void> check_options(const imaging::HuVolume& geometry, const CtOptions& options, double pitch_mm) {
  if (!(geometry.spacing_mm.minCoeff() >= kLeastSpacing_mm) || !(geometry.spacing_mm.maxCoeff() <= kMostSpacing_mm))
    return failure(ErrorCode::invalid_input,
                   "voxels of " + imaging::describe(geometry) + " are not those of a CT; export the scan again");
  if (!(pitch_mm >= kLeastPitch_mm) || !(pitch_mm <= kMostPitch_mm))
    return failure(ErrorCode::invalid_input, "the pitch must be a number from 0.02 to 10 mm; give another --pitch");
  if (!std::isfinite(options.threshold_hu))
    return failure(ErrorCode::invalid_input, "the threshold must be a number; give another --threshold");
  if (!std::isfinite(options.metal_hu)) return bad_input("the HU of metal must be a number; give another --metal-hu");
  if (!(options.gaussian_mm >= 0.0 && options.gaussian_mm <= kMostGaussian_mm))
    return bad_input("the Gaussian's sigma must be from 0 to 10 mm; give another --gaussian");
  if (!(options.margin_mm >= 0.0 && options.margin_mm <= kMostMargin_mm))
    return bad_input("the margin of the scan must be from 0 to 200 mm; give another --margin");
  if (const auto sound = check_landmarks(geometry, options.edits); !sound)
    return bad_input(options.edits_file + ", " + sound.error().message);
  return {};
}

Result<std::string> smooth_scan(imaging::HuVolume& scan, const CtOptions& options, const KeepGoing& keep_going) {
  std::string names;
  if (options.median) {
    if (auto done = imaging::smooth_median(scan, *options.median, part(keep_going, 0.0, 0.5)); !done)
      return tl::unexpected(done.error());
    names += options.median == imaging::MedianBox::slice ? ", median 3x3" : ", median 3x3x3";
  }
  if (options.gaussian_mm > 0.0) {
    if (auto done = imaging::smooth_gaussian(scan, options.gaussian_mm, part(keep_going, 0.5, 1.0)); !done)
      return tl::unexpected(done.error());
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), ", Gaussian %g mm", options.gaussian_mm);
    names += text.data();
  }
  return names;
}

Result<CoordBox> lattice_around(const imaging::HuVolume& volume, const std::array<int, 3>& bone_first,
                                const std::array<int, 3>& bone_last, double pitch_mm) {
  const Vec3 first(bone_first[0], bone_first[1], bone_first[2]), last(bone_last[0], bone_last[1], bone_last[2]);
  const Box cells = imaging::enclosing_box(volume, first - Vec3::Ones(), last + Vec3::Ones());
  const CoordBox lattice = covering_samples(cells.grown(5.0 * pitch_mm), pitch_mm);
  if (Result<void> fits = check_lattice(lattice, pitch_mm); !fits) return tl::unexpected(fits.error());
  return lattice;
}

Result<SparseVolume> measure_surface(const imaging::HuVolume& volume, const imaging::SparseMask& bones,
                                     const imaging::SurfaceLevel& level, const CoordBox& lattice, double pitch_mm,
                                     const KeepGoing& keep_going) {
  const auto field = imaging::BoneField::make(volume, bones, level, part(keep_going, 0.0, 0.02));
  if (!field) return tl::unexpected(field.error());
  const SampledField samples{
      .box = lattice,
      .inside = [&](const CoordBox& part) { return field->inside(imaging::voxels_for(volume, part, pitch_mm)); },
      .read =
          [&](const CoordBox& part, std::span<float> values) {
            const imaging::VoxelBox voxels = imaging::voxels_for(volume, part, pitch_mm);
            std::vector<std::int16_t> hu(voxels.count());
            field->read(voxels, hu);
            imaging::resample(volume, voxels, hu, part, pitch_mm, values);
          }};
  return narrow_band_mm(samples, static_cast<float>(level.threshold_hu), pitch_mm, part(keep_going, 0.02, 1.0));
}

Result<SparseVolume> measure_shapes(const imaging::HuVolume& volume, const imaging::SparseMask& bones,
                                    const imaging::SurfaceLevel& level, const CoordBox& lattice, double pitch_mm,
                                    const KeepGoing& keep_going) {
  const auto shapes = imaging::SliceShapes::make(volume, bones, level, part(keep_going, 0.0, 0.2));
  if (!shapes) return tl::unexpected(shapes.error());
  const SampledField samples{
      .box = lattice,
      .inside = [&](const CoordBox& part) { return shapes->inside(part, pitch_mm); },
      .read = [&](const CoordBox& part, std::span<float> values) { shapes->read(part, pitch_mm, values); }};
  return narrow_band_mm(samples, 0.0f, pitch_mm, part(keep_going, 0.2, 1.0));
}

CaseInfo description(const CtScan& scan, const CtOptions& options, const ScanCalibration& calibration,
                     double pitch_mm) {
  CaseInfo info;
  info.title = options.title;
  info.source = scan.source;
  info.pitch_mm = pitch_mm;
  info.calibration = calibration.line;
  info.density_from = calibration.provenance;
  // check_options() has refused a landmark beside the scan.
  for (const LabelEdit& edit : options.edits)
    if (edit.kind == EditKind::landmark) info.landmarks.push_back({edit.name, edit.points_mm.front()});
  return info;
}

Result<CtImport> make_case(MeasuredBones bones, CaseInfo info,
                           const std::function<void(const CaseScan&, CaseInfo&)>& list, const KeepGoing& keep_going) {
  // The samples are made from the scan that the case keeps, so that no voxel is in memory twice. Only a small margin
  // has too few voxels for that.
  const imaging::HuVolume volume = without_values(bones.volume);
  const double pitch_mm = info.pitch_mm;
  const DensityCalibration calibration = info.calibration;
  const imaging::VoxelBox needed = imaging::voxels_for(volume, bones.lattice, pitch_mm);
  std::vector<std::int16_t> beyond;
  if (!bones.keep.contains(needed)) beyond = hu_of(bones.volume, needed);
  const bool known_tissue = std::ranges::any_of(bones.known.tissue.values, [](std::uint8_t t) { return t != 0; });
  const std::bitset<256> bone_labels = bones.known.bone_labels;
  auto kept =
      kept_scan(std::move(bones.volume), std::move(bones.known), bones.keep, calibration, part(keep_going, 0.0, 0.03));
  if (!kept) return tl::unexpected(kept.error());
  list(*kept, info);
  const auto described = describe_scan(*kept, part(keep_going, 0.03, 0.125));
  if (!described) return tl::unexpected(described.error());
  info.scan = *described;
  CaseSamples content({.scan = bones.scan,
                       .volume = volume,
                       .hu_box = beyond.empty() ? bones.keep : needed,
                       .hu = beyond.empty() ? kept->hu : beyond,
                       .kept_box = bones.keep,
                       .kept = *kept,
                       .bone_labels = bone_labels,
                       .tissue_labels = bones.tissue_labels,
                       .several = bones.several,
                       .known_tissue = known_tissue,
                       .calibration = calibration,
                       .change_hu = bones.change_hu ? &*bones.change_hu : nullptr},
                      bones.surface_mm, pitch_mm);
  const FillPart fill = [&](const CoordBox& part_box, PartSamples& to) { return content.fill(part_box, to); };
  auto built = Case::build(std::move(info), bones.lattice, fill, part(keep_going, 0.125, 1.0));
  if (!built) return tl::unexpected(built.error());
  CtImport made{.found = {}, .bone = std::move(*built), .scan = std::move(*kept)};
  made.found.case_cm3 = made.bone->volume_mm3() * 1e-3;
  return made;
}

}  // namespace osteon::import
