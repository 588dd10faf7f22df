// Scenes of simple shapes: a patient with bones, and what lies around him.
#include "common/imaging/island_kinds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>

#include "common/imaging/calibration.hpp"
#include "common/imaging/segmentation.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kRoomAir_hu = -1000.0, kFoam_hu = -800.0, kSoft_hu = 40.0, kDenseBone_hu = 900.0, kPlate_hu = 500.0;

// HU at a position, mm from the middle of the scan: x to the patient's left, y to his back, z to his head.
using PatientScene = std::function<double(const Vec3&)>;

struct PatientGrid {
  std::array<int, 3> dims{44, 44, 32};
  double spacing_mm = 2.5;
};

HuVolume scan_of_scene(const PatientScene& scene, const PatientGrid& grid = {}) {
  HuVolume volume;
  volume.dims = grid.dims;
  volume.spacing_mm = Vec3::Constant(grid.spacing_mm);
  volume.origin_mm = -0.5 * grid.spacing_mm * Vec3(grid.dims[0] - 1, grid.dims[1] - 1, grid.dims[2] - 1);
  for (int z = 0; z < grid.dims[2]; ++z)
    for (int y = 0; y < grid.dims[1]; ++y)
      for (int x = 0; x < grid.dims[0]; ++x)
        volume.values.push_back(static_cast<std::int16_t>(scene(volume.position_mm(Vec3(x, y, z)))));
  return volume;
}

struct Named {
  Islands islands;
  std::vector<IslandNature> natures;

  // The kind of the island around a position; "none" if there is none within a voxel.
  [[nodiscard]] std::string at(const HuVolume& volume, const Vec3& position_mm) const {
    const Vec3 voxel = volume.voxel(position_mm);
    for (const VoxelRun& run : islands.components.runs)
      if (std::abs(run.slice - voxel.z()) <= 1.0 && std::abs(run.row - voxel.y()) <= 1.0 &&
          run.first <= voxel.x() + 1.0 && run.last >= voxel.x() - 1.0)
        return std::string(name_of(natures[static_cast<std::size_t>(islands.number[run.component] - 1)].kind));
    return "none";
  }
  // How many islands there are of each kind.
  [[nodiscard]] std::map<std::string, int> counts() const {
    std::map<std::string, int> of;
    for (const IslandNature& nature : natures) ++of[std::string(name_of(nature.kind))];
    return of;
  }
};

Named named(const HuVolume& volume) {
  const auto bone = dense_voxels(volume, kBoneThreshold_hu, always);
  EXPECT_TRUE(bone);
  auto islands = find_islands(volume, *bone, kRho1995, always);
  EXPECT_TRUE(islands);
  auto natures = name_islands(volume, *bone, *islands, kMetal_hu, always);
  EXPECT_TRUE(natures);
  EXPECT_EQ(natures->size(), islands->list.size());
  return {std::move(*islands), std::move(*natures)};
}
std::map<std::string, int> kinds(const PatientScene& scene) { return named(scan_of_scene(scene)).counts(); }

using Kinds = std::map<std::string, int>;

bool in_cylinder(const Vec3& p, double x, double y, double radius_mm) {
  return std::hypot(p.x() - x, p.y() - y) < radius_mm;
}
// A trunk or limb along z, with a bone in the middle of it.
double limb(const Vec3& p, double x = 0.0, double y = 0.0, double radius_mm = 26.0) {
  if (in_cylinder(p, x, y, 7.0)) return kDenseBone_hu;
  return in_cylinder(p, x, y, radius_mm) ? kSoft_hu : kRoomAir_hu;
}
// A sheet of 3 mm in front of or behind y.
bool in_sheet(const Vec3& p, double y) { return std::abs(p.y() - y) < 1.5 && std::abs(p.x()) < 50.0; }

