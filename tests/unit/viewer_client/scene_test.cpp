#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "common/tools/tool_solid.hpp"
#include "synthetic.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/gauges.hpp"
#include "viewer_client/scene/render_queue.hpp"
#include "viewer_client/scene/surface_scene.hpp"
#include "viewer_client/scene/tool_mesh.hpp"

namespace osteon {
namespace {

using test::block;
using test::sphere_mesh;

constexpr BlockKey key(int x, int y = 0, int z = 0, int level = 0) { return {BodyId{0}, level, Coord{x, y, z}}; }
Mesh small_sphere(double x_mm) { return sphere_mesh({x_mm, 0, 0}, 1.0, 0, 6); }
const std::size_t kSmallTriangles = small_sphere(0).triangles.size();

TEST(SurfaceScene, NewestVersionWinsInWhateverOrderItComes) {
  SurfaceScene forwards, backwards;
  for (const std::uint64_t version : {1, 2, 3}) {
    forwards.replace(block(key(0), version, std::to_string(version), small_sphere(double(version))));
  }
  for (const std::uint64_t version : {3, 1, 2}) {
    backwards.replace(block(key(0), version, std::to_string(version), small_sphere(double(version))));
  }
  EXPECT_EQ(forwards.hash(), backwards.hash());
  const RegionKey region = region_of(key(0));
  EXPECT_EQ(forwards.region_mesh(region).positions_mm, backwards.region_mesh(region).positions_mm);
  EXPECT_EQ(forwards.region_mesh(region).positions_mm, small_sphere(3).positions_mm);
}

TEST(SurfaceScene, HashNamesContentNotOrderVersionOrEmptyBlocks) {
  SurfaceScene a, b;
  a.replace(block(key(0), 1, "left", small_sphere(0)));
  a.replace(block(key(9), 1, "right", small_sphere(9)));
  b.replace(block(key(9), 7, "right", small_sphere(9)));
  b.replace(block(key(4), 2, "nothing", {}));
  b.replace(block(key(0), 5, "left", small_sphere(0)));
  EXPECT_EQ(a.hash(), b.hash());
  // Exchanging the same two meshes makes another surface.
  SurfaceScene swapped;
  swapped.replace(block(key(0), 1, "right", small_sphere(9)));
  swapped.replace(block(key(9), 1, "left", small_sphere(0)));
  EXPECT_NE(a.hash(), swapped.hash());
}

TEST(SurfaceScene, KnowsWhetherAnythingIsCut) {
  SurfaceScene scene;
  scene.replace(block(key(0), 1, "whole", sphere_mesh(Vec3::Zero(), 1.0, 0, 6)));
  EXPECT_FALSE(scene.any_cut_face());
  scene.replace(block(key(5), 1, "cut", sphere_mesh({5, 0, 0}, 1.0, 1, 6)));
  EXPECT_TRUE(scene.any_cut_face());
  scene.replace(block(key(5), 2, "whole again", sphere_mesh({5, 0, 0}, 1.0, 0, 6)));
  EXPECT_FALSE(scene.any_cut_face());
}

TEST(SurfaceScene, AChangeTouchesOnlyItsRegion) {
  SurfaceScene scene;
  for (int x = -8; x < 8; ++x) scene.replace(block(key(x), 1, std::to_string(x), small_sphere(x)));
  EXPECT_EQ(scene.take_dirty().size(), 4u);  // 16 blocks in a row, 4 to a region
  EXPECT_TRUE(scene.take_dirty().empty());

  scene.replace(block(key(-1), 2, "cut", small_sphere(-1)));
  EXPECT_EQ(scene.take_dirty(), std::vector{region_of(key(-1))});
  EXPECT_NE(region_of(key(-1)), region_of(key(0)));
  // A fine block has a region of its own although it is at the same position.
  scene.replace(block(key(-1, 0, 0, 2), 1, "fine", small_sphere(-1)));
  EXPECT_EQ(scene.take_dirty(), std::vector{region_of(key(-1, 0, 0, 2))});
}

TEST(SurfaceScene, SameBytesAgainRebuildNothing) {
  SurfaceScene scene;
  scene.replace(block(key(0), 1, "same", small_sphere(0)));
  (void)scene.take_dirty();
  EXPECT_FALSE(scene.replace(block(key(0), 2, "same", small_sphere(0))));
  EXPECT_TRUE(scene.take_dirty().empty());
}

TEST(SurfaceScene, CountsFollowReplacementAndRemoval) {
  SurfaceScene scene;
  scene.replace(block(key(0), 1, "a", small_sphere(0)));
  scene.replace(block(key(1), 1, "b", small_sphere(1)));
  EXPECT_EQ(scene.blocks(), 2u);
  EXPECT_EQ(scene.triangles(), 2 * kSmallTriangles);
  scene.replace(block(key(0), 2, "gone", {}));
  EXPECT_EQ(scene.blocks(), 1u);
  EXPECT_EQ(scene.triangles(), kSmallTriangles);
  scene.replace(block(key(1), 2, "gone too", {}));
  EXPECT_EQ(scene.regions(), 0u);
  EXPECT_EQ(scene.triangles(), 0u);
  EXPECT_TRUE(scene.region_mesh(region_of(key(0))).triangles.empty());
}

TEST(SurfaceScene, RegionMeshKeepsEveryTriangleOfItsBlocks) {
  SurfaceScene scene;
  scene.replace(block(key(2), 1, "b", small_sphere(20)));
  scene.replace(block(key(1), 1, "a", sphere_mesh({10, 0, 0}, 1.0, 1, 6)));
  const Mesh mesh = scene.region_mesh(region_of(key(1)));
  ASSERT_EQ(mesh.triangles.size(), 2 * kSmallTriangles);
  ASSERT_EQ(mesh.cut_face.size(), mesh.positions_mm.size());
  ASSERT_EQ(mesh.normals.size(), mesh.positions_mm.size());
  // No triangle reaches from one sphere to the other, and the marks stayed with their sphere.
  for (const auto& [a, b, c] : mesh.triangles) {
    const bool first = mesh.positions_mm[a][0] < 15.0f;
    EXPECT_EQ(first, mesh.positions_mm[b][0] < 15.0f);
    EXPECT_EQ(first, mesh.positions_mm[c][0] < 15.0f);
    EXPECT_EQ(mesh.cut_face[a], first ? 1 : 0);
  }
}

TEST(SurfaceScene, ASnapshotAfterAnInterruptionReplacesEverything) {
  SurfaceScene scene, late;
  scene.begin_snapshot();
  scene.replace(block(key(0), 40, "old", small_sphere(0)));
  scene.replace(block(key(9), 41, "vanishes", small_sphere(9)));
  scene.end_snapshot();

  // A restarted server counts versions from one and knows nothing of block 9.
  for (SurfaceScene* each : {&scene, &late}) {
    each->begin_snapshot();
    each->replace(block(key(0), 1, "new", small_sphere(5)));
    each->end_snapshot();
  }
  EXPECT_EQ(scene.hash(), late.hash());
  EXPECT_EQ(scene.blocks(), 1u);
  const auto dirty = scene.take_dirty();
  EXPECT_TRUE(std::ranges::count(dirty, region_of(key(9))));
  // From here on versions count again.
  EXPECT_FALSE(scene.replace(block(key(0), 1, "late copy", small_sphere(7))));
}

TEST(RenderQueue, HoldsOnlyTheNewestOfEachBlock) {
  RenderQueue render_queue;
  render_queue.begin_stream();
  for (std::uint64_t version = 1; version <= 500; ++version) {
    std::vector<ReceivedBlock> blocks;
    blocks.push_back(block(key(0), version, std::to_string(version), small_sphere(0)));
    render_queue.put_mesh(RoomSeq{version}, std::move(blocks), version > 10, 1, static_cast<std::int64_t>(version));
  }
  Delivery delivery = render_queue.take();
  EXPECT_TRUE(delivery.snapshot_begun);
  EXPECT_TRUE(delivery.snapshot_complete);
  ASSERT_EQ(delivery.blocks.size(), 1u);
  EXPECT_EQ(delivery.blocks.begin()->second.version, 500u);
  EXPECT_EQ(delivery.room_seq, RoomSeq{500});
  EXPECT_EQ(delivery.arrivals.size(), 500u);
  EXPECT_FALSE(render_queue.take().any_mesh);
}

TEST(RenderQueue, ArrivalsOfAStalledViewerAreBounded) {
  RenderQueue render_queue;
  for (std::uint64_t i = 1; i <= 5000; ++i) render_queue.put_mesh(RoomSeq{i}, {}, true, 0, 0);
  const Delivery delivery = render_queue.take();
  EXPECT_LT(delivery.arrivals.size(), 2000u);
  EXPECT_EQ(delivery.arrivals.back().room_seq, RoomSeq{5000});
}

TEST(CameraView, OverviewHoldsTheWholeBone) {
  const Box bone{Vec3(-70, -90, 10), Vec3(80, 100, 190)};
  const CameraView view = overview(bone);
  const Vec3 sight = (view.target_mm - view.eye_mm).normalized();
  // The extremes of the inscribed ellipsoid, the bone's likely extent, lie within the view's cone.
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Vec3 p = 0.5 * (bone.min_mm + bone.max_mm);
      p[axis] += side * 0.5 * (bone.max_mm - bone.min_mm)[axis];
      const double angle = std::acos(sight.dot((p - view.eye_mm).normalized()));
      EXPECT_LT(angle, 0.5 * view.view_angle_rad);
    }
  }
  EXPECT_GT(view.up.dot(Vec3::UnitZ()), 0.9);
}

