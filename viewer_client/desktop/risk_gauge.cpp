#include "viewer_client/desktop/risk_gauge.hpp"

#include <QLocale>
#include <QSettings>
#include <QStringList>
#include <utility>

#include "viewer_client/desktop/structure_names.hpp"
#include "viewer_client/desktop/tool_names.hpp"

namespace osteon {

namespace {

constexpr const char* kLimitKey = "view/risk_limit_mm";
constexpr int kNameWidth_px = 220;
// Black on orange: seen with any colour vision, and readable. A word besides says the same.
constexpr const char* kWarning = "QLabel { background: #e69f00; color: black; font-weight: bold; padding: 0 4px; }";

}  // namespace

RiskGauge::RiskGauge(QWidget* parent) : QLabel(parent) {
  setAccessibleDescription(tr("Distance to the nearest structure at risk"));
  limit_mm_ = QSettings().value(kLimitKey, kUsualLimit_mm).toDouble();
  hide();
}

void RiskGauge::set_plan(std::shared_ptr<const SurgicalPlan> plan) {
  if (plan == plan_) return;
  plan_ = std::move(plan);
  distances_.reset();
  if (plan_) distances_.emplace(plan_);
  show_tools({});
}

void RiskGauge::set_limit_mm(double limit_mm) {
  limit_mm_ = limit_mm;
  QSettings().setValue(kLimitKey, limit_mm);
}

QString RiskGauge::sentence_of(const NearestStructure& found, const QString& structure) const {
  const QString distance = QLocale().toString(found.distance_mm, 'f', 1);
  return found.inside                    ? tr("Inside %1").arg(structure)
         : found.distance_mm < limit_mm_ ? tr("Near %1: %2 mm").arg(structure, distance)
                                         : tr("%1: %2 mm").arg(structure, distance);
}

void RiskGauge::show_tools(std::span<const CuttingState> states) {
  std::optional<NearestStructure> nearest;
  QString nearest_tool;
  QStringList of_each;
  for (const CuttingState& state : states) {
    if (state.tool_name.empty() || !distances_) continue;
    const auto found = distances_->nearest(state.pose_bone_tool.position_mm);
    if (!found) continue;
    const QString tool = tool_title(state.tool_name);
    of_each << tool + ": " + sentence_of(*found, structure_title(plan_->structures[found->structure].name));
    if (nearest && found->distance_mm >= nearest->distance_mm) continue;
    nearest = found;
    nearest_tool = tool;
  }
  setVisible(nearest.has_value());
  setToolTip(of_each.join('\n'));
  if (!nearest) {
    clear();
    return;
  }
  const bool warns = nearest->distance_mm < limit_mm_;
  if (warns != warns_) setStyleSheet(warns ? kWarning : "");
  warns_ = warns;
  const QString whole = structure_title(plan_->structures[nearest->structure].name);
  const QString sentence = sentence_of(*nearest, fontMetrics().elidedText(whole, Qt::ElideRight, kNameWidth_px));
  setText(of_each.size() > 1 ? nearest_tool + ": " + sentence : sentence);
}

}  // namespace osteon
