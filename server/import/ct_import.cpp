#include "server/import/ct_import.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <new>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "common/core/freed_memory.hpp"
#include "common/imaging/contrast.hpp"
#include "common/imaging/hard_tissue.hpp"
#include "common/imaging/segmentation.hpp"
#include "common/imaging/slice_shapes.hpp"
#include "common/imaging/threshold.hpp"
#include "server/import/corrected_cortex.hpp"
#include "server/import/ct_case.hpp"
#include "server/import/kept_scan.hpp"
#include "server/import/separated_bones.hpp"

namespace osteon::import {
namespace {

// Smallest size of parts of an island that are reported if only marrow connects them: absolute, and relative to the
// largest.
constexpr double kLargePiece_cm3 = 0.5, kLargePiece = 0.1;

// The part around everything at or above the threshold, with what the case keeps of the scan; the whole scan if there
// is nothing. Error: cancelled.
Result<ScanRegion> dense_region(const imaging::HuVolume& volume, const CtOptions& options,
                                const KeepGoing& keep_going) {
  std::array<int, 3> first = volume.dims, last{-1, -1, -1};
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(0.0)) return failure(ErrorCode::cancelled, "stopped before looking for the bone");
    for (int row = 0; row < volume.dims[1]; ++row) {
      const std::int16_t* hu = volume.values.data() + volume.index(0, row, slice);
      for (int column = 0; column < volume.dims[0]; ++column) {
        if (hu[column] < options.threshold_hu) continue;
        first = {std::min(first[0], column), std::min(first[1], row), std::min(first[2], slice)};
        last = {std::max(last[0], column), std::max(last[1], row), std::max(last[2], slice)};
      }
    }
  }
  if (last[0] < 0)
    return region_around({0, 0, 0}, {volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1}, volume, options);
  return region_around(first, last, volume, options);
}

std::vector<int> all_of(const std::vector<imaging::Island>& islands) {
  std::vector<int> all(islands.size());
  std::iota(all.begin(), all.end(), 1);
  return all;
}

Result<std::vector<int>> islands_to_keep(const CtOptions& options, const std::vector<imaging::Island>& islands,
                                         const std::vector<imaging::IslandNature>& natures) {
  if (options.keep_all) return all_of(islands);
  if (options.keep.empty()) {
    const auto bone = std::ranges::find(natures, imaging::IslandKind::bone, &imaging::IslandNature::kind);
    const bool has_contrast =
        std::ranges::find(natures, imaging::IslandKind::contrast, &imaging::IslandNature::kind) != natures.end();
    if (bone == natures.end())
      return failure(ErrorCode::invalid_input,
                     "no island is bone: all that reaches the threshold of " +
                         std::to_string(std::lround(options.threshold_hu)) + " HU is metal" +
                         (has_contrast ? " or contrast medium" : "") +
                         "; take it with --keep, or give a lower --threshold or a higher --metal-hu");
    return std::vector<int>{static_cast<int>(bone - natures.begin()) + 1};
  }
  std::vector<int> kept;
  for (const int number : options.keep) {
    if (number < 1 || number > static_cast<int>(islands.size()))
      return failure(ErrorCode::invalid_input, "--keep names island " + std::to_string(number) +
                                                   ", but at this threshold there are islands 1 to " +
                                                   std::to_string(islands.size()) +
                                                   "; give numbers of the list, or all");
    if (std::ranges::find(kept, number) == kept.end()) kept.push_back(number);
  }
  return kept;
}

imaging::SegmentationParams segmentation_params(const CtOptions& options) {
  imaging::SegmentationParams params;
  params.threshold_hu = options.threshold_hu;
  params.hollow = options.hollow;
  return params;
}

// The part of the scan with dense voxels, its islands, and the bone to which each voxel belongs.
struct Segmented {
  imaging::HuVolume volume;
  imaging::VoxelMask bones;
  imaging::SurfaceLevel level;
  std::array<int, 3> first{}, last{};  // voxel box of the bones
  CtSegmentation found;
};