// A pinhole camera: a point is at (x, y) / depth in units of the half height of the picture, over the tangent of half
// of the angle.
TEST(CameraView, AFittedBoxTouchesTheMarginOfThePictureInEveryShape) {
  const Box femur{Vec3(-45, -60, -430), Vec3(50, 40, 25)}, skull{Vec3(-70, -90, 10), Vec3(80, 100, 190)};
  for (const Box& bone : {femur, skull})
    for (const double shape : {0.5, 1.0, 16.0 / 9.0, 3.0})
      for (const Vec3& from : {Vec3(0.62, -0.72, 0.30), Vec3(0, -1, 0), Vec3(1, 0, 0), Vec3(0, 0.3, 1)}) {
        CameraView before;
        before.target_mm = Vec3(1000, 0, 0);
        before.eye_mm = before.target_mm + from;
        const CameraView view = fitted(before, bone, shape);
        const Vec3 sight = (view.target_mm - view.eye_mm).normalized();
        EXPECT_LT((sight + from.normalized()).norm(), 1e-9);
        const Vec3 right = sight.cross(Vec3::UnitZ()).normalized(), up = right.cross(sight);
        double nearest = 0;  // to the border of the picture, which is at 1
        for (int corner = 0; corner < 8; ++corner) {
          const Vec3 p((corner & 1 ? bone.max_mm : bone.min_mm).x(), (corner & 2 ? bone.max_mm : bone.min_mm).y(),
                       (corner & 4 ? bone.max_mm : bone.min_mm).z());
          const Vec3 seen = p - view.eye_mm;
          const double half_height = std::tan(0.5 * view.view_angle_rad) * seen.dot(sight);
          ASSERT_GT(half_height, 0);
          nearest = std::max(
              {nearest, std::abs(seen.dot(up)) / half_height, std::abs(seen.dot(right)) / (half_height * shape)});
        }
        EXPECT_LT(nearest, 0.96);
        EXPECT_GT(nearest, 0.94);
      }
}

