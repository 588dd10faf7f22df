// Sends a case to a server: packs it with osteon-import, uploads the file, and opens a room with it. The case on this
// computer stays as it is.
#pragma once
#include <QCoreApplication>
#include <QObject>
#include <QString>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <thread>

#include "common/core/keep_going.hpp"
#include "common/wire/case_client.hpp"
#include "viewer_client/desktop/importer_run.hpp"
#include "viewer_client/desktop/server_fields.hpp"

namespace osteon {

// [GUI thread] Its destructor stops it.
class CaseSending : public QObject {
  Q_DECLARE_TR_FUNCTIONS(CaseSending)

 public:
  enum class Stage { packing, connecting, sending, checking, opening };
  struct Events {  // all in the GUI thread
    std::function<void(Stage stage)> stage;
    std::function<void(int percent)> progress;  // of packing and sending
    // One sentence. `room`: the room that is open with the case; empty: none.
    std::function<void(const QString& sentence, const QString& room)> sent;
    std::function<void(const QString& sentence)> failed;  // empty: cancelled, and the server stored nothing
  };
  // `what`: the folder of a case, or a file with one. `to.room`: the room to open; empty: none.
  CaseSending(std::filesystem::path what, RoomAddress to, Events events);
  ~CaseSending() override;

  void start();
  // Then `failed` tells so.
  void cancel();
  // Cancels, and waits until the server is let go.
  void stop();
  // After stop(), or within `sent` or `failed`: the server has the case, or it had all of it and gave no answer.
  [[nodiscard]] bool server_may_have_it() const { return server_may_have_it_; }

 private:
  void pack();
  void send(const std::filesystem::path& archive);
  // [own thread]
  void work(const std::filesystem::path& archive);
  void open_room(const std::shared_ptr<grpc::Channel>& channel, const Digest& hash);
  void show(Stage stage);
  [[nodiscard]] KeepGoing keep_going();
  // Runs it in the GUI thread, unless this object is gone by then.
  void in_gui(std::function<void()> call);

  void fail(const QString& sentence);

  const std::filesystem::path what_;
  const RoomAddress to_;
  const Events events_;
  const std::filesystem::path scratch_;  // folder of the packed case; it goes with this object
  std::unique_ptr<ImporterRun> packer_;
  std::atomic<bool> cancelled_{false}, server_may_have_it_{false};
  Stage shown_ = Stage::packing;  // the own thread's, as the next one
  int percent_ = -1;
  std::thread thread_;
};

}  // namespace osteon
