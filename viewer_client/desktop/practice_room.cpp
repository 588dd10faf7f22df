#include "viewer_client/desktop/practice_room.hpp"

#include <QCoreApplication>
#include <QDir>
#include <QElapsedTimer>
#include <QFile>
#include <chrono>
#include <utility>

namespace osteon {

namespace {

// How often a child may die, one time after the other, before the room gives up.
constexpr int kMostDeaths = 3;
// A child that lived longer than this has begun well. Its death counts as the first one.
constexpr int kSettled_ms = 20000;
constexpr int kAddressPeriod_ms = 30;
constexpr int kRestart_ms = 300;
// Programs that do not hang need a second together. One that hangs must not hold the window, so it is killed. That
// loses nothing that was acknowledged, because the journal syncs before the server acknowledges.
constexpr std::chrono::milliseconds kClientsEnd{1200}, kAllEnd{1700};
constexpr int kEnd_ms = 8000;  // for a child that starts again

}  // namespace

PracticeRoom::PracticeRoom(PracticeOptions options, Events events)
    : options_(std::move(options)), events_(std::move(events)) {
  connect(&address_timer_, &QTimer::timeout, this, [this] { look_for_address(); });
}

PracticeRoom::~PracticeRoom() {
  over_ = true;
  QElapsedTimer since;
  since.start();
  const auto left = [&](std::chrono::milliseconds of) { return of - std::chrono::milliseconds(since.elapsed()); };
  for (ChildProcess* client : {haptic_.get(), audio_.get()})
    if (client != nullptr) client->ask_to_end();
  for (ChildProcess* client : {haptic_.get(), audio_.get()})
    if (client != nullptr) client->end(left(kClientsEnd));
  if (server_) server_->end(left(kAllEnd));
}

QString PracticeRoom::log_file(const QString& program) const {
  return text_of(options_.folder / "logs") + '/' + program + ".log";
}

QString PracticeRoom::address_file() const { return text_of(options_.folder / "logs" / "address"); }

void PracticeRoom::fail(const QString& sentence) {
  if (over_) return;
  over_ = true;
  address_timer_.stop();
  events_.failed(sentence);
}

void PracticeRoom::start() {
  if (!QDir().mkpath(text_of(options_.folder / "logs")))
    return fail(tr("Cannot make the folder %1. Choose a place where you may write.").arg(text_of(options_.folder)));
  session_ = std::make_unique<FileLock>(options_.folder / "window.lock");
  if (session_->usable() && !session_->try_alone()) {
    // A killed window holds its lock until the last of its threads has run. Mesa's thread of the shader cache has nice
    // 19: beside eight busy programs on two processors that took 15 to 21 s, and 0.7 s without it.
    return fail(tr("Another window has this session open. Close it there, or wait until it has ended."));
  }
  start_server();
}

QString PracticeRoom::end_of(const ChildProcess& child) {
  const QString name = child.program().section('/', -1);
  // The last line of a program that was killed is about something else.
  if (child.exitStatus() == QProcess::CrashExit) return tr("%1 was ended by force or crashed.").arg(name);
  const QString said = child.last_sentence();
  return said.isEmpty() ? tr("%1 ended and gave no reason.").arg(name) : said;
}

ProgramState PracticeRoom::state_of(const ChildProcess* child, const Past& past) {
  using Phase = ProgramState::Phase;
  ProgramState state{Phase::off, past.restarts, past.why};
  if (child != nullptr && child->state() != QProcess::NotRunning)
    state.phase = Phase::runs;
  else if (past.given_up)
    state.phase = Phase::ended;
  else if (child != nullptr)
    state.phase = Phase::starts_again;
  return state;
}

void PracticeRoom::start_server() {
  QFile::remove(address_file());
  server_ = std::make_unique<ChildProcess>(log_file("osteon-server"));
  connect(server_.get(), QOverload<int, QProcess::ExitStatus>::of(&QProcess::finished), this,
          [this] { server_ended(); });
  connect(server_.get(), &QProcess::errorOccurred, this, [this](QProcess::ProcessError error) {
    if (error == QProcess::FailedToStart)
      fail(tr("osteon-server is not installed. Install the package osteon-server."));
  });
  // After a restart the server takes its old address, so that clients find it again.
  server_->start(program_path("osteon-server"),
                 {"--case", text_of(options_.bone), "--listen", address_.isEmpty() ? "127.0.0.1:0" : address_,
                  "--plain", "--address-file", address_file(), "--journal",
                  text_of(options_.folder / "session.journal"), "--drain-seconds", "1"});
  address_timer_.start(kAddressPeriod_ms);
}

void PracticeRoom::look_for_address() {
  QFile file(address_file());
  if (!file.open(QIODevice::ReadOnly)) return;
  const QString line = QString::fromUtf8(file.readAll());
  if (!line.endsWith('\n')) return;
  address_timer_.stop();
  address_ = line.trimmed();
  QTimer::singleShot(kSettled_ms, server_.get(), [this] { server_deaths_ = 0; });
  if (!haptic_) start_haptic();
  if (!audio_ && options_.sound) start_audio();
  events_.opened(address_);
}

void PracticeRoom::start_haptic() {
  haptic_ = std::make_unique<ChildProcess>(log_file("osteon-haptic"));
  connect(haptic_.get(), QOverload<int, QProcess::ExitStatus>::of(&QProcess::finished), this,
          [this] { haptic_ended(); });
  connect(haptic_.get(), &QProcess::errorOccurred, this, [this](QProcess::ProcessError error) {
    if (error == QProcess::FailedToStart) fail(tr("osteon-haptic is not installed. Install the package osteon."));
  });
  haptic_->start(program_path("osteon-haptic"),
                 {"--server", address_, "--plain", "--name", options_.hand_name, "--device",
                  "pointer:" + text_of(options_.pointer), "--tool", options_.tool, "--force-choice",
                  options_.force_choice, "--cache", text_of(options_.cache), "--timeout", "60"});
  QTimer::singleShot(kSettled_ms, haptic_.get(), [this] { haptic_deaths_ = 0; });
}

void PracticeRoom::start_audio() {
  audio_ = std::make_unique<ChildProcess>(log_file("osteon-audio"));
  connect(audio_.get(), QOverload<int, QProcess::ExitStatus>::of(&QProcess::finished), this, [this] { audio_ended(); });
  connect(audio_.get(), &QProcess::errorOccurred, this, [this](QProcess::ProcessError error) {
    if (error != QProcess::FailedToStart) return;
    audio_past_.given_up = true;
    audio_past_.why = tr("osteon-audio is not installed. Install the package osteon.");
    events_.notice(tr("There is no sound: %1").arg(audio_past_.why));
  });
  audio_->start(program_path("osteon-audio"), {"--server", address_, "--plain", "--output", "pulse", "--window",
                                               text_of(options_.sound_socket), "--timeout", "60"});
  QTimer::singleShot(kSettled_ms, audio_.get(), [this] { audio_deaths_ = 0; });
}

void PracticeRoom::want_sound() {
  options_.sound = true;
  if (audio_past_.given_up) {  // whoever switches the sound on again wants another attempt
    audio_past_.given_up = false;
    audio_deaths_ = 0;
    audio_.reset();
  }
  if (!audio_ && !address_.isEmpty()) start_audio();
}

void PracticeRoom::show_force(const QString& choice) {
  if (std::exchange(options_.force_choice, choice) == choice) return;
  if (!haptic_ || haptic_->state() == QProcess::NotRunning) return;  // it is about to start
  // A second signal would end it in a hurry. It starts with the newest choice.
  if (std::exchange(haptic_renewed_, true)) return;
  haptic_->terminate();
  QTimer::singleShot(kEnd_ms, haptic_.get(), [child = haptic_.get()] { child->kill(); });
}

void PracticeRoom::server_ended() {
  if (over_) return;
  address_timer_.stop();
  const QString why = server_past_.why = end_of(*server_);
  if (++server_deaths_ >= kMostDeaths || address_.isEmpty()) return fail(why);
  events_.notice(tr("The server ended and starts again. Nothing that it acknowledged is lost."));
  ++server_past_.restarts;
  QTimer::singleShot(kRestart_ms, this, [this] { start_server(); });
}

void PracticeRoom::haptic_ended() {
  if (over_) return;
  if (std::exchange(haptic_renewed_, false)) {
    QTimer::singleShot(0, this, [this] { start_haptic(); });
    return;
  }
  const QString why = haptic_past_.why = end_of(*haptic_);
  if (++haptic_deaths_ >= kMostDeaths) return fail(why);
  events_.notice(tr("The haptic client ended and starts again."));
  ++haptic_past_.restarts;
  QTimer::singleShot(kRestart_ms, this, [this] { start_haptic(); });
}

void PracticeRoom::audio_ended() {
  if (over_) return;
  audio_past_.why = end_of(*audio_);
  if (++audio_deaths_ >= kMostDeaths) {
    audio_past_.given_up = true;
    return events_.notice(tr("There is no sound: %1").arg(audio_past_.why));
  }
  events_.notice(tr("The audio client ended and starts again."));
  ++audio_past_.restarts;
  QTimer::singleShot(kRestart_ms, this, [this] { start_audio(); });
}

}  // namespace osteon
