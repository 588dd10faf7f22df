// Small scans whose bone is known voxel by voxel.
#pragma once
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "common/subvolumes/bone_voxels.hpp"
#include "common/subvolumes/bounding_boxes.hpp"

namespace osteon::subvolumes {

inline bool always(double) { return true; }

constexpr double kThreshold_hu = 226.0;

struct Scene {
  ScanGeometry geometry;
  std::vector<std::int16_t> hu;
  std::vector<std::uint8_t> bone;

  [[nodiscard]] BoneVoxels voxels() const { return {geometry, hu, bone, kThreshold_hu}; }
  [[nodiscard]] std::int64_t bones() const { return std::ranges::count(bone, 1); }
  [[nodiscard]] std::vector<CoordBox> sections() const { return section_boxes(*slice_boxes(voxels(), always)); }
};

// `is_bone`: of a voxel.
template <class IsBone>
Scene scene_of(std::array<int, 3> dims, const Vec3& spacing_mm, IsBone is_bone) {
  Scene scene;
  scene.geometry = {dims, Vec3(-3.0, 5.0, 20.0), spacing_mm.asDiagonal()};
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x) {
        const bool bone = is_bone(Coord{x, y, z});
        scene.bone.push_back(bone ? 1 : 0);
        scene.hu.push_back(bone ? 1200 : 40);
      }
  return scene;
}

// Any size, any share of bone, slices without bone, marrow, and dense voxels that are no bone.
inline Scene random_scene(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto whole = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  const auto length = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const std::array<int, 3> dims{whole(1, 21), whole(1, 17), whole(1, 14)};
  const double share = std::pow(length(0.0, 1.0), 2.0);
  const Vec3 middle(length(0.0, dims[0]), length(0.0, dims[1]), length(0.0, dims[2]));
  const double radius = length(1.0, 9.0);
  const int empty_slice = whole(0, 2 * dims[2]);
  Scene scene = scene_of(dims, Vec3(length(0.3, 1.0), length(0.3, 1.0), length(0.5, 3.0)), [&](Coord at) {
    const bool ball = (Vec3(at.x, at.y, at.z) - middle).norm() < radius;
    return at.z != empty_slice && (ball ? length(0.0, 1.0) < 0.98 : length(0.0, 1.0) < 0.2 * share);
  });
  if (scene.bones() == 0) {
    scene.bone.front() = 1;
    scene.hu.front() = 800;
  }
  for (std::int16_t& hu : scene.hu)
    if (whole(0, 4) == 0) hu = static_cast<std::int16_t>(whole(-1000, 1500));  // marrow in bone, metal beside it
  return scene;
}

template <class Call>
void for_each_voxel(const CoordBox& box, Call call) {
  for (int z = box.min.z; z <= box.max.z; ++z)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int x = box.min.x; x <= box.max.x; ++x) call(Coord{x, y, z});
}

}  // namespace osteon::subvolumes
