// How far the tip of the tool is from the nearest structure at risk, in the status bar.
#pragma once
#include <QCoreApplication>
#include <QLabel>
#include <memory>
#include <optional>

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
  // The tip in the bone's frame. None: no tool.
  void show_tip(const std::optional<Vec3>& tip_mm);

  // Below this distance, mm, the gauge warns. The settings store it.
  [[nodiscard]] double limit_mm() const { return limit_mm_; }
  void set_limit_mm(double limit_mm);
  [[nodiscard]] bool warns() const { return warns_; }

 private:
  std::shared_ptr<const SurgicalPlan> plan_;  // shared with the picture
  std::optional<StructureDistances> distances_;
  double limit_mm_ = kUsualLimit_mm;
  bool warns_ = false;
};

}  // namespace osteon
