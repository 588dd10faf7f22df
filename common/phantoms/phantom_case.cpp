#include "common/phantoms/phantom_case.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "common/core/check.hpp"
#include "common/volume/narrow_band.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kMostSamples = 5e8;
constexpr double kCoarsest_mm = 2.0;
constexpr int kBand = 5;                              // samples around the bone
constexpr double kScanEnd = 0.35, kSurfaceEnd = 0.7;  // of the whole work

constexpr std::array kTissueNames{"cortical", "cancellous", "marrow"};

Result<void> check_pitch(const CoordBox& box, double pitch_mm) {
  const Coord dims = box.dims();
  const double samples = static_cast<double>(dims.x) * dims.y * dims.z;
  if (pitch_mm >= 0.02 && pitch_mm <= kCoarsest_mm && samples <= kMostSamples) return {};
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "a pitch of %g mm does not fit this bone; give a --pitch from %.2g to %g",
                pitch_mm, std::max(0.02, pitch_mm * std::cbrt(samples / kMostSamples)), kCoarsest_mm);
  return bad_input(text.data());
}

tl::unexpected<Error> no_voxel(double pitch_mm) {
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "no voxel of a pitch of %g mm is in this bone; give a smaller --pitch",
                pitch_mm);
  return bad_input(text.data());
}

// The surface in its narrow band. Parts that the nearest surface cannot reach are not computed sample by sample.
Result<SparseVolume> surface_of(const PhantomBone& bone, const CoordBox& box, double pitch_mm,
                                const KeepGoing& keep_going) {
  SampledField field;
  field.box = box;
  field.inside = [&](const CoordBox& part) {
    const Vec3 middle = 0.5 * (position_mm(part.min, pitch_mm) + position_mm(part.max, pitch_mm));
    const double reach =
        kSteepest * (0.5 * (position_mm(part.max, pitch_mm) - position_mm(part.min, pitch_mm)).norm() + pitch_mm);
    const double surface_mm = bone.depths(middle).surface_mm;
    return surface_mm > reach ? Inside::none : surface_mm < -reach ? Inside::all : Inside::some;
  };
  field.read = [&](const CoordBox& part, std::span<float> values) {
    std::size_t n = 0;
    for (int x = part.min.x; x <= part.max.x; ++x)
      for (int y = part.min.y; y <= part.max.y; ++y)
        for (int z = part.min.z; z <= part.max.z; ++z)
          values[n++] = static_cast<float>(-bone.depths(position_mm({x, y, z}, pitch_mm)).surface_mm);
  };
  return narrow_band_mm(field, 0.0f, pitch_mm, keep_going);
}

PartKind fill_part(const PhantomBone& bone, const SparseVolume& surface, double pitch_mm, const CoordBox& part,
                   PartSamples& samples) {
  if (!surface.any_stored(part)) return PartKind::outside;
  surface.gather(part, samples.surface_mm);
  const auto band = static_cast<float>(4.0 * pitch_mm);
  const bool several = bone.names().size() > 1;
  samples.bone.assign(several ? samples.surface_mm.size() : 0, 1);
  std::size_t n = 0;
  for (int x = part.min.x; x <= part.max.x; ++x)
    for (int y = part.min.y; y <= part.max.y; ++y)
      for (int z = part.min.z; z <= part.max.z; ++z, ++n) {
        if (samples.surface_mm[n] >= band) {
          samples.density_g_cm3[n] = 0.0f;
          continue;
        }
        const Vec3 at = position_mm({x, y, z}, pitch_mm);
        samples.density_g_cm3[n] = static_cast<float>(bone.density_g_cm3(at, pitch_mm));
        if (several) samples.bone[n] = static_cast<std::uint8_t>(bone.depths(at).bone);
      }
  return PartKind::samples;
}

// Labels: three for each bone, in the order of kTissueNames, and one for each structure. Those without a voxel are left
// out, such as marrow of a bone that has none.
std::vector<CaseLabel> labels_of(const PhantomBone& bone, const std::vector<Structure>& structures,
                                 const CaseScan& scan) {
  const LabelProvenance provenance{.method = "parametric phantom", .parameters = {}, .edits = {}};
  std::vector<CaseLabel> labels;
  const std::vector<std::string> names = bone.names();
  for (const std::string& name : names)
    for (const char* tissue : kTissueNames) {
      const bool cortical = std::string_view(tissue) == kTissueNames[0];
      labels.push_back({static_cast<int>(labels.size()) + 1, names.size() > 1 ? name + ", " + tissue : tissue,
                        cortical ? LabelKind::cortical : LabelKind::cancellous, provenance});
    }
  for (const Structure& structure : structures)
    labels.push_back({static_cast<int>(labels.size()) + 1, structure.name, structure.kind, provenance});
  std::array<bool, 256> there{};
  for (const std::uint8_t value : scan.labels.values()) there[value] = true;
  std::erase_if(labels, [&](const CaseLabel& label) { return !there[static_cast<std::size_t>(label.value)]; });
  for (const NamedValue& parameter : bone.parameters())
    labels.front().provenance.parameters[std::string(parameter.name)] = parameter.value;
  return labels;
}

// The first structure that has a point, counted from 0; -1 if none has it.
int structure_at(const std::vector<Structure>& structures, const Vec3& at) {
  for (std::size_t i = 0; i < structures.size(); ++i) {
    const Box& box = structures[i].bounds;
    if ((at.array() < box.min_mm.array()).any() || (at.array() > box.max_mm.array()).any()) continue;
    if (structures[i].distance_mm(at) < 0.0) return static_cast<int>(i);
  }
  return -1;
}

