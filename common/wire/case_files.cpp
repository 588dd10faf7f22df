#include "common/wire/case_files.hpp"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <thread>

#include "common/core/mutex.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/room.grpc.pb.h"

namespace osteon::wire {
namespace {

using Clock = std::chrono::steady_clock;

// Cancels a call of which nothing was heard for too long. The thread that reads cannot: it waits for the next part.
class SilenceLimit {
 public:
  SilenceLimit(grpc::ClientContext& call, std::chrono::milliseconds longest)
      : call_(call), longest_(longest), thread_([this] { watch(); }) {}
  ~SilenceLimit() {
    {
      const MutexLock lock(mutex_);
      over_ = true;
      changed_.notify_all();
    }
    thread_.join();
  }
  SilenceLimit(const SilenceLimit&) = delete;
  SilenceLimit& operator=(const SilenceLimit&) = delete;

  void hear() {
    const MutexLock lock(mutex_);
    heard_ = Clock::now();
  }
  [[nodiscard]] bool exceeded() const {
    const MutexLock lock(mutex_);
    return exceeded_;
  }

 private:
  void watch() {
    MutexLock lock(mutex_);
    while (!over_ && Clock::now() < heard_ + longest_) changed_.wait_until(lock, heard_ + longest_);
    if (over_) return;
    exceeded_ = true;
    call_.TryCancel();
  }

  grpc::ClientContext& call_;
  const std::chrono::milliseconds longest_;
  mutable Mutex mutex_{LockRank::leaf};
  CondVar changed_;
  Clock::time_point heard_ OSTEON_GUARDED_BY(mutex_) = Clock::now();
  bool over_ OSTEON_GUARDED_BY(mutex_) = false, exceeded_ OSTEON_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // the last member: it uses all others
};

// How the server ended the call. Only `unavailable` may be better the next time.
Result<void> outcome_of(const grpc::Status& status) {
  const std::string said = "the server does not send the case: " + status.error_message();
  switch (status.error_code()) {
    case grpc::StatusCode::OK:
      return {};
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNAUTHENTICATED:
      return failure(ErrorCode::denied, said);
    case grpc::StatusCode::NOT_FOUND:
      return failure(ErrorCode::not_found, said);
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::UNIMPLEMENTED:
      return failure(ErrorCode::unsupported, said);
    default:
      return failure(ErrorCode::unavailable, "the server stopped sending the case: " + status.error_message());
  }
}

}  // namespace

Result<void> fetch_case_files(const JoinedRoom& room, const std::filesystem::path& folder,
                              const FetchControl& control) {
  v1::GetCaseRequest request;
  request.set_case_hash(to_wire(room.case_hash));
  grpc::ClientContext context;
  const Error stopped{ErrorCode::cancelled, "stopped while the case was fetched"};
  if (control.begin && !control.begin(context)) return tl::unexpected(stopped);
  const auto reader = v1::RoomService::NewStub(room.channel)->GetCase(&context, request);

  // A correct server sends these names and no others.
  std::optional<Error> failed;
  std::string open_name;
  std::ofstream file;
  v1::GetCaseResponse piece;
  std::optional<SilenceLimit> limit;
  limit.emplace(context, control.longest_silence);
  while (!failed && reader->Read(&piece)) {
    if (control.stop && control.stop()) {
      failed = stopped;
    } else if (piece.file() != "case.json" && piece.file() != "bone.vdb") {
      failed = Error{ErrorCode::unsupported, "the server sent a file that no case has: " + piece.file()};
    } else {
      if (piece.file() != open_name) {
        file.close();
        file.clear();
        file.open(folder / piece.file(), std::ios::binary | std::ios::trunc);
        open_name = piece.file();
      }
      file.write(piece.data().data(), static_cast<std::streamsize>(piece.data().size()));
      file.flush();
      if (!file)
        failed = Error{ErrorCode::internal, "cannot store the case in the cache: " + (folder / open_name).string() +
                                                ": it cannot be written (is the disk full?)"};
    }
    limit->hear();
  }
  if (failed) context.TryCancel();
  const grpc::Status status = reader->Finish();
  const bool silent = limit->exceeded() && !status.ok();
  limit.reset();
  if (control.end) control.end(context);
  if (failed) return tl::unexpected(*failed);
  if (silent)
    return failure(ErrorCode::unavailable, "the server stopped sending the case: nothing came for " +
                                               std::to_string(control.longest_silence.count()) + " ms");
  return outcome_of(status);
}

}  // namespace osteon::wire
