// The window's part of the sound: the socket to the audio client, the dialog, and the stored settings.
#pragma once
#include <QCoreApplication>
#include <QObject>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "common/input/sound_link.hpp"
#include "common/wire/credentials.hpp"
#include "viewer_client/desktop/sound_dialog.hpp"

namespace osteon {

// The command by which osteon-audio plays a room that others run, with the window's own way to its server.
[[nodiscard]] QString listening_command(const QString& address, const QString& room,
                                        const wire::ClientCredentials& credentials);

// [GUI thread]
class SoundControl : public QObject {
  Q_DECLARE_TR_FUNCTIONS(SoundControl)

 public:
  struct Events {
    std::function<void(bool on)> switched;                // the sound is on or off now
    std::function<void(const QString& sentence)> notice;  // why there is no sound
  };
  // Begins with the stored settings. `window`: the dialog's parent.
  SoundControl(Events events, QWidget* window);  // owned by the window

  // Makes the socket for the audio client of the next room. Errors: those of SoundServer::listen().
  [[nodiscard]] Result<void> listen(const std::filesystem::path& socket);
  // The next room is one that others run. `command`: what plays it, for the user to start.
  void join(const QString& command);
  void close();  // removes the socket, and forgets the command
  [[nodiscard]] bool on() const { return chosen_.on; }
  void set_on(bool on);
  void show_dialog();
  // Sends the settings and shows the newest report. Call it at the pace of the gauges.
  void refresh();
  // None: there is no audio client, or it has not reported yet.
  [[nodiscard]] std::optional<SoundReport> report();

 private:
  void choose(const SoundDialog::Chosen& chosen);
  void send();
  [[nodiscard]] QString missing() const;  // why there is no report

  Events events_;
  QWidget* window_;
  SoundDialog::Chosen chosen_;
  std::unique_ptr<SoundServer> server_;
  QString command_;                // of a room that others run; empty: in no such room
  SoundDialog* dialog_ = nullptr;  // the window's
  std::string trouble_;            // the one that notice got last
};

}  // namespace osteon
