#include "common/phantoms/patella.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "common/phantoms/phantom_case.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/islands.hpp"
#include "tests/unit/phantoms/made_bones.hpp"
#include "tests/unit/phantoms/measured_femur.hpp"

namespace osteon::phantoms {
namespace {

std::unique_ptr<PhantomBone> patella_of(Side side) { return bone_of({.kind = "patella", .side = side}); }

TEST(Patella, LandmarksLieOnTheSurface) {
  const auto bone = patella_of(Side::left);
  const PatellaParameters p;
  for (const char* name : {"patellar apex", "patellar base", "patellar ridge"})
    EXPECT_NEAR(bone->depths(landmark(*bone, name)).surface_mm, 0.0, 0.05) << name;
  EXPECT_NEAR(landmark(*bone, "patellar base").z() - landmark(*bone, "patellar apex").z(), p.height_mm, 1e-9);
  // The ridge is behind, and the wider facet is lateral of it: at +x of a left knee.
  EXPECT_NEAR(landmark(*bone, "patellar ridge").y(), 0.5 * p.thickness_mm, 1e-9);
  EXPECT_NEAR(landmark(*bone, "patellar ridge").x(), -p.ridge_mm, 1e-9);
}

TEST(Patella, RightIsTheMirrorImageOfLeft) {
  const auto left = patella_of(Side::left), right = patella_of(Side::right);
  test::Random random(31);
  for (int i = 0; i < 4000; ++i) {
    const Vec3 at = random.in_cube(26.0), mirrored(-at.x(), at.y(), at.z());
    EXPECT_EQ(left->depths(at).surface_mm, right->depths(mirrored).surface_mm);
    EXPECT_EQ(left->density_g_cm3(at, 0.5), right->density_g_cm3(mirrored, 0.5));
  }
}

TEST(Patella, IsAShellAroundCancellousBoneWithoutMarrow) {
  const auto bone = patella_of(Side::left);
  const PatellaParameters p;
  EXPECT_EQ(bone->tissue(Vec3::Zero()), BoneTissue::cancellous);
  const Vec3 front(0.0, -0.5 * p.thickness_mm, 0.0);
  EXPECT_EQ(bone->tissue(front + Vec3(0.0, 0.5 * p.shell_mm, 0.0)), BoneTissue::cortical);
  EXPECT_EQ(bone->tissue(front - Vec3(0.0, 0.1, 0.0)), BoneTissue::none);
  test::Random random(32);
  for (int i = 0; i < 4000; ++i) EXPECT_NE(bone->tissue(random.in_cube(26.0)), BoneTissue::marrow);
}

TEST(Patella, EveryPresetAndRandomSetIsOneClosedPiece) {
  for (const std::string_view preset : kPresets)
    for (const std::string_view condition : kConditions) {
      const auto bone =
          bone_of({.kind = "patella", .preset = std::string(preset), .condition = std::string(condition)});
      ASSERT_TRUE(bone);
      EXPECT_EQ(islands_of(*bone, 1.0), std::vector<int>{1}) << preset << " " << condition;
    }
  test::Random random(33);
  for (int set = 0; set < random_sets(); ++set) {
    const auto bone = random_bone("patella", 0.15, random);
    ASSERT_TRUE(bone);
    EXPECT_EQ(islands_of(*bone, 1.0), std::vector<int>{1}) << set;
    for (const Landmark& found : bone->anatomy().landmarks)
      EXPECT_NEAR(bone->depths(found.point_mm).surface_mm, 0.0, 0.05) << found.name << ", set " << set;
  }
}

TEST(Patella, ImpossibleParametersAreOneSentence) {
  const auto refused = [](const std::string& name, double value, const std::string& also) {
    expect_refused("patella", name, value, also);
  };
  expect_ranges("patella", patella_fields());
  refused("width_mm", 63.0, "height_mm");
  refused("thickness_mm", 13.0, "facets_degrees");
  refused("shell_mm", 3.8, "thickness_mm");
  refused("length_mm", 44.0, "no parameter");
}

struct Line {
  double at_zero = 0.0, slope = 0.0;
};
Line fitted_line(const std::vector<Vec3>& points) {  // y over x
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(points.size()), 2);
  Eigen::VectorXd y(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) << 1.0, points[i].x();
    y[static_cast<Eigen::Index>(i)] = points[i].y();
  }
  const Eigen::VectorXd found = least_squares(rows, y);
  return {found[0], found[1]};
}

