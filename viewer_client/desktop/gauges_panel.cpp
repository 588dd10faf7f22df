#include "viewer_client/desktop/gauges_panel.hpp"

#include <QCoreApplication>
#include <QFormLayout>
#include <QLabel>
#include <QLocale>
#include <QPainter>
#include <QPainterPath>
#include <QProgressBar>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

namespace osteon {

namespace {

constexpr double kShown_s = 10.0, kLeastTop = 5.0;
constexpr double kLeastChange = 0.02;  // less than half a pixel

// With the user's decimal sign, and never a negative zero.
QString number(double value, int decimals) {
  const double step = std::pow(10.0, -decimals);
  return QLocale().toString(std::round(value / step) * step + 0.0, 'f', decimals);
}

}  // namespace

ScrollingPlot::ScrollingPlot(QWidget* parent) : QWidget(parent) {
  setMinimumHeight(90);
  setAccessibleName(tr("Force over the last ten seconds"));
}

void ScrollingPlot::add(double at_s, double first, double second) {
  const auto changed = [&](double before, double now) { return std::abs(now - before) > kLeastChange; };
  if (samples_.empty() || changed(level_first_, first) || changed(level_second_, second)) {
    level_first_ = first;
    level_second_ = second;
    level_since_s_ = at_s;
  }
  samples_.push_back({at_s, first, second});
  while (samples_.front().at_s < at_s - kShown_s) samples_.pop_front();
  // Each repaint composes the window's whole picture again. Level lines look the same wherever they have scrolled to.
  if (samples_.front().at_s <= level_since_s_) update();
}

void ScrollingPlot::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  const QColor ink = palette().color(QPalette::WindowText);
  painter.fillRect(rect(), palette().color(QPalette::Base));
  double top = kLeastTop;
  for (const Sample& sample : samples_) top = std::max({top, sample.first, sample.second});
  top = std::ceil(top / kLeastTop) * kLeastTop;
  painter.setPen(QColor(ink.red(), ink.green(), ink.blue(), 90));
  painter.drawText(rect().adjusted(4, 2, -4, -2), Qt::AlignTop | Qt::AlignLeft, tr("%1 N").arg(number(top, 0)));
  painter.drawLine(0, height() - 1, width(), height() - 1);
  if (samples_.size() < 2) return;
  const double now_s = samples_.back().at_s;
  const auto line = [&](double Sample::*quantity, const QColor& colour, Qt::PenStyle style) {
    QPainterPath path;
    for (const Sample& sample : samples_) {
      const QPointF at(width() * (1.0 - (now_s - sample.at_s) / kShown_s), height() * (1.0 - sample.*quantity / top));
      path.elementCount() == 0 ? path.moveTo(at) : path.lineTo(at);
    }
    painter.setPen(QPen(colour, 1.6, style));
    painter.drawPath(path);
  };
  // Blue and orange differ for colour-blind people too; one is dashed besides.
  line(&Sample::first, QColor(0, 114, 178), Qt::SolidLine);
  line(&Sample::second, QColor(230, 159, 0), Qt::DashLine);
}

GaugesPanel::GaugesPanel(QWidget* parent) : QWidget(parent) {
  auto* form = new QFormLayout;
  const auto gauge = [&](const QString& what, const char* name) {
    auto* value = new QLabel("–");
    value->setObjectName(name);
    value->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
    QFont font = value->font();
    font.setPointSizeF(1.2 * font.pointSizeF());
    value->setFont(font);
    form->addRow(what, value);  // names it for screen readers, which then read its value too
    return value;
  };
  push_ = gauge(tr("Push"), "push");
  bone_ = gauge(tr("Force of the bone"), "force_bone");
  hand_ = gauge(tr("Force on the hand"), "force_hand");
  torque_ = gauge(tr("Torque"), "torque");
  depth_ = gauge(tr("Depth"), "depth");
  spindle_ = gauge(tr("Spindle"), "spindle");
  feed_ = gauge(tr("Feed"), "feed");
  density_ = gauge(tr("Density"), "density");
  flutes_ = gauge(tr("Flutes filled"), "flutes");
  wear_ = gauge(tr("Wear"), "wear");
  plan_angle_ = gauge(tr("Angle to the plan"), "plan_angle");
  plan_beside_ = gauge(tr("Beside the plan"), "plan_beside");
  plan_depth_ = gauge(tr("Depth left"), "plan_depth");
  gauge(tr("Temperature"), "temperature")->setText(tr("not simulated"));
  budget_ = new QProgressBar;
  budget_->setObjectName("budget");
  budget_->setTextVisible(false);
  budget_->setAccessibleName(tr("Force on the hand, of what the device holds"));
  budget_words_ = new QLabel;
  budget_words_->setObjectName("budget_words");
  budget_words_->setWordWrap(true);
  saturated_ = new QLabel("⚠ " + tr("The device cannot hold this force: the bone is harder than it feels."));
  saturated_->setObjectName("saturated");
  saturated_->setWordWrap(true);
  plot_ = new ScrollingPlot;
  auto* all = new QVBoxLayout(this);
  all->addLayout(form);
  all->addWidget(budget_);
  all->addWidget(budget_words_);
  all->addWidget(saturated_);
  all->addWidget(plot_);
  const QString colours = "<span style='color:#0072b2'>—</span> %1   <span style='color:#e69f00'>- -</span> %2";
  auto* legend = new QLabel(colours.arg(tr("bone"), tr("hand")));
  all->addWidget(legend);
  all->addStretch();
  // Their places stay, so that what comes and goes does not move the picture.
  for (QWidget* part :
       {static_cast<QWidget*>(budget_), static_cast<QWidget*>(budget_words_), static_cast<QWidget*>(saturated_)}) {
    QSizePolicy keeps = part->sizePolicy();
    keeps.setRetainSizeWhenHidden(true);
    part->setSizePolicy(keeps);
  }
  show_budget(HandForce{.device_holds_n = 1.0});
  show_budget(std::nullopt);
}

