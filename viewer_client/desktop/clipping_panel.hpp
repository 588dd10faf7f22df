// Clips the bone in the picture: by a box, whose sides move inwards, and by a plane across the line of sight. Only the
// picture changes.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <array>
#include <functional>
#include <optional>

#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/clipping.hpp"

class QCheckBox;
class QFormLayout;
class QSlider;

namespace osteon {

// [GUI thread]
class ClippingPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ClippingPanel)

 public:
  // `changed` gets what is drawn from now on, `view` gives the view of that moment.
  ClippingPanel(std::function<void(const Clipping&)> changed, std::function<CameraView()> view,
                QWidget* parent = nullptr);

  // The whole bone again, of this size.
  void reset(const Box& bone);
  [[nodiscard]] Clipping clipping() const;

 private:
  QSlider* add_slider(QFormLayout& form, const QString& what, const char* name, int value);
  void face_viewer();
  void report();

  std::function<void(const Clipping&)> changed_;
  std::function<CameraView()> view_;
  Box bone_;
  QCheckBox *box_ = nullptr, *plane_ = nullptr;
  std::array<QSlider*, 6> sides_{};  // from and to: x, y, z
  QSlider* depth_ = nullptr;
  Vec3 away_ = Vec3::UnitY();  // from the viewer, when the plane was turned to it
  bool resetting_ = false;
};

}  // namespace osteon
