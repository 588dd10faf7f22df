// Every parameter of a femur, measured in its finished case.
#include "tests/unit/phantoms/measured_femur.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/phantoms/phantom_case.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kPitch_mm = 0.6;
// A few lengths may be near zero. For these, two percent of the condyles' radius counts.
constexpr double kPositionTolerance_mm = 0.4;

void expect_measured(const BoneRecipe& recipe) {
  const auto bone = make_bone(recipe);
  ASSERT_TRUE(bone) << bone.error().message;
  const auto made = build_phantom_case(
      **bone, {.pitch_mm = kPitch_mm, .title = "Femur", .calibration = {0.001067, 0.131}}, [](double) { return true; });
  ASSERT_TRUE(made) << made.error().message;
  const MeasuredFemur found = measure_femur(made->bone, recipe.side);
  for (const NamedValue& parameter : (*bone)->parameters()) {
    const std::string name(parameter.name);
    if (name == "cartilage_mm") continue;  // not in the bone; structures_test.cpp measures it
    ASSERT_TRUE(found.values.contains(name)) << name << " is not measured";
    const double measured = found.values.at(name);
    double tolerance = 0.02 * std::abs(parameter.value);
    if (name.ends_with("_degrees")) tolerance = 0.5;
    if (parameter.least < 0.0) tolerance = std::max(tolerance, kPositionTolerance_mm);
    EXPECT_NEAR(measured, parameter.value, tolerance) << name;
    std::printf("[          ] %-26s %9.3f, measured %9.3f\n", name.c_str(), parameter.value, measured);
  }
}

TEST(MeasuredFemur, AMansLeftFemurHasItsParameters) { expect_measured({}); }

TEST(MeasuredFemur, AnOldWomansRightFemurHasItsParameters) {
  expect_measured(
      {.kind = "femur",
       .side = Side::right,
       .preset = "female",
       .condition = "osteoporotic",
       .changes = {{"neck_shaft_degrees", 127.0}, {"anteversion_degrees", 19.0}, {"bow_radius_mm", 1200.0}}});
}

}  // namespace
}  // namespace osteon::phantoms
