#include "viewer_client/desktop/risk_gauge.hpp"

#include <QLocale>
#include <QSettings>
#include <utility>

#include "viewer_client/desktop/structure_names.hpp"

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
  show_tip({});
}

void RiskGauge::set_limit_mm(double limit_mm) {
  limit_mm_ = limit_mm;
  QSettings().setValue(kLimitKey, limit_mm);
}

void RiskGauge::show_tip(const std::optional<Vec3>& tip_mm) {
  const auto found = tip_mm && distances_ ? distances_->nearest(*tip_mm) : std::nullopt;
  setVisible(found.has_value());
  if (!found) {
    clear();
    return;
  }
  const QString whole = structure_title(plan_->structures[found->structure].name);
  const QString name = fontMetrics().elidedText(whole, Qt::ElideRight, kNameWidth_px);
  const QString distance = QLocale().toString(found->distance_mm, 'f', 1);
  const bool warns = found->distance_mm < limit_mm_;
  if (warns != warns_) setStyleSheet(warns ? kWarning : "");
  warns_ = warns;
  setToolTip(whole);
  setText(found->inside ? tr("Inside %1").arg(name)
          : warns       ? tr("Near %1: %2 mm").arg(name, distance)
                        : tr("%1: %2 mm").arg(name, distance));
}

}  // namespace osteon
