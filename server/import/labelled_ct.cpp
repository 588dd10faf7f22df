// The case of a CT whose bones a label map says.
#include <algorithm>
#include <array>
#include <bitset>
#include <new>
#include <optional>

#include "common/core/freed_memory.hpp"
#include "common/imaging/hard_tissue.hpp"
#include "server/import/corrected_cortex.hpp"
#include "server/import/ct_case.hpp"
#include "server/import/label_surface.hpp"
#include "server/import/scan_ends.hpp"
#include "server/import/separated_bones.hpp"

namespace osteon::import {
namespace {

// The part of the scan with the labels of a map.
struct Labelled {
  imaging::HuVolume volume;
  imaging::SparseMask labels;  // of the part's voxels
  imaging::SparseMask bones;   // only those that are bone
  std::bitset<256> bone_labels;
  std::array<int, 3> first{}, last{};                // voxel box of the bones
  std::array<int, 3> labels_first{}, labels_last{};  // of all labels
};

// Widens a box so that it contains a voxel.
void widen(std::array<int, 3>& first, std::array<int, 3>& last, const std::array<int, 3>& at) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = std::min(first[axis], at[axis]);
    last[axis] = std::max(last[axis], at[axis]);
  }
}

Result<Labelled> take_labels(imaging::HuVolume scan, PlacedLabels& placed, const CtOptions& options,
                             const KeepGoing& keep_going) {
  Labelled found;
  for (const CaseLabel& label : placed.labels)
    found.bone_labels[static_cast<std::size_t>(label.value)] = is_carved(label.kind);
  found.first = found.labels_first = scan.dims;
  found.last = found.labels_last = {-1, -1, -1};
  for (int slice = 0; slice < scan.dims[2]; ++slice) {
    if (!keep_going(0.5 * slice / scan.dims[2])) return stopped_while("taking the labels");
    for (int row = 0; row < scan.dims[1]; ++row)
      for (int column = 0; column < scan.dims[0]; ++column) {
        const std::uint8_t value = placed.values.at(column, row, slice);
        if (value == 0) continue;
        widen(found.labels_first, found.labels_last, {column, row, slice});
        if (found.bone_labels[value]) widen(found.first, found.last, {column, row, slice});
      }
  }
  const ScanRegion work = region_around(found.labels_first, found.labels_last, scan, options);
  auto volume = imaging::cropped(std::move(scan), work.first, work.last, part(keep_going, 0.5, 0.8));
  if (!volume) return tl::unexpected(volume.error());
  found.volume = std::move(*volume);
  auto labels = imaging::cropped(std::move(placed.values), work.first, work.last, part(keep_going, 0.8, 1.0));
  if (!labels) return tl::unexpected(labels.error());
  found.labels = imaging::SparseMask(*labels);
  for (std::uint8_t& value : labels->values) value = found.bone_labels[value] ? value : std::uint8_t{0};
  found.bones = imaging::SparseMask(*labels);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::array<int, 3>* end : {&found.first, &found.last, &found.labels_first, &found.labels_last})
      (*end)[axis] -= work.first[axis];
  return found;
}

// What each label says of the tissue, which counts more than the HU.
std::array<Tissue, 256> said_tissues(const PlacedLabels& placed) {
  std::array<Tissue, 256> said{};
  for (const CaseLabel& label : placed.labels)
    said[static_cast<std::size_t>(label.value)] = label.kind == LabelKind::cortical     ? Tissue::cortical
                                                  : label.kind == LabelKind::cancellous ? Tissue::trabecular
                                                  : label.kind == LabelKind::metal      ? Tissue::metal
                                                  : label.kind == LabelKind::enamel     ? Tissue::enamel
                                                                                        : Tissue::none;
  return said;
}

// Writes the tissues that labels say over those of the HU. Gives these labels.
std::bitset<256> take_tissues(const PlacedLabels& placed, const imaging::SparseMask& labels,
                              imaging::VoxelMask& tissue) {
  const std::array<Tissue, 256> said = said_tissues(placed);
  std::bitset<256> saying;
  for (std::size_t label = 0; label < said.size(); ++label) saying[label] = said[label] != Tissue::none;
  if (saying.none()) return saying;
  if (tissue.values.empty()) tissue = imaging::VoxelMask(labels.dims);
  for (std::size_t i = 0; i < labels.values.size(); ++i) {
    const std::uint8_t label = labels.values[i];
    if (saying[label]) tissue.values[i] = static_cast<std::uint8_t>(said[label]);
  }
  return saying;
}

