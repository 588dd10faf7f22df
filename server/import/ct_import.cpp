#include "server/import/ct_import.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdio>
#include <new>
#include <numeric>
#include <span>
#include <vector>

#include "common/core/freed_memory.hpp"
#include "common/imaging/bone_field.hpp"
#include "common/imaging/hard_tissue.hpp"
#include "common/imaging/resample.hpp"
#include "common/imaging/segmentation.hpp"
#include "common/imaging/threshold.hpp"
#include "common/volume/narrow_band.hpp"
#include "server/import/case_samples.hpp"
#include "server/import/import_steps.hpp"
#include "server/import/kept_scan.hpp"

namespace osteon::import {
namespace {

// Shares of the stages in the total time, for one progress bar over all of them.
constexpr double kSmoothEnd = 0.05, kGrowEnd = 0.1, kSegmentEnd = 0.35, kSurfaceEnd = 0.85;
// Smallest size of parts of an island that are reported if only marrow connects them: absolute, and relative to the
// largest.
constexpr double kLargePiece_cm3 = 0.5, kLargePiece = 0.1;
constexpr double kLeastPitch_mm = 0.02, kMostPitch_mm = 10.0, kMostGaussian_mm = 10.0, kMostMargin_mm = 200.0;
constexpr double kLeastSpacing_mm = 0.01, kMostSpacing_mm = 20.0;  // of a CT's voxels
// Margin around the processed voxels, so that everything that the segmentation reads beside a bone is included.
constexpr double kMargin_mm = 5.0;

// A part of the scan, and the sides on which it ends with the scan.
struct Region {
  std::array<int, 3> first{}, last{};
  imaging::ScanEnds ends{};
};

Region grown(const std::array<int, 3>& first, const std::array<int, 3>& last, const imaging::HuVolume& volume,
             double margin_mm) {
  Region region;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int margin = 2 + static_cast<int>(std::ceil(margin_mm / volume.spacing_mm[static_cast<int>(axis)]));
    region.first[axis] = std::max(0, first[axis] - margin);
    region.last[axis] = std::min(volume.dims[axis] - 1, last[axis] + margin);
    region.ends[axis] = {region.first[axis] == 0, region.last[axis] == volume.dims[axis] - 1};
  }
  return region;
}

// Margin of what is processed, so that it contains what the case keeps of the scan.
double margin_mm_of(const CtOptions& options) { return std::max(kMargin_mm, options.margin_mm); }

// The part around everything at or above the threshold, with what the case keeps of the scan; the whole scan if there
// is nothing. Error: cancelled.
Result<Region> dense_region(const imaging::HuVolume& volume, const CtOptions& options, const KeepGoing& keep_going) {
  const double margin_mm = margin_mm_of(options);
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
    return grown({0, 0, 0}, {volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1}, volume, margin_mm);
  return grown(first, last, volume, margin_mm);
}

// The bone's voxels, the cell around each, and the band beyond.
CoordBox lattice_box(const imaging::HuVolume& volume, const std::array<int, 3>& bone_first,
                     const std::array<int, 3>& bone_last, double pitch_mm) {
  const Vec3 first(bone_first[0], bone_first[1], bone_first[2]), last(bone_last[0], bone_last[1], bone_last[2]);
  const Box cells = imaging::enclosing_box(volume, first - Vec3::Ones(), last + Vec3::Ones());
  return covering_samples(cells.grown(5.0 * pitch_mm), pitch_mm);
}

Result<std::vector<int>> islands_to_keep(const CtOptions& options, const std::vector<imaging::Island>& islands) {
  std::vector<int> all(islands.size());
  std::iota(all.begin(), all.end(), 1);
  if (options.keep_all) return all;
  if (options.keep.empty()) return std::vector<int>{1};
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

// The part of the scan with dense voxels, its islands, and the bone to which each voxel belongs.
struct Segmented {
  imaging::HuVolume volume;
  imaging::VoxelMask bones;
  std::array<int, 3> first{}, last{};  // voxel box of the kept islands
  CtSegmentation found;
};

// Large parts of kept islands that consist of dense and cancellous bone, cm³, largest first. Error: cancelled.
Result<std::vector<double>> pieces_without_marrow(const Segmented& s, const imaging::VoxelMask& bone,
                                                  const KeepGoing& keep_going) {
  imaging::VoxelMask firm(s.volume.dims);
  for (std::size_t i = 0; i < firm.values.size(); ++i)
    firm.values[i] =
        s.bones.values[i] != 0 && bone.values[i] != static_cast<std::uint8_t>(imaging::BoneVoxel::marrow) ? 1 : 0;
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

// Writes into `s.found` what was found and what was done with it. Error: cancelled.
Result<void> summarise(const imaging::VoxelMask& bone, const imaging::Islands& islands, std::vector<int> kept,
                       Segmented& s, const KeepGoing& keep_going) {
  CtSegmentation& found = s.found;
  std::int64_t below = 0;
  for (std::size_t i = 0; i < bone.values.size(); ++i)
    below += s.bones.values[i] != 0 && bone.values[i] != static_cast<std::uint8_t>(imaging::BoneVoxel::dense) ? 1 : 0;
  found.marrow_cm3 = static_cast<double>(below) * s.volume.spacing_mm.prod() * 1e-3;
  found.region = imaging::enclosing_box(s.volume, Vec3::Zero(),
                                        Vec3(s.volume.dims[0] - 1, s.volume.dims[1] - 1, s.volume.dims[2] - 1));
  found.islands = islands.list;
  for (const imaging::Island& island : islands.list) found.left_out_cm3 += island.volume_cm3;
  for (const int number : kept) found.left_out_cm3 -= islands.list[static_cast<std::size_t>(number - 1)].volume_cm3;
  if (kept.size() == islands.list.size()) found.left_out_cm3 = 0.0;
  // Several islands each have parts of their own, which nobody mistakes for a fracture.
  if (kept.size() == 1) {
    auto pieces = pieces_without_marrow(s, bone, keep_going);
    if (!pieces) return tl::unexpected(pieces.error());
    found.joined_cm3 = std::move(*pieces);
  }
  found.kept = std::move(kept);
  return {};
}

// The filters that the options name, and their names for the case's source. Error: cancelled.
Result<std::string> smooth(imaging::HuVolume& scan, const CtOptions& options, const KeepGoing& keep_going) {
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

Result<imaging::ThresholdSuggestion> suggested_threshold(const imaging::HuVolume& scan, const KeepGoing& keep_going) {
  const auto histogram = imaging::hu_histogram(scan, keep_going);
  if (!histogram) return tl::unexpected(histogram.error());
  return imaging::suggest_threshold(*histogram);
}

// The part around all regions.
Region grown_region(const std::vector<imaging::Region>& regions, const imaging::HuVolume& volume, double margin_mm) {
  std::array<int, 3> first = volume.dims, last{-1, -1, -1};
  for (const imaging::Region& region : regions)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = std::min(first[axis], region.first[axis]);
      last[axis] = std::max(last[axis], region.last[axis]);
    }
  return grown(first, last, volume, margin_mm);
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

// `bones`: what grew from seeds, if there are any.
Result<Segmented> segment(imaging::HuVolume scan, const CtOptions& options, std::optional<GrownBones> bones,
                          const KeepGoing& keep_going) {
  const auto work = bones ? Result<Region>(grown_region(bones->regions, scan, margin_mm_of(options)))
                          : dense_region(scan, options, keep_going);
  if (!work) return tl::unexpected(work.error());
  Segmented s;
  s.volume = imaging::cropped(std::move(scan), work->first, work->last);
  imaging::SegmentationParams params;
  params.threshold_hu = options.threshold_hu;
  params.hollow = options.hollow;
  const KeepGoing segmenting = part(keep_going, 0.0, 0.8);
  const auto bone =
      bones ? imaging::segment_bone(s.volume, imaging::cropped(std::move(bones->labels), work->first, work->last),
                                    params, work->ends, segmenting)
            : imaging::segment_bone(s.volume, params, work->ends, segmenting);
  if (!bone) return tl::unexpected(bone.error());
  const auto islands = imaging::find_islands(s.volume, *bone, options.calibration, part(keep_going, 0.8, 0.9));
  if (!islands) return tl::unexpected(islands.error());
  auto kept = options.list_only ? Result<std::vector<int>>{}
              : bones           ? Result<std::vector<int>>(islands_of(bones->regions, *islands, work->first))
                                : islands_to_keep(options, islands->list);
  if (!kept) return tl::unexpected(kept.error());
  s.bones = imaging::number_bones(*islands, *kept, options.merge, s.volume.dims);
  s.found.merged = options.merge;
  if (bones) s.found.regions = std::move(bones->regions);
  s.first = s.volume.dims;
  s.last = {-1, -1, -1};
  for (const int number : *kept)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const imaging::Island& island = islands->list[static_cast<std::size_t>(number - 1)];
      s.first[axis] = std::min(s.first[axis], island.first[axis]);
      s.last[axis] = std::max(s.last[axis], island.last[axis]);
    }
  if (auto summarised = summarise(*bone, *islands, std::move(*kept), s, part(keep_going, 0.9, 1.0)); !summarised)
    return tl::unexpected(summarised.error());
  return s;
}

// The signed distance to the kept bones in the narrow band around their surface.
Result<SparseVolume> measure_surface(const Segmented& s, const CoordBox& box, double threshold_hu, double pitch_mm,
                                     const KeepGoing& keep_going) {
  if (Result<void> fits = check_lattice(box, pitch_mm); !fits) return tl::unexpected(fits.error());
  const imaging::BoneField field(s.volume, s.bones, threshold_hu);
  const SampledField samples{
      .box = box,
      .inside = [&](const CoordBox& part) { return field.inside(imaging::voxels_for(s.volume, part, pitch_mm)); },
      .read =
          [&](const CoordBox& part, std::span<float> values) {
            const imaging::VoxelBox voxels = imaging::voxels_for(s.volume, part, pitch_mm);
            std::vector<std::int16_t> hu(voxels.count());
            field.read(voxels, hu);
            imaging::resample(s.volume, voxels, hu, part, pitch_mm, values);
          }};
  return narrow_band_mm(samples, static_cast<float>(threshold_hu), pitch_mm, keep_going);
}

// The geometry of a volume without its values.
imaging::HuVolume geometry_of(const imaging::HuVolume& volume) {
  imaging::HuVolume geometry;
  geometry.dims = volume.dims;
  geometry.spacing_mm = volume.spacing_mm;
  geometry.origin_mm = volume.origin_mm;
  geometry.directions = volume.directions;
  return geometry;
}

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

// What is wrong with the voxels or the options. Error: invalid_input.
Result<void> check_options(const imaging::HuVolume& geometry, const CtOptions& options, double pitch_mm) {
  if (!(geometry.spacing_mm.minCoeff() >= kLeastSpacing_mm) || !(geometry.spacing_mm.maxCoeff() <= kMostSpacing_mm))
    return failure(ErrorCode::invalid_input,
                   "voxels of " + imaging::describe(geometry) + " are not those of a CT; export the scan again");
  if (!(pitch_mm >= kLeastPitch_mm) || !(pitch_mm <= kMostPitch_mm))
    return failure(ErrorCode::invalid_input, "the pitch must be a number from 0.02 to 10 mm; give another --pitch");
  if (!std::isfinite(options.threshold_hu))
    return failure(ErrorCode::invalid_input, "the threshold must be a number; give another --threshold");
  if (!(options.gaussian_mm >= 0.0 && options.gaussian_mm <= kMostGaussian_mm))
    return bad_input("the Gaussian's sigma must be from 0 to 10 mm; give another --gaussian");
  if (!(options.margin_mm >= 0.0 && options.margin_mm <= kMostMargin_mm))
    return bad_input("the margin of the scan must be from 0 to 200 mm; give another --margin");
  return {};
}

// Finds the bones in the scan, and adds to its source what was done. `options`: gets the threshold that was used.
Result<Segmented> find_bones(CtScan& scan, CtOptions& options, const KeepGoing& keep_going) {
  const auto smoothed = smooth(scan.volume, options, part(keep_going, 0.0, kSmoothEnd));
  if (!smoothed) return tl::unexpected(smoothed.error());
  scan.source += *smoothed;
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
    auto grown = grow_bones(scan.volume, options.grow, options.threshold_hu, part(keep_going, kSmoothEnd, kGrowEnd));
    if (!grown) return tl::unexpected(grown.error());
    options.threshold_hu = grown->threshold_hu;
    scan.source += grown->description;
    bones = std::move(*grown);
  }
  auto s = segment(std::move(scan.volume), options, std::move(bones), part(keep_going, kGrowEnd, kSegmentEnd));
  if (s) s->found.threshold_reason = std::move(reason);
  return s;
}

Result<CtImport> make_case(CtScan scan, CtOptions options, const KeepGoing& keep_going) {
  const imaging::HuVolume geometry = geometry_of(scan.volume);
  const double pitch_mm = options.pitch_mm.value_or(std::max(kLeastPitch_mm, geometry.spacing_mm.minCoeff()));
  if (Result<void> sound = check_options(geometry, options, pitch_mm); !sound) return tl::unexpected(sound.error());
  auto s = find_bones(scan, options, keep_going);
  if (!s) return tl::unexpected(s.error());
  if (!s->found.regions.empty())
    s->found.region = imaging::enclosing_box(geometry, Vec3::Zero(),
                                             Vec3(geometry.dims[0] - 1, geometry.dims[1] - 1, geometry.dims[2] - 1));
  if (options.list_only) return CtImport{std::move(s->found), {}, {}};
  give_back_freed_memory();
  const CoordBox lattice = lattice_box(s->volume, s->first, s->last, pitch_mm);
  auto surface_mm =
      measure_surface(*s, lattice, options.threshold_hu, pitch_mm, part(keep_going, kSegmentEnd, kSurfaceEnd));
  if (!surface_mm) return tl::unexpected(surface_mm.error());
  give_back_freed_memory();
  const KeepGoing building = part(keep_going, kSurfaceEnd, 1.0);
  auto hard = imaging::find_hard_tissue(s->volume, s->bones, options.calibration, part(building, 0.0, 0.2));
  if (!hard) return tl::unexpected(hard.error());
  s->found.metal_cm3 = hard->metal_cm3;
  s->found.enamel_cm3 = hard->enamel_cm3;

  CaseInfo info;
  info.title = options.title;
  info.source = scan.source;
  info.pitch_mm = pitch_mm;
  info.calibration = options.calibration;
  info.threshold_hu = options.threshold_hu;
  // The samples are made from the scan that the case keeps, so that no voxel is in memory twice. Only a small margin
  // has too few voxels for that.
  const imaging::HuVolume volume = geometry_of(s->volume);
  const imaging::VoxelBox kept_box = kept_voxels(volume, s->first, s->last, options.margin_mm),
                          needed = imaging::voxels_for(volume, lattice, pitch_mm);
  std::vector<std::int16_t> beyond;
  if (!kept_box.contains(needed)) beyond = hu_of(s->volume, needed);
  CaseScan kept = kept_scan(std::move(s->volume), std::move(s->bones), std::move(hard->tissue), kept_box, options);
  list_labels(kept, options, s->found, info);
  const auto described = describe_scan(kept, part(building, 0.2, 0.3));
  if (!described) return tl::unexpected(described.error());
  info.scan = *described;
  CaseSamples content({.scan = geometry,
                       .volume = volume,
                       .hu_box = beyond.empty() ? kept_box : needed,
                       .hu = beyond.empty() ? kept.hu : beyond,
                       .kept_box = kept_box,
                       .kept = kept,
                       .several = s->found.kept.size() > 1 && !options.merge,
                       .hard = hard->metal_cm3 > 0.0 || hard->enamel_cm3 > 0.0,
                       .calibration = options.calibration},
                      *surface_mm, pitch_mm);
  const FillPart fill = [&](const CoordBox& part_box, PartSamples& to) { return content.fill(part_box, to); };
  auto built = Case::build(std::move(info), lattice, fill, part(building, 0.3, 1.0));
  if (!built) return tl::unexpected(built.error());
  s->found.case_cm3 = built->volume_mm3() * 1e-3;
  return CtImport{std::move(s->found), std::move(*built), std::move(kept)};
}

}  // namespace

Result<CtImport> import_ct(CtScan scan, const CtOptions& options, const KeepGoing& keep_going) try {
  return make_case(std::move(scan), options, keep_going);
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted,
                 "this machine has no memory for a scan of that size; export thicker slices or a smaller region");
}

}  // namespace osteon::import
