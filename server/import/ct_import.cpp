#include "server/import/ct_import.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdio>
#include <new>
#include <numeric>

#include "common/imaging/bone_field.hpp"
#include "common/imaging/hard_tissue.hpp"
#include "common/imaging/resample.hpp"
#include "common/imaging/segmentation.hpp"
#include "common/imaging/threshold.hpp"
#include "server/import/import_steps.hpp"
#include "server/import/kept_scan.hpp"
#include "server/import/label_surface.hpp"

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

// Bone ends where the scan ends: the intersection of two solids is the maximum of their distances.
Result<void> cap_at_scan(const imaging::HuVolume& scan, double pitch_mm, DenseVolume<float>& surface_mm,
                         const KeepGoing& keep_going) {
  const auto band = static_cast<float>(4.0 * pitch_mm);
  const CoordBox& box = surface_mm.box;
  float* value = surface_mm.values.data();
  for (int x = box.min.x; x <= box.max.x; ++x) {
    if (!keep_going(static_cast<double>(x - box.min.x) / box.dims().x))
      return failure(ErrorCode::cancelled, "stopped at the ends of the scan");
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z, ++value) {
        if (*value >= band) continue;
        const auto outside = static_cast<float>(imaging::outside_scan_mm(scan, position_mm({x, y, z}, pitch_mm)));
        *value = std::min(band, std::max(*value, outside));
      }
  }
  return {};
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

// Labels of the lattice's samples from those of the voxels. A sample takes the label of the nearest voxel. If that is
// not bone, as near the surface, it takes that of any voxel of the cell, or else of any beside the nearest.
class NearestLabel {
 public:
  NearestLabel(const imaging::HuVolume& volume, const imaging::VoxelMask& bones) : volume_(volume), bones_(bones) {}
  // The index of the voxel from which a sample in bone takes its labels.
  [[nodiscard]] std::size_t voxel(const Vec3& position_mm) const {
    const Vec3 at = volume_.voxel(position_mm);
    const auto clamped = [&](double c, std::size_t axis) {
      return std::clamp(static_cast<int>(c), 0, volume_.dims[axis] - 1);
    };
    const std::size_t nearest =
        bones_.index(clamped(std::round(at.x()), 0), clamped(std::round(at.y()), 1), clamped(std::round(at.z()), 2));
    if (bones_.values[nearest] != 0) return nearest;
    for (int corner = 0; corner < 8; ++corner) {
      const std::size_t beside = bones_.index(clamped(std::floor(at.x()) + (corner & 1), 0),
                                              clamped(std::floor(at.y()) + (corner >> 1 & 1), 1),
                                              clamped(std::floor(at.z()) + (corner >> 2), 2));
      if (bones_.values[beside] != 0) return beside;
    }
    // The surface of labels may lie a part of a voxel beyond the cell.
    const int column = clamped(std::round(at.x()), 0), row = clamped(std::round(at.y()), 1),
              slice = clamped(std::round(at.z()), 2);
    for (int z = std::max(0, slice - 1); z <= std::min(volume_.dims[2] - 1, slice + 1); ++z)
      for (int y = std::max(0, row - 1); y <= std::min(volume_.dims[1] - 1, row + 1); ++y)
        for (int x = std::max(0, column - 1); x <= std::min(volume_.dims[0] - 1, column + 1); ++x)
          if (bones_.at(x, y, z) != 0) return bones_.index(x, y, z);
    return nearest;
  }

 private:
  const imaging::HuVolume& volume_;
  const imaging::VoxelMask& bones_;
};

// Makes the samples of the case from the scan, one part at a time. Density and labels are computed only where bone is
// in or near a leaf.
class CaseSamples {
 public:
  CaseSamples(const imaging::HuVolume& volume, const imaging::VoxelMask& bones, const imaging::VoxelMask& hard,
              bool several, const DenseVolume<float>& surface_mm, const CtOptions& options, double pitch_mm)
      : volume_(volume),
        bones_(bones),
        hard_(hard),
        several_(several),
        surface_mm_(surface_mm),
        calibration_(options.calibration),
        pitch_mm_(pitch_mm),
        band_(static_cast<float>(4.0 * pitch_mm)),
        label_(volume, bones) {}

