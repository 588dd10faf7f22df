// Forces on devices that hold less than a tool asks: closed forms of the map, and the energy of what it shows.
#include "haptic_client/rendering/force_scaling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <tuple>
#include <vector>

#include "haptic_client/rendering/haptic_loop.hpp"
#include "tests/support/stability/stability.hpp"
#include "tests/support/trials.hpp"

namespace osteon::haptic::test {
namespace {

// Continuous forces of weak and strong devices: Omni and Touch, Desktop, Falcon, omega, the simulated one, none weak.
constexpr double kContinuous_n[] = {0.88, 1.75, 2.0, 8.0, 12.0, 30.0, 60.0, 100.0};

LoopParams params_of(double continuous_n, ForceChoice choice) {
  DeviceLimits limits;
  limits.continuous_n = continuous_n;
  limits.peak_n = 4.0 * continuous_n;
  limits.peak_nmm = limits.continuous_nmm = 100.0;
  limits.stiffness_n_per_mm = 1.0;
  return loop_params(limits, {0.0, choice});
}
double shown_n(const LoopParams& params, double force_n) { return params.force_scale * params.compression.of(force_n); }

TEST(ForceScaling, NamesAreFoundAgain) {
  for (const ForceChoice choice : {ForceChoice::proportional, ForceChoice::compressed, ForceChoice::feed_cue}) {
    const Result<ForceChoice> found = find_force_choice(name(choice));
    ASSERT_TRUE(found);
    EXPECT_EQ(*found, choice);
  }
  const Result<ForceChoice> none = find_force_choice("linear");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::invalid_input);
}

TEST(ForceScaling, ProportionalIsAsItWas) {
  const LoopParams omni = params_of(0.88, ForceChoice::proportional);
  EXPECT_EQ(omni.force_scale, 0.88 / 30.0);
  EXPECT_EQ(omni.peak_n, 3.52);
  EXPECT_EQ(omni.peak_nmm, 100.0);
  EXPECT_FALSE(omni.compression.on());
  EXPECT_EQ(omni.scale_of(17.0), omni.force_scale);
  EXPECT_EQ(omni.cue_n, 0.0);
}

// c(F) = B ln(1 + F / 3) / ln(21) for a budget of B that the knee of 3 N and a slope below 1 allow.
TEST(ForceScaling, ClosedFormOnAWeakDevice) {
  const LoopParams omni = params_of(0.88, ForceChoice::compressed);
  EXPECT_NEAR(shown_n(omni, 3.0), 0.88 * std::log(2.0) / std::log(21.0), 1e-12);
  EXPECT_NEAR(shown_n(omni, 27.0), 0.88 * std::log(10.0) / std::log(21.0), 1e-12);
  EXPECT_NEAR(shown_n(omni, 60.0), 0.88, 1e-12);
  // Marrow and cortex, 3.25 and 28.9 N (Chi): 8.9 times as much is shown as 3.2 times as much.
  EXPECT_NEAR(shown_n(omni, 28.9) / shown_n(omni, 3.25), std::log(1.0 + 28.9 / 3.0) / std::log(1.0 + 3.25 / 3.0),
              1e-12);
}

TEST(ForceScaling, MonotoneContinuousAndWithinTheBudget) {
  for (const double continuous_n : kContinuous_n)
    for (const ForceChoice choice : {ForceChoice::compressed, ForceChoice::feed_cue}) {
      SCOPED_TRACE(std::string(name(choice)) + " " + std::to_string(continuous_n));
      const LoopParams params = params_of(continuous_n, choice);
      const double budget_n = (choice == ForceChoice::feed_cue ? 0.3 : 1.0) * continuous_n;
      EXPECT_EQ(params.peak_n, budget_n);
      EXPECT_NEAR(params.peak_n + params.cue_n, choice == ForceChoice::feed_cue ? continuous_n : budget_n, 1e-12);
      EXPECT_EQ(params.peak_nmm, 0.0);
      EXPECT_LE(params.force_scale, 1.0);
      EXPECT_EQ(shown_n(params, 0.0), 0.0);
      // The slope at zero is s, and nowhere larger: c is concave.
      EXPECT_NEAR(shown_n(params, 1e-6) / 1e-6, params.force_scale, 1e-6 * params.force_scale);
      EXPECT_NEAR(shown_n(params, kFullForce_n), std::min(budget_n, kFullForce_n), 1e-9 * budget_n);
      constexpr double kStep_n = 0.01;
      double slope = params.force_scale * (1.0 + 1e-9);
      for (int i = 0; i < 6000; ++i) {
        const double now = (shown_n(params, (i + 1) * kStep_n) - shown_n(params, i * kStep_n)) / kStep_n;
        ASSERT_GT(now, 0.0) << i;
        ASSERT_LE(now, slope + 1e-9) << i;
        slope = now;
      }
      for (const double force_n : {1e-9, 0.1, 1.0, 7.0, 30.0, 60.0})
        EXPECT_NEAR(params.compression.inverse(params.compression.of(force_n)), force_n, 1e-9 * force_n);
    }
}

// Far above the knee equal ratios are equal differences. Everywhere the shown ratio is between 1 and the physical one.
TEST(ForceScaling, Ratios) {
  const Compression compression{3.0};
  const auto difference = [&](double force_n) { return compression.of(2.0 * force_n) - compression.of(force_n); };
  EXPECT_NEAR(difference(3000.0), 3.0 * std::log(2.0), 2e-3);
  EXPECT_NEAR(difference(6000.0) / difference(3000.0), 1.0, 1e-3);
  for (double force_n = 0.01; force_n < 60.0; force_n *= 1.3) {
    const double ratio = compression.of(2.0 * force_n) / compression.of(force_n);
    EXPECT_GT(ratio, 1.0);
    EXPECT_LT(ratio, 2.0);
    if (force_n < 0.03) {
      EXPECT_NEAR(ratio, 2.0, 0.01);
    }
  }
}

// A spring's energy is the area under its compressed force, summed here in small steps.
TEST(ForceScaling, EnergyIsTheAreaUnderTheForce) {
  for (const double knee_n : {0.0, 3.0, 24.0})
    for (const double k : {0.4, 50.0})
      for (const double e_mm : {1e-6, 0.01, 0.3, 1.2}) {
        const Compression compression{knee_n};
        double sum_mj = 0.0;
        constexpr int kSteps = 20000;
        for (int i = 0; i < kSteps; ++i) sum_mj += compression.of(k * e_mm * (i + 0.5) / kSteps) * e_mm / kSteps;
        EXPECT_NEAR(compression.stored_mj(k, e_mm), sum_mj, 1e-6 * sum_mj);
        // What holds half of that energy.
        const double less_k = compression.paid_n_per_mm(k, e_mm, 0.5 * sum_mj);
        EXPECT_NEAR(compression.stored_mj(less_k, e_mm), 0.5 * sum_mj, 1e-6 * sum_mj);
        EXPECT_LT(less_k, k);
        const double less_mm = compression.paid_mm(k, e_mm, 0.5 * sum_mj);
        EXPECT_NEAR(compression.stored_mj(k, less_mm), 0.5 * sum_mj, 1e-6 * sum_mj);
        EXPECT_EQ(compression.paid_mm(k, e_mm, 2.0 * sum_mj), e_mm);
        EXPECT_EQ(compression.paid_n_per_mm(k, e_mm, 2.0 * sum_mj), k);
      }
}

using osteon::test::StabilityResult;
using osteon::test::StabilityRun;
using osteon::test::StabilityScene;

class CompressedForce : public ::testing::TestWithParam<std::tuple<int, ForceChoice>> {};

TEST_P(CompressedForce, GivesNothingAway) {
  StabilityRun run;
  run.scene = static_cast<StabilityScene>(std::get<0>(GetParam()));
  run.choice = std::get<1>(GetParam());
  run.delay_ms = 100;
  run.ticks = osteon::test::trials(200'000, 20'000);
  const StabilityResult r = osteon::test::run_stability(run);
  std::printf(
      "  %s, %s: %lld ticks, %llu contacts, generated %.4f mJ, worst %.5f, of the hand alone %.5f, net %.1f, cutting "
      "%.1f; at most %.2f N, cue %.2f N; held back %lld, cutting %lld\n",
      name(run.scene), std::string(name(run.choice)).c_str(), static_cast<long long>(r.ticks),
      static_cast<unsigned long long>(r.episodes), r.generated_mj, r.worst_mj, r.hand_worst_mj, r.net_mj, r.cutting_mj,
      r.force_most_n, r.cue_most_n, static_cast<long long>(r.held_back), static_cast<long long>(r.cutting));
  EXPECT_LE(r.worst_mj, 0.01);
  EXPECT_LE(r.hand_worst_mj, 0.01);
  EXPECT_LE(r.generated_mj, 1.0);
  EXPECT_LE(r.step_over_n, 1e-9);
  EXPECT_LE(r.still_step_n, 0.5 + 1e-9);
  EXPECT_LE(r.budget_over_n, 1e-9);
  EXPECT_LE(r.motor_over_n, 1e-9);
  EXPECT_EQ(r.allocations, 0);
  EXPECT_LE(r.still_off_n, 1e-9);
  // Otherwise the test would prove nothing.
  EXPECT_GT(r.touching, 2'000);
  if (run.scene == StabilityScene::stroke) {
    EXPECT_GT(r.still, 100);
  }
  EXPECT_GT(r.force_most_n, 2.0);
  if (run.scene == StabilityScene::burr || run.scene == StabilityScene::drill) {
    EXPECT_GT(r.cutting, 1'000);
    EXPECT_EQ(r.cue_most_n > 0.1, run.choice == ForceChoice::feed_cue);
  }
}

// By day each scene has one of the two.
std::vector<std::tuple<int, ForceChoice>> scenes_and_choices() {
  std::vector<std::tuple<int, ForceChoice>> found;
  for (int scene = 0; scene < osteon::test::kStabilityScenes; ++scene)
    for (const ForceChoice choice : {ForceChoice::compressed, ForceChoice::feed_cue})
      if (osteon::test::all_trials() || (scene % 2 == 0) == (choice == ForceChoice::feed_cue))
        found.emplace_back(scene, choice);
  return found;
}

INSTANTIATE_TEST_SUITE_P(Scenes, CompressedForce, ::testing::ValuesIn(scenes_and_choices()));

}  // namespace
}  // namespace osteon::haptic::test
