// "Practise alone": a room on this computer. It starts a server, a haptic client and an audio client as children on
// loopback, watches them, starts them again when they die, and ends them.
#pragma once
#include <QCoreApplication>
#include <QObject>
#include <QString>
#include <QTimer>
#include <filesystem>
#include <functional>
#include <memory>

#include "viewer_client/desktop/child_process.hpp"
#include "viewer_client/desktop/connection_panel.hpp"
#include "viewer_client/desktop/file_lock.hpp"

namespace osteon {

struct PracticeOptions {
  std::filesystem::path bone;     // folder of the case
  std::filesystem::path folder;   // of the session: journal, logs. It is made if it is missing.
  std::filesystem::path cache;    // where the haptic client keeps cases
  std::filesystem::path pointer;  // socket of the window's pointer
  std::filesystem::path sound_socket;
  QString hand_name;     // of the haptic client; others in the room see it
  QString tool;          // that the hand holds first
  QString force_choice;  // as --force-choice of the haptic client names it
  bool sound = true;
};

// [GUI thread]
class PracticeRoom : public QObject {
  Q_DECLARE_TR_FUNCTIONS(PracticeRoom)

 public:
  struct Events {
    std::function<void(const QString& address)> opened;   // the server takes clients; after its restart again
    std::function<void(const QString& sentence)> notice;  // a child died and is started again, or there is no sound
    std::function<void(const QString& sentence)> failed;  // the room has ended for good
  };

  PracticeRoom(PracticeOptions options, Events events);
  // Ends the clients first, then the server, all within two seconds. It kills what does not obey.
  ~PracticeRoom() override;

  void start();
  [[nodiscard]] ProgramState server_state() const { return state_of(server_.get(), server_past_); }
  [[nodiscard]] ProgramState haptic_state() const { return state_of(haptic_.get(), haptic_past_); }
  [[nodiscard]] ProgramState audio_state() const { return state_of(audio_.get(), audio_past_); }
  // Starts the audio client when the sound is wanted for the first time. Its socket switches it off and on again.
  void want_sound();
  // The haptic client ends and starts again, to show force in another way.
  void show_force(const QString& choice);

 private:
  // Why a program ended, as a sentence that names it.
  [[nodiscard]] static QString end_of(const ChildProcess& child);
  // What became of a program before.
  struct Past {
    int restarts = 0;
    QString why;  // it ended last
    bool given_up = false;
  };

  [[nodiscard]] static ProgramState state_of(const ChildProcess* child, const Past& past);
  void start_server();
  void look_for_address();
  void start_haptic();
  void start_audio();
  void server_ended();
  void haptic_ended();
  void audio_ended();
  [[nodiscard]] QString log_file(const QString& program) const;
  [[nodiscard]] QString address_file() const;
  void fail(const QString& sentence);

  PracticeOptions options_;
  Events events_;
  QTimer address_timer_;
  QString address_;
  // of children that died soon after their start, one after the other
  int server_deaths_ = 0, haptic_deaths_ = 0, audio_deaths_ = 0;
  std::unique_ptr<FileLock> session_;  // while the room is there
  bool over_ = false;
  bool haptic_renewed_ = false;  // its end is wanted: it is to start with other options
  Past server_past_, haptic_past_, audio_past_;
  std::unique_ptr<ChildProcess> server_, haptic_, audio_;
};

}  // namespace osteon
