// Checks in the pixels what is drawn.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/surface/block_source.hpp"
#include "common/volume/cut_field.hpp"
#include "picture.hpp"
#include "synthetic.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"
#include "viewer_client/app/viewer.hpp"
#include "viewer_client/render/window.hpp"

namespace osteon {
namespace {

using test::differing_pixels;
using test::focal_px;
using test::from_front;
using test::kHeight;
using test::kWidth;
using test::sphere_mesh;

constexpr RegionKey kHere{BodyId{0}, 0, {0, 0, 0}}, kThere{BodyId{0}, 0, {1, 0, 0}};

class Picture : public test::Picture {};

TEST_F(Picture, ASphereCoversItsOutline) {
  const Image empty = drawn();
  window_->show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  const Image image = drawn();
  ASSERT_EQ(image.width_px, kWidth);
  ASSERT_EQ(image.height_px, kHeight);

  // Seen from distance d a sphere's outline is a circle of angle asin(r / d).
  const double radius_px = focal_px(from_front(100.0)) * std::tan(std::asin(15.0 / 100.0));
  const double expected = std::numbers::pi * radius_px * radius_px;
  EXPECT_NEAR(differing_pixels(image, empty), expected, 0.03 * expected);
  for (const auto& [x, y] : {std::pair{2, 2}, {kWidth - 3, 2}, {2, kHeight - 3}, {kWidth - 3, kHeight - 3}}) {
    EXPECT_EQ(image.at(x, y), empty.at(x, y));
  }
  // Bone is bright against the background, and of a warm colour: red over blue.
  const Vec3 middle = colour(image, kWidth / 2, kHeight / 2);
  EXPECT_GT(middle.sum(), colour(empty, kWidth / 2, kHeight / 2).sum() + 200.0);
  EXPECT_GT(middle.x(), middle.z() + 10.0);
}

TEST_F(Picture, WhatIsRemovedLeavesBackground) {
  const Image empty = drawn();
  window_->show_region(kHere, sphere_mesh(Vec3(-15, 0, 0), 8.0, 0));
  const Image one = drawn();
  window_->show_region(kThere, sphere_mesh(Vec3(15, 0, 0), 8.0, 0));
  EXPECT_GT(differing_pixels(drawn(), one), 500);
  window_->show_region(kThere, {});
  EXPECT_EQ(differing_pixels(drawn(), one), 0);
  window_->show_region(kHere, {});
  EXPECT_EQ(differing_pixels(drawn(), empty), 0);
}

TEST_F(Picture, CutFacesAreRedder) {
  window_->show_region(kHere, sphere_mesh(Vec3(-15, 0, 0), 10.0, 0));
  window_->show_region(kThere, sphere_mesh(Vec3(15, 0, 0), 10.0, 1));
  const Image image = drawn();
  const int offset = static_cast<int>(focal_px(from_front(100.0)) * 15.0 / 100.0);
  const Vec3 imported = colour(image, kWidth / 2 - offset, kHeight / 2);
  const Vec3 cut = colour(image, kWidth / 2 + offset, kHeight / 2);
  EXPECT_GT(cut.x() / cut.y(), 1.25 * imported.x() / imported.y());
}

// A block of bone with a rod of metal and a cap of enamel, and a groove through all of the bone between them. It is
// encoded, decoded and drawn.
TEST_F(Picture, MetalAndEnamelHaveColoursOfTheirOwn) {
  const auto tissue = [](const Vec3& p) {
    if (std::hypot(p.x() - 8.0, p.z() + 6.0) < 3.0) return Tissue::metal;
    return p.x() < -6.0 ? Tissue::enamel : Tissue::none;
  };
  CutField field(test::marked_block(28.0, 12.0, 0.5, tissue), BodyId{});
  SurfaceBlocks blocks{BodyId{}};
  // Along the front face, into the enamel and the bone, short of the rod.
  const Cut groove = test::straight_cut(*find_tool("burr-round-5"), {-12, -15.5, -8.5}, {-1, -15.5, -8.5}, {0, 0, -1});
  (void)blocks.touch(groove.level, field.apply(groove).changed_leaves);
  std::vector<BlockKey> keys = blocks.fine_blocks();
  const CoordBox b = field.bone().bounds_samples();
  for (int x = (b.min.x - 1) >> 4; x <= b.max.x >> 4; ++x)
    for (int y = (b.min.y - 1) >> 4; y <= b.max.y >> 4; ++y)
      for (int z = (b.min.z - 1) >> 4; z <= b.max.z >> 4; ++z) keys.push_back({{}, 0, {x, y, z}});
  int region = 0;
  for (const BlockKey& key : keys) {
    BlockSamples samples;
    gather_block(field, blocks, key, 0.5, samples);
    const auto mesh = decode_block(key, encode_block(samples), level_pitch_mm(0.5, key.level));
    ASSERT_TRUE(mesh);
    window_->show_region({BodyId{0}, 0, {region++, 0, 0}}, *mesh);
  }
  CameraView view = from_front(90.0);
  view.target_mm = Vec3(0, -14, -6);
  view.eye_mm = Vec3(0, -90, -6);
  window_->look(view);
  const Image image = drawn();
  if (const char* folder = std::getenv("OSTEON_PICTURES"))
    ASSERT_TRUE(window_->save_png(std::string(folder) + "/metal.png"));
  const double px_per_mm = focal_px(view) / 76.0;
  const auto seen = [&](double x_mm, double z_mm) {
    return colour(image, kWidth / 2 + static_cast<int>(std::lround(px_per_mm * x_mm)),
                  kHeight / 2 - static_cast<int>(std::lround(px_per_mm * (z_mm + 6.0))));
  };
  const Vec3 bone = seen(2.0, -2.0), metal = seen(8.0, -6.0), enamel = seen(-10.0, -2.0), cut_bone = seen(-3.0, -6.0),
             cut_enamel = seen(-10.0, -6.0);
  EXPECT_GT(bone.x(), bone.z() + 10.0) << "warm";
  EXPECT_GT(metal.z(), metal.x() + 10.0) << "cold";
  EXPECT_NEAR(enamel.x(), enamel.z(), 20.0) << "white";
  EXPECT_GT(enamel.minCoeff(), bone.z() + 10.0);
  EXPECT_GT(cut_bone.x() / cut_bone.y(), 1.25 * bone.x() / bone.y());
  EXPECT_GT((cut_enamel - cut_bone).norm(), 40.0);
  EXPECT_GT((cut_enamel - enamel).norm(), 12.0);
}

TEST_F(Picture, DoesNotDependOnTheOrderOfArrival) {
  // Two spheres of different colour at one position: the depth test cannot decide between them.
  window_->show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  window_->show_region(kThere, sphere_mesh(Vec3::Zero(), 15.0, 1));
  const Image forwards = drawn();
  window_->show_region(kHere, {});
  window_->show_region(kThere, {});
  window_->show_region(kThere, sphere_mesh(Vec3::Zero(), 15.0, 1));
  window_->show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  EXPECT_EQ(differing_pixels(drawn(), forwards), 0);
}

TEST_F(Picture, TheToolStandsAtTheProxyAndTheGhostAtTheHand) {
  const Image empty = drawn();
  CuttingState state;
  state.author = AuthorId{7};
  state.tool_name = "burr-round-5";
  state.pose_bone_tool = pose_along(Vec3::Zero(), -Vec3::UnitZ());  // tip down: the shank rises from the centre
  state.pose_bone_device = state.pose_bone_tool;
  window_->show_tools(std::span(&state, 1));
  const Image tool = drawn();
  // Between tip and shank, at the ball's middle: a radius above the tip.
  const int up_px = static_cast<int>(focal_px(from_front(100.0)) * 2.5 / 100.0);
  EXPECT_NE(tool.at(kWidth / 2, kHeight / 2 - up_px), empty.at(kWidth / 2, kHeight / 2 - up_px));
  EXPECT_EQ(tool.at(kWidth / 2, kHeight / 2 + 2 * up_px), empty.at(kWidth / 2, kHeight / 2 + 2 * up_px));

  // The hand is 10 mm to the right: something translucent appears there, and the tool is unchanged.
  state.pose_bone_device.position_mm += Vec3(10, 0, 0);
  window_->show_tools(std::span(&state, 1));
  const Image ghost = drawn();
  const int right_px = static_cast<int>(focal_px(from_front(100.0)) * 10.0 / 100.0);
  EXPECT_EQ(ghost.at(kWidth / 2, kHeight / 2 - up_px), tool.at(kWidth / 2, kHeight / 2 - up_px));
  const Vec3 there = colour(ghost, kWidth / 2 + right_px, kHeight / 2 - up_px);
  const Vec3 before = colour(empty, kWidth / 2 + right_px, kHeight / 2 - up_px);
  EXPECT_GT((there - before).norm(), 10.0);
  EXPECT_LT((there - before).norm(), (colour(tool, kWidth / 2, kHeight / 2 - up_px) - before).norm());

  window_->show_tools({});
  EXPECT_EQ(differing_pixels(drawn(), empty), 0);
}

TEST_F(Picture, TheCameraIsWhereItWasPut) {
  const CameraView view = from_front(321.0);
  window_->look(view);
  const CameraView back = window_->camera();
  EXPECT_NEAR((back.eye_mm - view.eye_mm).norm(), 0.0, 1e-9);
  EXPECT_NEAR((back.target_mm - view.target_mm).norm(), 0.0, 1e-9);
  EXPECT_NEAR(back.view_angle_rad, view.view_angle_rad, 1e-9);
}

TEST_F(Picture, IsSavedAsPng) {
  window_->show_region(kHere, sphere_mesh(Vec3::Zero(), 15.0, 0));
  const test::TempDir folder;
  const auto file = folder / "picture.png";
  ASSERT_TRUE(window_->save_png(file));
  std::ifstream in(file, std::ios::binary);
  std::array<unsigned char, 24> head{};
  in.read(reinterpret_cast<char*>(head.data()), head.size());
  EXPECT_EQ(std::string(head.begin() + 1, head.begin() + 4), "PNG");
  // IHDR: width and height as big-endian 32-bit numbers.
  EXPECT_EQ(head[18] * 256 + head[19], kWidth);
  EXPECT_EQ(head[22] * 256 + head[23], kHeight);
  EXPECT_FALSE(window_->save_png("/nowhere/at/all.png"));
}

// Tests the render loop between a network thread's render queue and the window.
TEST_F(Picture, TheLoopShowsWhatTheRenderQueueBrings) {
  const test::TempDir folder;
  ViewerOptions options;
  options.bounds = {Vec3(-20, -20, -20), Vec3(20, 20, 20)};
  options.frame_log = folder / "frames.csv";
  RenderQueue render_queue;
  auto viewer = Viewer::make(options, *window_, render_queue,
                             ScriptReader::of("wait surface\nwait seq 5\nstatus " + (folder / "status.json").string()));
  ASSERT_TRUE(viewer);

  const BlockKey key{BodyId{0}, 0, {0, 0, 0}};
  const auto deliver = [&](std::uint64_t seq, double radius_mm, bool complete) {
    std::vector<ReceivedBlock> blocks;
    blocks.push_back(test::block(key, seq + 1, std::to_string(seq), sphere_mesh(Vec3::Zero(), radius_mm, 0)));
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    render_queue.put_mesh(RoomSeq{seq}, std::move(blocks), complete, 1, std::chrono::nanoseconds(now).count());
  };
  const auto turns = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const auto state = viewer->turn(false);
      if (!state || *state == Viewer::State::finished) return true;
    }
    return false;
  };
  // Nothing of the surface is drawn until the whole surface is there.
  render_queue.begin_stream();
  deliver(3, 15.0, false);
  EXPECT_FALSE(turns(8));
  const Image before = window_->image();
  deliver(4, 15.0, true);
  EXPECT_FALSE(turns(8));
  EXPECT_GT(differing_pixels(window_->image(), before), 1000);
  deliver(5, 18.0, true);
  EXPECT_TRUE(turns(100));

