#include "viewer_client/desktop/sound_control.hpp"

#include <QRegularExpression>
#include <QSettings>
#include <algorithm>
#include <utility>

namespace osteon {

namespace {
constexpr const char* kOnKey = "sound/on";
constexpr const char* kVolumeKey = "sound/volume";  // percent

// As a shell reads it as one word.
QString shell_word(const QString& text) {
  static const QRegularExpression special("[^A-Za-z0-9_./:=,@%+-]");
  if (!text.isEmpty() && !text.contains(special)) return text;
  return "'" + QString(text).replace("'", "'\\''") + "'";
}
}  // namespace

QString listening_command(const QString& address, const QString& room, const wire::ClientCredentials& credentials) {
  QString command = "osteon-audio --server " + shell_word(address);
  if (!room.isEmpty()) command += " --room " + shell_word(room);
  if (credentials.certificates.empty()) return command + " --plain";
  return command + " --certificates " + shell_word(QString::fromStdString(credentials.certificates.string())) +
         " --ticket " + shell_word(QString::fromStdString(credentials.ticket.string()));
}

SoundControl::SoundControl(Events events, QWidget* window)
    : QObject(window), events_(std::move(events)), window_(window) {
  const QSettings settings;
  chosen_.on = settings.value(kOnKey, true).toBool();
  chosen_.percent = std::clamp(settings.value(kVolumeKey, 100).toInt(), 0, 100);
}

Result<void> SoundControl::listen(const std::filesystem::path& socket) {
  auto made = SoundServer::listen(socket);
  if (!made) return tl::unexpected(made.error());
  server_ = std::move(*made);
  return {};
}

void SoundControl::join(const QString& command) {
  command_ = command;
  refresh();
}

void SoundControl::close() {
  server_.reset();
  command_.clear();
  trouble_.clear();
  refresh();
}

void SoundControl::choose(const SoundDialog::Chosen& chosen) {
  const bool switched = chosen.on != chosen_.on;
  chosen_ = chosen;
  QSettings settings;
  settings.setValue(kOnKey, chosen_.on);
  settings.setValue(kVolumeKey, chosen_.percent);
  send();
  if (switched) events_.switched(chosen_.on);
  if (switched && chosen_.on && !command_.isEmpty()) events_.notice(missing());
}

void SoundControl::set_on(bool on) {
  if (dialog_ != nullptr) dialog_->set_on(on);
  choose({on, chosen_.percent});
}

void SoundControl::show_dialog() {
  if (dialog_ == nullptr)
    dialog_ = new SoundDialog(
        chosen_, [this](const SoundDialog::Chosen& chosen) { choose(chosen); }, window_);
  dialog_->show();
  refresh();
  dialog_->raise();
  dialog_->activateWindow();
}

void SoundControl::send() {
  if (server_) server_->send({amplitude_of(chosen_.percent), chosen_.on});
}

void SoundControl::refresh() {
  send();
  const std::optional<SoundReport> heard = report();
  if (heard && heard->trouble != trouble_) {
    trouble_ = heard->trouble;
    if (!trouble_.empty() && chosen_.on) events_.notice(tr("There is no sound: %1").arg(sound_trouble(trouble_)));
  }
  if (dialog_ != nullptr && dialog_->isVisible()) dialog_->show_report(heard, missing());
}

QString SoundControl::missing() const {
  if (!command_.isEmpty())
    return tr("The window plays only the rooms that it opened. To hear this one, start: %1").arg(command_);
  if (!server_) return tr("Only a practice room has sound. Open a bone first.");
  return chosen_.on ? tr("The audio client has not reported yet.") : tr("The sound is off.");
}

std::optional<SoundReport> SoundControl::report() { return server_ ? server_->newest() : std::nullopt; }

}  // namespace osteon
