#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/field/kernel.hpp"
#include "common/volume/case.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

CaseInfo info_of(double pitch_mm) {
  return {.title = "Test bone", .source = "closed form", .pitch_mm = pitch_mm, .calibration = {}, .threshold_hu = 0.0};
}

// A ball with a denser shell, and the way in which its parts are filled.
struct Ball {
  double radius_mm = 20.0, pitch_mm = 0.5;
  Vec3 centre_mm{1.7, -0.9, 0.3};
  std::int64_t samples_asked = 0;

  [[nodiscard]] double distance_mm(const Vec3& p) const { return (p - centre_mm).norm() - radius_mm; }
  [[nodiscard]] double density(const Vec3& p) const { return distance_mm(p) > -3.0 ? 1.8 : 0.4; }
  [[nodiscard]] CoordBox box() const {
    const Vec3 half = Vec3::Constant(radius_mm + 5.0 * pitch_mm);
    return covering_samples({centre_mm - half, centre_mm + half}, pitch_mm);
  }
  // Marks parts of one value as such.
  PartKind fill(const CoordBox& part, PartSamples& to) {
    const Vec3 low = position_mm(part.min, pitch_mm), high = position_mm(part.max, pitch_mm);
    const double middle = distance_mm(0.5 * (low + high)),
                 reach = 0.5 * (high - low).norm() + (kBandVoxels + 1) * pitch_mm;
    if (middle > reach) return PartKind::outside;
    const PartKind kind = middle < -reach ? PartKind::inside : PartKind::samples;
    std::size_t i = 0;
    for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
      for (std::int32_t y = part.min.y; y <= part.max.y; ++y)
        for (std::int32_t z = part.min.z; z <= part.max.z; ++z, ++i) {
          const Vec3 p = position_mm({x, y, z}, pitch_mm);
          constexpr float kUnread = std::numeric_limits<float>::quiet_NaN();
          to.surface_mm[i] = kind == PartKind::inside ? kUnread : static_cast<float>(distance_mm(p));
          to.density_g_cm3[i] = static_cast<float>(density(p));
        }
    samples_asked += static_cast<std::int64_t>(i);
    return kind;
  }
};

TEST(CaseFromParts, IsTheCaseFromTheWholeVolume) {
  Ball ball{.radius_mm = 40.0};
  const CoordBox box = ball.box();
  DenseVolume<float> surface(box, 0.0f), density(box, 0.0f);
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 p = position_mm({x, y, z}, ball.pitch_mm);
        surface.at({x, y, z}) = static_cast<float>(ball.distance_mm(p));
        density.at({x, y, z}) = static_cast<float>(ball.density(p));
      }
  const auto whole = Case::build(info_of(ball.pitch_mm), surface, density);
  const auto fill = [&](const CoordBox& part, PartSamples& to) { return ball.fill(part, to); };
  const auto parts = Case::build(info_of(ball.pitch_mm), box, fill);
  ASSERT_TRUE(whole && parts);
  EXPECT_EQ(parts->hash(), whole->hash());
  EXPECT_EQ(parts->volume_mm3(), whole->volume_mm3());
  EXPECT_EQ(parts->bounds_samples(), whole->bounds_samples());
  // Not every sample of the box was asked for.
  EXPECT_LT(ball.samples_asked, static_cast<std::int64_t>(surface.values.size()));
  // The samples that were left out have their values.
  EXPECT_NEAR(parts->density_g_cm3(ball.centre_mm), 0.4, 1e-6);
  EXPECT_EQ(parts->tissue({3, -2, 1}), Tissue::trabecular);
  EXPECT_EQ(parts->density_g_cm3({60.0, 0.0, 0.0}), 0.0);
}

TEST(CaseFromParts, MemoryFollowsTheSurfaceNotTheVolume) {
  // Twice the size has eight times the volume and four times the surface.
  Ball small{.radius_mm = 20.0}, large{.radius_mm = 40.0};
  const auto build = [](Ball& ball) {
    const auto fill = [&](const CoordBox& part, PartSamples& to) { return ball.fill(part, to); };
    const auto built = Case::build(info_of(ball.pitch_mm), ball.box(), fill);
    EXPECT_TRUE(built);
    EXPECT_NEAR(built->volume_mm3(), 4.0 / 3.0 * std::numbers::pi * std::pow(ball.radius_mm, 3),
                0.002 * built->volume_mm3());
    return static_cast<double>(built->memory_bytes());
  };
  EXPECT_LT(build(large), 5.0 * build(small));
}

TEST(CaseFromParts, DistancesAreThoseOfTheNearestQuantum) {
  constexpr double kQuantum_mm = 1.0 / 1024.0, kPitch_mm = 0.5;
  const CoordBox box{{0, 0, 0}, {7, 7, 7}};
  const double wanted[] = {-1.6, -1.4, -0.6, -0.4, 0.4, 0.6, 1.4, 1.6};  // quanta
  DenseVolume<float> surface(box, 0.0f);
  const DenseVolume<float> density(box, 1.0f);
  for (std::int32_t x = 0; x < 8; ++x)
    for (std::int32_t y = 0; y < 8; ++y)
      for (std::int32_t z = 0; z < 8; ++z) surface.at({x, y, z}) = static_cast<float>(wanted[z] * kQuantum_mm);
  const auto bone = Case::build(info_of(kPitch_mm), surface, density);
  ASSERT_TRUE(bone) << bone.error().message;
  for (std::int32_t z = 0; z < 8; ++z)
    EXPECT_DOUBLE_EQ(bone->surface_mm(position_mm({3, 4, z}, kPitch_mm)), std::round(wanted[z]) * kQuantum_mm)
        << wanted[z] << " quanta";
}

TEST(CaseFromParts, StopsWhenAskedAndRefusesWhatIsNoNumber) {
  Ball ball;
  const auto fill = [&](const CoordBox& part, PartSamples& to) { return ball.fill(part, to); };
  const auto stopped = Case::build(info_of(ball.pitch_mm), ball.box(), fill, [](double done) { return done < 0.3; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  for (const bool in_density : {false, true}) {
    const auto broken = Case::build(info_of(ball.pitch_mm), ball.box(), [&](const CoordBox& part, PartSamples& to) {
      const PartKind kind = ball.fill(part, to);
      auto& values = in_density ? to.density_g_cm3 : to.surface_mm;
      if (kind == PartKind::samples) std::ranges::fill(values, std::numeric_limits<float>::quiet_NaN());
      return kind;
    });
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace osteon
