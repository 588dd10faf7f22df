#include "viewer_client/desktop/case_sending.hpp"

#include <QMetaObject>
#include <chrono>
#include <system_error>
#include <utility>

#include "common/wire/room_client.hpp"
#include "viewer_client/desktop/field_sentences.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {

namespace {
// For the connection. Where nothing listens, a server may be about to start.
constexpr std::chrono::seconds kReachPatience{10}, kRefusedPatience{1};
constexpr const char* kArchive = "case.osteon";
}  // namespace

// StaleFiles knows a folder of this name as that of a program that was killed.
CaseSending::CaseSending(std::filesystem::path what, RoomAddress to, Events events)
    : what_(std::move(what)),
      to_(std::move(to)),
      events_(std::move(events)),
      scratch_(cases_folder() / (".partial-send-" + std::to_string(QCoreApplication::applicationPid()))) {}

CaseSending::~CaseSending() {
  stop();
  std::error_code ignored;
  std::filesystem::remove_all(scratch_, ignored);
}

void CaseSending::start() { is_file(what_) ? send(what_) : pack(); }

void CaseSending::cancel() {
  cancelled_ = true;
  if (packer_) packer_->cancel();
}

void CaseSending::stop() {
  cancelled_ = true;
  packer_.reset();
  if (thread_.joinable()) thread_.join();
}

void CaseSending::fail(const QString& sentence) { events_.failed(cancelled_ ? QString() : sentence); }

// Only the user may read the file: it has a patient's scan.
void CaseSending::pack() {
  std::error_code error;
  std::filesystem::remove_all(scratch_, error);
  std::filesystem::create_directories(scratch_, error);
  if (!error) std::filesystem::permissions(scratch_, std::filesystem::perms::owner_all, error);
  if (error) return fail(tr("Cannot make the folder %1. Choose a place where you may write.").arg(text_of(scratch_)));
  events_.stage(Stage::packing);
  const std::filesystem::path archive = scratch_ / kArchive;
  packer_ =
      std::make_unique<ImporterRun>(QStringList{"pack", text_of(what_), text_of(archive)}, text_of(scratch_ / "log"),
                                    ImporterRun::Events{[this](int percent) { events_.progress(percent); },
                                                        [this, archive](const QString&) {
                                                          packer_.release()->deleteLater();
                                                          cancelled_ ? fail({}) : send(archive);
                                                        },
                                                        [this](const QString& sentence) {
                                                          packer_.release()->deleteLater();
                                                          fail(sentence);
                                                        }});
  packer_->start();
}

void CaseSending::send(const std::filesystem::path& archive) {
  events_.stage(Stage::connecting);
  shown_ = Stage::connecting;
  thread_ = std::thread([this, archive] { work(archive); });
}

void CaseSending::in_gui(std::function<void()> call) {
  QMetaObject::invokeMethod(this, std::move(call), Qt::QueuedConnection);
}

void CaseSending::show(Stage stage) {
  if (std::exchange(shown_, stage) != stage)
    in_gui([this, stage] {
      if (!cancelled_) events_.stage(stage);
    });
}

KeepGoing CaseSending::keep_going() {
  return [this](double fraction) {
    if (cancelled_) return false;
    const int percent = static_cast<int>(100.0 * fraction);
    if (shown_ != Stage::opening) show(fraction >= 1.0 ? Stage::checking : Stage::sending);
    if (shown_ == Stage::sending && std::exchange(percent_, percent) != percent)
      in_gui([this, percent] { events_.progress(percent); });
    return true;
  };
}

void CaseSending::work(const std::filesystem::path& archive) {
  const auto failed = [this](const Error& error) {
    in_gui([this, why = sentence_of(error), has_all = shown_ == Stage::checking] {
      cancelled_&& has_all ? events_.failed(tr("Cancelled. A server that had already checked the case may have it."))
                           : fail(why);
    });
  };
  // As the administrator's program: while the server checks, a slow answer is awaited.
  const auto channel = wire::reach_server(
      to_.address.toStdString(), wire::ClientKind::haptic, {kReachPatience, kRefusedPatience},
      [this] { return cancelled_.load(); }, to_.credentials);
  if (!channel) return failed(channel.error());
  show(Stage::sending);
  const auto stored = wire::upload_case(*channel, archive, keep_going());
  const bool unanswered =
      !stored && (stored.error().code == ErrorCode::cancelled || stored.error().code == ErrorCode::unavailable);
  server_may_have_it_ = stored || (unanswered && shown_ == Stage::checking);
  if (!stored) return failed(stored.error());
  if (!to_.room.isEmpty()) return open_room(*channel, stored->hash);
  in_gui([this, known = stored->known] {
    events_.sent(known ? tr("%1 had the case already.").arg(to_.address) : tr("%1 has the case now.").arg(to_.address),
                 {});
  });
}

void CaseSending::open_room(const std::shared_ptr<grpc::Channel>& channel, const Digest& hash) {
  show(Stage::opening);
  const auto opened = wire::create_room_with(channel, to_.room.toStdString(), hash, keep_going());
  if (opened)
    return in_gui([this] {
      events_.sent(tr("%1 has the case, and the room %2 is open with it.").arg(to_.address, to_.room), to_.room);
    });
  in_gui([this, why = sentence_of(opened.error())] {
    events_.failed(cancelled_ ? tr("Cancelled. %1 has the case, and the room may be open.").arg(to_.address)
                              : tr("%1 has the case, but did not open the room: %2").arg(to_.address, why));
  });
}

}  // namespace osteon
