// The service for uploaded cases.
#include <grpcpp/alarm.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/cases.grpc.pb.h"
#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

v1::CaseInfo to_wire(const Digest& hash, const std::string& title, std::uint64_t bytes) {
  v1::CaseInfo info;
  info.set_case_hash(wire::to_wire(hash));
  info.set_title(title);
  info.set_bytes(bytes);
  return info;
}

std::uint64_t folder_bytes(const std::filesystem::path& folder) {
  std::uint64_t bytes = 0;
  for (const std::string_view file : kCaseFiles) {
    std::error_code none;
    const std::uint64_t size = std::filesystem::file_size(folder / file, none);
    if (!none) bytes += size;
  }
  return bytes;
}

// One upload. Received data is written to the disk at once, so that none of it waits in memory. An upload ends when its
// sender's right ends or when it takes too long, since there are only few concurrent uploads.
class UploadStream final : public grpc::ServerReadReactor<v1::UploadCaseRequest> {
 public:
  static constexpr std::size_t kMostPiece = 1 << 20;
  static constexpr std::string_view kMethod = "/osteon.v1.CaseService/UploadCase";

  UploadStream(Rooms& rooms, v1::UploadCaseResponse* response)
      : rooms_(rooms), store_(rooms.case_repository()), response_(response) {}

  // gRPC holds the stream until OnDone. The thread that validates cases, the authorizer and the alarm may hold it
  // longer.
  static UploadStream* launch(const std::shared_ptr<UploadStream>& stream, const Result<Caller>& caller) {
    stream->self_ = stream;
    stream->start(caller);
    return stream.get();
  }

  // Makes a stream that only ends.
  static UploadStream* refuse(const std::shared_ptr<UploadStream>& stream, Status why) {
    stream->self_ = stream;
    stream->end(std::move(why));
    return stream.get();
  }

  void OnReadDone(bool ok) override {
    MutexLock lock(mutex_);
    if (finished_ || !upload_) return;
    if (!ok) {
      // The validation thread unpacks and checks it.
      whole_ = true;
      lock.unlock();
      return rooms_.checks.run([this, keep = self_] { keep_case(); });
    }
    newest_ = Clock::now();
    Result<void> added = request_.data().size() <= kMostPiece
                             ? upload_->add(request_.data())
                             : failure(ErrorCode::invalid_input,
                                       "a piece of the upload has more than " + std::to_string(kMostPiece) + " bytes");
    if (!added) return finish(status_of(added.error()));
    StartRead(&request_);
  }
  void OnCancel() override { cancelled_ = true; }
  void OnDone() override {
    {
      const MutexLock lock(mutex_);
      finished_ = true;  // the alarm is not set any more
      alarm_.reset();
      if (!whole_) upload_.reset();
    }
    watched_.reset();
    const std::shared_ptr<UploadStream> last = std::move(self_);
  }

 private:
  using Clock = std::chrono::steady_clock;

  void start(const Result<Caller>& caller) {
    const MutexLock lock(mutex_);
    if (!caller) return finish(status_of(caller.error()));
    if (!store_)
      return finish({StatusCode::FAILED_PRECONDITION, "this server takes no cases; start it with --uploads FOLDER"});
    if (rooms_.authorizer) {
      auto entered = rooms_.authorizer->enter(*caller, caller->room, {}, kMethod,
                                              [weak = std::weak_ptr(self_)](const Refusal& why) {
                                                if (const auto self = weak.lock()) self->end(status_of(why));
                                              });
      if (!entered) return finish(status_of(entered.error()));
      watched_ = std::move(*entered);
    }
    Result<std::unique_ptr<Upload>> upload = store_->begin();
    if (!upload) return finish(status_of(upload.error()));
    upload_ = std::move(*upload);
    began_ = newest_ = Clock::now();
    set_alarm();
    StartRead(&request_);
  }

  void end(Status why) {
    cancelled_ = true;  // also for a case that is being validated
    const MutexLock lock(mutex_);
    finish(std::move(why));
  }
  // Only the first call has an effect.
  void finish(Status status) OSTEON_REQUIRES(mutex_) {
    if (std::exchange(finished_, true)) return;
    if (!status.ok()) log::warn("upload refused", {{"reason", status.error_message()}});
    if (!whole_) upload_.reset();
    Finish(std::move(status));
  }

