// Which programs of the room work, how fast they answer, and what to do when one is missing.
#pragma once
#include <QCoreApplication>
#include <QTimer>
#include <QWidget>
#include <functional>
#include <optional>

#include "common/input/pointer_link.hpp"
#include "common/input/sound_link.hpp"

class QFormLayout;
class QLabel;

namespace osteon {

// A program that the window started.
struct ProgramState {
  enum class Phase { off, runs, starts_again, ended };
  Phase phase = Phase::off;
  int restarts = 0;
  QString why;  // its last sentence, of its last end; empty: it has not ended, or said nothing
};

struct ConnectionState {
  QString address, room;  // empty: none
  bool practice = false, watching = false, joined = false, interrupted = false;
  std::optional<double> round_trip_ms;  // of a request to the server
  ProgramState server, haptic, audio;   // of a practice room
  bool pointer_connected = false;
  std::optional<double> pointer_silence_ms;  // since the haptic client said something
  std::optional<PointerOutput> hand;
  bool sound_on = true;
  std::optional<SoundReport> sound;
};

// [GUI thread]
class ConnectionPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ConnectionPanel)

 public:
  // `state` is asked for twice a second while the panel is seen.
  explicit ConnectionPanel(std::function<ConnectionState()> state, QWidget* parent = nullptr);

 protected:
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;

 private:
  void refresh();
  QLabel* add_row(QFormLayout& form, const QString& what, const char* name);

  std::function<ConnectionState()> state_;
  QLabel *room_, *role_, *server_, *haptic_, *device_, *audio_, *advice_;
  QTimer timer_;
};

}  // namespace osteon