// Every parameter, measured in the finished case from its surface and density alone.
void expect_measured_patella(const BoneRecipe& recipe) {
  const auto bone = make_bone(recipe);
  ASSERT_TRUE(bone) << bone.error().message;
  const auto made = build_phantom_case(**bone, {.pitch_mm = 0.5, .title = "Patella", .calibration = {0.001067, 0.131}},
                                       [](double) { return true; });
  ASSERT_TRUE(made) << made.error().message;
  const BoneView view(made->bone, recipe.side);
  std::map<std::string, double> found;
  Box box;
  std::vector<Vec3> medial, lateral;
  const std::vector<Vec3> points = view.surface_points();
  for (const Vec3& p : points) box.include(p);
  found["width_mm"] = box.size_mm().x();
  found["thickness_mm"] = box.size_mm().y();
  found["height_mm"] = box.size_mm().z();
  // Both facets are flat: a line across each, at middle height.
  const double far_mm = 0.24 * found["width_mm"];
  for (const Vec3& p : points)
    if (p.y() < 0.0 && p.z() > 0.0 && p.z() < 0.14 * found["height_mm"]) {
      if (p.x() > 3.0 && p.x() < far_mm) lateral.push_back(p);
      if (p.x() < -7.5 && p.x() > -far_mm) medial.push_back(p);
    }
  const Line l = fitted_line(lateral), m = fitted_line(medial);
  found["facets_degrees"] = 180.0 - (std::atan(l.slope) - std::atan(m.slope)) * 180.0 / std::numbers::pi;
  found["ridge_mm"] = (l.at_zero - m.at_zero) / (l.slope - m.slope);
  double shell = 0.0;
  for (int i = -3; i <= 3; ++i) shell += view.cortex_mm({1.0 * i, 0.0, 1.5 * i}, Vec3::UnitY(), 5.0) / 7.0;
  found["shell_mm"] = shell;
  const double front = view.reach_mm(Vec3::Zero(), Vec3::UnitY());
  found["cortical_g_cm3"] = view.density_g_cm3((front - 0.5 * shell) * Vec3::UnitY());
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (double x = -8.0; x <= 8.0; x += 0.5)
    for (double y = -2.0; y <= 5.0; y += 0.5)
      for (double z = -8.0; z <= 11.0; z += 0.5, ++count) {
        const double density = view.density_g_cm3({x, y, z});
        sum += density;
        squares += density * density;
      }
  const double mean = sum / count;
  found["cancellous_g_cm3"] = mean;
  // Noise between lattice points, interpolated with smooth weights, has this deviation.
  constexpr double kDeviation = 0.3698;
  found["texture"] = std::sqrt(squares / count - mean * mean) / mean / kDeviation;
  for (const NamedValue& parameter : (*bone)->parameters()) {
    if (parameter.name == "cartilage_mm") continue;  // not in the bone; structures_test.cpp measures it
    ASSERT_TRUE(found.contains(parameter.name)) << parameter.name << " is not measured";
    double tolerance = 0.02 * parameter.value;
    if (parameter.name == "facets_degrees") tolerance = 0.5;
    if (parameter.name == "ridge_mm") tolerance = 0.15;
    if (parameter.name == "texture") tolerance = 0.05 * parameter.value;  // there are some thousand grains only
    EXPECT_NEAR(found[parameter.name], parameter.value, tolerance) << parameter.name;
    std::printf("[          ] %-18s %8.3f, measured %8.3f\n", parameter.name.c_str(), parameter.value,
                found[parameter.name]);
  }
}

TEST(Patella, AMansLeftPatellaHasItsParameters) { expect_measured_patella({.kind = "patella"}); }

TEST(Patella, AnOldWomansRightPatellaHasItsParameters) {
  expect_measured_patella({.kind = "patella",
                           .side = Side::right,
                           .preset = "female",
                           .condition = "osteoporotic",
                           .changes = {{"facets_degrees", 138.0}, {"ridge_mm", 1.5}, {"shell_mm", 1.3}}});
}

}  // namespace
}  // namespace osteon::phantoms