  PartKind fill(const CoordBox& part, PartSamples& to) {
    const auto row = static_cast<std::size_t>(part.dims().z);
    std::size_t n = 0;
    for (int x = part.min.x; x <= part.max.x; ++x)
      for (int y = part.min.y; y <= part.max.y; ++y, n += row)
        std::copy_n(&surface_mm_.values[surface_mm_.index({x, y, part.min.z})], row, &to.surface_mm[n]);
    if (std::ranges::all_of(to.surface_mm, [&](float s) { return s >= band_; })) return PartKind::outside;

    std::ranges::fill(to.density_g_cm3, 0.0f);
    if (several_) to.bone.assign(to.surface_mm.size(), 0);
    if (!hard_.values.empty()) to.tissue.assign(to.surface_mm.size(), Tissue::none);
    const Coord first = floor_to(part.min, kLeafSize);
    for (int x = first.x; x <= part.max.x; x += kLeafSize)
      for (int y = first.y; y <= part.max.y; y += kLeafSize)
        for (int z = first.z; z <= part.max.z; z += kLeafSize) fill_leaf({x, y, z}, part, to);
    return PartKind::samples;
  }

 private:
  void fill_leaf(Coord origin, const CoordBox& part, PartSamples& to) {
    const CoordBox box{{std::max(origin.x, part.min.x), std::max(origin.y, part.min.y), std::max(origin.z, part.min.z)},
                       {std::min(origin.x + kLeafSize - 1, part.max.x), std::min(origin.y + kLeafSize - 1, part.max.y),
                        std::min(origin.z + kLeafSize - 1, part.max.z)}};
    const Coord dims = part.dims();
    const auto index = [&](Coord c) {
      return (static_cast<std::size_t>(c.x - part.min.x) * static_cast<std::size_t>(dims.y) +
              static_cast<std::size_t>(c.y - part.min.y)) *
                 static_cast<std::size_t>(dims.z) +
             static_cast<std::size_t>(c.z - part.min.z);
    };
    const auto each = [&](auto visit) {
      for (int x = box.min.x; x <= box.max.x; ++x)
        for (int y = box.min.y; y <= box.max.y; ++y)
          for (int z = box.min.z; z <= box.max.z; ++z) visit(Coord{x, y, z}, index({x, y, z}));
    };
    bool near = false;
    each([&](Coord, std::size_t i) { near = near || to.surface_mm[i] < band_; });
    if (!near) return;
    const Coord size = box.dims();
    hu_.resize(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z));
    imaging::resample(volume_, box, pitch_mm_, hu_);
    std::size_t n = 0;
    each([&](Coord c, std::size_t i) {
      to.density_g_cm3[i] =
          static_cast<float>(imaging::bone_density_g_cm3(calibration_, static_cast<double>(hu_[n++])));
      if (to.surface_mm[i] >= 0.0f || (to.bone.empty() && to.tissue.empty())) return;
      const std::size_t voxel = label_.voxel(position_mm(c, pitch_mm_));
      if (!to.bone.empty()) to.bone[i] = bones_.values[voxel];
      if (!to.tissue.empty()) to.tissue[i] = static_cast<Tissue>(hard_.values[voxel]);
    });
  }

  const imaging::HuVolume& volume_;
  const imaging::VoxelMask &bones_, &hard_;
  bool several_;
  const DenseVolume<float>& surface_mm_;
  DensityCalibration calibration_;
  double pitch_mm_;
  float band_;
  NearestLabel label_;
  std::vector<float> hu_;
};

// The part of the scan with bone, and the bone to which each voxel belongs.
struct Segmented {
  imaging::HuVolume volume;
  imaging::VoxelMask bones;
  std::array<int, 3> first{}, last{};  // voxel box of the bones
  CtSegmentation found;                // without a label map
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

// The part of the scan with the labels of a map.
struct Labelled {
  Segmented s;
  imaging::VoxelMask labels;                         // of the part's voxels
  std::array<int, 3> labels_first{}, labels_last{};  // voxel box of all labels
};

// Widens a box by a run of voxels.
void widen(std::array<int, 3>& first, std::array<int, 3>& last, const std::array<int, 3>& at) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = std::min(first[axis], at[axis]);
    last[axis] = std::max(last[axis], at[axis]);
  }
}

