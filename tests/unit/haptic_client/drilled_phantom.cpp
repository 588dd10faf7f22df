#include "tests/unit/haptic_client/drilled_phantom.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/check.hpp"
#include "common/imaging/calibration.hpp"
#include "common/phantoms/phantom_case.hpp"
#include "tests/support/scenes/scanned_phantoms.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kPlacesPerMm = 2.0;

int place_of(double x_mm) { return static_cast<int>(std::floor(kPlacesPerMm * x_mm)); }

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

// The middle of the canal at a height. The bow moves the canal away from the chord, so the section itself is asked.
Vec3 canal_at(const phantoms::PhantomBone& bone, double z_mm) {
  constexpr double kStep_mm = 0.25;
  const Box bounds = bone.bounds();
  Box section;
  for (double x = bounds.min_mm.x(); x < bounds.max_mm.x(); x += kStep_mm)
    for (double y = bounds.min_mm.y(); y < bounds.max_mm.y(); y += kStep_mm)
      if (const Vec3 at(x, y, z_mm); bone.depths(at).marrow_mm < 0.0) section.include(at);
  return section.centre_mm();
}

Result<Thrusts> thrusts_along_x(const Case& bone, const Vec3& at_mm) {
  PlanStep step = straight_down("drill-3.2", HandKind::rig);
  step.entry = {.toward = {}, .point_mm = at_mm, .axis = Vec3::UnitX(), .beside_last_mm = {}};
  step.feed_mm_per_s = kPhantomFeed_mm_per_s;
  step.spindle_rpm = kPhantomSpindle_rpm;
  std::map<int, std::pair<double, int>> sums;
  Bench bench(bone, {step});
  bench.run([&](const SessionTick& tick) {
    if (tick.order.phase != SurgeonPhase::push && tick.order.phase != SurgeonPhase::feed) return;
    auto& [sum, count] = sums[place_of(tick.report.pose_bone_proxy.position_mm.x())];
    sum -= tick.report.coupling.force_n.x();
    ++count;
  });
  if (!bench.session().done() || sums.empty()) return failure(ErrorCode::internal, "the drill did not end");
  Thrusts means;
  for (const auto& [place, sum] : sums) means[place] = sum.first / sum.second;
  return means;
}

double at(const Thrusts& thrusts, int place) {
  const auto found = thrusts.find(place);
  return found == thrusts.end() ? 0.0 : found->second;
}

}  // namespace

Result<DrilledPhantom> drill_phantom_and_scan(const std::filesystem::path& folder) {
  const auto go_on = [](double) { return true; };
  const auto femur = phantoms::make_bone({});
  if (!femur) return tl::unexpected(femur.error());
  const std::vector<PlannedAxis> axes = (*femur)->anatomy().axes;
  const auto shaft = std::ranges::find(axes, "anatomical axis", &PlannedAxis::name);
  OSTEON_CHECK(shaft != axes.end());
  const SawnPart part(**femur, shaft->point_mm.z(), 15.0);
  const auto direct = phantoms::build_phantom_case(part, {.pitch_mm = 0.5, .calibration = imaging::kRho1995}, go_on);
  if (!direct) return tl::unexpected(direct.error());
  // The bone goes on beyond the scan: an import takes an open canal for soft tissue.
  const auto scanned = osteon::test::scanned_and_imported(**femur, part, {}, folder);
  if (!scanned) return tl::unexpected(scanned.error());

  const Vec3 centre = canal_at(part, shaft->point_mm.z());
  auto of_direct = thrusts_along_x(direct->bone, centre);
  if (!of_direct) return tl::unexpected(of_direct.error());
  auto of_scanned = thrusts_along_x(*scanned->bone, centre);
  if (!of_scanned) return tl::unexpected(of_scanned.error());
  DrilledPhantom drilled{std::move(*of_direct), std::move(*of_scanned), place_of(centre.x())};
  double sum = 0.0, difference = 0.0;
  const int last = std::max(drilled.direct.rbegin()->first, drilled.scanned.rbegin()->first);
  for (int place = std::min(drilled.direct.begin()->first, drilled.scanned.begin()->first); place <= last; ++place) {
    sum += std::abs(at(drilled.direct, place));
    difference += std::abs(at(drilled.direct, place) - at(drilled.scanned, place));
  }
  drilled.difference_percent = 100.0 * difference / sum;
  return drilled;
}

}  // namespace osteon::haptic::test
