// One slice of the bone's inside as an image. The left button sets the cross, or draws axes and planes and moves their
// ends. The right one sets the window of HU, the middle one moves the image. The wheel moves the slice.
#pragma once
#include <QCoreApplication>
#include <QImage>
#include <QPoint>
#include <QWidget>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/tools/annotation.hpp"
#include "viewer_client/imaging/hu_window.hpp"
#include "viewer_client/inside/slice_painter.hpp"

namespace osteon {

// What is drawn over the images, in the bone's frame.
struct SliceOverlay {
  Vec3 point_mm = Vec3::Zero();  // of the cross
  struct Axis {
    Vec3 point_mm, direction;
  };
  std::optional<Axis> tool_axis;  // none: no hand holds a tool
  std::optional<Implicit> tool;   // its solid, where it is now; none: not a built-in tool
  struct Planned {
    QString name;
    Vec3 point_mm, direction;
  };
  std::vector<Planned> planned;
  std::vector<Annotation> drawn;  // axes and planes of people
  std::uint32_t selected = 0;     // of them
  bool draws = false;             // a click gives a point of a new one
  std::optional<Vec3> begun;      // its first point
};

// [GUI thread]
class SliceView : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(SliceView)

 public:
  struct Events {
    std::function<void(const Vec3& point_mm)> point;  // the user wants the cross there
    std::function<void(const Vec3& point_mm)> drawn;  // a point of a new axis or plane
    std::function<void(std::uint32_t id, std::size_t end, const Vec3& point_mm)> dragged;  // an end of a drawn one
    std::function<void()> dropped;                                                         // that end
    std::function<void(double steps)> move;                     // the slice, along its normal
    std::function<void(const Vec3& by_mm)> shift;               // the image's middle
    std::function<void(double factor)> zoom;                    // of the length of a pixel
    std::function<void(double right, double down)> window;      // a drag of the right button, pixels
    std::function<void(std::optional<Vec3> point_mm)> hovered;  // the pointer; none: it left
    std::function<void()> resized;
  };

  explicit SliceView(Events events, QWidget* parent = nullptr);

  // `line_colours`: of the cross's horizontal and vertical line. They are those of the planes that they stand for.
  void set_title(const QString& title, const QColor& colour, const std::array<QColor, 2>& line_colours);
  // Null: there is none yet, and the notice is shown.
  void show_image(std::shared_ptr<const SliceImage> image, const HuWindow& window);
  void show_overlay(const SliceOverlay& overlay);
  void set_notice(const QString& notice);

  [[nodiscard]] ImageSize size_px() const;  // of the screen
  [[nodiscard]] const SliceImage* image() const { return image_.get(); }
  [[nodiscard]] const QImage& grey() const { return grey_; }
  // HU of the pixel that is nearest to a point of the plane. None: it is outside the image.
  [[nodiscard]] std::optional<double> hu_at(const Vec3& point_mm) const;
  // In pixels of the widget.
  [[nodiscard]] QPointF place_of(const Vec3& point_mm) const;
  [[nodiscard]] Vec3 point_at(const QPointF& place) const;
  [[nodiscard]] const std::vector<OutlinePart>& outline() const {
    return outline_;
  }  // of the tool, pixels of the image
  [[nodiscard]] QSize sizeHint() const override { return {260, 220}; }
  [[nodiscard]] QSize minimumSizeHint() const override { return {130, 110}; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void leaveEvent(QEvent* event) override;

 private:
  void refresh_overlay();
  // From pixels of the image to those of the widget: an image of another size is shown about the middle.
  [[nodiscard]] QPointF to_widget(const Pixel& pixel) const;
  [[nodiscard]] Pixel to_image(const QPointF& place) const;
  void paint_lines(QPainter& painter) const;
  void paint_planned(QPainter& painter) const;
  void paint_drawn(QPainter& painter) const;
  // An end of an axis or plane that lies in the slice or near it.
  struct End {
    std::uint32_t id;
    std::size_t end;
    double depth_mm;
  };
  [[nodiscard]] std::optional<End> end_under(const QPointF& place) const;
  void use_left_button(const QPointF& place);
  void paint_words(QPainter& painter) const;

  Events events_;
  QString title_, notice_;
  QColor colour_;
  std::array<QColor, 2> line_colours_;
  std::shared_ptr<const SliceImage> image_;  // shared with the painter
  HuWindow window_;
  QImage grey_;
  SliceOverlay overlay_;
  std::vector<OutlinePart> outline_;
  QPoint last_, pressed_;    // of the mouse
  std::optional<End> held_;  // while the left button drags it
  bool drew_ = false;        // the left button, which is still down, gave a point
};

}  // namespace osteon
