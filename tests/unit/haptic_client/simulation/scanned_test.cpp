// Drills through a bone from a CT scan at the default threshold, and compares it with the same bone made directly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "common/imaging/calibration.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/phantom.hpp"
#include "server/import/phantom_export.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

bool keep_going(double) { return true; }

// The layered block as a scanner shows it, entered along +z at z = 0.
Case scanned_block() {
  const import::Phantom slab{
      .kind = import::PhantomKind::block, .layers = {{5.0, 1.9}, {20.0, 0.3}, {5.0, 1.9}}, .width_mm = 20.0};
  auto volume = import::scan_phantom(slab, 0.5, keep_going);
  EXPECT_TRUE(volume);
  volume->origin_mm.z() += 30.0;
  auto made = import::import_ct({std::move(*volume), "phantom", {}}, {}, keep_going);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made->bone);
}

TEST(ScannedBlock, TheFeedRigFeelsTheLawsThrustInEachLayer) {
  PlanStep step = straight_down("drill-3.2", HandKind::rig);
  step.feed_mm_per_s = 1.0;
  step.beyond_mm = 3.0;
  Bench bench(scanned_block(), {step});
  // Depths at which the whole point, 0.961 mm high, is in one layer.
  const double from[] = {1.2, 6.3, 26.3}, to[] = {4.7, 24.7, 29.7}, law_n[] = {28.9, 3.25, 28.9};
  double sum[3] = {}, after_n = 0.0;
  int count[3] = {};
  bench.run([&](const SessionTick& tick) {
    const double tip = tick.report.pose_bone_proxy.position_mm.z(), force_n = -tick.report.coupling.force_n.z();
    if (tip > 31.5) after_n = std::max(after_n, std::abs(force_n));
    if (tick.order.phase != SurgeonPhase::push && tick.order.phase != SurgeonPhase::feed) return;
    for (int i = 0; i < 3; ++i)
      if (tip > from[i] && tip < to[i]) {
        sum[i] += force_n;
        ++count[i];
      }
  });
  ASSERT_TRUE(bench.session().done());
  for (int i = 0; i < 3; ++i) {
    ASSERT_GT(count[i], 100);
    EXPECT_NEAR(sum[i] / count[i], law_n[i], 0.05 * law_n[i]) << "layer " << i;
    std::printf("[          ] layer %d: %.2f N\n", i, sum[i] / count[i]);
  }
  EXPECT_EQ(after_n, 0.0);
}

// A part of a phantom bone: all within `half_mm` of a height. Both ends are flat, as if sawn.
class SawnPart final : public phantoms::PhantomBone {
 public:
  SawnPart(const phantoms::PhantomBone& whole, double middle_mm, double half_mm)
      : whole_(whole), middle_mm_(middle_mm), half_mm_(half_mm) {}
  std::vector<std::string> names() const override { return whole_.names(); }
  std::vector<phantoms::NamedValue> parameters() const override { return whole_.parameters(); }
  phantoms::BoneAnatomy anatomy() const override { return {}; }
  Box bounds() const override {
    Box box = whole_.bounds();
    box.min_mm.z() = middle_mm_ - half_mm_;
    box.max_mm.z() = middle_mm_ + half_mm_;
    return box;
  }
  phantoms::BoneDepths depths(const Vec3& at_mm) const override {
    phantoms::BoneDepths depths = whole_.depths(at_mm);
    depths.surface_mm = std::max(depths.surface_mm, std::abs(at_mm.z() - middle_mm_) - half_mm_);
    return depths;
  }
  double cancellous_g_cm3(const Vec3& at_mm) const override { return whole_.cancellous_g_cm3(at_mm); }
  double cortical_g_cm3(int bone) const override { return whole_.cortical_g_cm3(bone); }
  double marrow_g_cm3(int bone) const override { return whole_.marrow_g_cm3(bone); }

 private:
  const phantoms::PhantomBone& whole_;
  double middle_mm_, half_mm_;
};

// What a scanner shows of a part of a bone, in thick, tilted, noisy slices, by the ordinary import. The bone goes on
// beyond the scan.
Case through_dicom(const phantoms::PhantomBone& bone, const SawnPart& part) {
  const osteon::test::TempDir folder;
  import::ScannerSettings settings{.pixel_mm = 0.8, .blur_mm = 0.5, .noise_hu = 30.0, .tilt_degrees = 12.0};
  settings = import::scanner_around(part, settings, 3.0);
  EXPECT_TRUE(
      import::write_simulated_scan(settings, import::blurred_hu(bone, settings.blur_mm), folder / "ct", keep_going));
  auto scan = import::read_dicom_series(folder / "ct", keep_going);
  if (!scan) throw std::runtime_error(scan.error().message);
  auto made = import::import_ct(std::move(*scan), {}, keep_going);
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made->bone);
}

