// Drills through a bone from a CT scan at the default threshold, and compares it with the same bone made directly.
#include <gtest/gtest.h>

#include "server/import/ct_import.hpp"
#include "server/import/phantom.hpp"
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

}  // namespace
}  // namespace osteon::haptic::test
