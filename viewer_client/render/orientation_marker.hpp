// A small cube in the lower right corner that turns with the bone. Its faces name the patient's sides: L left, R right,
// A anterior, P posterior, H head, F foot. All functions: [render], the thread that owns the window.
#pragma once
#include <memory>

#include "viewer_client/scene/camera_view.hpp"

class vtkRenderWindow;

namespace osteon {

class OrientationMarker {
 public:
  // Adds a renderer of its own to the window, which must outlive it.
  explicit OrientationMarker(vtkRenderWindow& window);
  ~OrientationMarker();

  void show(bool on);
  // Turns the cube as the bone appears in this view. Call this before each picture.
  void follow(const CameraView& view);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
