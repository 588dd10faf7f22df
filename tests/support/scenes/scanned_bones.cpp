#include "tests/support/scenes/scanned_bones.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/imaging/calibration.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/cut_field.hpp"
#include "server/import/bone_surface.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/simulated_scanner.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;

constexpr double kField_mm = 8.0;      // of the scan around the bones
constexpr double kPointStep_mm = 0.5;  // between points on the true surface
constexpr double kLeastIsland_cm3 = 0.05;

// Without noise. Where a surface is much less curved than the blur is wide, its blurred edge depends on the distance
// alone.
double hu_at(const BoneScan& scan, const Vec3& at_mm) {
  double hu = kSoftTissue_hu;
  if (scan.skin_mm)
    hu += (kAir_hu - kSoftTissue_hu) * import::blurred_step(at_mm.head<2>().norm() - *scan.skin_mm, scan.blur_mm);
  for (const Shaft& shaft : scan.shafts) {
    const double inside_mm = -shaft.surface_mm(at_mm);
    hu += (kCortex_hu - kSoftTissue_hu) * import::blurred_step(inside_mm, scan.blur_mm) +
          (kCancellous_hu - kCortex_hu) * import::blurred_step(inside_mm - shaft.cortex_mm, scan.blur_mm);
  }
  return hu;
}

Box box_of(const BoneScan& scan) {
  Box box;
  for (const Shaft& shaft : scan.shafts)
    for (const Vec3& end : {shaft.from_mm, shaft.to_mm}) {
      box.include(end.array() - shaft.radius_mm);
      box.include(end.array() + shaft.radius_mm);
    }
  return box;
}

// Points spread evenly over the true surface, without those within another shaft.
std::vector<Vec3> surface_points(const BoneScan& scan) {
  std::vector<Vec3> points;
  for (const Shaft& shaft : scan.shafts) {
    const Vec3 along = (shaft.to_mm - shaft.from_mm).normalized();
    const Vec3 u = along.unitOrthogonal(), v = along.cross(u);
    const double length_mm = (shaft.to_mm - shaft.from_mm).norm(), r = shaft.radius_mm;
    // Along the line and over both halves of a sphere, a step of the position along is the same area.
    for (double t = -r + 0.5 * kPointStep_mm; t < length_mm + r; t += kPointStep_mm) {
      const double beyond_mm = std::max({0.0, -t, t - length_mm});
      const double ring_mm = std::sqrt(std::max(0.0, r * r - beyond_mm * beyond_mm));
      const int count = static_cast<int>(2.0 * std::numbers::pi * r / kPointStep_mm);
      for (int i = 0; i < count; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / count;
        points.emplace_back(shaft.from_mm + t * along + ring_mm * (std::cos(angle) * u + std::sin(angle) * v));
      }
    }
  }
  return points;
}

// Everything within a radius of a line.
double capsule_mm3(double length_mm, double radius_mm) {
  return std::numbers::pi * radius_mm * radius_mm * (length_mm + 4.0 / 3.0 * radius_mm);
}

const Shaft& nearest_shaft(const BoneScan& scan, const Vec3& at_mm) {
  return *std::ranges::min_element(scan.shafts, {}, [&](const Shaft& shaft) { return shaft.surface_mm(at_mm); });
}

double percent_error(double found, double truth) { return 100.0 * (found - truth) / truth; }

// Sums over samples of a layer of bone, cortex or cancellous.
struct LayerSums {
  double interior_g_cm3 = 0.0, all_g_cm3 = 0.0;
  std::int64_t interior = 0;
};