// Large parts of kept islands that consist of dense and cancellous bone, cm³, largest first. Error: cancelled.
Result<std::vector<double>> pieces_without_marrow(const Segmented& s, const imaging::VoxelMask& bone,
                                                  const KeepGoing& keep_going) {
  imaging::VoxelMask firm(s.volume.dims);
  for (std::size_t i = 0; i < firm.values.size(); ++i)
    firm.values[i] =
        s.bones.values[i] != 0 && bone.values[i] != imaging::mask_value(imaging::BoneVoxel::marrow) ? 1 : 0;
  std::bitset<256> one;
  one.set(1);
  const auto pieces = imaging::find_components(firm, one, imaging::Connectivity::corners, keep_going);
  if (!pieces) return tl::unexpected(pieces.error());
  std::vector<double> volumes_cm3;
  for (const std::int64_t voxels : pieces->voxels())
    volumes_cm3.push_back(static_cast<double>(voxels) * s.volume.spacing_mm.prod() * 1e-3);
  std::ranges::sort(volumes_cm3, std::ranges::greater{});
  const double least_cm3 = volumes_cm3.empty() ? 0.0 : std::max(kLargePiece_cm3, kLargePiece * volumes_cm3.front());
  std::erase_if(volumes_cm3, [&](double volume) { return volume < least_cm3; });
  return volumes_cm3;
}

bool is_below_threshold(std::uint8_t voxel) {
  return voxel == imaging::mask_value(imaging::BoneVoxel::cancellous) ||
         voxel == imaging::mask_value(imaging::BoneVoxel::marrow);
}

// Writes into `s.found` what was found and what was done with it. Error: cancelled.
Result<void> summarise(const imaging::VoxelMask& bone, const imaging::Islands& islands, std::vector<int> kept,
                       Segmented& s, const KeepGoing& keep_going) {
  CtSegmentation& found = s.found;
  std::int64_t below = 0;
  for (std::size_t i = 0; i < bone.values.size(); ++i)
    below += s.bones.values[i] != 0 && is_below_threshold(bone.values[i]) ? 1 : 0;
  found.marrow_cm3 = static_cast<double>(below) * s.volume.spacing_mm.prod() * 1e-3;
  found.region = imaging::enclosing_box(s.volume, Vec3::Zero(),
                                        Vec3(s.volume.dims[0] - 1, s.volume.dims[1] - 1, s.volume.dims[2] - 1));
  found.islands = islands.list;
  for (const imaging::Island& island : islands.list) found.left_out_cm3 += island.volume_cm3;
  for (const int number : kept) found.left_out_cm3 -= islands.list[static_cast<std::size_t>(number - 1)].volume_cm3;
  if (kept.size() == islands.list.size()) found.left_out_cm3 = 0.0;
  // Several islands each have parts of their own, which nobody mistakes for a fracture.
  if (kept.size() == 1 && !s.found.separated) {
    auto pieces = pieces_without_marrow(s, bone, keep_going);
    if (!pieces) return tl::unexpected(pieces.error());
    found.joined_cm3 = std::move(*pieces);
  }
  found.kept = std::move(kept);
  return {};
}

Result<imaging::ThresholdSuggestion> suggested_threshold(const imaging::HuVolume& scan, const KeepGoing& keep_going) {
  const auto histogram = imaging::hu_histogram(scan, keep_going);
  if (!histogram) return tl::unexpected(histogram.error());
  return imaging::suggest_threshold(*histogram);
}

// Widens a part so that it contains another.
void widen(ScanRegion& region, const ScanRegion& other) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    region.first[axis] = std::min(region.first[axis], other.first[axis]);
    region.last[axis] = std::max(region.last[axis], other.last[axis]);
    for (std::size_t side = 0; side < 2; ++side)
      region.ends[axis][side] = region.ends[axis][side] || other.ends[axis][side];
  }
}

