// Phantom bones of tests, and their landmarks.
#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

inline std::unique_ptr<PhantomBone> bone_of(const BoneRecipe& recipe) {
  auto made = make_bone(recipe);
  EXPECT_TRUE(made) << made.error().message;
  return made ? std::move(*made) : nullptr;
}

inline Vec3 landmark(const PhantomBone& bone, const std::string& name) {
  for (const Landmark& found : bone.anatomy().landmarks)
    if (found.name == name) return found.point_mm;
  ADD_FAILURE() << "no landmark " << name;
  return Vec3::Zero();
}

}  // namespace osteon::phantoms
