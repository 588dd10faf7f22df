// How far the tips of the tools are from the nearest structure at risk, in the status bar.
#pragma once
#include <QCoreApplication>
#include <QLabel>
#include <memory>
#include <optional>
#include <span>

#include "viewer_client/scene/held_tools.hpp"
#include "viewer_client/scene/structure_distances.hpp"

namespace osteon {

// [GUI thread] Hidden while there is no structure at risk or no tool.
class RiskGauge : public QLabel {
  Q_DECLARE_TR_FUNCTIONS(RiskGauge)

 public:
  static constexpr double kUsualLimit_mm = 5.0;

  explicit RiskGauge(QWidget* parent = nullptr);

  // Null: there is none.
  void set_plan(std::shared_ptr<const SurgicalPlan> plan);
  // Of all people in the room. The gauge shows the tool that is nearest, and its tool tip shows each of them. It says
  // whose tool that is, unless only the user of this window holds one.
  void show_tools(std::span<const HeldTool> tools);

  // Below this distance, mm, the gauge warns. The settings store it.
  [[nodiscard]] double limit_mm() const { return limit_mm_; }
  void set_limit_mm(double limit_mm);
  [[nodiscard]] bool warns() const { return warns_; }

 private:
  [[nodiscard]] static QString holder_of(const HeldTool& tool);
  void show_tip(const QString& words);
  [[nodiscard]] QString sentence_of(const NearestStructure& found, const QString& structure) const;

  std::shared_ptr<const SurgicalPlan> plan_;  // shared with the picture
  std::optional<StructureDistances> distances_;
  double limit_mm_ = kUsualLimit_mm;
  bool warns_ = false;
};

}  // namespace osteon
