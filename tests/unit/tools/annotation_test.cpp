#include "common/tools/annotation.hpp"

#include <gtest/gtest.h>

namespace osteon {
namespace {

TEST(Annotation, StepsAreParts1024OfAMillimetre) {
  EXPECT_EQ(in_steps(Vec3(1, -2.5, 0)), (std::array<std::int32_t, 3>{1024, -2560, 0}));
  EXPECT_EQ(from_steps({1024, -2560, 512}), Vec3(1, -2.5, 0.5));
  EXPECT_EQ(in_steps(Vec3(1e30, -1e30, 0.0)), (std::array<std::int32_t, 3>{1 << 30, -(1 << 30), 0}));
}

TEST(Annotation, WhatIsPlannedHasADirection) {
  const auto refused = [](AnnotationKind kind, std::vector<std::array<std::int32_t, 3>> points) {
    const Result<void> checked = check({.kind = kind, .points = std::move(points)});
    return checked ? std::string() : checked.error().message;
  };
  using Kind = AnnotationKind;
  EXPECT_EQ(refused(Kind::axis, {{0, 0, 0}, {0, 0, -1024}}), "");
  EXPECT_EQ(refused(Kind::plane, {{0, 0, 0}, {1024, 0, 0}, {0, 1024, 0}}), "");
  EXPECT_NE(refused(Kind::axis, {{0, 0, 0}, {0, 0, 50}}).find("drawn.points"), std::string::npos) << "0.05 mm";
  EXPECT_NE(refused(Kind::axis, {{0, 0, 0}}).find("drawn.points"), std::string::npos);
  EXPECT_NE(refused(Kind::axis, {{0, 0, 0}, {0, 0, 2000}, {0, 0, 4000}}).find("drawn.points"), std::string::npos);
  EXPECT_NE(refused(Kind::plane, {{0, 0, 0}, {1024, 0, 0}, {4096, 50, 0}}).find("one line"), std::string::npos);
  EXPECT_NE(refused(Kind::plane, {{0, 0, 0}, {0, 0, 0}, {0, 1024, 0}}).find("drawn.points"), std::string::npos);
  // The farthest points that in_steps() gives.
  constexpr std::int32_t kFar = 1 << 30;
  EXPECT_EQ(refused(Kind::plane, {{-kFar, -kFar, -kFar}, {kFar, kFar, -kFar}, {kFar, -kFar, kFar}}), "");
  EXPECT_EQ(planned_direction({.kind = Kind::axis, .points = {{5, 5, 5}, {5, 5, -3000}}}), -Vec3::UnitZ());
  EXPECT_EQ(planned_direction({.kind = Kind::plane, .points = {{0, 0, 0}, {2048, 0, 0}, {512, 1024, 0}}}),
            Vec3::UnitZ());
}

}  // namespace
}  // namespace osteon
