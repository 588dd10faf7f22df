#include "common/wire/case_client.hpp"

#include <grpcpp/grpcpp.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <optional>
#include <system_error>

#include "common/wire/convert.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/cases.grpc.pb.h"
#include "osteon/v1/rooms.grpc.pb.h"

namespace osteon::wire {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPieceBytes = 256 * 1024;
constexpr auto kLookPeriod = 50ms;  // how often the caller may stop a call

Result<StoredCaseLine> line_of(const v1::CaseInfo& info) {
  const Result<Digest> hash = digest_from_wire(info.case_hash());
  if (!hash) return failure(ErrorCode::unsupported, "the server does not answer as an Osteon server does");
  return StoredCaseLine{*hash, info.title(), info.bytes()};
}

// Waits for the operations of one call, and cancels it when the caller stops. A cancelled call still ends all of them.
class WatchedCall {
 public:
  explicit WatchedCall(const KeepGoing& keep_going) : keep_going_(keep_going) {}
  ~WatchedCall() {
    queue_.Shutdown();
    void* tag = nullptr;
    bool is_ok = false;
    while (queue_.Next(&tag, &is_ok)) {
    }
  }
  WatchedCall(const WatchedCall&) = delete;
  WatchedCall& operator=(const WatchedCall&) = delete;

  [[nodiscard]] grpc::ClientContext& context() { return context_; }
  [[nodiscard]] grpc::CompletionQueue& queue() { return queue_; }
  [[nodiscard]] bool stopped() const { return stopped_; }

  // True: the only operation at work succeeded.
  [[nodiscard]] bool wait(double fraction) {
    void* tag = nullptr;
    bool is_ok = false;
    look(fraction);
    while (queue_.AsyncNext(&tag, &is_ok, std::chrono::system_clock::now() + kLookPeriod) ==
           grpc::CompletionQueue::NextStatus::TIMEOUT)
      look(fraction);
    return is_ok;
  }

 private:
  void look(double fraction) {
    if (stopped_ || !keep_going_ || keep_going_(fraction)) return;
    stopped_ = true;
    context_.TryCancel();
  }

  const KeepGoing& keep_going_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  bool stopped_ = false;
};

// Of a call that began when the server was there. A server that ends gives up its calls.
// `remedy`: what to do when it is lost.
Error error_of_call(const grpc::Status& status, const std::string& remedy) {
  if (std::optional<Error> http = error_of_http(status.error_message(), "the server")) return std::move(*http);
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::CANCELLED:
      return {ErrorCode::unavailable,
              "the connection to the server was lost before it answered; see whether the server runs, and " + remedy};
    case grpc::StatusCode::UNIMPLEMENTED:
      return {ErrorCode::unsupported, "the server is not an Osteon server of this version"};
    default:
      return error_of_answer(status);
  }
}

}  // namespace

Error error_of_answer(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::INVALID_ARGUMENT:
      return {ErrorCode::invalid_input, status.error_message()};
    case grpc::StatusCode::NOT_FOUND:
      return {ErrorCode::not_found, status.error_message()};
    case grpc::StatusCode::ALREADY_EXISTS:
      return {ErrorCode::exists, status.error_message()};
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::DEADLINE_EXCEEDED:  // of the server: no call here has a deadline
      return {ErrorCode::unavailable, status.error_message()};
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return {ErrorCode::exhausted, status.error_message()};
    case grpc::StatusCode::UNAUTHENTICATED:
    case grpc::StatusCode::PERMISSION_DENIED:
      return {ErrorCode::denied, "the server does not do that for you: " + status.error_message()};
    case grpc::StatusCode::INTERNAL:
      return {ErrorCode::internal, status.error_message()};
    default:
      return {ErrorCode::unavailable, "the server does not answer: " + status.error_message()};
  }
}

Result<std::vector<StoredCaseLine>> list_cases(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::ClientContext context;
  v1::ListCasesResponse response;
  const grpc::Status status = v1::CaseService::NewStub(channel)->ListCases(&context, {}, &response);
  if (!status.ok()) return tl::unexpected(error_of_answer(status));
  std::vector<StoredCaseLine> lines;
  for (const v1::CaseInfo& info : response.cases()) {
    Result<StoredCaseLine> line = line_of(info);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
  }
  return lines;
}

Result<StoredCaseLine> upload_case(const std::shared_ptr<grpc::Channel>& channel, const std::filesystem::path& archive,
                                   const KeepGoing& keep_going) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(archive, error);
  errno = 0;
  std::ifstream in(archive, std::ios::binary);
  if (!error && !in) error = std::error_code(errno, std::generic_category());
  if (error)
    return failure(ErrorCode::not_found, archive.string() + " cannot be read: " + error.message() +
                                             "; see whether it is there and you may read it");
  v1::UploadCaseResponse response;
  const auto stub = v1::CaseService::NewStub(channel);
  WatchedCall call(keep_going);
  const auto writer = stub->AsyncUploadCase(&call.context(), &response, &call.queue(), nullptr);
  bool is_ok = call.wait(0.0);
  std::string piece(kPieceBytes, '\0');
  std::uint64_t sent = 0;
  const auto fraction = [&] { return size > 0 ? static_cast<double>(sent) / static_cast<double>(size) : 1.0; };
  while (is_ok && (in.read(piece.data(), static_cast<std::streamsize>(kPieceBytes)), in.gcount() > 0)) {
    v1::UploadCaseRequest request;
    request.set_data(piece.data(), static_cast<std::size_t>(in.gcount()));
    writer->Write(request, nullptr);
    is_ok = call.wait(fraction());  // not: the server has said why
    sent += static_cast<std::uint64_t>(in.gcount());
  }
  // Without an end of the data, the server keeps nothing of a file that can no longer be read.
  const bool cut_short = is_ok && sent < size;
  if (cut_short) call.context().TryCancel();
  if (is_ok && !cut_short) {
    writer->WritesDone(nullptr);
    (void)call.wait(fraction());
  }
  grpc::Status status;
  writer->Finish(&status, nullptr);
  (void)call.wait(fraction());
  if (cut_short) return failure(ErrorCode::not_found, archive.string() + " cannot be read to its end; send it again");
  if (call.stopped() && !status.ok()) return stopped_while("sending the case");
  if (!status.ok()) return tl::unexpected(error_of_call(status, "send the case again"));
  Result<StoredCaseLine> line = line_of(response.stored());
  if (line) line->known = response.known();
  return line;
}

Result<void> create_room_with(const std::shared_ptr<grpc::Channel>& channel, const std::string& room,
                              const Digest& case_hash, const KeepGoing& keep_going) {
  v1::CreateRoomRequest request;
  request.set_name(room);
  request.set_case_hash(to_wire(case_hash));
  const auto stub = v1::RoomsService::NewStub(channel);
  WatchedCall call(keep_going);
  // The call names the room, since the role in that room may be higher than the ticket's role.
  call.context().AddMetadata("osteon-room-bin", room);
  v1::CreateRoomResponse response;
  grpc::Status status;
  const auto reader = stub->AsyncCreateRoom(&call.context(), request, &call.queue());
  reader->Finish(&response, &status, nullptr);
  (void)call.wait(0.0);
  if (call.stopped() && !status.ok()) return stopped_while("opening the room");
  if (!status.ok()) return tl::unexpected(error_of_call(status, "join the room: it may be open"));
  return {};
}

}  // namespace osteon::wire
