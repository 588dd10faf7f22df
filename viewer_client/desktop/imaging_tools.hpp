// The bar of tools of image processing, and the bone that they work on.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <functional>
#include <vector>

#include "viewer_client/imaging/plane_drag.hpp"

class QBoxLayout;
class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLineEdit;
class QSpinBox;
class QToolButton;

namespace osteon {

// [GUI thread]
class ImagingTools : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ImagingTools)

 public:
  // The tool or the brush has changed.
  explicit ImagingTools(std::function<void()> changed, QWidget* parent = nullptr);

  [[nodiscard]] ImagingTool tool() const { return tool_; }
  [[nodiscard]] double radius_mm() const;
  [[nodiscard]] bool flat() const;
  // A notch is a step of the radius.
  void turn_radius(int notches);
  // Without parts of bone only the crosshair, the box and the landmark work. `reason`: why there are none.
  void set_found(bool found, const QString& reason);
  // As at the start.
  void reset();

 private:
  struct Words {
    ImagingTool tool;
    QString text;
    const char* name;
    QString tip;
    const char* keys;
  };
  void add_tool(QBoxLayout& row, const Words& words);
  void choose(ImagingTool tool);

  std::function<void()> changed_;
  ImagingTool tool_ = ImagingTool::look;
  std::vector<QToolButton*> buttons_;
  QDoubleSpinBox* radius_;
  QCheckBox* flat_;
};

// [GUI thread] Which bone the tools work on, its name, and the opacity of its tint.
class ImagingBoneChoice : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ImagingBoneChoice)

 public:
  struct Events {
    std::function<void(int bone, const QString& name)> name;
    std::function<void(int bone, int percent)> fade;
  };
  explicit ImagingBoneChoice(Events events, QWidget* parent = nullptr);

  // The bones that there are.
  void follow(const ImagingEdits& edits);
  // 0: a seed makes a new bone, and other tools work on the bone under the mouse.
  [[nodiscard]] int bone() const;

 private:
  void show_bone();

  Events events_;
  ImagingEdits edits_;
  QComboBox* bone_;
  QLineEdit* name_;
  QSpinBox* opacity_;
};

}  // namespace osteon
