// What is drawn over the bone: a renderer in front of its picture, or in front of each of two pictures side by side,
// with the camera of that picture. All functions: [render], the thread that owns the window.
#pragma once
#include <array>
#include <memory>

class vtkProp;
class vtkRenderer;
class vtkRenderWindow;

namespace osteon {

// The pictures of the bone. The right one is drawn side by side only.
struct BonePictures {
  vtkRenderer *left, *right;
};

class LayerAbove {
 public:
  static constexpr int kPictures = 2;  // left, right

  // All must outlive it.
  LayerAbove(vtkRenderWindow& window, const BonePictures& bone);
  ~LayerAbove();

  void add(vtkProp* prop);  // in both pictures
  void add(vtkProp* prop, int picture);
  void remove(vtkProp* prop);
  // Call this before each picture. `any`: there is something to draw.
  void place(bool any, bool two_pictures);

  [[nodiscard]] vtkRenderer* above(int picture) const;
  // Of the bone's picture, in pixels of the window: left edge, width, height.
  struct Frame {
    int left, width, height;
  };
  [[nodiscard]] Frame frame(int picture) const;
  // Where a point of the bone's frame appears in the picture: pixels from its lower left.
  [[nodiscard]] std::array<double, 2> on_screen(int picture, const std::array<double, 3>& point_mm) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
