// The surface of what is kept, against balls of known place and radius.
#include "viewer_client/imaging/kept_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "common/geometry/triangle_mesh.hpp"
#include "viewer_client/imaging/reduced_scan.hpp"

namespace osteon {
namespace {

const KeepGoing kGoOn = [](double) { return true; };
constexpr double kLarge_mm = 20.0, kSmall_mm = 9.0;  // radii

// Two balls in oblique voxels that are no cubes: island 1 is the large one, and island 2 the small one.
class KeptBones : public testing::Test {
 protected:
  KeptBones() {
    scan_.dims = {220, 170, 45};
    scan_.origin_mm = {-30.0, 12.0, 5.0};
    scan_.axes_mm =
        Eigen::AngleAxisd(0.5, Vec3(2, 1, 3).normalized()).toRotationMatrix() * Vec3(0.5, 0.5, 1.2).asDiagonal();
    large_mm_ = scan_.position_mm(Vec3(70, 80, 22));
    small_mm_ = scan_.position_mm(Vec3(170, 90, 20));
    VoxelFile<std::uint8_t> numbers{scan_, {}};
    for (int k = 0; k < scan_.dims[2]; ++k)
      for (int j = 0; j < scan_.dims[1]; ++j)
        for (int i = 0; i < scan_.dims[0]; ++i) {
          const Vec3 at = scan_.position_mm(Vec3(i, j, k));
          const bool large = (at - large_mm_).norm() <= kLarge_mm, small = (at - small_mm_).norm() <= kSmall_mm;
          numbers.values.push_back(large ? 1 : small ? 2 : 0);
        }
    islands_ = *IslandMap::make(scan_, std::move(numbers));
    kept_.bones[1].set(1);
    const ScanBlocks blocks = blocks_of(scan_);
    block_mm_ = blocks.geometry.axes_mm.colwise().norm().maxCoeff();
    EXPECT_EQ(blocks.step, (std::array<int, 3>{2, 2, 1}));
  }
  [[nodiscard]] std::vector<KeptSurface> surfaces() const {
    auto made = kept_surfaces(scan_, islands_, kept_, kGoOn);
    EXPECT_TRUE(made) << made.error().message;
    return made ? std::move(*made) : std::vector<KeptSurface>();
  }
  // Of the only bone.
  [[nodiscard]] Mesh surface() const {
    auto made = surfaces();
    EXPECT_LE(made.size(), 1u);
    return made.empty() ? Mesh() : std::move(made.front().mesh);
  }
  void correct(Correction correction) {
    kept_.corrections.push_back(std::make_shared<const Correction>(std::move(correction)));
  }
  // All of it lies on the sphere, to within a block, and it is not shifted.
  void expect_ball(const Mesh& mesh, const Vec3& centre_mm, double radius_mm) const {
    ASSERT_FALSE(mesh.triangles.empty());
    const TriangleMesh plain{mesh.positions_mm, mesh.triangles, {}};
    EXPECT_EQ(open_edges(plain), 0u);
    const auto volume_mm3 = [](double radius) { return 4.0 / 3.0 * std::numbers::pi * radius * radius * radius; };
    EXPECT_GT(enclosed_mm3(plain), volume_mm3(radius_mm - 0.5 * block_mm_));
    EXPECT_LT(enclosed_mm3(plain), volume_mm3(radius_mm + 0.5 * block_mm_));
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t vertex = 0; vertex < mesh.positions_mm.size(); ++vertex) {
      const Vec3 from_centre = position(plain, vertex) - centre_mm;
      sum += from_centre;
      ASSERT_NEAR(from_centre.norm(), radius_mm, block_mm_);
      const auto& [x, y, z] = mesh.normals[vertex];
      ASSERT_GT(from_centre.normalized().dot(Vec3(x, y, z)), 0.6) << "it points inwards";
    }
    EXPECT_LT(sum.norm() / static_cast<double>(mesh.positions_mm.size()), 0.25 * block_mm_);
  }

  ScanGeometry scan_;
  Vec3 large_mm_, small_mm_;
  IslandMap islands_;
  KeptParts kept_;
  double block_mm_ = 0.0;
};

TEST_F(KeptBones, ABallLiesWhereItIs) {
  expect_ball(surface(), large_mm_, kLarge_mm);
  kept_.bones = {};
  kept_.bones[2].set(7);
  expect_ball(surface(), small_mm_, kSmall_mm);
}

TEST_F(KeptBones, EachBoneHasItsOwn) {
  kept_.bones[2].set(7);
  auto both = surfaces();
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].bone, 1);
  EXPECT_EQ(both[1].bone, 7);
  expect_ball(both[0].mesh, large_mm_, kLarge_mm);
  expect_ball(both[1].mesh, small_mm_, kSmall_mm);
  // Two bones of one island show as the lowest. Paint within it is the bone that was painted.
  kept_.bones[1].set(3);
  correct({CorrectionKind::paint, 9, {large_mm_}, 8.0, Vec3::Zero()});
  both = surfaces();
  ASSERT_EQ(both.size(), 3u);
  EXPECT_EQ(both[0].bone, 1);
  EXPECT_EQ(both[2].bone, 9);
  expect_ball(both[2].mesh, large_mm_, 8.0);
  const auto ball_mm3 = [](double radius_mm) { return 4.0 / 3.0 * std::numbers::pi * std::pow(radius_mm, 3); };
  EXPECT_NEAR(enclosed_mm3({both[0].mesh.positions_mm, both[0].mesh.triangles, {}}),
              ball_mm3(kLarge_mm) - ball_mm3(8.0), 0.08 * ball_mm3(kLarge_mm));
}

