// A window of its own with a scene of the bone, for scripts and observers. All functions: [render], the thread that
// opened the window.
#pragma once
#include <memory>
#include <string>

#include "common/core/result.hpp"
#include "viewer_client/render/bone_scene.hpp"
#include "viewer_client/render/window_input.hpp"

namespace osteon {

struct WindowOptions {
  int width_px = 1280;
  int height_px = 720;
  std::string title = "Osteon";
};

class BoneWindow {
 public:
  // Error not_found: there is no X display, it cannot be reached, or it has no OpenGL.
  [[nodiscard]] static Result<std::unique_ptr<BoneWindow>> open(const WindowOptions& options);
  ~BoneWindow();

  [[nodiscard]] BoneScene& scene();
  // Draws the scene, with the hint and the line of the user's mouse.
  void draw();
  // Handles the events that the window system has sent.
  [[nodiscard]] WindowEvents events();

 private:
  struct Impl;
  explicit BoneWindow(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
