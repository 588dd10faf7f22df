#include "viewer_client/desktop/connection_panel.hpp"

#include <QFormLayout>
#include <QLabel>
#include <QLocale>
#include <QStringList>
#include <QVBoxLayout>
#include <utility>

#include "viewer_client/desktop/sound_dialog.hpp"

namespace osteon {

namespace {

constexpr int kPeriod_ms = 500;
constexpr double kSilent_ms = 1000.0;  // the pointer of a haptic client that works says something 60 times a second

struct PanelText {
  Q_DECLARE_TR_FUNCTIONS(ConnectionPanel)
};

QString in_ms(double ms) { return PanelText::tr("%1 ms").arg(QLocale().toString(ms, 'f', 1)); }

QString phase_text(const ProgramState& program) {
  switch (program.phase) {
    case ProgramState::Phase::off:
      return PanelText::tr("not started");
    case ProgramState::Phase::starts_again:
      return PanelText::tr("starts again");
    case ProgramState::Phase::ended:
      return PanelText::tr("ended");
    case ProgramState::Phase::runs:
      break;
  }
  return PanelText::tr("runs");
}

// Its phase, what is measured, and how often it was started again.
QString text_of_program(const ProgramState& program, const QString& measured) {
  QStringList parts{phase_text(program)};
  if (!measured.isEmpty()) parts << measured;
  if (program.restarts > 0) parts << PanelText::tr("started again: %1").arg(program.restarts);
  return parts.join(", ");
}

QString text_of_server(const ConnectionState& state) {
  if (!state.joined) return state.practice ? text_of_program(state.server, {}) : PanelText::tr("not connected");
  if (state.interrupted) return PanelText::tr("connection lost, trying again");
  const QString trip =
      state.round_trip_ms ? PanelText::tr("answers in %1").arg(in_ms(*state.round_trip_ms)) : QString();
  if (state.practice) return text_of_program(state.server, trip);
  return trip.isEmpty() ? PanelText::tr("connected") : trip;
}

QString text_of_haptic(const ConnectionState& state) {
  if (!state.practice) return PanelText::tr("not in this window");
  QString measured;
  if (state.pointer_silence_ms)
    measured = PanelText::tr("last message %1 ms ago").arg(QLocale().toString(*state.pointer_silence_ms, 'f', 0));
  return text_of_program(state.haptic, measured);
}

QString text_of_device(const ConnectionState& state) {
  if (!state.practice) return PanelText::tr("none");
  if (!state.pointer_connected) return PanelText::tr("mouse, not connected yet");
  if (!state.hand) return PanelText::tr("mouse, makes its tools ready");
  const Vec3& at = state.hand->pose_bone_tool.position_mm;
  const auto mm = [](double value) { return QLocale().toString(value, 'f', 1); };
  return PanelText::tr("mouse, at %1, %2, %3 mm").arg(mm(at.x()), mm(at.y()), mm(at.z()));
}

QString text_of_audio(const ConnectionState& state) {
  if (!state.practice) return PanelText::tr("not in this window");
  QString measured;
  if (!state.sound_on)
    measured = PanelText::tr("switched off");
  else if (state.sound && state.sound->trouble.empty())
    measured = PanelText::tr("delay %1").arg(in_ms(state.sound->latency_ms));
  else if (state.sound)
    measured = PanelText::tr("no device");
  return text_of_program(state.audio, measured);
}

// What is missing and what to do, one sentence for each line. Empty: nothing.
QStringList advice_of(const ConnectionState& state) {
  QStringList lines;
  if (state.address.isEmpty() && !state.practice) return {PanelText::tr("Open a bone or join a room.")};
  if (state.interrupted && !state.practice)
    lines << PanelText::tr("Check the network to %1. The window connects again by itself.").arg(state.address);
  // Each sentence names its program.
  for (const ProgramState* program : {&state.server, &state.haptic, &state.audio})
    if (!program->why.isEmpty() && program->phase != ProgramState::Phase::runs) lines << program->why;
  if (state.practice && state.joined) {
    if (!state.pointer_connected)
      lines << PanelText::tr("Wait some seconds: the haptic client makes its tools ready.");
    else if (state.pointer_silence_ms && *state.pointer_silence_ms > kSilent_ms)
      lines << PanelText::tr("The haptic client is silent. Close other programs that use the processor.");
  }
  if (state.sound_on && state.sound && !state.sound->trouble.empty()) {
    lines << PanelText::tr("No sound device: %1").arg(sound_trouble(state.sound->trouble));
    lines << PanelText::tr("Without loudspeakers, switch the sound off: Tools > Sound.");
  }
  return lines;
}

QString role_of(const ConnectionState& state) {
  if (state.practice) return PanelText::tr("You practise alone.");
  if (!state.joined) return QString("–");
  return state.watching ? PanelText::tr("You watch.") : PanelText::tr("You joined this room as a viewer.");
}

}  // namespace

ConnectionPanel::ConnectionPanel(std::function<ConnectionState()> state, QWidget* parent)
    : QWidget(parent), state_(std::move(state)) {
  auto* form = new QFormLayout;
  form->setRowWrapPolicy(QFormLayout::WrapAllRows);
  room_ = add_row(*form, tr("Room"), "link_room");
  role_ = add_row(*form, tr("Your role"), "link_role");
  server_ = add_row(*form, tr("The server"), "link_server");
  haptic_ = add_row(*form, tr("Haptic client"), "link_haptic");
  device_ = add_row(*form, tr("Its device"), "link_device");
  audio_ = add_row(*form, tr("Audio client"), "link_audio");
  advice_ = add_row(*form, tr("What to do"), "link_advice");
  auto* all = new QVBoxLayout(this);
  all->addLayout(form);
  all->addStretch();
  connect(&timer_, &QTimer::timeout, this, [this] { refresh(); });
}

QLabel* ConnectionPanel::add_row(QFormLayout& form, const QString& what, const char* name) {
  auto* value = new QLabel(QString("–"));
  value->setObjectName(name);
  value->setWordWrap(true);
  value->setTextFormat(Qt::PlainText);
  value->setTextInteractionFlags(Qt::TextSelectableByMouse);
  auto* title = new QLabel(what);
  QFont bold = title->font();
  bold.setBold(true);
  title->setFont(bold);
  title->setBuddy(value);  // names it for screen readers, which then read its value too
  form.addRow(title, value);
  return value;
}

void ConnectionPanel::showEvent(QShowEvent*) {
  refresh();
  timer_.start(kPeriod_ms);
}

void ConnectionPanel::hideEvent(QHideEvent*) { timer_.stop(); }

void ConnectionPanel::refresh() {
  const ConnectionState state = state_();
  const auto put = [](QLabel* label, const QString& text) {
    if (label->text() != text) label->setText(text);
  };
  const QString where = state.room.isEmpty() ? state.address : tr("%1 at %2").arg(state.room, state.address);
  put(room_, where.isEmpty() ? QString("–") : where);
  put(role_, role_of(state));
  put(server_, text_of_server(state));
  put(haptic_, text_of_haptic(state));
  put(device_, text_of_device(state));
  put(audio_, text_of_audio(state));
  const QStringList advice = advice_of(state);
  put(advice_, advice.isEmpty() ? tr("Nothing: everything works.") : advice.join("\n"));
}

}  // namespace osteon