TEST(CameraView, BesideToolSeesTheTipFromBehindTheTool) {
  for (const Vec3& axis : {Vec3(0, 0, 1), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(-1, 0.2, -0.4), Vec3(0.5, 0.5, 0.7)}) {
    const Pose pose = pose_along({10, 20, 30}, axis);
    const CameraView view = beside_tool(pose, 80.0);
    EXPECT_NEAR((view.eye_mm - pose.position_mm).norm(), 80.0, 1e-9);
    EXPECT_NEAR((view.target_mm - pose.position_mm).norm(), 0.0, 1e-12);
    const double angle = std::acos((view.eye_mm - pose.position_mm).normalized().dot(-axis.normalized()));
    EXPECT_GT(angle, 0.3);  // the shank does not hide the tip
    EXPECT_LT(angle, 1.0);  // neither does the bone
    EXPECT_GT(view.up.cross((view.target_mm - view.eye_mm).normalized()).norm(), 0.9);
  }
}

// A point in the camera's frame: right, up and towards the eye from where the camera looks.
Vec3 seen(const CameraView& view, const Vec3& point) {
  const Vec3 back = (view.eye_mm - view.target_mm).normalized();
  const Vec3 up = (view.up - view.up.dot(back) * back).normalized();
  const Vec3 off = point - view.target_mm;
  return {off.dot(up.cross(back)), off.dot(up), off.dot(back)};
}