// The part around all regions.
ScanRegion region_around_all(const std::vector<imaging::Region>& regions, const imaging::HuVolume& volume,
                             const CtOptions& options) {
  std::array<int, 3> first = volume.dims, last{-1, -1, -1};
  for (const imaging::Region& region : regions)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = std::min(first[axis], region.first[axis]);
      last[axis] = std::max(last[axis], region.last[axis]);
    }
  return region_around(first, last, volume, options);
}

// The islands with the regions' seeds, in the order of the seeds. `first`: the part's first voxel in the scan.
std::vector<int> islands_of(const std::vector<imaging::Region>& regions, const imaging::Islands& islands,
                            const std::array<int, 3>& first) {
  std::vector<int> numbers;
  for (const imaging::Region& region : regions)
    for (const imaging::VoxelRun& run : islands.components.runs) {
      if (run.slice != region.seed[2] - first[2] || run.row != region.seed[1] - first[1] ||
          run.first > region.seed[0] - first[0] || run.last < region.seed[0] - first[0])
        continue;
      const int number = islands.number[run.component];
      if (std::ranges::find(numbers, number) == numbers.end()) numbers.push_back(number);
    }
  return numbers;
}

// Dense voxels without tables and casts, which would enclose a limb as bone encloses marrow. Those go to `equipment`.
Result<imaging::VoxelMask> take_out_equipment(const imaging::HuVolume& volume, imaging::VoxelMask dense,
                                              const CtOptions& options, const DensityCalibration& calibration,
                                              std::vector<imaging::VoxelRun>& equipment, const KeepGoing& keep_going) {
  const auto islands = imaging::find_islands(volume, dense, calibration, part(keep_going, 0.0, 0.5));
  if (!islands) return tl::unexpected(islands.error());
  const auto natures = imaging::name_islands(volume, dense, *islands, options.metal_hu, part(keep_going, 0.5, 1.0));
  if (!natures) return tl::unexpected(natures.error());
  for (const imaging::VoxelRun& run : islands->components.runs) {
    const auto island = static_cast<std::size_t>(islands->number[run.component] - 1);
    const imaging::IslandKind kind = (*natures)[island].kind;
    if (kind != imaging::IslandKind::table && kind != imaging::IslandKind::cast) continue;
    imaging::fill_run(dense, run, 0);
    equipment.push_back(run);
  }
  return dense;
}

// The voxels of bone, and of whatever else is as dense. `contrast`: what is known of contrast medium. Errors:
// invalid_input (there is none), cancelled.
Result<imaging::VoxelMask> find_voxels(const imaging::HuVolume& volume, const CtOptions& options,
                                       const DensityCalibration& calibration, const imaging::ScanEnds& ends,
                                       std::optional<imaging::BloodPool>& contrast, const KeepGoing& keep_going) {
  auto dense = imaging::dense_voxels(volume, options.threshold_hu, part(keep_going, 0.0, 0.03));
  if (!dense && dense.error().code == ErrorCode::invalid_input &&
      std::ranges::find(options.edits, EditKind::box, &LabelEdit::kind) != options.edits.end())
    return bad_input("the box: " + dense.error().message + " or draw a larger box");
  if (!dense) return dense;
  std::vector<imaging::VoxelRun> equipment;
  dense = take_out_equipment(volume, std::move(*dense), options, calibration, equipment, part(keep_going, 0.03, 0.1));
  if (!dense) return dense;
  if (!options.contrast_is_bone) {
    auto found =
        imaging::mark_contrast(volume, options.threshold_hu, options.metal_hu, *dense, part(keep_going, 0.1, 0.2));
    if (!found) return tl::unexpected(found.error());
    contrast = *found;
  }
  auto bone =
      imaging::segment_bone(volume, std::move(*dense), segmentation_params(options), ends, part(keep_going, 0.2, 1.0));
  if (!bone) return bone;
  for (const imaging::VoxelRun& run : equipment)
    imaging::fill_run(*bone, run, imaging::mask_value(imaging::BoneVoxel::dense));
  return bone;
}

