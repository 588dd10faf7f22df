// The samples of a case take label and tissue from the nearest voxel of bone.
#include "server/import/case_samples.hpp"

#include <gtest/gtest.h>

#include <array>

namespace osteon::import {
namespace {

constexpr double kPitch_mm = 0.2;
constexpr std::array<int, 3> kBone{5, 5, 5};  // the only voxel of bone, of metal; voxels have an edge of 1 mm
constexpr std::uint8_t kLabel = 7;

struct SampleLabel {
  int bone = 0;
  Tissue tissue = Tissue::none;
};

// What a sample gets that lies at `at_mm` within the surface.
SampleLabel label_at(const Vec3& at_mm) {
  imaging::HuVolume volume;
  volume.dims = {11, 11, 11};
  CaseScan kept;
  kept.geometry.dims = volume.dims;
  kept.hu.assign(volume.count(), 500);
  std::vector<std::uint8_t> labels(volume.count(), 0), tissue(volume.count(), 0);
  const std::size_t bone = volume.index(kBone[0], kBone[1], kBone[2]);
  labels[bone] = kLabel;
  tissue[bone] = static_cast<std::uint8_t>(Tissue::metal);
  kept.labels = SparseBytes(labels);
  kept.tissue = SparseBytes(tissue);
  const imaging::VoxelBox all{{0, 0, 0}, {10, 10, 10}};
  const Vec3 index = at_mm / kPitch_mm;
  const Coord sample{static_cast<std::int32_t>(std::lround(index.x())),
                     static_cast<std::int32_t>(std::lround(index.y())),
                     static_cast<std::int32_t>(std::lround(index.z()))};
  SparseVolume surface_mm(static_cast<float>(4.0 * kPitch_mm));
  const Coord origin = floor_to(sample, kLeafSize), in = sample - origin;
  surface_mm.edit_leaf(origin)[(in.x * kLeafSize + in.y) * kLeafSize + in.z] = -0.1f;
  CaseSamples samples({.scan = volume,
                       .volume = volume,
                       .hu_box = all,
                       .hu = kept.hu,
                       .kept_box = all,
                       .kept = kept,
                       .bone_labels = std::bitset<256>().set(kLabel),
                       .tissue_labels = {},
                       .several = true,
                       .known_tissue = true,
                       .calibration = imaging::kRho1995},
                      surface_mm, kPitch_mm);
  PartSamples to;
  to.surface_mm.resize(1);
  to.density_g_cm3.resize(1);
  if (samples.fill({sample, sample}, to) != PartKind::samples) return {-1, Tissue::none};
  return {to.bone.at(0), to.tissue.at(0)};
}

void expect_bone(const Vec3& at_mm) {
  const SampleLabel found = label_at(at_mm);
  EXPECT_EQ(found.bone, kLabel) << at_mm.transpose();
  EXPECT_EQ(found.tissue, Tissue::metal) << at_mm.transpose();
}

TEST(CaseSamples, ASampleInAVoxelOfBoneHasItsLabel) { expect_bone({5.2, 4.8, 5.0}); }

// The cell round such a sample does not reach the voxel of bone: the surface of labels lies beyond it.
TEST(CaseSamples, ASampleBeyondTheCellHasTheLabelOfAnyOfThe26NeighboursOfItsVoxel) {
  for (const int x : {-1, 0, 1})
    for (const int y : {-1, 0, 1})
      for (const int z : {-1, 0, 1}) expect_bone(Vec3(5, 5, 5) + 1.2 * Vec3(x, y, z));
}

TEST(CaseSamples, ASampleFarFromBoneHasNoLabel) {
  for (const Vec3& at_mm : {Vec3(7.2, 5.0, 5.0), Vec3(5.0, 2.8, 5.0), Vec3(7.2, 7.2, 7.2)}) {
    const SampleLabel found = label_at(at_mm);
    EXPECT_EQ(found.bone, 0) << at_mm.transpose();
    EXPECT_EQ(found.tissue, Tissue::none) << at_mm.transpose();
  }
}

}  // namespace
}  // namespace osteon::import
