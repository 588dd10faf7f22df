#include "tests/support/scenes/scanned_phantoms.hpp"

#include <algorithm>

#include "server/import/dicom_reader.hpp"
#include "server/import/phantom_export.hpp"

namespace osteon::test {
namespace {

constexpr double kSlice_mm = 3.0, kSample_mm = 1.0;
constexpr double kCorticalInterior_mm = 1.0, kCancellousInterior_mm = 2.5;

bool go_on(double) { return true; }

struct Sums {
  double found = 0.0, truth = 0.0;
  [[nodiscard]] double percent() const { return 100.0 * (found - truth) / truth; }
};

template <class Visit>
void visit_samples(const CoordBox& box, double pitch_mm, Visit visit) {
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) visit(Coord{x, y, z}, position_mm({x, y, z}, pitch_mm));
}

}  // namespace

Vec3 cortex_of(const phantoms::PhantomBone& bone, int number) {
  constexpr int kFromEnds = 45;
  CoordBox box = covering_samples(bone.bounds(), kSample_mm);
  box.min.z += kFromEnds;
  box.max.z -= kFromEnds;
  Vec3 found = Vec3::Zero();
  double deepest = 0.0;
  visit_samples(box, kSample_mm, [&](const Coord&, const Vec3& at_mm) {
    const phantoms::BoneDepths at = bone.depths(at_mm);
    const double depth = std::min(-at.surface_mm, at.cortex_mm);
    if (at.bone != number || depth <= deepest) return;
    deepest = depth;
    found = at_mm;
  });
  return found;
}

Result<import::CtImport> scanned_and_imported(const phantoms::PhantomBone& shown, const phantoms::PhantomBone& around,
                                              const import::CtOptions& options, const std::filesystem::path& folder) {
  import::ScannerSettings settings{.pixel_mm = 0.8, .blur_mm = 0.5, .noise_hu = 30.0, .tilt_degrees = 12.0};
  settings = import::scanner_around(around, settings, kSlice_mm);
  if (auto written =
          import::write_simulated_scan(settings, import::blurred_hu(shown, settings.blur_mm), folder / "ct", go_on);
      !written)
    return tl::unexpected(written.error());
  auto scan = import::read_dicom_series(folder / "ct", go_on);
  if (!scan) return tl::unexpected(scan.error());
  return import::import_ct(std::move(*scan), options, go_on);
}

Result<PhantomAgreement> agreement_of_scan(const phantoms::PhantomBone& bone, const import::CtOptions& options,
                                           const std::filesystem::path& folder, double compared_mm) {
  const auto made = scanned_and_imported(bone, bone, options, folder);
  if (!made) return tl::unexpected(made.error());
  if (auto saved = made->bone->save(folder / "case", made->scan); !saved) return tl::unexpected(saved.error());
  const auto found = Case::load(folder / "case");
  if (!found) return tl::unexpected(found.error());

  constexpr double kAround_mm = 4.0, kFar_mm = 6.0;
  double both = 0.0, sum = 0.0;
  Sums cortical, cancellous;
  const Box around = bone.bounds().grown(kAround_mm);
  visit_samples(covering_samples(around, compared_mm), compared_mm, [&](const Coord&, const Vec3& at) {
    const phantoms::BoneDepths depths = bone.depths(at);
    const bool real = depths.surface_mm < 0.0, there = found->surface_mm(at) < 0.0;
    both += real && there ? 1.0 : 0.0;
    sum += (real ? 1.0 : 0.0) + (there ? 1.0 : 0.0);
    if (depths.surface_mm > kFar_mm) return;
    if (std::max(depths.surface_mm, -depths.cortex_mm) < -kCorticalInterior_mm) {
      cortical.found += there ? found->density_g_cm3(at) : 0.0;
      cortical.truth += bone.cortical_g_cm3(depths.bone);
    }
    if (depths.cortex_mm < -kCancellousInterior_mm && depths.marrow_mm > kCancellousInterior_mm) {
      cancellous.found += there ? found->density_g_cm3(at) : 0.0;
      cancellous.truth += bone.cancellous_g_cm3(at);
    }
  });
  return PhantomAgreement{2.0 * both / sum, cortical.percent(), cancellous.percent()};
}

Result<std::vector<BoneDice>> dice_of_bones(const phantoms::PhantomBone& joint, const std::vector<BoneSeed>& more,
                                            const std::filesystem::path& folder) {
  const std::vector<std::string> names = joint.names();
  const int bones = static_cast<int>(names.size());
  std::vector<BoneSeed> seeds = more;
  for (int bone = 1; bone <= bones; ++bone) seeds.push_back({cortex_of(joint, bone), bone});
  import::CtOptions options;
  options.pitch_mm = kSample_mm;
  options.separate = true;
  for (const BoneSeed& seed : seeds) {
    options.grow.seeds_mm.push_back(seed.at_mm);
    options.grow.bones.push_back(seed.bone);
  }
  const auto made = scanned_and_imported(joint, joint, options, folder);
  if (!made) return tl::unexpected(made.error());

  // Where every slice has the whole width of the leg.
  constexpr double kFromEnds_mm = 30.0, kAround_mm = 4.0;
  CoordBox box = covering_samples(joint.bounds().grown(kAround_mm), kSample_mm);
  const Box field = joint.bounds().grown(-kFromEnds_mm);
  box.min.z = static_cast<int>(field.min_mm.z());
  box.max.z = static_cast<int>(field.max_mm.z());
  std::vector<double> both(names.size()), sum(names.size());
  double without_seed = 0.0;
  visit_samples(box, kSample_mm, [&](const Coord& sample, const Vec3& at) {
    const phantoms::BoneDepths depths = joint.depths(at);
    const int real = depths.surface_mm < 0.0 ? depths.bone : 0;
    const int there = made->bone->surface_mm(at) < 0.0 ? made->bone->bone_number(sample) : 0;
    if (real > 0) sum[static_cast<std::size_t>(real) - 1] += 1.0;
    if (there > bones) without_seed += 1.0;
    if (there > 0 && there <= bones) sum[static_cast<std::size_t>(there) - 1] += 1.0;
    if (real > 0 && real == there) both[static_cast<std::size_t>(real) - 1] += 1.0;
  });
  if (without_seed > 0.0) return failure(ErrorCode::internal, "a bone without a seed has grown");
  std::vector<BoneDice> found;
  for (std::size_t bone = 0; bone < names.size(); ++bone) found.push_back({names[bone], 2.0 * both[bone] / sum[bone]});
  return found;
}

}  // namespace osteon::test