// The signed distance to labelled bones. `geometry`: of the whole scan, at whose ends they end.
Result<SparseVolume> measure_labels(const Labelled& found, const imaging::HuVolume& geometry, const CoordBox& lattice,
                                    double pitch_mm, const KeepGoing& keep_going) {
  const auto field = label_field(found.bones, found.volume, found.first, found.last, part(keep_going, 0.0, 0.3));
  if (!field) return tl::unexpected(field.error());
  // Every voxel of the field is on the side of 0 on which its label is, so its values stay as they are.
  auto surface_mm = measure_surface(field->field, field->bones, {}, lattice, pitch_mm, part(keep_going, 0.3, 0.9));
  if (!surface_mm) return surface_mm;
  // The volume is that of the bone within the scan.
  if (auto capped = cap_at_scan(geometry, pitch_mm, *surface_mm, part(keep_going, 0.9, 1.0)); !capped)
    return tl::unexpected(capped.error());
  const std::size_t voxels = field->bones.values.values().size();
  restore_volume(static_cast<double>(voxels) * geometry.spacing_mm.prod(), pitch_mm, lattice, *surface_mm);
  return surface_mm;
}

Result<CtImport> import_labelled(CtScan scan, PlacedLabels placed, const CtOptions& options,
                                 const KeepGoing& keep_going) {
  const imaging::HuVolume geometry = without_values(scan.volume);
  const double pitch_mm = pitch_mm_of(geometry, options);
  if (Result<void> sound = check_options(geometry, options, pitch_mm); !sound) return tl::unexpected(sound.error());
  auto calibrated = calibrate_scan(scan.volume, options.calibration, part(keep_going, 0.0, kCalibrateEnd));
  if (!calibrated) return tl::unexpected(calibrated.error());
  const auto smoothed = smooth_scan(scan.volume, options, part(keep_going, kCalibrateEnd, kSmoothEnd));
  if (!smoothed) return tl::unexpected(smoothed.error());
  scan.source += *smoothed + ", bones of a label map";
  const auto edits = edit_labels(scan.volume, options, placed, part(keep_going, kSmoothEnd, kSmoothEnd));
  if (!edits) return tl::unexpected(edits.error());
  auto found = take_labels(std::move(scan.volume), placed, options, part(keep_going, kSmoothEnd, kFindEnd));
  if (!found) return tl::unexpected(found.error());
  give_back_freed_memory();
  const auto lattice = lattice_around(found->volume, found->first, found->last, pitch_mm);
  if (!lattice) return tl::unexpected(lattice.error());
  auto surface_mm = measure_labels(*found, geometry, *lattice, pitch_mm, part(keep_going, kFindEnd, kSurfaceEnd));
  if (!surface_mm) return tl::unexpected(surface_mm.error());
  give_back_freed_memory();
  std::optional<SparseVolume> change_hu;
  if (options.thin_cortex) {
    auto change =
        correct_cortex(found->volume, *surface_mm, pitch_mm, *calibrated, part(keep_going, kSurfaceEnd, kCortexEnd));
    if (!change) return tl::unexpected(change.error());
    change_hu = std::move(*change);
  }
  const KeepGoing building = part(keep_going, kCortexEnd, 1.0);
  auto hard = imaging::find_hard_tissue(found->volume, found->bones, calibrated->line, options.metal_hu,
                                        part(building, 0.0, 0.2));
  if (!hard) return tl::unexpected(hard.error());
  found->bones = {};
  const std::bitset<256> tissue_labels = take_tissues(placed, found->labels, hard->tissue);

  const imaging::VoxelBox keep = kept_voxels(found->volume, found->labels_first, found->labels_last, options.margin_mm);
  auto made = make_case(
      {.scan = geometry,
       .volume = std::move(found->volume),
       .known = {std::move(found->labels), std::move(hard->tissue), found->bone_labels},
       .tissue_labels = tissue_labels,
       .keep = keep,
       .several = true,
       .lattice = *lattice,
       .surface_mm = std::move(*surface_mm),
       .change_hu = std::move(change_hu)},
      description(scan, options, *calibrated, pitch_mm),
      [&](const CaseScan& kept, CaseInfo& info) { list_labels(kept, placed, options, info); },
      part(building, 0.2, 1.0));
  if (made) {
    made->labels = std::move(placed);
    made->calibration_text = calibrated->text;
    made->found.edits = *edits;
  }
  return made;
}

}  // namespace

Result<CtImport> import_ct(CtScan scan, PlacedLabels labels, const CtOptions& options,
                           const KeepGoing& keep_going) try {
  return import_labelled(std::move(scan), std::move(labels), options, keep_going);
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, kNoMemory);
}

}  // namespace osteon::import