// Each point of a surface belongs to the island whose ball it is on, also where it lies beside all voxels of it.
TEST_F(KeptBones, APointOfItChoosesItsIsland) {
  kept_.bones[2].set(1);
  const Mesh both = surface();
  const TriangleMesh plain{both.positions_mm, both.triangles, {}};
  for (std::uint32_t vertex = 0; vertex < both.positions_mm.size(); ++vertex) {
    const Vec3 at_mm = position(plain, vertex);
    const bool large = (at_mm - large_mm_).norm() < kLarge_mm + block_mm_;
    const std::array<int, 3> beside = voxel_near(scan_, at_mm);
    ASSERT_EQ(island_near(scan_, islands_, kept_.bones, 1, beside), large ? 1 : 2);
    if (vertex % 100 != 0) continue;  // it makes whole slices
    const auto within = bone_voxel_near(scan_, islands_, kept_, 1, beside);
    ASSERT_TRUE(within);
    ASSERT_EQ(islands_.number(*within), large ? 1 : 2);
    ASSERT_LT((centre_of(scan_, *within) - at_mm).norm(), 2.0 * block_mm_);
  }
  EXPECT_FALSE(bone_voxel_near(scan_, islands_, kept_, 1, {219, 0, 0}));
  // Paint far from its bone's islands is of the first one; another bone has none.
  EXPECT_EQ(island_near(scan_, islands_, kept_.bones, 1, {219, 0, 0}), 1);
  EXPECT_EQ(island_near(scan_, islands_, kept_.bones, 4, {70, 80, 22}), 0);
}

TEST(PaintedPoints, AreAtLeastSoFarApart) {
  const auto stroke = [](CorrectionKind kind, std::vector<Vec3> points) {
    return std::make_shared<const Correction>(Correction{kind, 1, std::move(points), 2.0, Vec3::Zero()});
  };
  const std::vector<SharedCorrection> strokes{
      stroke(CorrectionKind::paint, {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(3, 0, 0), Vec3(3.5, 0, 0), Vec3(6, 0, 0)}),
      stroke(CorrectionKind::erase, {Vec3(50, 0, 0)}), stroke(CorrectionKind::paint, {Vec3(6.5, 0, 0)})};
  EXPECT_EQ(painted_points(strokes, 2.0),
            (std::vector<Vec3>{Vec3(0, 0, 0), Vec3(3, 0, 0), Vec3(6, 0, 0), Vec3(6.5, 0, 0)}));
}

TEST_F(KeptBones, NothingRemainsOfWhatIsDropped) {
  EXPECT_FALSE(surface().triangles.empty());
  const KeptParts before = kept_;
  // No seed, an eraser over all, a cut beside the ball, and a box beside it.
  kept_.bones = {};
  EXPECT_TRUE(surface().triangles.empty());
  kept_ = before;
  correct({CorrectionKind::erase, 0, {large_mm_}, 25.0, Vec3::Zero()});
  EXPECT_TRUE(surface().triangles.empty());
  kept_ = before;
  const Vec3 along = scan_.axes_mm.col(0).normalized();
  correct({CorrectionKind::cut, 1, {large_mm_ - 21.0 * along}, 0.0, along});
  EXPECT_TRUE(surface().triangles.empty());
  kept_ = before;
  kept_.box = MarkedBox{scan_.position_mm(Vec3(140, 60, 2)), scan_.position_mm(Vec3(210, 120, 40))};
  EXPECT_TRUE(surface().triangles.empty());
}

TEST_F(KeptBones, ACutLeavesItsSide) {
  const Vec3 along = scan_.axes_mm.col(0).normalized();
  correct({CorrectionKind::cut, 1, {large_mm_}, 0.0, along});
  const Mesh half = surface();
  const TriangleMesh plain{half.positions_mm, half.triangles, {}};
  for (std::uint32_t vertex = 0; vertex < half.positions_mm.size(); ++vertex)
    ASSERT_LT((position(plain, vertex) - large_mm_).dot(along), block_mm_);
  const double ball_mm3 = 4.0 / 3.0 * std::numbers::pi * kLarge_mm * kLarge_mm * kLarge_mm;
  EXPECT_NEAR(enclosed_mm3(plain), 0.5 * ball_mm3, 0.08 * ball_mm3);
}