void GaugesPanel::show_push(double push_n) { push_->setText(tr("%1 N").arg(number(push_n, 0))); }

void GaugesPanel::show_plan(const std::optional<PlanOffset>& offset, const QString& name) {
  plan_angle_->setText(offset ? tr("%1°").arg(number(offset->angle_deg, 1)) : QString("–"));
  plan_beside_->setText(offset ? tr("%1 mm").arg(number(offset->beside_mm, 1)) : QString("–"));
  const bool deep = offset && offset->depth_left_mm;
  plan_depth_->setText(deep ? tr("%1 mm").arg(number(*offset->depth_left_mm, 1)) : QString("–"));
  for (QLabel* label : {plan_angle_, plan_beside_, plan_depth_}) label->setToolTip(offset ? name : QString());
}

void GaugesPanel::show_budget(const std::optional<HandForce>& hand) {
  const bool known = hand && hand->device_holds_n > 0.0;
  budget_->setVisible(known);
  budget_words_->setVisible(known);
  saturated_->setVisible(known && hand->saturated);
  if (!known) return;
  constexpr int kWhole = 1000;
  budget_->setRange(0, kWhole);
  budget_->setValue(static_cast<int>(std::lround(kWhole * std::min(1.0, hand->hand_n / hand->device_holds_n))));
  budget_words_->setText(tr("Force of the bone: %1 N. On the hand: %2 N. The device can hold: %3 N.")
                             .arg(number(hand->bone_n, 1), number(hand->hand_n, 1), number(hand->device_holds_n, 1)));
}

std::optional<HandForce> hand_force(const CuttingState& state, const std::optional<PointerOutput>& output) {
  // A device holds a little less than its limit when the loop saturates: rounding.
  constexpr double kNearlyAll = 0.999;
  if (output)
    return HandForce{output->force_bone_n.norm(), output->force_hand_n.norm(), output->device_holds_n, output->depth_mm,
                     output->saturated};
  if (state.device_holds_N <= 0.0) return std::nullopt;
  return HandForce{state.force_physical_N.norm(), state.force_hand_N, state.device_holds_N, state.depth_mm,
                   state.force_hand_N > kNearlyAll * state.device_holds_N};
}

void GaugesPanel::show(const CuttingState& state, const std::optional<PointerOutput>& pointer, double at_s) {
  const std::optional<HandForce> hand = hand_force(state, pointer);
  const double bone_n = state.force_physical_N.norm(), hand_n = hand ? hand->hand_n : 0.0;
  bone_->setText(tr("%1 N").arg(number(bone_n, 1)));
  hand_->setText(hand ? tr("%1 N").arg(number(hand_n, 1)) : QString("–"));
  torque_->setText(tr("%1 Nmm").arg(number(state.torque_Nmm, 0)));
  depth_->setText(tr("%1 mm").arg(number(hand ? hand->depth_mm : state.depth_mm, 1)));
  spindle_->setText(tr("%1 rpm").arg(number(state.spindle_rpm, 0)));
  feed_->setText(tr("%1 mm/s").arg(number(state.feed_mm_per_s, 1)));
  const bool in_bone = state.engaged_fraction > 0.0;
  density_->setText(in_bone ? tr("%1 g/cm³").arg(number(state.density_g_cm3, 2)) : QString("–"));
  flutes_->setText(state.flutes_full > 0.0 ? tr("%1 %").arg(number(100.0 * state.flutes_full, 0)) : QString("–"));
  wear_->setText(pointer && pointer->wear ? number(*pointer->wear, 2) : QString("–"));
  show_budget(hand);
  plot_->add(at_s, bone_n, hand_n);
}

}  // namespace osteon