TEST(IslandKinds, ATableIsNoBone) {
  const HuVolume volume = scan_of_scene([](const Vec3& p) { return in_sheet(p, 40.0) ? kPlate_hu : limb(p); });
  const Named found = named(volume);
  EXPECT_EQ(found.at(volume, {0, 0, 0}), "bone");
  EXPECT_EQ(found.at(volume, {0, 40, 0}), "table");
  EXPECT_EQ(found.counts(), (Kinds{{"bone", 1}, {"table", 1}}));
  // What decided: two voxels of 2.5 mm on 40, without a surface where the scan ends.
  const IslandNature& table = found.natures[found.islands.list[0].centre_mm.y() > 20.0 ? 0 : 1];
  EXPECT_GT(table.at_air, 0.95);
  EXPECT_NEAR(table.thickness_mm, 2.0 * 100.0 * 5.0 / (2.0 * 100.0 + 2.0 * 5.0), 1e-9);
  EXPECT_EQ(table.metal, 0.0);
}

// The table is larger than the bone, and first in the list.
TEST(IslandKinds, ATableIsNoBoneEvenIfItIsTheLargest) {
  const HuVolume volume = scan_of_scene([](const Vec3& p) {
    if (in_sheet(p, 38.0) || in_sheet(p, 41.0)) return kPlate_hu;
    return in_cylinder(p, 0.0, 0.0, 4.0) ? kDenseBone_hu : limb(p) == kRoomAir_hu ? kRoomAir_hu : kSoft_hu;
  });
  const Named found = named(volume);
  EXPECT_GT(found.islands.list[0].centre_mm.y(), 30.0);
  EXPECT_EQ(found.natures[0].kind, IslandKind::table);
  EXPECT_EQ(found.natures[1].kind, IslandKind::bone);
}

// Two sheets with foam between, and a layer of foam of one voxel between the upper one and the skin.
TEST(IslandKinds, ATableOfFoamUnderTheSkinIsNoBone) {
  for (const double foam_hu : {-900.0, -700.0, -500.0}) {
    const PatientScene scene = [&](const Vec3& p) {
      if (in_sheet(p, 30.0) || in_sheet(p, 46.0)) return kPlate_hu;
      if (p.y() > 25.8 && p.y() < 46.0 && std::abs(p.x()) < 50.0) return foam_hu;
      return limb(p);
    };
    EXPECT_EQ(kinds(scene), (Kinds{{"bone", 1}, {"table", 2}})) << foam_hu;
  }
}

TEST(IslandKinds, PronePatientsAndTablesAtASideMakeNoDifference) {
  for (const double side : {-1.0, 1.0}) {
    EXPECT_EQ(kinds([&](const Vec3& p) { return in_sheet(p, side * 40.0) ? kPlate_hu : limb(p); }),
              (Kinds{{"bone", 1}, {"table", 1}}));
    EXPECT_EQ(kinds([&](const Vec3& p) {
                return in_sheet({p.y(), p.x(), p.z()}, side * 40.0) ? kPlate_hu : limb(p);
              }),
              (Kinds{{"bone", 1}, {"table", 1}}));
  }
}

// Half of a tube around the head, on a layer of foam.
double headrest(const Vec3& p) {
  const double radius_mm = std::hypot(p.x(), p.y());
  if (p.y() > -5.0 && radius_mm >= 30.0 && radius_mm < 34.0) return kPlate_hu;
  if (p.y() > -5.0 && radius_mm >= 26.0 && radius_mm < 30.0) return kFoam_hu;
  return limb(p);
}

TEST(IslandKinds, AHeadrestAroundHalfOfAHeadIsNoCast) {
  EXPECT_EQ(kinds(headrest), (Kinds{{"bone", 1}, {"table", 1}}));
}