  const auto status = nlohmann::json::parse(std::ifstream(folder / "status.json"));
  EXPECT_EQ(status["room_seq"], 5);
  EXPECT_EQ(status["blocks"], 1);
  EXPECT_EQ(status["triangles"], sphere_mesh(Vec3::Zero(), 18.0, 0).triangles.size());
  EXPECT_EQ(status["updates"], 2);

  std::ifstream log(folder / "frames.csv");
  std::string line;
  std::getline(log, line);
  EXPECT_EQ(line, "room_seq,received_mono_ns,rendered_mono_ns");
  std::vector<std::uint64_t> seqs;
  while (std::getline(log, line)) {
    long long seq = 0, received = 0, rendered = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lld,%lld,%lld", &seq, &received, &rendered), 3);
    EXPECT_LT(received, rendered);
    seqs.push_back(static_cast<std::uint64_t>(seq));
  }
  EXPECT_EQ(seqs, (std::vector<std::uint64_t>{3, 4, 5}));
}

TEST(NoScreen, IsSaidInOneSentence) {
  ::unsetenv("DISPLAY");
  const auto without = BoneWindow::open({kWidth, kHeight, ""});
  ASSERT_FALSE(without);
  EXPECT_NE(without.error().message.find("DISPLAY"), std::string::npos);
  EXPECT_NE(without.error().message.find("xvfb-run"), std::string::npos);

  ::setenv("DISPLAY", "nowhere.invalid:99", 1);
  const auto unreachable = BoneWindow::open({kWidth, kHeight, ""});
  ASSERT_FALSE(unreachable);
  EXPECT_NE(unreachable.error().message.find("nowhere.invalid:99"), std::string::npos);
  ::unsetenv("DISPLAY");
}

}  // namespace
}  // namespace osteon
