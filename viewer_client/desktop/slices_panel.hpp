// Three linked slices of the bone as it is now: along the patient's axes, or along the tool. They go through the tip of
// the tool while it cuts, else through the cross that the user sets. The bone's inside is followed while the panel is
// seen.
#pragma once
#include <QCoreApplication>
#include <QPointer>
#include <QWidget>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/mechanics/cutting_state.hpp"
#include "common/surface/surgical_plan.hpp"
#include "viewer_client/desktop/inside_link.hpp"
#include "viewer_client/desktop/slice_view.hpp"
#include "viewer_client/inside/slice_painter.hpp"
#include "viewer_client/inside/slice_point.hpp"

class QBoxLayout;
class QCheckBox;
class QComboBox;
class QLabel;
class QSlider;

namespace osteon {

// [GUI thread]
class SlicesPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(SlicesPanel)

 public:
  // What the mouse draws on the images.
  struct Drawing {
    // A point of a new axis or plane, and the direction through the image.
    std::function<void(const Vec3& point_mm, const Vec3& into_image)> drawn;
    std::function<void(std::uint32_t id, std::size_t end, const Vec3& point_mm)> dragged;
    std::function<void()> dropped;
  };

  SlicesPanel(InsideLink& inside, Drawing drawing, QWidget* parent = nullptr);

  // A new bone, or none: an empty box.
  void reset(const Box& bone, double pitch_mm);
  // Called often. `tool`: what the own hand holds, or the only tool in the room; null: none. `plan`: null, or with the
  // axes that are to be drawn.
  void refresh(const CuttingState* tool, const SurgicalPlan* plan);

  // Axes and planes, which of them is selected, whether a click gives a point of a new one, and its first point.
  void show_drawn(const std::vector<Annotation>& drawn, std::uint32_t selected, bool draws,
                  const std::optional<Vec3>& begun);
  // Puts the cross there.
  void look_at(const Vec3& point_mm) { set_point(point_mm); }
  // Above the images, below the panel's own choices.
  void add_row(QWidget* row);

  [[nodiscard]] const Vec3& point_mm() const { return point_.point_mm(); }
  // Unit vector through the image that has the keyboard's focus, else through the first one.
  [[nodiscard]] Vec3 into_image() const;
  [[nodiscard]] const HuWindow& window() const { return window_; }

 protected:
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  void add_choices(QBoxLayout& all);
  void add_views(QBoxLayout& all);
  [[nodiscard]] SliceAxes axes() const;
  void set_axes();
  void set_point(const Vec3& point_mm);
  void move_slice(std::size_t slice, double by_mm);
  void zoom(double factor);
  void set_window(const HuWindow& window);
  void choose_window();
  void show_hu(std::size_t slice, const std::optional<Vec3>& point_mm);
  void show_whole();
  // As it is to be seen now. Without a zoom of the user's, the bone fits into each image.
  [[nodiscard]] LinkedSlices view() const;
  // Asks for what is to be seen now, unless it was asked for before.
  void ask();
  void show_images();
  void show_status();
  void follow(const CuttingState* tool);
  void set_tool(const CuttingState* tool);
  void set_sliders();

  QPointer<InsideLink> inside_;
  Drawing drawing_;
  std::shared_ptr<SlicePainter> painter_;  // shared with the thread that paints
  Box bone_;
  double pitch_mm_ = 1.0;
  SlicePoint point_;
  Vec3 centre_mm_ = Vec3::Zero();                // of the images along the patient's axes
  std::array<std::optional<double>, 2> zoom_{};  // mm for each pixel of the widget, for each choice of axes
  HuWindow window_ = kBoneWindow;
  std::array<radiology::PixelGrid, kSlices> asked_{};
  SliceOverlay overlay_;
  std::string tool_name_;          // of overlay_.tool, before it was placed
  std::optional<Implicit> solid_;  // in the tool's frame; none: not a built-in tool
  std::optional<Pose> tool_pose_;
  std::size_t planned_ = 0;  // number of axes that are drawn
  std::optional<std::pair<std::size_t, Vec3>> hovered_;
  bool sets_sliders_ = false;

  QComboBox *axes_ = nullptr, *presets_ = nullptr;
  QCheckBox* follows_ = nullptr;
  QBoxLayout* images_ = nullptr;
  std::array<SliceView*, kSlices> views_{};
  std::array<QSlider*, kSlices> sliders_{};
  QLabel *hu_ = nullptr, *status_ = nullptr;
};

}  // namespace osteon
