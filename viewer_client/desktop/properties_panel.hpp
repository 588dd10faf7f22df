// The properties of the tool in the hand, as in Niu 2008, Figure 9.6: size, spindle speed, push, teeth, feed, wear and
// force law. A change reaches picture, force and sound at once.
#pragma once
#include <QCoreApplication>
#include <QWidget>
#include <functional>
#include <map>
#include <optional>
#include <string>

class QAction;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QSpinBox;
class QVBoxLayout;

namespace osteon {

struct Tool;

class PropertiesPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(PropertiesPanel)

 public:
  // What the user chose for a tool. The choice lasts until the window closes.
  struct WearAndLaw {
    std::optional<double> wear;  // none: as the tool is
    std::string law;             // empty: the tool's own
  };
  struct Chosen {
    double spindle_rpm = 0;
    double push_n = 10;
    WearAndLaw wear_and_law;
  };
  // `resized`: the user chose the tool of another size in the same group.
  PropertiesPanel(std::function<void(const Chosen&)> changed, std::function<void(const std::string&)> resized,
                  QWidget* parent = nullptr);

  // Shows the tool's own values, and the wear and law that were chosen for it. `not_held`: why it cannot be held here,
  // so that wear and law cannot be chosen; empty: it can.
  void show_tool(const std::string& tool, const QString& not_held);
  // There is no tool, for this reason. The switches stay as they are.
  void show_none(const QString& reason);
  void show_push(double push_n);
  // A check box for an action that can be checked. Either shows the other's state.
  void add_switch(QAction& action);
  [[nodiscard]] Chosen chosen() const;

 private:
  void show_wear_and_law(const Tool& tool, const QString& not_held);

  std::function<void(const Chosen&)> changed_;
  std::function<void(const std::string&)> resized_;
  bool showing_ = false;   // its own change of a value is none of the user's
  QWidget* of_tool_;       // all parts but the switches
  QVBoxLayout* switches_;  // of the other hand, which needs no tool
  QComboBox* size_;
  QSpinBox *rpm_, *push_;
  QLabel *teeth_, *feed_;
  QDoubleSpinBox* wear_;
  QComboBox* law_;
  std::string tool_;                          // shown
  std::map<std::string, WearAndLaw> chosen_;  // by the name of the tool
};

}  // namespace osteon
