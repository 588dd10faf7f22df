// One plane of a scan as a picture: crosshair, letters of the patient's sides, and a slider through its slices.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "viewer_client/imaging/kept_boxes.hpp"
#include "viewer_client/imaging/plane_drag.hpp"
#include "viewer_client/imaging/plane_picture.hpp"

class QPainter;
class QRectF;
class QSlider;

namespace osteon {

// What the three planes show together.
struct ImagingScene {
  ShownScan scan;  // without voxels: none is open, or it is being read
  // The slice in the middle of a scan that is being read; `scan` says where all lie. Without voxels: there is none.
  ShownScan first;
  IslandMap islands;
  PlaneLook look;
  GreyTable greys{HuWindow{}};
  std::array<int, 3> crosshair{};  // its voxel
  ImagingTool tool = ImagingTool::look;
  double brush_mm = 3.0;  // radius
  struct SeedMark {
    std::array<int, 3> voxel{};
    bool outside = false;
  };
  std::vector<SeedMark> seeds;
  struct LandmarkMark {
    std::array<int, 3> voxel{};
    QString name;
  };
  std::vector<LandmarkMark> landmarks;
  std::shared_ptr<const KeptBoxes> boxes;  // of what is kept; nothing: they are not shown

  [[nodiscard]] bool open() const { return !scan.values.empty(); }
  [[nodiscard]] bool waits() const { return !open() && !first.values.empty(); }
};

// [GUI thread] The left button moves the crosshair, a double click keeps the bone there, the right button drags the
// window, and the wheel goes through the slices. Arrow keys, page keys and Enter do the same. With another tool the
// left button drags the tool. On the keyboard, the space bar begins and ends that drag at the crosshair, and Escape
// takes it back. A drag also ends when the plane loses the focus. While a scan is being read, the plane along its
// slices shows the one in the middle, and the others say that they wait.
class ImagingPlane : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ImagingPlane)

 public:
  struct Events {
    std::function<void(const std::array<int, 3>&voxel)> look_at, point_at, keep;
    std::function<void(const HuWindow& window)> change_window;
    std::function<bool(const PlaneAxes& axes, const std::array<int, 3>& voxel)> begin_drag;  // whether one begins
    std::function<void(const std::array<int, 3>& voxel)> drag;
    std::function<void(bool keep)> end_drag;
    std::function<void(int notches)> change_brush;
  };
  // `scene` outlives the plane.
  ImagingPlane(Plane plane, const ImagingScene& scene, Events events, QWidget* parent = nullptr);

  // Another scan, with other axes.
  void begin();
  // The scene has changed.
  void refresh();
  // Of a tool, if there is one. Or takes it back.
  void end_drag(bool keep);
  // Middle of a voxel, in pixels of the widget.
  [[nodiscard]] QPoint pixel(const std::array<int, 3>& voxel) const;
  [[nodiscard]] int slice() const;
  [[nodiscard]] QSize sizeHint() const override { return {360, 300}; }
  [[nodiscard]] QSize minimumSizeHint() const override { return {160, 140}; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  [[nodiscard]] PlaneFrame frame() const;
  [[nodiscard]] std::array<int, 3> voxel_under(const QPoint& at) const;
  // The crosshair, moved by so many voxels within the plane and through it.
  void move_by(int right, int down, int through);
  void go_to_slice(int slice);
  void begin_drag(const std::array<int, 3>& voxel);
  [[nodiscard]] bool has_brush() const {
    return scene_.tool == ImagingTool::paint || scene_.tool == ImagingTool::erase;
  }
  // Whether there is a slice to see.
  [[nodiscard]] bool shows() const { return scene_.open() || (scene_.waits() && axes_.through == kSlices); }
  [[nodiscard]] std::vector<std::uint32_t> draw() const;
  // Crosshair, box, seeds and brush.
  void paint_marks(QPainter& painter, const PlaneFrame& at) const;
  // The voxels of a box in the widget. Its corners are opposite ones.
  [[nodiscard]] QRectF rectangle(const PlaneFrame& at, const std::array<int, 3>& first,
                                 const std::array<int, 3>& last) const;
  // Sub-volumes that this slice crosses.
  void paint_boxes(QPainter& painter, const PlaneFrame& at) const;
  // Those in this slice, with their names.
  void paint_landmarks(QPainter& painter, const PlaneFrame& at) const;

  static constexpr int kSlices = 2;  // axis of the voxels, through the slices of the scanner
  Plane plane_;
  const ImagingScene& scene_;
  Events events_;
  PlaneAxes axes_;
  QSlider* slider_;
  std::vector<std::uint32_t> pixels_;
  int drawn_slice_ = -1;  // -1: the picture is stale
  int turned_ = 0;        // of the wheel, less than a notch
  QPoint dragged_from_;
  bool dragging_ = false;  // a tool
  std::optional<QPoint> hovered_;
};

}  // namespace osteon