// A tube around a limb, with padding or on the skin itself, as long as the scan or shorter.
double cast(const Vec3& p, double padding_mm, double half_mm) {
  const double radius_mm = std::hypot(p.x(), p.y());
  if (std::abs(p.z()) < half_mm && radius_mm >= 26.0 + padding_mm && radius_mm < 31.0 + padding_mm) return kPlate_hu;
  if (radius_mm >= 26.0 && radius_mm < 26.0 + padding_mm) return kFoam_hu;
  return limb(p);
}

TEST(IslandKinds, ACastAroundALimbIsNoBone) {
  for (const double padding_mm : {0.0, 3.0, 8.0})
    for (const double half_mm : {100.0, 25.0})
      EXPECT_EQ(kinds([&](const Vec3& p) { return cast(p, padding_mm, half_mm); }), (Kinds{{"bone", 1}, {"cast", 1}}))
          << padding_mm << " " << half_mm;
}

TEST(IslandKinds, TheOtherLegBesideACastIsBone) {
  const HuVolume volume = scan_of_scene(
      [](const Vec3& p) {
        const double radius_mm = std::hypot(p.x() + 38.0, p.y());
        if (radius_mm >= 26.0 && radius_mm < 31.0) return kPlate_hu;
        return std::max(limb(p, -38.0), limb(p, 38.0));
      },
      {.dims = {64, 32, 24}, .spacing_mm = 2.5});
  const Named found = named(volume);
  EXPECT_EQ(found.at(volume, {-38, 0, 0}), "bone");
  EXPECT_EQ(found.at(volume, {38, 0, 0}), "bone");
  EXPECT_EQ(found.at(volume, {-38, 28, 0}), "cast");
  EXPECT_EQ(found.counts(), (Kinds{{"bone", 2}, {"cast", 1}}));
}

TEST(IslandKinds, AScrewApartFromBoneIsMetal) {
  EXPECT_EQ(kinds([](const Vec3& p) { return in_cylinder(p, 16.0, 0.0, 4.0) ? 3071.0 : limb(p); }),
            (Kinds{{"bone", 1}, {"metal", 1}}));
  // One voxel wide, with an edge of one voxel that the scanner has blurred.
  const PatientScene thin = [](const Vec3& p) {
    const double off_mm = std::max(std::abs(p.x() - 16.25), std::abs(p.y() - 1.25));
    return off_mm < 1.0 ? 3071.0 : off_mm < 3.0 ? 800.0 : limb(p);
  };
  EXPECT_EQ(kinds(thin), (Kinds{{"bone", 1}, {"metal", 1}}));
}

TEST(IslandKinds, ABoneWithAScrewIsBone) {
  EXPECT_EQ(kinds([](const Vec3& p) { return in_cylinder(p, 0.0, 0.0, 3.0) ? 3071.0 : limb(p); }),
            (Kinds{{"bone", 1}}));
}

TEST(IslandKinds, DryBonesInAirAreBone) {
  // A shaft, half a skull's vault, and a plate, none of them in soft tissue.
  EXPECT_EQ(kinds([](const Vec3& p) { return in_cylinder(p, 0.0, 0.0, 7.0) ? kDenseBone_hu : kRoomAir_hu; }),
            (Kinds{{"bone", 1}}));
  EXPECT_EQ(kinds([](const Vec3& p) {
              const double radius_mm = std::hypot(p.x(), p.y(), p.z());
              if (p.y() > 0.0 && radius_mm > 36.0 && radius_mm < 40.0) return kDenseBone_hu;
              return in_cylinder(p, 0.0, -20.0, 7.0) || in_sheet(p, 46.0) ? kDenseBone_hu : kRoomAir_hu;
            }),
            (Kinds{{"bone", 3}}));
}

TEST(IslandKinds, ABoneUnderSkinOfOneVoxelIsBone) {
  // A long thin plate of bone, as a rib or a shin, with 2.5 mm of skin before it.
  EXPECT_EQ(kinds([](const Vec3& p) {
              if (std::abs(p.y() + 31.25) < 2.0 && std::abs(p.x()) < 15.0) return kDenseBone_hu;
              return std::abs(p.y() + 31.25) < 4.5 && std::abs(p.x()) < 17.5 ? kSoft_hu : limb(p, 0.0, -4.0);
            }),
            (Kinds{{"bone", 2}}));
}

