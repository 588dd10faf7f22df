// The moment of a cut in bone of two densities, against its closed form.
//
// The point of a drill is a cone of radius R and full angle beta. It fits into its hole and is fed with v along its
// axis z. The half of it on the side of the unit vector u is in bone of density b, the other half in bone of density
// a. Niu 2008, (7.12), gives the force of the bone on each part dA of the cone's area A, and (7.14) sums it:
//
//   dF = -K_1 K_2 D v n,  K_2 = dA / A its share of the area, D the density there, n its outward normal.
//
// At the distance r from the axis, with e the unit vector away from the axis, the normal is n = cos(beta/2) e +
// sin(beta/2) z, and the arm from the tip is p = r e - r / tan(beta/2) z. So
//
//   dF z = -K_1 v D dA/A sin(beta/2),
//   dM   = p x dF = K_1 v D dA/A r / sin(beta/2) (z x e),  because sin(beta/2) + cos^2(beta/2) / sin(beta/2) is
//          1 / sin(beta/2).
//
// Seen along the axis, the cone is a disc, with the same shares dA / A. In half a disc the mean of r e is c u, where
// c = (2 R^3 / 3) / (pi R^2 / 2) = 4 R / (3 pi). Both halves together give
//
//   T = K_1 v (a + b) / 2 sin(beta/2),                thrust, against the feed,
//   M = K_1 v (b - a) / 2 c / sin(beta/2) (z x u).    moment about the tip
//
// Another law gives another thrust T, and the parts bear it in the same proportion:
// M = T c / sin^2(beta/2) (b - a) / (a + b) (z x u). Chi 2005, (7.3), gives T = 134.6 N^-0.3327 v^0.5189 D^1.1841 for
// N rpm and the mean density D = (a + b) / 2. Neither law has a torque of the spindle. It is that of two lips [A],
// T 2 R / (4 sin(beta/2)), and the bone turns the drill back with it, about -z.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>

#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/contact/proxy.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadius_mm = 1.6, kHalfAngle_rad = 59.0 / 180.0 * kPi, kRpm = 1000.0;
constexpr double kCentroid_mm = 4.0 * kRadius_mm / (3.0 * kPi);
constexpr double kStiffness = 50.0, kPush_mm = 0.3;

struct Halves {
  double a = 0, b = 0;  // g/cm3; b on the side of u
  double angle_rad = 0;
  [[nodiscard]] Vec3 u() const { return {std::cos(angle_rad), std::sin(angle_rad), 0.0}; }
};

// A drill in the hole that fits it, in the first tick in which it is pushed.
ProxyStep cut(const Halves& bone, std::string_view law) {
  const double tip_mm = 3.0, sine = std::sin(kHalfAngle_rad), cosine = std::cos(kHalfAngle_rad);
  const Case block = osteon::test::make_bone(
      {Vec3(-3, -3, 0), Vec3(3, 3, 5)}, 0.125,
      [&](const Vec3& p) {
        const double r = std::hypot(p.x(), p.y());
        const double in_hole = std::max(r - kRadius_mm, (p.z() - tip_mm) * sine + r * cosine);
        return std::max(-p.z(), -in_hole);
      },
      [&](const Vec3& p) {
        const double side = p.dot(bone.u());
        return std::abs(side) < 1e-9 ? 0.5 * (bone.a + bone.b) : side > 0.0 ? bone.b : bone.a;
      });
  const CutField field(block, BodyId{});
  const Result<ToolModel> model = ToolModel::make(*find_tool("drill-3.2"), block.pitch_mm(), 1.0, law);
  EXPECT_TRUE(model.has_value());
  EXPECT_NEAR(model->tool.diameter_mm, 2.0 * kRadius_mm, 1e-9);
  EXPECT_NEAR(model->tool.point_angle_rad, 2.0 * kHalfAngle_rad, 1e-9);
  const Pose there{{0.0, 0.0, tip_mm}, Eigen::Quaterniond::Identity()};
  const Pose device{{0.0, 0.0, tip_mm + kPush_mm}, Eigen::Quaterniond::Identity()};
  PatchBuilder builder;
  Patch patch;
  builder.build(field, *model, there, patch);
  Proxy proxy;
  proxy.place(there);
  const ProxyStep step = proxy.step(*model, patch, device, kRpm, kStiffness, true, 1e-3, {});
  EXPECT_TRUE(step.cutting);
  EXPECT_FALSE(step.heel_contact);
  EXPECT_NEAR(step.engaged, 1.0, 1e-6);
  EXPECT_EQ(step.turn_rad.norm(), 0.0);
  return step;
}