TEST(CameraView, TheBoneFollowsTheCap) {
  const CameraView before{Vec3(30.0, -200.0, 80.0), Vec3(5.0, 10.0, -20.0), Vec3(0.1, 0.2, 1.0), 0.5};
  const Vec3 point(12.0, 40.0, -3.0), twist = Vec3(0.3, -0.8, 0.5).normalized();
  const double distance_mm = (before.eye_mm - before.target_mm).norm();

  // A twist of the cap turns the picture about its middle, right-handed about the cap's own axis.
  const CameraView turned = held_by_cap(before, Vec3::Zero(), twist, 0.25);
  const double angle = rotation_between(seen(before, point).cross(twist), seen(turned, point).cross(twist))
                           .angularDistance(Eigen::Quaterniond::Identity());
  EXPECT_GT(angle, 0.1);
  EXPECT_LT((seen(turned, point) - Eigen::AngleAxisd(angle, twist) * seen(before, point)).norm(), 1e-9);
  EXPECT_EQ(turned.target_mm, before.target_mm);
  // Twice the time is twice the turn.
  const CameraView further = held_by_cap(before, Vec3::Zero(), twist, 0.5);
  EXPECT_LT((seen(further, point) - Eigen::AngleAxisd(2.0 * angle, twist) * seen(before, point)).norm(), 1e-9);

  // Pushing the cap sideways shifts the picture that way. Pulling it to the user brings the picture nearer.
  const Vec3 shifted = seen(held_by_cap(before, Vec3(1.0, -0.5, 0.0), Vec3::Zero(), 0.1), point) - seen(before, point);
  EXPECT_GT(shifted.x(), 1.0);
  EXPECT_NEAR(shifted.y(), -0.5 * shifted.x(), 1e-9);
  EXPECT_NEAR(shifted.z(), 0.0, 1e-9);
  const CameraView nearer = held_by_cap(before, Vec3::UnitZ(), Vec3::Zero(), 0.1);
  EXPECT_LT((nearer.eye_mm - nearer.target_mm).norm(), 0.95 * distance_mm);
  EXPECT_LT((seen(nearer, point) - seen(before, point)).norm(), 1e-9);

  const CameraView still = held_by_cap(before, Vec3::Zero(), Vec3::Zero(), 1.0);
  EXPECT_LT((still.eye_mm - before.eye_mm).norm() + (seen(still, point) - seen(before, point)).norm(), 1e-9);
}

class ToolMeshes : public testing::TestWithParam<Tool> {};

// Drills and round burs are drawn with flutes, every other tool as it is.
bool fluted(const Tool& tool) { return tool.kind == ToolKind::drill || tool.kind == ToolKind::round_burr; }

TEST_P(ToolMeshes, LiesOnTheToolAndFillsItsBox) {
  const Tool& tool = GetParam();
  const ToolMesh mesh = tool_mesh(tool);
  const Implicit solid = tool_solid(tool);
  ASSERT_EQ(mesh.normals.size(), mesh.positions_mm.size());
  ASSERT_EQ(mesh.cutting.size(), mesh.positions_mm.size());
  Box drawn;
  std::size_t cutting = 0;
  double inside_mm = 0.0;
  for (std::size_t i = 0; i < mesh.positions_mm.size(); ++i) {
    const Vec3 p(mesh.positions_mm[i][0], mesh.positions_mm[i][1], mesh.positions_mm[i][2]);
    const double distance_mm = solid(p);
    if (fluted(tool)) {
      EXPECT_LT(distance_mm, 2e-3);
    } else {
      EXPECT_LT(distance_mm, 0.03);  // in a hollow edge that a cell cuts short
      inside_mm += std::max(0.0, -distance_mm) / static_cast<double>(mesh.positions_mm.size());
    }
    if (mesh.cutting[i] != 0) {
      ++cutting;
      EXPECT_GT(p.z(), -tool.cutting_length_mm - 0.01);
    }
    drawn.include(p);
  }
  EXPECT_LT(inside_mm, 0.005);
  EXPECT_EQ(cutting > 0, tool.cuts());
  EXPECT_LT(cutting, mesh.positions_mm.size());
  // A narrow point may end in its last cell, at most a millimetre away.
  const Box box = local_bounds(tool);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(drawn.min_mm[k], box.min_mm[k], 0.01 * box.size_mm()[k]);
    EXPECT_NEAR(drawn.max_mm[k], box.max_mm[k],
                k == 2 ? std::min(1.0, 0.02 * box.size_mm()[k]) : 0.01 * box.size_mm()[k]);
  }
  EXPECT_NEAR(drawn.min_mm.z(), -tool.reach_mm(), 1e-3);
}

