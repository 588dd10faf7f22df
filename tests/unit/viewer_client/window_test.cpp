// Checks the camera of a window and the file that it saves.
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <string>

#include "picture.hpp"
#include "synthetic.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using test::from_front;
using test::kHeight;
using test::kWidth;
using test::sphere_mesh;

constexpr RegionKey kRegion{BodyId{0}, 0, {0, 0, 0}};

class Window : public test::Picture {};

TEST_F(Window, TheCameraIsWhereItWasPut) {
  const CameraView view = from_front(321.0);
  window_->scene().look(view);
  const CameraView back = window_->scene().camera();
  EXPECT_NEAR((back.eye_mm - view.eye_mm).norm(), 0.0, 1e-9);
  EXPECT_NEAR((back.target_mm - view.target_mm).norm(), 0.0, 1e-9);
  EXPECT_NEAR(back.view_angle_rad, view.view_angle_rad, 1e-9);
}

TEST_F(Window, IsSavedAsPng) {
  window_->scene().show_region(kRegion, sphere_mesh(Vec3::Zero(), 15.0, 0));
  const test::TempDir folder;
  const auto file = folder / "picture.png";
  ASSERT_TRUE(window_->scene().save_png(file));
  std::ifstream in(file, std::ios::binary);
  std::array<unsigned char, 24> head{};
  in.read(reinterpret_cast<char*>(head.data()), head.size());
  EXPECT_EQ(std::string(head.begin() + 1, head.begin() + 4), "PNG");
  // IHDR: width and height as big-endian 32-bit numbers.
  EXPECT_EQ(head[18] * 256 + head[19], kWidth);
  EXPECT_EQ(head[22] * 256 + head[23], kHeight);
  EXPECT_FALSE(window_->scene().save_png("/nowhere/at/all.png"));
}

}  // namespace
}  // namespace osteon