// What grew from seeds, whatever its number.
imaging::VoxelMask dense_of(imaging::VoxelMask grown) {
  for (std::uint8_t& value : grown.values)
    value = imaging::mask_value(value != 0 ? imaging::BoneVoxel::dense : imaging::BoneVoxel::none);
  return grown;
}

// The voxels of the bones that grew from seeds. `work`: the part of the scan that `volume` is. Error: cancelled.
Result<imaging::VoxelMask> take_grown(const imaging::HuVolume& volume, imaging::VoxelMask grown, const ScanRegion& work,
                                      const CtOptions& options, const KeepGoing& keep_going) {
  auto labels = imaging::cropped(std::move(grown), work.first, work.last, part(keep_going, 0.0, 0.02));
  if (!labels) return labels;
  return imaging::segment_bone(volume, dense_of(std::move(*labels)), segmentation_params(options), work.ends,
                               part(keep_going, 0.02, 1.0));
}

// If nobody has chosen yet, the first islands get a colour each, so that one sees them apart.
std::vector<int> islands_with_colours(const std::vector<imaging::Island>& islands) {
  std::vector<int> first(std::min(kMostIslandsDrawn, islands.size()));
  std::iota(first.begin(), first.end(), 1);
  return first;
}

// `bones`: what grew from seeds, if there are any.
Result<Segmented> segment(imaging::HuVolume scan, const CtOptions& options, const DensityCalibration& calibration,
                          std::optional<GrownBones> bones, const KeepGoing& keep_going) {
  auto work = bones ? Result<ScanRegion>(region_around_all(bones->regions, scan, options))
                    : dense_region(scan, options, keep_going);
  if (!work) return tl::unexpected(work.error());
  if (const auto reached = reached_voxels(scan, options.edits))
    widen(*work, region_around(reached->first, reached->last, scan, options));
  Segmented s;
  auto cropped = imaging::cropped(std::move(scan), work->first, work->last, part(keep_going, 0.0, 0.02));
  if (!cropped) return tl::unexpected(cropped.error());
  s.volume = std::move(*cropped);
  const auto bone =
      bones ? take_grown(s.volume, std::move(bones->labels), *work, options, part(keep_going, 0.02, 0.65))
            : find_voxels(s.volume, options, calibration, work->ends, s.found.contrast, part(keep_going, 0.02, 0.65));
  if (!bone) return tl::unexpected(bone.error());
  const auto islands = imaging::find_islands(s.volume, *bone, calibration, part(keep_going, 0.65, 0.69));
  if (!islands) return tl::unexpected(islands.error());
  s.found.metal_hu = options.metal_hu;
  if (!bones) {
    // What grew from seeds is what somebody has chosen.
    auto natures = imaging::name_islands(s.volume, *bone, *islands, options.metal_hu, part(keep_going, 0.69, 0.72));
    if (!natures) return tl::unexpected(natures.error());
    s.found.natures = std::move(*natures);
  }
  auto kept = options.list_only ? Result<std::vector<int>>{}
              : bones           ? Result<std::vector<int>>(islands_of(bones->regions, *islands, work->first))
                                : islands_to_keep(options, islands->list, s.found.natures);
  if (!kept) return tl::unexpected(kept.error());
  if (options.draw_islands) {
    const std::vector<int> shown = options.list_only ? islands_with_colours(islands->list) : *kept;
    auto views = draw_islands(s.volume, *islands, shown, part(keep_going, 0.72, 0.72));
    if (!views) return tl::unexpected(views.error());
    s.found.views = std::move(*views);
  }
  s.bones = imaging::number_bones(*islands, options.number_islands ? all_of(islands->list) : *kept, options.merge,
                                  s.volume.dims);
  s.found.merged = options.merge;
  s.found.separated = options.separate;
  std::vector<imaging::BoneSeed> seeds;
  if (bones) {
    s.found.regions = std::move(bones->regions);
    seeds = std::move(bones->seeds);
  }
  for (imaging::BoneSeed& seed : seeds)
    for (std::size_t axis = 0; axis < 3; ++axis) seed.voxel[axis] -= work->first[axis];
  if (auto summarised = summarise(*bone, *islands, std::move(*kept), s, part(keep_going, 0.72, 0.78)); !summarised)
    return tl::unexpected(summarised.error());
  if (options.list_only) return s;
  auto level = finish_bones(s.volume, options, seeds, s.bones, s.found, part(keep_going, 0.78, 1.0));
  if (!level) return tl::unexpected(level.error());
  s.level = std::move(*level);
  const imaging::VoxelBox box = voxels_of(s.bones);
  s.first = box.first;
  s.last = box.last;
  return s;
}

