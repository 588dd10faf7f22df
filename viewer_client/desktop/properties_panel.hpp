// The properties of the tool in the hand, as in Niu 2008, Figure 9.6: size, spindle speed, push, teeth, feed. A
// change reaches picture, force and sound at once.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <functional>
#include <string>

class QAction;
class QComboBox;
class QFormLayout;
class QLabel;
class QSpinBox;

namespace osteon {

class PropertiesPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(PropertiesPanel)

 public:
  struct Chosen {
    double spindle_rpm = 0;
    double push_n = 10;
  };
  // `resized`: the user chose the tool of another size in the same group.
  PropertiesPanel(std::function<void(const Chosen&)> changed, std::function<void(const std::string&)> resized,
                  QWidget* parent = nullptr);

  // Shows the tool's own values.
  void show_tool(const std::string& tool);
  void show_push(double push_n);
  // A check box for an action that can be checked. Either shows the other's state.
  void add_switch(QAction& action);
  [[nodiscard]] Chosen chosen() const;

 private:
  std::function<void(const Chosen&)> changed_;
  std::function<void(const std::string&)> resized_;
  bool showing_ = false;  // its own change of a value is none of the user's
  QFormLayout* form_;
  QComboBox* size_;
  QSpinBox *rpm_, *push_;
  QLabel *teeth_, *feed_;
};

}  // namespace osteon