// Thin plates in a nose: air on both sides, but no line of sight out of the head, except to the front.
TEST(IslandKinds, ThinBonesInTheAirwayAreBone) {
  EXPECT_EQ(kinds([](const Vec3& p) {
              const bool airway = std::abs(p.x()) < 12.0 && p.y() < -10.0 && p.y() > -32.0 && std::abs(p.z()) < 36.0;
              const bool nostril = std::abs(p.x()) < 6.0 && p.y() <= -32.0 && std::abs(p.z()) < 6.0;
              if (airway && std::abs(std::abs(p.x()) - 3.75) < 1.0 && p.y() > -28.0 && p.y() < -14.0)
                return kDenseBone_hu;
              return airway || nostril ? kRoomAir_hu : limb(p, 0.0, 0.0, 48.0);
            }),
            (Kinds{{"bone", 3}}));
}

// A rib's edge that lies bare beside a lung, where the scan ends and the lung is open.
TEST(IslandKinds, ThinBonesBesideALungAtTheEndOfTheScanAreBone) {
  EXPECT_EQ(kinds([](const Vec3& p) {
              const bool lung = in_cylinder(p, 0.0, 24.0, 16.0);
              if (std::abs(p.x() - 12.5) < 1.3 && std::abs(p.y() - 24.0) < 9.0) return kDenseBone_hu;
              return lung ? -850.0 : limb(p, 0.0, 0.0, 48.0);
            }),
            (Kinds{{"bone", 2}}));
}

TEST(IslandKinds, ABoneAtTheEndOfTheScanIsBone) {
  // The limb is cut off on three sides.
  EXPECT_EQ(kinds([](const Vec3& p) { return limb(p, 50.0, 30.0); }), (Kinds{{"bone", 1}}));
}

// The same scene on axes in any order and direction.
TEST(IslandKinds, AxesMakeNoDifference) {
  const PatientScene scene = [](const Vec3& p) {
    if (in_sheet(p, 46.0)) return kPlate_hu;
    if (in_cylinder(p, 16.0, 0.0, 4.0)) return 3071.0;
    return cast(p, 3.0, 25.0);
  };
  const std::array<std::array<int, 3>, 6> orders{{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (const auto& order : orders)
    for (int mirrored = 0; mirrored < 8; ++mirrored) {
      const Named found = named(scan_of_scene(
          [&](const Vec3& p) {
            Vec3 at;
            for (int axis = 0; axis < 3; ++axis)
              at[axis] = ((mirrored >> axis) & 1) != 0 ? -p[order[static_cast<std::size_t>(axis)]]
                                                       : p[order[static_cast<std::size_t>(axis)]];
            return scene(at);
          },
          {.dims = {44, 44, 44}, .spacing_mm = 2.5}));
      EXPECT_EQ(found.counts(), (Kinds{{"bone", 1}, {"cast", 1}, {"metal", 1}, {"table", 1}}))
          << order[0] << order[1] << order[2] << " " << mirrored;
    }
}

TEST(IslandKinds, StopsWhenAsked) {
  const HuVolume volume = scan_of_scene(headrest);
  const auto bone = dense_voxels(volume, kBoneThreshold_hu, always);
  const auto islands = find_islands(volume, *bone, kRho1995, always);
  int calls = 0;
  ASSERT_TRUE(name_islands(volume, *bone, *islands, kMetal_hu, [&](double) { return ++calls > 0; }));
  for (int last = 0; last < calls; ++last) {
    int left = last;
    const auto stopped = name_islands(volume, *bone, *islands, kMetal_hu, [&](double) { return left-- > 0; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace osteon::imaging