  [[nodiscard]] Clock::time_point due() const OSTEON_REQUIRES(mutex_) {
    return std::min(newest_ + store_->quota().idle, began_ + store_->quota().sending);
  }
  void set_alarm() OSTEON_REQUIRES(mutex_) {
    const Clock::duration until = std::max<Clock::duration>(due() - Clock::now(), Clock::duration(0));
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until);
    alarm_ = std::make_unique<grpc::Alarm>();
    alarm_->Set(std::chrono::system_clock::now() + left, [weak = std::weak_ptr(self_)](bool rang) {
      if (const auto self = rang ? weak.lock() : nullptr) self->look_at_the_clock();
    });
  }
  // Once all data has come, the validation has its own time limit.
  void look_at_the_clock() {
    const MutexLock lock(mutex_);
    if (finished_ || whole_) return;
    if (Clock::now() < due()) return set_alarm();
    const bool idle = due() < began_ + store_->quota().sending;
    const auto limit = std::chrono::ceil<std::chrono::seconds>(idle ? store_->quota().idle : store_->quota().sending);
    const std::string seconds = std::to_string(limit.count()) + " s";
    finish({StatusCode::DEADLINE_EXCEEDED,
            idle ? "nothing of the upload came for " + seconds + "; send it again"
                 : "the upload took longer than the " + seconds + " that it may; send it again over a faster line"});
  }

  // [thread that validates cases]
  void keep_case() {
    // The sender is gone or the server stops: nobody waits for the result.
    const auto stop = [this] { return cancelled_ || rooms_.ending(); };
    Result<StoredCase> stored =
        stop() ? failure(ErrorCode::cancelled, "the upload was given up") : Result<StoredCase>{};
    if (stored) stored = store_->keep(std::move(upload_), stop);
    upload_.reset();
    if (stored) {
      rooms_.add_case({stored->hash, stored->title, stored->folder, stored->memory_bytes});
      log::info("case uploaded", {{"hash", to_hex(stored->hash)}, {"title", stored->title}, {"bytes", stored->bytes}});
    }
    const MutexLock lock(mutex_);
    if (!stored)
      return finish(stop() ? Status{StatusCode::CANCELLED, "the upload was given up"} : status_of(stored.error()));
    if (!finished_) {
      *response_->mutable_stored() = to_wire(stored->hash, stored->title, stored->bytes);
      response_->set_known(stored->known);
    }
    finish(Status::OK);
  }

  Rooms& rooms_;
  const std::shared_ptr<CaseRepository> store_;  // shared with the rooms; outlives the uploads
  v1::UploadCaseResponse* const response_;       // valid until the call has finished
  v1::UploadCaseRequest request_;
  std::atomic<bool> cancelled_{false};
  std::shared_ptr<OpenStream> watched_;  // shared with the authorizer while it ends the stream
  Mutex mutex_{LockRank::upload};
  std::shared_ptr<UploadStream> self_;
  std::unique_ptr<Upload> upload_;  // under mutex_; once all data has come, used by the validation thread alone
  std::unique_ptr<grpc::Alarm> alarm_ OSTEON_GUARDED_BY(mutex_);
  Clock::time_point began_ OSTEON_GUARDED_BY(mutex_), newest_ OSTEON_GUARDED_BY(mutex_);
  bool whole_ OSTEON_GUARDED_BY(mutex_) = false, finished_ OSTEON_GUARDED_BY(mutex_) = false;
};

class CaseServiceImpl final : public v1::CaseService::CallbackService {
 public:
  explicit CaseServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  grpc::ServerReadReactor<v1::UploadCaseRequest>* UploadCase(grpc::CallbackServerContext* context,
                                                             v1::UploadCaseResponse* response) override {
    auto stream = std::make_shared<UploadStream>(rooms_, response);  // see launch()
    if (auto why = refusal_of<v1::UploadCaseRequest>(rooms_, *context))
      return UploadStream::refuse(stream, std::move(*why));
    return UploadStream::launch(stream, caller_of(rooms_, *context));
  }
  grpc::ServerUnaryReactor* ListCases(grpc::CallbackServerContext* context, const v1::ListCasesRequest*,
                                      v1::ListCasesResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::ListCasesRequest>(rooms_, *context, reactor)) return reactor;
    rooms_.files.run([this, reactor, response] {
      for (const KnownCase& one : rooms_.cases())
        *response->add_cases() = to_wire(one.hash, one.title, folder_bytes(one.folder));
      reactor->Finish(Status::OK);
    });
    return reactor;
  }

 private:
  Rooms& rooms_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_case_service(Rooms& rooms) { return std::make_unique<CaseServiceImpl>(rooms); }

}  // namespace osteon