void measure_density(const BoneScan& scan, const Case& bone, const CoordBox& box, Accuracy& accuracy) {
  LayerSums cortex, cancellous;
  const double pitch_mm = bone.pitch_mm();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = position_mm({x, y, z}, pitch_mm);
        const Shaft& shaft = nearest_shaft(scan, at);
        const double depth_mm = -shaft.surface_mm(at);
        LayerSums& layer = depth_mm < shaft.cortex_mm ? cortex : cancellous;
        const double from_inner_mm = std::abs(depth_mm - shaft.cortex_mm);
        const bool interior = std::min(depth_mm, from_inner_mm) >= kInterior_mm;
        layer.interior += interior ? 1 : 0;
        if (bone.surface_mm(at) >= 0.0) continue;
        const double density = bone.density_g_cm3(at);
        layer.all_g_cm3 += density;
        if (interior) layer.interior_g_cm3 += density;
      }
  double bone_mm3 = 0.0, cancellous_mm3 = 0.0;
  for (const Shaft& shaft : scan.shafts) {
    bone_mm3 += shaft.volume_mm3();
    cancellous_mm3 += shaft.cancellous_mm3();
  }
  const auto density = [&](double hu) { return imaging::density_g_cm3(bone.info().calibration, hu); };
  const double sample_mm3 = pitch_mm * pitch_mm * pitch_mm;
  accuracy.cortical_percent =
      percent_error(cortex.interior_g_cm3 / static_cast<double>(cortex.interior), density(kCortex_hu));
  accuracy.cancellous_percent =
      percent_error(cancellous.interior_g_cm3 / static_cast<double>(cancellous.interior), density(kCancellous_hu));
  const double cortical_mass = density(kCortex_hu) * (bone_mm3 - cancellous_mm3),
               cancellous_mass = density(kCancellous_hu) * cancellous_mm3;
  accuracy.cortical_mass_percent = percent_error(cortex.all_g_cm3 * sample_mm3, cortical_mass);
  accuracy.cancellous_mass_percent = percent_error(cancellous.all_g_cm3 * sample_mm3, cancellous_mass);
  accuracy.mass_percent =
      percent_error((cortex.all_g_cm3 + cancellous.all_g_cm3) * sample_mm3, cortical_mass + cancellous_mass);
}

double percentile95(std::vector<double> values) {
  const auto rank = static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(values.size()));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