Result<CaseScan> scan_of(const PhantomBone& bone, const std::vector<Structure>& structures,
                         const PhantomCaseOptions& options, const CoordBox& box, const KeepGoing& keep_going) {
  CaseScan scan;
  const Coord dims = box.dims();
  scan.geometry.dims = {dims.x, dims.y, dims.z};
  scan.geometry.origin_mm = position_mm(box.min, options.pitch_mm);
  scan.geometry.axes_mm = options.pitch_mm * Eigen::Matrix3d::Identity();
  scan.hu.reserve(scan.geometry.count());
  const auto hu_of = [&](double density_g_cm3) {
    const DensityCalibration& line = options.calibration;
    return static_cast<std::int16_t>(
        std::lround(std::max(options.hu.first, (density_g_cm3 - line.intercept_g_cm3) / line.slope_g_cm3_per_hu)));
  };
  const auto soft = static_cast<std::int16_t>(std::lround(options.hu.second));
  const int first_structure = static_cast<int>(kTissueNames.size() * bone.names().size()) + 1;
  OSTEON_CHECK(first_structure + structures.size() <= 1 + std::numeric_limits<std::uint8_t>::max());
  for (int z = box.min.z; z <= box.max.z; ++z) {
    if (!keep_going(static_cast<double>(z - box.min.z) / dims.z)) return stopped_while("labelling the phantom");
    for (int y = box.min.y; y <= box.max.y; ++y) {
      double free_until_mm = -std::numeric_limits<double>::infinity();  // no bone in this row before there
      for (int x = box.min.x; x <= box.max.x; ++x) {
        const Vec3 at = position_mm({x, y, z}, options.pitch_mm);
        const bool is_free = at.x() < free_until_mm;
        const BoneDepths depths = is_free ? BoneDepths{} : bone.depths(at);
        const BoneTissue tissue = is_free ? BoneTissue::none : tissue_of(depths);
        if (tissue == BoneTissue::none) {
          if (!is_free) free_until_mm = at.x() + depths.surface_mm / kSteepest;
          const int found = structure_at(structures, at);
          scan.hu.push_back(found < 0 ? soft : static_cast<std::int16_t>(std::lround(structures[to_index(found)].hu)));
          scan.labels.push_back(static_cast<std::uint8_t>(found < 0 ? 0 : first_structure + found));
          scan.tissue.push_back(0);
          continue;
        }
        const bool cortical = tissue == BoneTissue::cortical;
        const int number = depths.bone;
        const double density = cortical                           ? bone.cortical_g_cm3(number)
                               : tissue == BoneTissue::cancellous ? bone.cancellous_g_cm3(at)
                                                                  : bone.marrow_g_cm3(number);
        const int first = static_cast<int>(kTissueNames.size()) * (number - 1);
        scan.hu.push_back(hu_of(density));
        scan.labels.push_back(static_cast<std::uint8_t>(first + static_cast<int>(tissue)));
        scan.tissue.push_back(static_cast<std::uint8_t>(cortical ? Tissue::cortical : Tissue::trabecular));
      }
    }
  }
  return scan;
}

}  // namespace

Result<PhantomCase> build_phantom_case(const PhantomBone& bone, const PhantomCaseOptions& options,
                                       const KeepGoing& keep_going) {
  const double pitch_mm = options.pitch_mm;
  const std::vector<Structure> structures = bone.structures();
  const CoordBox box = covering_samples(with_structures(bone.bounds(), structures).grown(kBand * pitch_mm), pitch_mm);
  if (auto fits = check_pitch(box, pitch_mm); !fits) return tl::unexpected(fits.error());
  auto scan = scan_of(bone, structures, options, box, part(keep_going, 0.0, kScanEnd));
  if (!scan) return tl::unexpected(scan.error());
  if (std::ranges::none_of(scan->labels.values(), [](std::uint8_t value) { return value != 0; }))
    return no_voxel(pitch_mm);
  const auto described = describe_scan(*scan);
  if (!described) return tl::unexpected(described.error());
  const auto surface = surface_of(bone, box, pitch_mm, part(keep_going, kScanEnd, kSurfaceEnd));
  if (!surface) return tl::unexpected(surface.error());

  CaseInfo info;
  info.title = options.title;
  info.pitch_mm = pitch_mm;
  info.calibration = options.calibration;
  info.source = "parametric phantom";
  for (const std::string& name : bone.names()) info.source += ", " + name;
  info.scan = *described;
  info.labels = labels_of(bone, structures, *scan);
  info.tissues = {
      {static_cast<int>(Tissue::cortical), "cortical", LabelKind::cortical, {.method = "parametric phantom"}},
      {static_cast<int>(Tissue::trabecular), "cancellous", LabelKind::cancellous, {.method = "parametric phantom"}}};
  BoneAnatomy anatomy = bone.anatomy();
  info.landmarks = std::move(anatomy.landmarks);
  info.axes = std::move(anatomy.axes);
  info.planes = std::move(anatomy.planes);
  auto built = Case::build(
      std::move(info), box,
      [&](const CoordBox& samples_box, PartSamples& samples) {
        return fill_part(bone, *surface, pitch_mm, samples_box, samples);
      },
      part(keep_going, kSurfaceEnd, 1.0));
  if (!built) return tl::unexpected(built.error());
  return PhantomCase{std::move(*built), std::move(*scan)};
}

}  // namespace osteon::phantoms