// Applies the filters, then the box, so that voxels beside the box count for the filters. Adds to the scan's source
// what was done. Errors: invalid_input (a box without voxels), cancelled.
Result<void> prepare_scan(CtScan& scan, const CtOptions& options, const KeepGoing& keep_going) {
  const auto smoothed = smooth_scan(scan.volume, options, keep_going);
  if (!smoothed) return tl::unexpected(smoothed.error());
  scan.source += *smoothed;
  const auto box = boxed_voxels(scan.volume, options.edits);
  if (!box) return bad_input(options.edits_file + ", " + box.error().message);
  if (!*box) return {};
  auto cropped = imaging::cropped(std::move(scan.volume), (*box)->first, (*box)->last, part(keep_going, 1.0, 1.0));
  if (!cropped) return tl::unexpected(cropped.error());
  scan.volume = std::move(*cropped);
  scan.source += ", a box of it";
  return {};
}

// Finds the bones in the scan, and adds to its source what was done. `options`: gets the threshold that was used.
Result<Segmented> find_bones(CtScan& scan, CtOptions& options, const DensityCalibration& calibration,
                             const KeepGoing& keep_going) {
  std::string reason;
  if (options.suggest_threshold) {
    const auto suggested = suggested_threshold(scan.volume, part(keep_going, kSmoothEnd, kSmoothEnd));
    if (!suggested) return tl::unexpected(suggested.error());
    options.threshold_hu = suggested->threshold_hu;
    reason = suggested->reason;
    scan.source += ", threshold suggested";
  }
  std::optional<GrownBones> bones;
  if (!options.grow.seeds_mm.empty()) {
    auto grown = grow_bones(scan.volume, options.grow, options.threshold_hu, part(keep_going, kSmoothEnd, kFindEnd));
    if (!grown) return tl::unexpected(grown.error());
    options.threshold_hu = grown->threshold_hu;
    scan.source += grown->description;
    bones = std::move(*grown);
  }
  auto s =
      segment(std::move(scan.volume), options, calibration, std::move(bones), part(keep_going, kFindEnd, kSegmentEnd));
  if (s) {
    s->found.threshold_hu = options.threshold_hu;
    s->found.threshold_reason = std::move(reason);
  }
  return s;
}

CaseScan numbered_islands(const Segmented& s) {
  const imaging::HuVolume& v = s.volume;
  return {.geometry = {v.dims, v.origin_mm, v.directions * v.spacing_mm.asDiagonal()},
          .labels = SparseBytes(s.bones.values)};
}