// Mean thrust of a feed rig, N, at each half millimetre of the way of its tip, along +x.
std::map<int, double> thrusts_along_x(const Case& bone, const Vec3& at_mm) {
  PlanStep step = straight_down("drill-3.2", HandKind::rig);
  step.entry = {.toward = {}, .point_mm = at_mm, .axis = Vec3::UnitX(), .beside_last_mm = {}};
  step.feed_mm_per_s = 2.0;
  std::map<int, std::pair<double, int>> sums;
  Bench bench(bone, {step});
  bench.run([&](const SessionTick& tick) {
    if (tick.order.phase != SurgeonPhase::push && tick.order.phase != SurgeonPhase::feed) return;
    auto& [sum, count] = sums[static_cast<int>(std::floor(2.0 * tick.report.pose_bone_proxy.position_mm.x()))];
    sum -= tick.report.coupling.force_n.x();
    ++count;
  });
  EXPECT_TRUE(bench.session().done());
  std::map<int, double> means;
  for (const auto& [place, sum] : sums) means[place] = sum.first / sum.second;
  return means;
}

// Drilled across its shaft, a phantom femur resists as the import of its scan does: both cortices, and marrow between.
TEST(PhantomFemur, ItsScanIsFeltAsItIs) {
  const auto femur = phantoms::make_bone({});
  ASSERT_TRUE(femur) << femur.error().message;
  const phantoms::BoneAnatomy anatomy = (*femur)->anatomy();
  const auto shaft = std::ranges::find(anatomy.axes, "anatomical axis", &PlannedAxis::name);
  ASSERT_NE(shaft, anatomy.axes.end());
  const SawnPart part(**femur, shaft->point_mm.z(), 15.0);
  const auto direct =
      phantoms::build_phantom_case(part, {.pitch_mm = 0.5, .calibration = imaging::kRho1995}, keep_going);
  ASSERT_TRUE(direct) << direct.error().message;
  // The bow moves the canal away from the chord, so its centre is found in the section itself.
  Box section;
  for (double x = part.bounds().min_mm.x(); x < part.bounds().max_mm.x(); x += 0.25)
    for (double y = part.bounds().min_mm.y(); y < part.bounds().max_mm.y(); y += 0.25) {
      const Vec3 at(x, y, shaft->point_mm.z());
      if (part.depths(at).marrow_mm < 0.0) section.include(at);
    }
  const Vec3 centre = section.centre_mm();
  const auto truth = thrusts_along_x(direct->bone, centre);
  const auto scanned = thrusts_along_x(through_dicom(**femur, part), centre);
  const auto at = [](const std::map<int, double>& thrusts, int place) {
    const auto found = thrusts.find(place);
    return found == thrusts.end() ? 0.0 : found->second;
  };
  double sum = 0.0, difference = 0.0;
  for (int place = std::min(truth.begin()->first, scanned.begin()->first);
       place <= std::max(truth.rbegin()->first, scanned.rbegin()->first); ++place) {
    sum += std::abs(at(truth, place));
    difference += std::abs(at(truth, place) - at(scanned, place));
  }
  std::printf("[          ] mean difference %.1f %% of the mean thrust\n", 100.0 * difference / sum);
  EXPECT_LE(difference, 0.1 * sum);
  // Both cortices resist, by Chi's law (7.3) with 1000 rpm, 2 mm/s and 1.9 g/cm3. Marrow between them does not.
  const double cortex_n = 134.6 * std::pow(1000.0, -0.3327) * std::pow(2.0, 0.5189) * std::pow(1.9, 1.1841);
  const int middle = static_cast<int>(std::floor(2.0 * centre.x()));
  for (const auto& thrusts : {truth, scanned}) {
    double before = 0.0, behind = 0.0;
    for (const auto& [place, force] : thrusts)
      (place < middle ? before : behind) = std::max(place < middle ? before : behind, force);
    EXPECT_NEAR(before, cortex_n, 0.05 * cortex_n);
    EXPECT_NEAR(behind, cortex_n, 0.05 * cortex_n);
    EXPECT_LT(at(thrusts, middle), 0.05 * cortex_n);
  }
}

}  // namespace
}  // namespace osteon::haptic::test
