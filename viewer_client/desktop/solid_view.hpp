// The picture of a scan in three dimensions, and the mouse over it: a drag turns it, the wheel brings it nearer, a
// click chooses a bone, and a double click a point of its surface. Shift and a drag move it aside. Arrow keys, with
// Shift too, + and -, and Enter do the same; Enter takes the middle of the picture. Home shows all.
#pragma once
#include <QCoreApplication>
#include <QPoint>
#include <QTimer>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

#include <QVTKOpenGLNativeWidget.h>

#include "viewer_client/render/solid_scene.hpp"

namespace osteon {

// [GUI thread]
class SolidView : public QVTKOpenGLNativeWidget {
  Q_DECLARE_TR_FUNCTIONS(SolidView)

 public:
  struct Events {
    std::function<void(const SolidHit&hit)> bone, point;  // that the user has chosen
    std::function<void()> focused;                        // the keyboard's focus came or went
  };
  explicit SolidView(Events events, QWidget* parent = nullptr);
  ~SolidView() override;

  // Its OpenGL context is the current one then: VTK frees there what goes from the picture.
  [[nodiscard]] SolidScene& scene() {
    makeCurrent();
    return *scene_;
  }
  // What is to be seen. Until the user moves the camera, it shows all of it.
  void set_bounds(const Box& bounds);
  // From the patient's front, as at first.
  void look_overview();
  [[nodiscard]] CameraView camera() const { return scene_->camera(); }
  // Marks the picture as old. It is drawn soon, at most at the display's rate. `moving`: more such calls are likely, so
  // soft tissue is coarse until there is a pause.
  void redraw(bool moving = false);
  // Pictures so far, and of them those with soft tissue in a low resolution.
  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  [[nodiscard]] std::uint64_t coarse_frames() const { return coarse_frames_; }
  [[nodiscard]] QSize sizeHint() const override { return {360, 300}; }
  [[nodiscard]] QSize minimumSizeHint() const override { return {160, 110}; }

 protected:
  void initializeGL() override;
  void resizeEvent(QResizeEvent* event) override;
  void showEvent(QShowEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void focusInEvent(QFocusEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  void draw();
  // The user moves the camera.
  void move(const CameraView& view);
  void look_whole(const CameraView& from);
  // Of the bone at a pixel of the widget, if there is one.
  void choose(const QPoint& at, bool point);

  Events events_;
  std::unique_ptr<SolidScene> scene_;
  Box bounds_;
  QPoint last_;            // position of the mouse
  bool clicking_ = false;  // its left button is down, and nothing has moved
  bool whole_ = true;      // nobody has moved the camera
  QTimer frame_timer_, rest_timer_;
  std::chrono::steady_clock::time_point next_frame_{};
  bool moving_ = false, drawing_ = false;
  std::uint64_t frames_ = 0, coarse_frames_ = 0;
};

}  // namespace osteon