double Shaft::surface_mm(const Vec3& at_mm) const {
  const Vec3 along = to_mm - from_mm;
  const double t = std::clamp((at_mm - from_mm).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (at_mm - from_mm - t * along).norm() - radius_mm;
}

double Shaft::volume_mm3() const { return capsule_mm3((to_mm - from_mm).norm(), radius_mm); }
double Shaft::cancellous_mm3() const { return capsule_mm3((to_mm - from_mm).norm(), radius_mm - cortex_mm); }

double BoneScan::surface_mm(const Vec3& at_mm) const { return nearest_shaft(*this, at_mm).surface_mm(at_mm); }

std::vector<Shaft> long_bone() {
  return {{.from_mm = {-2.0, 1.0, -14.0}, .to_mm = {2.0, -1.5, 14.0}, .radius_mm = 9.0, .cortex_mm = 3.0}};
}

std::vector<Shaft> two_bones(double gap_mm) {
  const double half_mm = 0.5 * gap_mm + 6.0;
  return {{.from_mm = {-half_mm, 0.5, -12.0}, .to_mm = {-half_mm, -0.5, 12.0}, .radius_mm = 6.0, .cortex_mm = 2.5},
          {.from_mm = {half_mm, 0.5, -12.0}, .to_mm = {half_mm, -0.5, 12.0}, .radius_mm = 6.0, .cortex_mm = 2.5}};
}

std::vector<BoneScan> accuracy_scans() {
  const auto even = [](double gap_mm) { return std::vector<double>(static_cast<std::size_t>(60.0 / gap_mm), gap_mm); };
  std::vector<double> uneven;
  for (int i = 0; i < 10; ++i)
    for (const double gap_mm : {1.0, 2.0, 3.0}) uneven.push_back(gap_mm);
  std::vector<BoneScan> scans;
  for (const auto& [bone, shafts] : {std::pair{"long bone", long_bone()}, std::pair{"two bones", two_bones(2.0)}}) {
    const BoneScan plain{.name = bone, .shafts = shafts, .gaps_mm = even(1.0)};
    const auto add = [&](const char* what, const auto& change) {
      BoneScan scan = plain;
      scan.name += std::string(", ") + what;
      change(scan);
      scans.push_back(std::move(scan));
    };
    add("fine slices", [](BoneScan&) {});
    add("noise", [](BoneScan& scan) { scan.noise_hu = 80.0; });
    add("blur", [](BoneScan& scan) { scan.blur_mm = 0.7; });
    add("3 mm slices", [&](BoneScan& scan) { scan.gaps_mm = even(3.0), scan.thickness_mm = 3.0; });
    add("tilted", [](BoneScan& scan) { scan.tilt_degrees = 20.0; });
    add("uneven", [&](BoneScan& scan) { scan.gaps_mm = uneven; });
  }
  return scans;
}

Result<void> write_scan(const BoneScan& scan, const fs::path& folder) {
  const Box box = box_of(scan);
  // The tilt moves the ends of the bone within the slices.
  const double half_mm = std::max(box.min_mm.head<2>().cwiseAbs().cwiseMax(box.max_mm.head<2>().cwiseAbs()).maxCoeff(),
                                  scan.skin_mm.value_or(0.0));
  const double size_mm = 2.0 * (half_mm + kField_mm + 0.5 * std::abs(scan.tilt_degrees));
  const import::ScannerSettings settings{.pixel_mm = scan.pixel_mm,
                                         .gaps_mm = scan.gaps_mm,
                                         .thickness_mm = scan.thickness_mm,
                                         .blur_mm = scan.blur_mm,
                                         .noise_hu = scan.noise_hu,
                                         .tilt_degrees = scan.tilt_degrees,
                                         .seed = scan.seed,
                                         .centre_mm = Vec3::Zero(),
                                         .width_mm = size_mm,
                                         .height_mm = size_mm};
  return import::write_simulated_scan(
      settings, [&](const Vec3& at_mm) { return hu_at(scan, at_mm); }, folder, [](double) { return true; });
}

Accuracy accuracy_of(const BoneScan& scan, const Case& bone) {
  Accuracy accuracy;
  const double pitch_mm = bone.pitch_mm();
  Box both = box_of(scan);
  both.include(bone.bounds().min_mm);
  both.include(bone.bounds().max_mm);
  const CoordBox box = covering_samples(both.grown(pitch_mm), pitch_mm);
  std::int64_t common = 0, sum = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = position_mm({x, y, z}, pitch_mm);
        const int found = bone.surface_mm(at) < 0.0 ? 1 : 0, real = scan.surface_mm(at) < 0.0 ? 1 : 0;
        common += found * real;
        sum += found + real;
      }
  accuracy.dice = sum > 0 ? 2.0 * static_cast<double>(common) / static_cast<double>(sum) : 0.0;
  measure_density(scan, bone, box, accuracy);
  const auto mesh = import::bone_surface(CutField(bone, BodyId{0}), [](double) { return true; });
  if (!mesh) return accuracy;
  std::vector<double> from_case, from_truth;
  double signed_sum = 0.0, total = 0.0;
  for (const auto& corner : mesh->positions_mm) {
    const double off = scan.surface_mm(Vec3(corner[0], corner[1], corner[2]));
    signed_sum += off;
    from_case.push_back(std::abs(off));
  }
  // The case knows distances up to a few pitches; a hole is that far away at least.
  for (const Vec3& at : surface_points(scan)) from_truth.push_back(std::abs(bone.surface_mm(at)));
  for (const auto* distances : {&from_case, &from_truth})
    for (const double distance : *distances) total += distance;
  accuracy.mean_mm = total / static_cast<double>(from_case.size() + from_truth.size());
  accuracy.percentile95_mm = std::max(percentile95(from_case), percentile95(from_truth));
  accuracy.offset_mm = signed_sum / static_cast<double>(from_case.size());
  return accuracy;
}

Result<Accuracy> measure_accuracy(const BoneScan& scan, const import::CtOptions& options, const fs::path& folder) {
  const auto going = [](double) { return true; };
  std::error_code error;
  if (!fs::create_directories(folder, error))
    return failure(ErrorCode::internal, "cannot make the folder " + folder.string());
  if (auto written = write_scan(scan, folder / "series"); !written) return tl::unexpected(written.error());
  auto read = import::read_dicom_series(folder / "series", going);
  if (!read) return tl::unexpected(read.error());
  // As many islands as there are bones, or fewer if bones have grown together.
  import::CtOptions keeping = options;
  for (int number = 1; number <= static_cast<int>(scan.shafts.size()); ++number) keeping.keep.push_back(number);
  auto made = import::import_ct(*read, keeping, going);
  if (!made && scan.shafts.size() > 1) made = import::import_ct(std::move(*read), options, going);
  if (!made) return tl::unexpected(made.error());
  if (auto saved = made->bone->save(folder / "case", made->scan); !saved) return tl::unexpected(saved.error());
  const auto bone = Case::load(folder / "case");
  if (!bone) return tl::unexpected(bone.error());
  Accuracy accuracy = accuracy_of(scan, *bone);
  for (const imaging::Island& island : made->found.islands)
    accuracy.islands += island.volume_cm3 >= kLeastIsland_cm3 ? 1 : 0;
  return accuracy;
}

}  // namespace osteon::test