// Gauss: the flux of the position through a closed surface is three times its volume. It is positive only if all
// triangles face outwards.
TEST_P(ToolMeshes, IsClosedAndTurnsOutwards) {
  const Tool& tool = GetParam();
  const ToolMesh mesh = tool_mesh(tool);
  double volume_mm3 = 0.0;
  Vec3 area_mm2 = Vec3::Zero();
  std::size_t against = 0;
  const auto point = [&](std::uint32_t i) {
    return Vec3(mesh.positions_mm[i][0], mesh.positions_mm[i][1], mesh.positions_mm[i][2]);
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 normal = 0.5 * (point(b) - point(a)).cross(point(c) - point(a));
    volume_mm3 += point(a).dot(normal) / 3.0;
    area_mm2 += normal;
    const Vec3 shading(mesh.normals[a][0], mesh.normals[a][1], mesh.normals[a][2]);
    if (normal.norm() > 1e-5 && shading.dot(normal) < 0.0) ++against;
  }
  EXPECT_LT(area_mm2.norm(), 0.01);  // a closed surface has no net area
  EXPECT_LT(against, mesh.triangles.size() / 100);

  const double radius = 0.5 * tool.diameter_mm, shank = 0.5 * tool.shank_diameter_mm;
  const double shank_mm3 = std::numbers::pi * shank * shank * tool.shank_length_mm;
  if (fluted(tool)) {
    // Flutes remove less than half of the solid.
    const double head_mm3 =
        tool.kind == ToolKind::drill
            ? std::numbers::pi * radius * radius *
                  (tool.cutting_length_mm - 2.0 / 3.0 * radius / std::tan(0.5 * tool.point_angle_rad))
            : 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
    EXPECT_GT(volume_mm3, shank_mm3 + 0.5 * head_mm3);
    EXPECT_LT(volume_mm3, 1.02 * (shank_mm3 + head_mm3));
    return;
  }
  // The volume of every other tool by counting random positions, within three and a half standard deviations and chords
  // of three per cent.
  const Implicit solid = tool_solid(tool);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  constexpr int kPlaces = 50000;
  int inside = 0;
  const Box box = solid.bounds;
  for (int i = 0; i < kPlaces; ++i)
    inside += solid(box.min_mm + Vec3(share(random), share(random), share(random)).cwiseProduct(box.size_mm())) < 0.0;
  const double p = static_cast<double>(inside) / kPlaces, whole_mm3 = box.size_mm().prod();
  EXPECT_NEAR(volume_mm3, p * whole_mm3, 3.5 * std::sqrt(p * (1.0 - p) / kPlaces) * whole_mm3 + 0.03 * p * whole_mm3);
}

INSTANTIATE_TEST_SUITE_P(Builtin, ToolMeshes, testing::ValuesIn(builtin_tools().begin(), builtin_tools().end()),
                         [](const auto& param) {
                           std::string name = param.param.name;
                           std::ranges::replace_if(
                               name, [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

TEST(Gauges, NameToolForceAndDepth) {
  CuttingState state;
  state.tool_name = "drill-3.2";
  state.spindle_rpm = 999.7;
  state.force_physical_N = Vec3(3, 4, 12);
  state.depth_mm = -0.01;
  state.density_g_cm3 = 1.9;
  state.phase = CuttingPhase::cutting;
  state.engaged_fraction = 0.5;
  EXPECT_EQ(gauge_text(state), "drill-3.2, cutting\n1000 rpm\nforce 13.0 N\ndepth 0.0 mm\ndensity 1.90 g/cm\xC2\xB3");
  state.phase = CuttingPhase::rubbing;
  state.on_metal = true;
  EXPECT_NE(gauge_text(state).find("\non metal: it does not cut\n"), std::string::npos) << gauge_text(state);
  state.on_metal = false;
  state.irrigation = state.suction = true;
  state.flutes_full = 0.62;
  CuttingState empty;
  EXPECT_TRUE(gauge_text(empty).starts_with("empty hand, idle\n")) << gauge_text(empty);
  EXPECT_NE(gauge_text(state).find("\ndepth 0.0 mm\nflutes 62 % full\nirrigation\nsuction\n"), std::string::npos)
      << gauge_text(state);
}

}  // namespace
}  // namespace osteon