// A cut of another bone changes nothing, and paint needs no island. The box bounds it.
TEST_F(KeptBones, PaintIsKeptWithinTheBox) {
  correct({CorrectionKind::cut, 3, {large_mm_}, 0.0, Vec3::UnitX()});
  expect_ball(surface(), large_mm_, kLarge_mm);
  kept_.bones = {};
  const Vec3 beside = scan_.position_mm(Vec3(180, 40, 22));
  correct({CorrectionKind::paint, 5, {beside}, 8.0, Vec3::Zero()});
  expect_ball(surface(), beside, 8.0);
  kept_.box = MarkedBox{scan_.position_mm(Vec3(0, 0, 0)), scan_.position_mm(Vec3(180, 169, 44))};
  const Mesh half = surface();
  const TriangleMesh plain{half.positions_mm, half.triangles, {}};
  const Vec3 along = scan_.axes_mm.col(0).normalized();
  ASSERT_FALSE(half.triangles.empty());
  for (std::uint32_t vertex = 0; vertex < half.positions_mm.size(); ++vertex)
    ASSERT_LT((position(plain, vertex) - beside).dot(along), block_mm_);
}

TEST_F(KeptBones, ACancelledOneGivesNone) {
  int asked = 0;
  const auto stopped = kept_surfaces(scan_, islands_, kept_, [&](double) { return ++asked < 20; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  EXPECT_EQ(asked, 20) << "it goes on after it was stopped";
}

// A bone through all slices. The last block has one of its two slices, so the surface ends beyond the scan.
TEST(KeptSurfaceOfACutBone, ChoosesVoxelsOfTheScan) {
  ScanGeometry scan;
  scan.dims = {200, 61, 61};
  scan.origin_mm = {3.0, -4.0, 9.0};
  scan.axes_mm = Eigen::AngleAxisd(0.7, Vec3(3, 1, 2).normalized()).toRotationMatrix();
  VoxelFile<std::uint8_t> numbers{scan, std::vector<std::uint8_t>(scan.count())};
  for (int k = 0; k < 61; ++k)
    for (int j = 20; j <= 40; ++j)
      for (int i = 90; i <= 110; ++i) numbers.values[numbers.index({i, j, k})] = 1;
  KeptParts kept;
  kept.bones[1].set(1);
  ASSERT_EQ(blocks_of(scan).step, (std::array<int, 3>{2, 2, 2}));
  const auto made = kept_surfaces(scan, *IslandMap::make(scan, std::move(numbers)), kept, kGoOn);
  ASSERT_TRUE(made && made->size() == 1);
  const Mesh* rod = &made->front().mesh;
  const TriangleMesh plain{rod->positions_mm, rod->triangles, {}};
  int beyond = 0;
  for (std::uint32_t vertex = 0; vertex < rod->positions_mm.size(); ++vertex) {
    const Vec3 at_mm = position(plain, vertex);
    const Vec3 at = scan.axes_mm.transpose() * (at_mm - scan.origin_mm);
    const std::array<int, 3> voxel = voxel_near(scan, at_mm);
    ASSERT_NEAR(voxel[0], at.x(), 0.51);
    ASSERT_NEAR(voxel[1], at.y(), 0.51);
    ASSERT_GE(voxel[2], 0);
    ASSERT_LE(voxel[2], 60);
    if (at.z() <= 60.6) continue;
    ++beyond;
    ASSERT_EQ(voxel[2], 60);
  }
  EXPECT_GT(beyond, 50) << "the surface ends with the scan";
}

// A wall of one voxel among blocks of four is a quarter of them.
TEST(KeptSurfaceOfThinBone, IsNotLost) {
  ScanGeometry scan;
  scan.dims = {640, 16, 16};
  scan.axes_mm = 0.5 * Eigen::Matrix3d::Identity();
  VoxelFile<std::uint8_t> numbers{scan, std::vector<std::uint8_t>(scan.count())};
  for (int k = 0; k < 16; ++k)
    for (int i = 40; i < 600; ++i) numbers.values[numbers.index({i, 6, k})] = 1;
  KeptParts kept;
  kept.bones[1].set(1);
  ASSERT_EQ(blocks_of(scan).step, (std::array<int, 3>{4, 4, 4}));
  const auto made = kept_surfaces(scan, *IslandMap::make(scan, std::move(numbers)), kept, kGoOn);
  ASSERT_TRUE(made && made->size() == 1);
  const Mesh* wall = &made->front().mesh;
  const Box box = bounds({wall->positions_mm, wall->triangles, {}});
  EXPECT_NEAR(box.min_mm.x(), 20.0, 2.0);
  EXPECT_NEAR(box.max_mm.x(), 300.0, 2.0);
  EXPECT_NEAR(box.centre_mm().y(), 3.0, 2.0);
}

}  // namespace
}  // namespace osteon