Result<Labelled> take_labels(imaging::HuVolume scan, PlacedLabels& placed, const CtOptions& options,
                             const KeepGoing& keep_going) {
  std::array<bool, 256> carved{};
  for (const CaseLabel& label : placed.labels) carved[static_cast<std::size_t>(label.value)] = is_carved(label.kind);
  Labelled found;
  Segmented& s = found.s;
  s.first = found.labels_first = scan.dims;
  s.last = found.labels_last = {-1, -1, -1};
  for (int slice = 0; slice < scan.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / scan.dims[2])) return stopped_while("taking the labels");
    for (int row = 0; row < scan.dims[1]; ++row)
      for (int column = 0; column < scan.dims[0]; ++column) {
        const std::uint8_t value = placed.values.at(column, row, slice);
        if (value == 0) continue;
        widen(found.labels_first, found.labels_last, {column, row, slice});
        if (carved[value]) widen(s.first, s.last, {column, row, slice});
      }
  }
  const Region work = grown(found.labels_first, found.labels_last, scan, margin_mm_of(options));
  s.volume = imaging::cropped(std::move(scan), work.first, work.last);
  found.labels = imaging::cropped(std::move(placed.values), work.first, work.last);
  s.bones = found.labels;
  for (std::uint8_t& value : s.bones.values) value = carved[value] ? value : std::uint8_t{0};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::array<int, 3>* end : {&s.first, &s.last, &found.labels_first, &found.labels_last})
      (*end)[axis] -= work.first[axis];
  return found;
}

// What the labels of tissues say counts more than the HU.
void take_tissues(const PlacedLabels& placed, const imaging::VoxelMask& labels, imaging::HardTissue& hard) {
  std::array<Tissue, 256> tissue{};
  for (const CaseLabel& label : placed.labels) {
    const Tissue said = label.kind == LabelKind::cortical     ? Tissue::cortical
                        : label.kind == LabelKind::cancellous ? Tissue::trabecular
                        : label.kind == LabelKind::metal      ? Tissue::metal
                        : label.kind == LabelKind::enamel     ? Tissue::enamel
                                                              : Tissue::none;
    tissue[static_cast<std::size_t>(label.value)] = said;
  }
  if (std::ranges::all_of(tissue, [](Tissue t) { return t == Tissue::none; })) return;
  if (hard.tissue.values.empty()) hard.tissue = imaging::VoxelMask(labels.dims);
  for (std::size_t i = 0; i < labels.values.size(); ++i)
    if (const Tissue said = tissue[labels.values[i]]; said != Tissue::none)
      hard.tissue.values[i] = static_cast<std::uint8_t>(said);
}

// The signed distance to labelled bones, which end where the scan ends. `geometry`: of the whole scan.
Result<DenseVolume<float>> measure_labels(const Segmented& s, const imaging::HuVolume& geometry, double pitch_mm,
                                          const KeepGoing& keep_going) {
  const CoordBox box = lattice_box(s.volume, s.first, s.last, pitch_mm);
  if (Result<void> fits = check_lattice(box, pitch_mm); !fits) return tl::unexpected(fits.error());
  auto field = label_field(s.bones, s.volume, s.first, s.last, part(keep_going, 0.0, 0.3));
  if (!field) return tl::unexpected(field.error());
  auto samples = imaging::resample(*field, box, pitch_mm, part(keep_going, 0.3, 0.4));
  if (!samples) return tl::unexpected(samples.error());
  field->values = {};
  auto surface_mm = signed_distance_mm(*samples, 0.0f, pitch_mm, part(keep_going, 0.4, 0.9));
  if (!surface_mm) return surface_mm;
  samples->values = {};
  const auto voxels = std::ranges::count_if(s.bones.values, [](std::uint8_t value) { return value != 0; });
  if (auto capped = cap_at_scan(geometry, pitch_mm, *surface_mm, part(keep_going, 0.9, 0.95)); !capped)
    return tl::unexpected(capped.error());
  restore_volume(static_cast<double>(voxels) * geometry.spacing_mm.prod(), pitch_mm, *surface_mm);
  if (auto capped = cap_at_scan(geometry, pitch_mm, *surface_mm, part(keep_going, 0.95, 1.0)); !capped)
    return tl::unexpected(capped.error());
  return surface_mm;
}

