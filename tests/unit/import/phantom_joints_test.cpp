// Phantoms of more than one bone that come back from a CT. Each takes a quarter of a minute, so they run every night.
// deploy/test runs those of a femur, and of a knee through the program (phantom_bone_test.cpp).
#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "common/phantoms/joint.hpp"
#include "server/import/ct_import.hpp"
#include "tests/support/scenes/scanned_phantoms.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::import {
namespace {

// The cortex of a fibula is as thin as a slice is thick, so its density is not asked for.
TEST(PhantomJointsCt, ATibiaAndItsFibulaComeBackAsTwoBones) {
  const auto tibia = phantoms::make_bone({.kind = "tibia", .side = phantoms::Side::right});
  ASSERT_TRUE(tibia) << tibia.error().message;
  CtOptions options;
  options.keep = {1, 2};
  const test::TempDir folder;
  const auto found = test::agreement_of_scan(**tibia, options, folder.path());
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GE(found->dice, 0.97);
}

void expect_back_apart(const phantoms::PhantomBone& joint, const std::vector<test::BoneSeed>& more = {}) {
  const test::TempDir folder;
  const auto found = test::dice_of_bones(joint, more, folder.path());
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->size(), joint.names().size());
  for (const auto& [bone, dice] : *found) {
    std::printf("[          ] %s: Dice %.4f\n", bone.c_str(), dice);
    EXPECT_GE(dice, 0.95) << bone;
  }
}

TEST(PhantomJointsCt, AKneeComesBackAsFourBones) {
  const auto knee = phantoms::make_bone({.kind = "knee"});
  ASSERT_TRUE(knee) << knee.error().message;
  expect_back_apart(**knee);
}

// In slices this thick, the import divides the femur at its neck and not at the joint, so the head needs its own seed.
TEST(PhantomJointsCt, AHipComesBackAsTwoBones) {
  const auto hip = phantoms::make_bone({.kind = "hip"});
  ASSERT_TRUE(hip) << hip.error().message;
  expect_back_apart(**hip, {{phantoms::point_of(**hip, "head centre"), 2}});
}

}  // namespace
}  // namespace osteon::import