Result<CtImport> import_bones(CtScan scan, CtOptions options, const KeepGoing& keep_going) {
  const imaging::HuVolume whole = without_values(scan.volume);
  const double pitch_mm = pitch_mm_of(whole, options);
  if (Result<void> sound = check_options(whole, options, pitch_mm); !sound) return tl::unexpected(sound.error());
  auto calibrated = calibrate_scan(scan.volume, options.calibration, part(keep_going, 0.0, kCalibrateEnd));
  if (!calibrated) return tl::unexpected(calibrated.error());
  if (auto prepared = prepare_scan(scan, options, part(keep_going, kCalibrateEnd, kSmoothEnd)); !prepared)
    return tl::unexpected(prepared.error());
  const imaging::HuVolume geometry = without_values(scan.volume);
  auto s = find_bones(scan, options, calibrated->line, keep_going);
  if (!s) return tl::unexpected(s.error());
  if (!s->found.regions.empty())
    s->found.region = imaging::enclosing_box(geometry, Vec3::Zero(),
                                             Vec3(geometry.dims[0] - 1, geometry.dims[1] - 1, geometry.dims[2] - 1));
  if (options.list_only)
    return CtImport{.found = std::move(s->found),
                    .bone = {},
                    .scan = options.number_islands ? numbered_islands(*s) : CaseScan(),
                    .calibration_text = calibrated->text};
  give_back_freed_memory();
  const auto lattice = lattice_around(s->volume, s->first, s->last, pitch_mm);
  if (!lattice) return tl::unexpected(lattice.error());
  // From here on nothing changes them. Dense, they would take half the memory of the scan.
  imaging::SparseMask bones(s->bones);
  s->bones = {};
  give_back_freed_memory();
  const bool shapes = options.between_slices == BetweenSlices::shapes ||
                      (options.between_slices == BetweenSlices::automatic && imaging::has_thick_slices(geometry));
  if (options.surface == SurfaceAt::threshold) scan.source += ", surface at the threshold";
  if (shapes) scan.source += ", shapes interpolated between slices";
  auto surface_mm = (shapes ? measure_shapes : measure_surface)(s->volume, bones, s->level, *lattice, pitch_mm,
                                                                part(keep_going, kSegmentEnd, kSurfaceEnd));
  if (!surface_mm) return tl::unexpected(surface_mm.error());
  s->level = {};
  give_back_freed_memory();
  std::optional<SparseVolume> change_hu;
  if (options.thin_cortex) {
    auto change =
        correct_cortex(s->volume, *surface_mm, pitch_mm, *calibrated, part(keep_going, kSurfaceEnd, kCortexEnd));
    if (!change) return tl::unexpected(change.error());
    change_hu = std::move(*change);
  }
  const KeepGoing building = part(keep_going, kCortexEnd, 1.0);
  auto hard = imaging::find_hard_tissue(s->volume, bones, calibrated->line, options.metal_hu, part(building, 0.0, 0.2));
  if (!hard) return tl::unexpected(hard.error());
  s->found.metal_cm3 = hard->metal_cm3;
  s->found.enamel_cm3 = hard->enamel_cm3;

  CaseInfo info = description(scan, options, *calibrated, pitch_mm);
  info.threshold_hu = options.threshold_hu;
  const imaging::VoxelBox keep = kept_voxels(s->volume, s->first, s->last, options.margin_mm);
  auto made = make_case(
      {.scan = geometry,
       .volume = std::move(s->volume),
       .known = {std::move(bones), std::move(hard->tissue), ~std::bitset<256>(1)},
       .tissue_labels = {},
       .keep = keep,
       .several = s->found.bones.empty() ? s->found.kept.size() > 1 && !options.merge
                                         : s->found.bones.size() > 1 || s->found.bones.front().number != 1,
       .lattice = *lattice,
       .surface_mm = std::move(*surface_mm),
       .change_hu = std::move(change_hu)},
      std::move(info), [&](const CaseScan& kept, CaseInfo& to) { list_labels(kept, options, s->found, to); },
      part(building, 0.2, 1.0));
  if (!made) return made;
  s->found.case_cm3 = made->found.case_cm3;
  made->found = std::move(s->found);
  made->calibration_text = calibrated->text;
  return made;
}

}  // namespace

Result<CtImport> import_ct(CtScan scan, const CtOptions& options, const KeepGoing& keep_going) try {
  return import_bones(std::move(scan), options, keep_going);
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, kNoMemory);
}

}  // namespace osteon::import
