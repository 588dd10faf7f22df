#include "viewer_client/desktop/sound_dialog.hpp"

#include <QCheckBox>
#include <QDialogButtonBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLocale>
#include <QPainter>
#include <QPainterPath>
#include <QPushButton>
#include <QSlider>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer_client/desktop/enabled.hpp"

namespace osteon {

namespace {

constexpr double kQuietest_db = -90.0;

QString decimals(double value, int count) { return QLocale().toString(value, 'f', count); }

}  // namespace

// Without what an option of the audio client would do, and without PulseAudio's own words, which its log has.
QString sound_trouble(const std::string& said) {
  if (said.starts_with("no sound server answers"))
    return SoundDialog::tr("no sound server answers; start PulseAudio or PipeWire.");
  if (said.starts_with("the sound server went away"))
    return SoundDialog::tr("the sound server went away; start it again.");
  if (said.starts_with("the sound has not begun yet")) return SoundDialog::tr("the sound has not begun yet.");
  return QString::fromStdString(said);
}

double amplitude_of(int percent) { return std::pow(std::clamp(percent, 0, 100) / 100.0, 3); }

WavePlot::WavePlot(QWidget* parent) : QWidget(parent) {
  setObjectName("wave");
  setMinimumHeight(110);
  setAccessibleName(tr("Waveform of the sound"));
}

void WavePlot::show_wave(const std::vector<int>& wave, double rate_hz) {
  wave_ = wave;
  rate_hz_ = rate_hz;
  update();
}

void WavePlot::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  const QColor ink = palette().color(QPalette::WindowText);
  painter.fillRect(rect(), palette().color(QPalette::Base));
  painter.setPen(QColor(ink.red(), ink.green(), ink.blue(), 90));
  painter.drawLine(0, height() / 2, width(), height() / 2);
  if (wave_.size() < 2) return;
  const double length_ms = 1e3 * static_cast<double>(wave_.size()) / rate_hz_;
  painter.drawText(rect().adjusted(4, 2, -4, -2), Qt::AlignBottom | Qt::AlignRight,
                   tr("%1 ms").arg(decimals(length_ms, 1)));
  QPainterPath path;
  for (std::size_t i = 0; i < wave_.size(); ++i) {
    const QPointF at(width() * static_cast<double>(i) / static_cast<double>(wave_.size() - 1),
                     0.5 * height() * (1.0 - static_cast<double>(wave_[i]) / kFullScale));
    i == 0 ? path.moveTo(at) : path.lineTo(at);
  }
  painter.setPen(QPen(QColor(0, 114, 178), 1.4));
  painter.drawPath(path);
}

SoundDialog::SoundDialog(const Chosen& chosen, std::function<void(const Chosen&)> changed, QWidget* parent)
    : QDialog(parent), changed_(std::move(changed)) {
  setObjectName("sound_dialog");
  setWindowTitle(tr("Sound"));
  on_ = new QCheckBox(tr("&Play the sound"));
  on_->setObjectName("sound_on");
  on_->setChecked(chosen.on);
  volume_ = new QSlider(Qt::Horizontal);
  volume_->setObjectName("volume");
  volume_->setAccessibleName(tr("Volume"));
  volume_->setRange(0, 100);
  volume_->setPageStep(10);
  volume_->setValue(chosen.percent);
  percent_ = new QLabel;
  percent_->setMinimumWidth(percent_->fontMetrics().horizontalAdvance(tr("%1 %").arg(1000)));
  auto* louder = new QHBoxLayout;
  auto* words = new QLabel(tr("&Volume"));
  words->setBuddy(volume_);
  louder->addWidget(words);
  louder->addWidget(volume_, 1);
  louder->addWidget(percent_);

  plot_ = new WavePlot;
  auto* form = new QFormLayout;
  const auto row = [&](const QString& what, const char* name) {
    auto* value = new QLabel(QString("–"));
    value->setObjectName(name);
    form->addRow(what, value);
    return value;
  };
  level_ = row(tr("Level"), "sound_level");
  work_ = row(tr("Computing time of a buffer"), "sound_work");
  latency_ = row(tr("Latency from tool to ear, at most"), "sound_latency");
  gaps_ = row(tr("Gaps"), "sound_gaps");
  late_ = row(tr("Late callbacks"), "sound_late");
  device_ = row(tr("Device"), "sound_device");
  trouble_ = new QLabel;
  trouble_->setObjectName("sound_trouble");
  trouble_->setWordWrap(true);
  trouble_->setTextInteractionFlags(Qt::TextSelectableByMouse);  // it may have a command
  auto* buttons = new QDialogButtonBox;
  QPushButton* close = buttons->addButton(tr("Close"), QDialogButtonBox::RejectRole);
  connect(close, &QPushButton::clicked, this, [this] { reject(); });

  auto* all = new QVBoxLayout(this);
  all->addWidget(on_);
  all->addLayout(louder);
  all->addWidget(plot_, 1);
  all->addLayout(form);
  all->addWidget(trouble_);
  all->addWidget(buttons);
  connect(on_, &QCheckBox::toggled, this, [this] { report_choice(); });
  connect(volume_, &QSlider::valueChanged, this, [this] { report_choice(); });
  report_choice();
}

void SoundDialog::report_choice() {
  percent_->setText(tr("%1 %").arg(volume_->value()));
  set_enabled(*volume_, on_->isChecked(), tr("The sound is off."));
  if (!showing_) changed_({on_->isChecked(), volume_->value()});
}

void SoundDialog::set_on(bool on) {
  showing_ = true;
  on_->setChecked(on);
  showing_ = false;
}

void SoundDialog::show_report(const std::optional<SoundReport>& report, const QString& missing) {
  const bool played = report && report->trouble.empty();
  plot_->show_wave(played ? report->wave : std::vector<int>(), played ? report->rate_hz : 48000.0);
  const auto text = [&](QLabel* label, auto words) { label->setText(played ? words() : QString("–")); };
  text(level_, [&] {
    const double db = 20.0 * std::log10(std::max(report->level, 1e-9));
    return db < kQuietest_db ? tr("silent") : tr("%1 dB").arg(decimals(db, 0));
  });
  text(work_, [&] { return tr("%1 of %2 ms").arg(decimals(report->work_ms, 2), decimals(report->buffer_ms, 2)); });
  text(latency_, [&] { return tr("%1 ms").arg(decimals(report->latency_ms, 1)); });
  text(gaps_, [&] { return QLocale().toString(static_cast<qlonglong>(report->gaps)); });
  text(late_, [&] { return QLocale().toString(static_cast<qlonglong>(report->late_callbacks)); });
  text(device_, [&] { return QString::fromStdString(report->device); });
  QString trouble = missing;
  if (report) trouble = played ? QString() : tr("No sound device: %1").arg(sound_trouble(report->trouble));
  if (trouble != trouble_->text()) trouble_->setText(trouble);
}

}  // namespace osteon
