// The dialog of the practice room's sound: volume, on and off, and what is played. While it is open it shows the newest
// waveform, or why there is no sound.
#pragma once
#include <QCoreApplication>
#include <QDialog>
#include <QWidget>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/input/sound_link.hpp"

class QCheckBox;
class QLabel;
class QSlider;

namespace osteon {

// What was played last, over time. The height is the amplitude from -1 to 1.
class WavePlot : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(WavePlot)

 public:
  explicit WavePlot(QWidget* parent = nullptr);
  // As of SoundReport.
  void show_wave(const std::vector<int>& wave, double rate_hz);
  [[nodiscard]] const std::vector<int>& wave() const { return wave_; }
  [[nodiscard]] QSize sizeHint() const override { return {420, 140}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  std::vector<int> wave_;
  double rate_hz_ = 48000.0;
};

class SoundDialog : public QDialog {
  Q_DECLARE_TR_FUNCTIONS(SoundDialog)

 public:
  // What the user sets. `percent`: of the slider.
  struct Chosen {
    bool on = true;
    int percent = 100;
  };

  // `changed` is called when the user has set something.
  SoundDialog(const Chosen& chosen, std::function<void(const Chosen&)> changed, QWidget* parent);
  void set_on(bool on);
  // `missing`: why there is no report, as a text of the window.
  void show_report(const std::optional<SoundReport>& report, const QString& missing);

 private:
  void report_choice();

  std::function<void(const Chosen&)> changed_;
  QCheckBox* on_;
  QSlider* volume_;
  QLabel *percent_, *level_, *work_, *latency_, *gaps_, *late_, *device_, *trouble_;
  WavePlot* plot_;
  bool showing_ = false;  // a change is not the user's
};

// Factor of the amplitude for a volume in percent. The ear hears ratios, so it is the third power, as with the volume
// sliders of desktops.
[[nodiscard]] double amplitude_of(int percent);

// The trouble of a SoundReport in the language of the window. An unknown sentence stays as it is.
[[nodiscard]] QString sound_trouble(const std::string& said);

}  // namespace osteon
