// Keys and mouse in a window. The mouse moves the camera as VTK's trackball does. After P or L the left button draws
// once instead. All functions: [render], the thread that opened the window.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/pose.hpp"

class vtkRenderWindow;

namespace osteon {

// The user's actions in the window since the last call of events().
struct WindowEvents {
  bool closed = false;
  bool redraw = false;          // the camera moved, or the window was uncovered or resized
  bool wants_overview = false;  // key O
  bool wants_tool = false;      // key T
  bool wants_wipe = false;      // key X
  std::optional<Vec3> pointed;  // key P, then a click on the surface; bone frame, mm
  std::vector<Vec3> drawn;      // key L, then a line drawn on the surface with the left button; empty: none
};

class WindowInput {
 public:
  // The point of the bone at a pixel, bone frame. Columns from the left, rows from the bottom.
  using SurfaceAt = std::function<std::optional<Vec3>(int x_px, int y_px)>;

  // The window must outlive it.
  WindowInput(vtkRenderWindow& window, SurfaceAt surface_at);
  ~WindowInput();

  // Handles the events that the window system has sent.
  [[nodiscard]] WindowEvents events();

  // What the left button does next. Empty: it moves the camera.
  [[nodiscard]] std::string hint() const;
  // The line that the user is drawing, bone frame, mm. Empty: none.
  [[nodiscard]] std::vector<Vec3> stroke() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
