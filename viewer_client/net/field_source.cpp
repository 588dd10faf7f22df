#include "viewer_client/net/field_source.hpp"

#include <grpcpp/grpcpp.h>

#include <optional>
#include <string>
#include <utility>

#include "common/field/kernel.hpp"
#include "common/wire/case_files.hpp"
#include "osteon/v1/field.grpc.pb.h"
#include "viewer_client/net/open_requests.hpp"

namespace osteon {
namespace {

using Clock = std::chrono::steady_clock;

class ServerField final : public FieldSource {
 public:
  explicit ServerField(FieldSourceOptions options) : options_(std::move(options)) {}

  Result<Case> imported() override {
    const wire::JoinedRoom room = options_.room();
    const wire::FetchControl control{.begin = [this](grpc::ClientContext& call) { return calls_.add(call); },
                                     .end = [this](grpc::ClientContext& call) { calls_.remove(call); }};
    Result<Case> bone = cached_case(options_.cache, room.case_hash, [&](const std::filesystem::path& folder) {
      return wire::fetch_case_files(room, folder, control);
    });
    if (bone) {
      fetched_ = room.case_hash;
      refused_since_.reset();
    } else {
      judge(bone.error());
    }
    if (!bone && bone.error().code == ErrorCode::internal)
      bone.error().message += "; make space there, or set XDG_CACHE_HOME to another folder";
    return bone;
  }

  End read(const std::function<bool(const v1::WatchFieldResponse&)>& take) override {
    const wire::JoinedRoom room = options_.room();
    // The leaves of another case do not belong to the bone that was fetched.
    if (room.case_hash != fetched_)
      return {{ErrorCode::unsupported, "the server now has another case: join the room again to see it"}, true};
    v1::WatchFieldRequest request;
    request.set_author(room.author.value);
    request.set_kernel_version(kKernelVersion);
    grpc::ClientContext context;
    if (!calls_.add(context)) return {{ErrorCode::cancelled, "it ends"}};
    const auto reader = v1::FieldService::NewStub(room.channel)->WatchField(&context, request);
    v1::WatchFieldResponse message;
    while (reader->Read(&message)) {
      refused_since_.reset();
      if (take(message)) continue;
      context.TryCancel();
      break;
    }
    const grpc::Status status = reader->Finish();
    calls_.remove(context);
    return end_of(status);
  }

  void cancel() override { calls_.cancel_all(); }

 private:
  // As of a stream: a server that refuses the case may be a restarted one.
  void judge(Error& why) {
    const bool refused = why.code == ErrorCode::denied || why.code == ErrorCode::not_found;
    if (refused && !stays_refused()) why.code = ErrorCode::unavailable;
    if (!refused) refused_since_.reset();
  }
  [[nodiscard]] End end_of(const grpc::Status& status) {
    const std::string said =
        status.error_message().empty() ? "the server closed the connection" : status.error_message();
    switch (status.error_code()) {
      case grpc::StatusCode::UNIMPLEMENTED:
        return {{ErrorCode::unsupported,
                 "the server is older than this viewer and does not send the inside of the bone; install a newer "
                 "Osteon where it runs"},
                true};
      case grpc::StatusCode::FAILED_PRECONDITION:
        return {{ErrorCode::unsupported, said}, true};
      case grpc::StatusCode::ABORTED:  // the room cannot go on
        return {{ErrorCode::unavailable, said}, true};
      case grpc::StatusCode::PERMISSION_DENIED:
      case grpc::StatusCode::UNAUTHENTICATED:
        return {{ErrorCode::denied, said}, stays_refused()};
      case grpc::StatusCode::INVALID_ARGUMENT:
      case grpc::StatusCode::NOT_FOUND:
        return {{ErrorCode::unavailable, said}, stays_refused()};
      default:
        refused_since_.reset();  // a server that is away or busy refuses nobody
        return {{ErrorCode::unavailable, said}};
    }
  }
  // Whether nothing else was answered for too long.
  [[nodiscard]] bool stays_refused() {
    if (!refused_since_) refused_since_ = Clock::now();
    return Clock::now() - *refused_since_ >= options_.patience;
  }

  const FieldSourceOptions options_;
  OpenRequests calls_;
  Digest fetched_;  // the case of imported()
  std::optional<Clock::time_point> refused_since_;
};

}  // namespace

std::unique_ptr<FieldSource> field_of_server(FieldSourceOptions options) {
  return std::make_unique<ServerField>(std::move(options));
}

}  // namespace osteon
