#include "viewer_client/desktop/risk_gauge.hpp"

#include <QCursor>
#include <QLocale>
#include <QSettings>
#include <QStringList>
#include <QToolTip>
#include <utility>

#include "viewer_client/desktop/structure_names.hpp"
#include "viewer_client/desktop/tool_names.hpp"

namespace osteon {

namespace {

constexpr const char* kLimitKey = "view/risk_limit_mm";
constexpr int kNameWidth_px = 220, kHolderWidth_px = 120;
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

QString RiskGauge::holder_of(const HeldTool& tool) {
  return tool.own() ? tr("Your tool") : QString::fromStdString(tool.holder);
}

// Qt does not renew a tool tip that is read just now.
void RiskGauge::show_tip(const QString& words) {
  if (words == toolTip()) return;
  setToolTip(words);
  if (QToolTip::isVisible() && underMouse()) QToolTip::showText(QCursor::pos(), words, this);
}

void RiskGauge::show_tools(std::span<const HeldTool> tools) {
  std::optional<NearestStructure> nearest;
  const HeldTool* nearest_tool = nullptr;
  QStringList of_each;
  for (const HeldTool& tool : tools) {
    const auto found = distances_ ? distances_->nearest(tool.state.pose_bone_tool.position_mm) : std::nullopt;
    if (!found) continue;
    of_each << tr("%1 (%2): %3")
                   .arg(holder_of(tool), tool_title(tool.state.tool_name),
                        sentence_of(*found, structure_title(plan_->structures[found->structure].name)));
    if (nearest && found->distance_mm >= nearest->distance_mm) continue;
    nearest = found;
    nearest_tool = &tool;
  }
  setVisible(nearest.has_value());
  show_tip(of_each.join('\n'));
  if (!nearest) {
    clear();
    return;
  }
  const bool warns = nearest->distance_mm < limit_mm_;
  if (warns != warns_) setStyleSheet(warns ? kWarning : "");
  warns_ = warns;
  const QString whole = structure_title(plan_->structures[nearest->structure].name);
  const QString sentence = sentence_of(*nearest, fontMetrics().elidedText(whole, Qt::ElideRight, kNameWidth_px));
  const QString holder = fontMetrics().elidedText(holder_of(*nearest_tool), Qt::ElideRight, kHolderWidth_px);
  setText(of_each.size() > 1 || !nearest_tool->own() ? tr("%1: %2").arg(holder, sentence) : sentence);
}

}  // namespace osteon
