// Drills through a bone from a CT scan at the default threshold, and compares it with the same bone made directly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/import/ct_import.hpp"
#include "server/import/phantom.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/haptic_client/bench.hpp"
#include "tests/unit/haptic_client/drilled_phantom.hpp"

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

// Drilled across its shaft, a phantom femur resists as the import of its scan does: both cortices, and marrow between.
TEST(PhantomFemur, ItsScanIsFeltAsItIs) {
  const osteon::test::TempDir folder;
  const auto drilled = drill_phantom_and_scan(folder.path());
  ASSERT_TRUE(drilled) << drilled.error().message;
  std::printf("[          ] mean difference %.1f %% of the mean thrust\n", drilled->difference_percent);
  EXPECT_LE(drilled->difference_percent, 10.0);
  // Both cortices resist, by Chi's law (7.3) with 1.9 g/cm3. Marrow between them does not.
  const double cortex_n =
      134.6 * std::pow(kPhantomSpindle_rpm, -0.3327) * std::pow(kPhantomFeed_mm_per_s, 0.5189) * std::pow(1.9, 1.1841);
  for (const Thrusts& thrusts : {drilled->direct, drilled->scanned}) {
    double before = 0.0, behind = 0.0;
    for (const auto& [place, force] : thrusts) {
      double& most = place < drilled->middle ? before : behind;
      most = std::max(most, force);
    }
    EXPECT_NEAR(before, cortex_n, 0.05 * cortex_n);
    EXPECT_NEAR(behind, cortex_n, 0.05 * cortex_n);
    EXPECT_LT(thrusts.at(drilled->middle), 0.05 * cortex_n);
  }
}

}  // namespace
}  // namespace osteon::haptic::test
