// A leg as large as the scan of Niu 2008, §5.3: 302 slices of 512 x 512 voxels of 0.489 x 0.489 x 1.5 mm.
#include <gtest/gtest.h>

#include <cstdio>

#include "common/subvolumes/quadtree.hpp"
#include "common/subvolumes/subvolume_list.hpp"
#include "common/subvolumes/voxel_surface.hpp"
#include "tests/unit/subvolumes/scenes.hpp"

namespace osteon::subvolumes {
namespace {

// A tibia of 400 mm: elliptic slices of a shaft that bends, and becomes wide at the knee and at the ankle. [A] for the
// sizes: 24 mm across the shaft, 72 x 50 mm at the knee, 48 x 40 mm at the ankle.
struct Tibia {
  static constexpr double kLength_mm = 400.0;

  [[nodiscard]] bool has(const Vec3& at_mm) const {
    const double from_knee = at_mm.z() / kLength_mm;
    if (from_knee < 0.0 || from_knee > 1.0) return false;
    const double knee = std::exp(-std::pow(from_knee / 0.1, 2.0)),
                 ankle = std::exp(-std::pow((1.0 - from_knee) / 0.08, 2.0));
    const double across = 12.0 + 24.0 * knee + 12.0 * ankle, along = 12.0 + 13.0 * knee + 8.0 * ankle;
    const double bend = 6.0 * std::sin(3.14159265 * from_knee);
    return std::pow((at_mm.x() - bend) / across, 2.0) + std::pow(at_mm.y() / along, 2.0) <= 1.0;
  }
};

TEST(Leg, KeepsLessThanTheDissertationDoes) {
  constexpr std::array<int, 3> kDims{512, 512, 302};
  const Vec3 spacing(0.489, 0.489, 1.5);
  Scene scene;
  scene.geometry = {kDims, Vec3(-125.0, -125.0, -25.0), spacing.asDiagonal()};
  scene.hu.assign(scene.geometry.count(), 40);
  scene.bone.assign(scene.geometry.count(), 0);
  const Tibia tibia;
  for (int z = 0; z < kDims[2]; ++z)
    for (int y = 180; y < 332; ++y)
      for (int x = 170; x < 352; ++x) {
        if (!tibia.has(scene.geometry.position_mm(Vec3(x, y, z)))) continue;
        const std::size_t i = scene.voxels().index({x, y, z});
        scene.bone[i] = 1;
        scene.hu[i] = 1200;
      }
  const BoneVoxels voxels = scene.voxels();
  const auto slices = slice_boxes(voxels, always);
  ASSERT_TRUE(slices);
  const CoordBox object = object_box(*slices);
  const std::vector<CoordBox> sections = section_boxes(*slices);
  std::int64_t of_sections = 0, bone = 0;
  for (const CoordBox& section : sections) {
    of_sections += voxels_of(section);
    bone += bone_in(voxels, section);
  }
  EXPECT_EQ(bone, scene.bones());
  const double kept = static_cast<double>(of_sections) / static_cast<double>(voxels_of(voxels.box()));
  const double of_object = static_cast<double>(of_sections) / static_cast<double>(voxels_of(object));
  std::printf("leg: %zu sections, %.2f %% of the voxels of the scan, %.2f %% of those of the object box\n",
              sections.size(), 100.0 * kept, 100.0 * of_object);
  EXPECT_LE(kept, 0.0212);    // Niu 2008, Table 5.2
  EXPECT_LT(of_object, 0.5);  // 31 % there: the shaft is thin, and the ends are wide
  const auto whole = reconstruct(voxels, std::array{voxels.box().grown(1)}, always);
  const auto parts = reconstruct(voxels, cell_boxes(sections), always);
  ASSERT_TRUE(whole && parts);
  EXPECT_EQ(parts->triangles.size(), whole->triangles.size());
  const auto rows = count_subdivisions(voxels, sections, 3, always);
  const auto list = SubVolumeList::divide(voxels, sections, 3, always);
  ASSERT_TRUE(rows && list);
  EXPECT_EQ(list->bone(), scene.bones());
  // The more subdivisions, the smaller the part that is kept, as in Table 5.3.
  for (std::size_t n = 1; n < rows->size(); ++n) EXPECT_LE((*rows)[n].kept(), (*rows)[n - 1].kept());
  EXPECT_LT((*rows)[3].kept(), 0.8);
}

}  // namespace
}  // namespace osteon::subvolumes
