// A window on a screen of its own, for tests that read pixels.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>

#include "synthetic.hpp"
#include "tests/support/xvfb.hpp"
#include "viewer_client/render/window.hpp"

namespace osteon::test {

inline constexpr int kWidth = 320, kHeight = 240;

// View from the front at this distance, with z upwards.
inline CameraView from_front(double distance_mm) {
  CameraView view;
  view.target_mm = Vec3::Zero();
  view.eye_mm = Vec3(0, -distance_mm, 0);
  view.up = Vec3::UnitZ();
  return view;
}

// Pixels for one radian at the picture's centre.
inline double focal_px(const CameraView& view) { return 0.5 * kHeight / std::tan(0.5 * view.view_angle_rad); }

inline int differing_pixels(const Image& a, const Image& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) count += a.rgb[i] != b.rgb[i] ? 1 : 0;
  return count;
}

class Picture : public testing::Test {
 protected:
  void SetUp() override {
    screen_ = Xvfb::start();
    ASSERT_TRUE(screen_) << "Xvfb, of Debian's package xvfb, did not start";
    ::setenv("DISPLAY", screen_->display().c_str(), 1);
    auto window = BoneWindow::open({kWidth, kHeight, "picture test"});
    ASSERT_TRUE(window) << window.error().message;
    window_ = std::move(*window);
    window_->scene().look(from_front(100.0));
  }
  void TearDown() override {
    window_.reset();
    screen_.reset();
  }

  Image drawn() {
    window_->draw();
    return window_->scene().image();
  }
  // Mean colour of a square of 9 pixels round a position.
  static Vec3 colour(const Image& image, int x, int y) {
    Vec3 sum = Vec3::Zero();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto& [r, g, b] = image.at(x + dx, y + dy);
        sum += Vec3(r, g, b);
      }
    }
    return sum / 9.0;
  }

  std::optional<Xvfb> screen_;
  std::unique_ptr<BoneWindow> window_;
};

// A sphere of bone about the origin, seen from the front.
inline constexpr double kRadius_mm = 15.0, kFrom_mm = 100.0;

// A point on the sphere's front, at these angles to the right and up.
inline Vec3 on_front(double right_rad, double up_rad) {
  return kRadius_mm *
         Vec3(std::sin(right_rad) * std::cos(up_rad), -std::cos(right_rad) * std::cos(up_rad), std::sin(up_rad));
}

class SpherePicture : public Picture {
 protected:
  void SetUp() override {
    Picture::SetUp();
    if (!window_) return;
    window_->scene().show_region({BodyId{0}, 0, {0, 0, 0}}, sphere_mesh(Vec3::Zero(), kRadius_mm, 0));
    bare_ = drawn();
  }
  // Where a point of the bone appears from the front: column and row.
  static std::pair<int, int> seen(const Vec3& p) {
    const double px_per_mm = focal_px(from_front(kFrom_mm)) / (kFrom_mm + p.y());
    const auto x = std::lround(0.5 * kWidth + px_per_mm * p.x()), y = std::lround(0.5 * kHeight - px_per_mm * p.z());
    return {static_cast<int>(x), static_cast<int>(y)};
  }
  static Vec3 at(const Image& image, const Vec3& p) {
    const auto [x, y] = seen(p);
    return colour(image, x, y);
  }

  Image bare_;  // the sphere alone
};

}  // namespace osteon::test
