// Two pictures of one scene, for the left and the right eye. All functions: [render], the thread that owns the window.
#pragma once
#include <memory>

#include "viewer_client/scene/camera_view.hpp"

class vtkRenderWindow;
class vtkRenderer;

namespace osteon {

enum class StereoMode {
  off,
  anaglyph,      // the left eye's picture in red, the right eye's in green and blue
  side_by_side,  // the left eye's picture in the left half, at full width: nothing is squeezed
  quad_buffer,   // for a display that shows the pictures in turn
};

// The view of one eye: turned about the target, as eyes that look at one point.
[[nodiscard]] CameraView left_eye(const CameraView& view);
[[nodiscard]] CameraView right_eye(const CameraView& view);

class Stereo {
 public:
  // Both must outlive it.
  Stereo(vtkRenderWindow& window, vtkRenderer& scene);
  ~Stereo();

  // A mode that the window does not have stays off, and the answer is false.
  [[nodiscard]] bool set(StereoMode mode);
  [[nodiscard]] StereoMode mode() const;
  // The picture of the right eye. It is drawn side by side only.
  [[nodiscard]] vtkRenderer& right() const;
  // Places both pictures. `view` is between the eyes. Call this before each picture.
  void place(const CameraView& view);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
