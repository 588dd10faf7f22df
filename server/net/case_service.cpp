// Cases that are uploaded.
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "common/runtime/log.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/cases.grpc.pb.h"
#include "server/net/called_room.inl"
#include "server/net/services.hpp"

namespace osteon {
namespace {

v1::CaseInfo to_wire(const Digest& hash, const std::string& title, std::uint64_t bytes) {
  v1::CaseInfo info;
  info.set_case_hash(wire::to_wire(hash));
  info.set_title(title);
  info.set_bytes(bytes);
  return info;
}

std::uint64_t bytes_of(const std::filesystem::path& folder) {
  std::uint64_t bytes = 0;
  for (const std::string_view file : kCaseFiles) {
    std::error_code none;
    const std::uint64_t size = std::filesystem::file_size(folder / file, none);
    if (!none) bytes += size;
  }
  return bytes;
}

// One upload. What has come goes to the disk at once, so that none of it waits in memory.
class UploadStream final : public grpc::ServerReadReactor<v1::UploadCaseRequest> {
 public:
  static constexpr std::size_t kMostPiece = 1 << 20;

  UploadStream(Rooms& rooms, v1::UploadCaseResponse* response) : rooms_(rooms), response_(response) {}

  void start() {
    if (rooms_.store() == nullptr)
      return Finish({StatusCode::FAILED_PRECONDITION, "this server takes no cases; start it with --uploads FOLDER"});
    Result<std::unique_ptr<Upload>> upload = rooms_.store()->begin();
    if (!upload) return Finish(status_of(upload.error()));
    upload_ = std::move(*upload);
    StartRead(&request_);
  }

  void OnReadDone(bool ok) override {
    if (!upload_) return;
    // Taken apart and looked through by the thread for what takes long; gRPC keeps this until it has finished.
    if (!ok) return rooms_.jobs.run([this] { Finish(keep()); });
    Result<void> added = request_.data().size() <= kMostPiece
                             ? upload_->add(request_.data())
                             : failure(ErrorCode::invalid_input, "a piece of the upload has more than " + std::to_string(kMostPiece) + " bytes");
    if (added) return StartRead(&request_);
    upload_.reset();
    Finish(status_of(added.error()));
  }
  void OnCancel() override { cancelled_ = true; }
  void OnDone() override { delete this; }

 private:
  Status keep() {
    // A sender who is gone, or a server that stops: nobody waits for it.
    const auto stop = [this] { return cancelled_ || rooms_.ending(); };
    if (stop()) return {StatusCode::CANCELLED, "the upload was given up"};
    const Result<StoredCase> stored = rooms_.store()->keep(std::move(upload_), stop);
    if (!stored) {
      log::warn("upload refused", {{"reason", stored.error().message}});
      return status_of(stored.error());
    }
    // What is read here was written by the process that looked it through, not by whoever sent it.
    Result<Case> bone = Case::load(stored->folder);
    if (!bone) return status_of(bone.error());
    rooms_.add_case({std::move(*bone), stored->folder});
    log::info("case uploaded", {{"hash", to_hex(stored->hash)}, {"title", stored->title}, {"bytes", stored->bytes}});
    *response_->mutable_stored() = to_wire(stored->hash, stored->title, stored->bytes);
    response_->set_known(stored->known);
    return Status::OK;
  }

  Rooms& rooms_;
  v1::UploadCaseResponse* const response_;
  v1::UploadCaseRequest request_;
  std::unique_ptr<Upload> upload_;
  std::atomic<bool> cancelled_{false};
};

class CaseServiceImpl final : public v1::CaseService::CallbackService {
 public:
  explicit CaseServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  grpc::ServerReadReactor<v1::UploadCaseRequest>* UploadCase(grpc::CallbackServerContext*, v1::UploadCaseResponse* response) override {
    auto* stream = new UploadStream(rooms_, response);  // deletes itself in OnDone
    stream->start();
    return stream;
  }
  grpc::ServerUnaryReactor* ListCases(grpc::CallbackServerContext* context, const v1::ListCasesRequest*,
                                      v1::ListCasesResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    rooms_.files.run([this, reactor, response] {
      for (const ServedCase* one : rooms_.cases()) *response->add_cases() = to_wire(one->bone.hash(), one->bone.info().title, bytes_of(one->folder));
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