// The signed distance to the kept bones, which end where the scan ends. `geometry`: of the whole scan.
Result<DenseVolume<float>> measure_surface(const Segmented& s, const imaging::HuVolume& geometry, double threshold_hu,
                                           double pitch_mm, const KeepGoing& keep_going) {
  const CoordBox box = lattice_box(s.volume, s.first, s.last, pitch_mm);
  if (Result<void> fits = check_lattice(box, pitch_mm); !fits) return tl::unexpected(fits.error());
  auto field = imaging::bone_field(s.volume, s.bones, threshold_hu, part(keep_going, 0.0, 0.1));
  if (!field) return tl::unexpected(field.error());
  auto samples = imaging::resample(*field, box, pitch_mm, part(keep_going, 0.1, 0.25));
  if (!samples) return tl::unexpected(samples.error());
  field->values = {};
  auto surface_mm =
      signed_distance_mm(*samples, static_cast<float>(threshold_hu), pitch_mm, part(keep_going, 0.25, 0.9));
  if (!surface_mm) return surface_mm;
  if (auto capped = cap_at_scan(geometry, pitch_mm, *surface_mm, part(keep_going, 0.9, 1.0)); !capped)
    return tl::unexpected(capped.error());
  return surface_mm;
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

// The scan without its voxels.
imaging::HuVolume geometry_of(const imaging::HuVolume& scan) {
  return {.dims = scan.dims,
          .spacing_mm = scan.spacing_mm,
          .origin_mm = scan.origin_mm,
          .directions = scan.directions,
          .values = {}};
}

double pitch_mm_of(const imaging::HuVolume& geometry, const CtOptions& options) {
  return options.pitch_mm.value_or(std::max(kLeastPitch_mm, geometry.spacing_mm.minCoeff()));
}

// What the case says of itself, without labels.
CaseInfo description(const CtScan& scan, const CtOptions& options, double pitch_mm) {
  CaseInfo info;
  info.title = options.title;
  info.source = scan.source;
  info.pitch_mm = pitch_mm;
  info.calibration = options.calibration;
  return info;
}

// The case of a described scan. `several`: bones have numbers.
Result<Case> build(CaseInfo info, const Segmented& s, const imaging::VoxelMask& tissue, bool several,
                   const DenseVolume<float>& surface_mm, const CtOptions& options, const KeepGoing& keep_going) {
  CaseSamples content(s.volume, s.bones, tissue, several, surface_mm, options, info.pitch_mm);
  const FillPart fill = [&](const CoordBox& part_box, PartSamples& to) { return content.fill(part_box, to); };
  return Case::build(std::move(info), surface_mm.box, fill, keep_going);
}

Result<CtImport> make_case(CtScan scan, CtOptions options, const KeepGoing& keep_going) {
  const imaging::HuVolume geometry = geometry_of(scan.volume);
  const double pitch_mm = pitch_mm_of(geometry, options);
  if (Result<void> sound = check_options(geometry, options, pitch_mm); !sound) return tl::unexpected(sound.error());
  auto s = find_bones(scan, options, keep_going);
  if (!s) return tl::unexpected(s.error());
  if (!s->found.regions.empty())
    s->found.region = imaging::enclosing_box(geometry, Vec3::Zero(),
                                             Vec3(geometry.dims[0] - 1, geometry.dims[1] - 1, geometry.dims[2] - 1));
  if (options.list_only) return CtImport{std::move(s->found), {}, {}};
  const auto surface_mm =
      measure_surface(*s, geometry, options.threshold_hu, pitch_mm, part(keep_going, kSegmentEnd, kSurfaceEnd));
  if (!surface_mm) return tl::unexpected(surface_mm.error());
  const KeepGoing building = part(keep_going, kSurfaceEnd, 1.0);
  const auto hard = imaging::find_hard_tissue(s->volume, s->bones, options.calibration, part(building, 0.0, 0.2));
  if (!hard) return tl::unexpected(hard.error());
  s->found.metal_cm3 = hard->metal_cm3;
  s->found.enamel_cm3 = hard->enamel_cm3;

  CaseInfo info = description(scan, options, pitch_mm);
  info.threshold_hu = options.threshold_hu;
  CaseScan kept = kept_scan(s->volume, {s->bones, s->bones, hard->tissue}, s->first, s->last, options);
  list_labels(kept, options, s->found, info);
  const auto described = describe_scan(kept, part(building, 0.2, 0.3));
  if (!described) return tl::unexpected(described.error());
  info.scan = *described;
  const bool several = s->found.kept.size() > 1 && !options.merge;
  auto built = build(std::move(info), *s, hard->tissue, several, *surface_mm, options, part(building, 0.3, 1.0));
  if (!built) return tl::unexpected(built.error());
  s->found.case_cm3 = built->volume_mm3() * 1e-3;
  return CtImport{std::move(s->found), std::move(*built), std::move(kept)};
}

// The same with the bones and structures of a label map, instead of islands.
Result<CtImport> make_labelled_case(CtScan scan, PlacedLabels placed, const CtOptions& options,
                                    const KeepGoing& keep_going) {
  const imaging::HuVolume geometry = geometry_of(scan.volume);
  const double pitch_mm = pitch_mm_of(geometry, options);
  if (Result<void> sound = check_options(geometry, options, pitch_mm); !sound) return tl::unexpected(sound.error());
  const auto smoothed = smooth(scan.volume, options, part(keep_going, 0.0, kSmoothEnd));
  if (!smoothed) return tl::unexpected(smoothed.error());
  scan.source += *smoothed + ", bones of a label map";
  auto found = take_labels(std::move(scan.volume), placed, options, part(keep_going, kSmoothEnd, kGrowEnd));
  if (!found) return tl::unexpected(found.error());
  const Segmented& s = found->s;
  const auto surface_mm = measure_labels(s, geometry, pitch_mm, part(keep_going, kGrowEnd, kSurfaceEnd));
  if (!surface_mm) return tl::unexpected(surface_mm.error());
  const KeepGoing building = part(keep_going, kSurfaceEnd, 1.0);
  auto hard = imaging::find_hard_tissue(s.volume, s.bones, options.calibration, part(building, 0.0, 0.2));
  if (!hard) return tl::unexpected(hard.error());
  take_tissues(placed, found->labels, *hard);

  CaseInfo info = description(scan, options, pitch_mm);
  CaseScan kept =
      kept_scan(s.volume, {found->labels, s.bones, hard->tissue}, found->labels_first, found->labels_last, options);
  list_labels(kept, placed, info);
  const auto described = describe_scan(kept, part(building, 0.2, 0.3));
  if (!described) return tl::unexpected(described.error());
  info.scan = *described;
  auto built = build(std::move(info), s, hard->tissue, true, *surface_mm, options, part(building, 0.3, 1.0));
  if (!built) return tl::unexpected(built.error());
  CtImport made{.found = {}, .bone = std::move(*built), .scan = std::move(kept), .labels = std::move(placed)};
  made.found.case_cm3 = made.bone->volume_mm3() * 1e-3;
  return made;
}

constexpr const char* kNoMemory =
    "this machine has no memory for a scan of that size; export thicker slices or a smaller region";

}  // namespace

Result<CtImport> import_ct(CtScan scan, const CtOptions& options, const KeepGoing& keep_going) try {
  return make_case(std::move(scan), options, keep_going);
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, kNoMemory);
}

Result<CtImport> import_ct(CtScan scan, PlacedLabels labels, const CtOptions& options,
                           const KeepGoing& keep_going) try {
  return make_labelled_case(std::move(scan), std::move(labels), options, keep_going);
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, kNoMemory);
}

}  // namespace osteon::import