// The density is interpolated between samples h = 0.125 mm apart. So the step from a to b is a ramp from -h to h, which
// takes h^2 / (2 R^2), 0.3 %, of the moment.
constexpr double kRelative = 0.01;

void expect_thrust(const ProxyStep& step, double thrust_n) {
  EXPECT_GT(thrust_n, 5.0);
  EXPECT_NEAR((step.cutting_force_n - thrust_n * Vec3::UnitZ()).norm(), 0.0, kRelative * thrust_n);
}

// To a part of the moment that the whole thrust has in one half.
void expect_moment(const ProxyStep& step, const Vec3& moment_nmm, double thrust_n) {
  const double sine = std::sin(kHalfAngle_rad);
  const Vec3 lips_nmm = -thrust_n * 2.0 * kRadius_mm / (4.0 * sine) * Vec3::UnitZ();
  EXPECT_NEAR((step.contact_torque_nmm - moment_nmm - lips_nmm).norm(), 0.0,
              kRelative * thrust_n * kCentroid_mm / (sine * sine));
}

class TwoDensities : public testing::TestWithParam<Halves> {};

TEST_P(TwoDensities, GiveTheMomentOfTheMultiPointForce) {
  constexpr double kK1 = 17.7;  // N s/mm per g/cm3
  const double a = GetParam().a, b = GetParam().b, sine = std::sin(kHalfAngle_rad);
  const ProxyStep step = cut(GetParam(), "multi-point");
  const double v = step.feed_mm_per_s;
  const double thrust_n = kK1 * v * (a + b) / 2.0 * sine;
  const Vec3 moment_nmm = kK1 * v * (b - a) / 2.0 * kCentroid_mm / sine * Vec3::UnitZ().cross(GetParam().u());
  std::printf("  %.1f and %.1f g/cm3: thrust %.3f N, by hand %.3f; moment %.3f %.3f N mm, by hand %.3f %.3f\n", a, b,
              step.cutting_force_n.z(), thrust_n, step.contact_torque_nmm.x(), step.contact_torque_nmm.y(),
              moment_nmm.x(), moment_nmm.y());
  expect_thrust(step, thrust_n);
  expect_moment(step, moment_nmm, thrust_n);
}

TEST_P(TwoDensities, ShareTheThrustOfTheDrillingLaw) {
  const double a = GetParam().a, b = GetParam().b, sine = std::sin(kHalfAngle_rad);
  const ProxyStep step = cut(GetParam(), "chi");
  const double thrust_n =
      134.6 * std::pow(kRpm, -0.3327) * std::pow(step.feed_mm_per_s, 0.5189) * std::pow((a + b) / 2.0, 1.1841);
  expect_thrust(step, thrust_n);
  expect_moment(step, thrust_n * kCentroid_mm / (sine * sine) * (b - a) / (a + b) * Vec3::UnitZ().cross(GetParam().u()),
                thrust_n);
}

INSTANTIATE_TEST_SUITE_P(Halves, TwoDensities,
                         testing::Values(Halves{0.5, 1.9, 0.0}, Halves{1.9, 0.5, 0.0}, Halves{0.5, 1.9, kPi / 2.0},
                                         Halves{0.3, 1.2, kPi / 6.0}, Halves{1.2, 1.2, 0.0}));

}  // namespace
}  // namespace osteon::haptic::test
