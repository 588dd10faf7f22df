// The window's part of the sound: the socket to the audio client, the dialog, and the stored settings.
#pragma once
#include <QCoreApplication>
#include <QObject>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "common/input/sound_link.hpp"
#include "viewer_client/desktop/sound_dialog.hpp"

namespace osteon {

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
  void close();  // removes the socket
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
  SoundDialog* dialog_ = nullptr;  // the window's
  std::string trouble_;            // the one that notice got last
};

}  // namespace osteon
