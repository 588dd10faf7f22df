// Answers calls that no service of this server has.
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <optional>
#include <utility>

#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

class RefusedCall final : public grpc::ServerGenericBidiReactor {
 public:
  explicit RefusedCall(Status why) { Finish(std::move(why)); }
  void OnDone() override { delete this; }  // as gRPC requires of reactors
};

class UnknownCalls final : public grpc::CallbackGenericService {
 public:
  explicit UnknownCalls(const Rooms& rooms) : rooms_(rooms) {}
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
    std::optional<Status> refusal = refusal_of(rooms_, *context, context->method());
    if (!refusal) refusal = Status(StatusCode::UNIMPLEMENTED, "this server has no such call");
    return new RefusedCall(std::move(*refusal));
  }

 private:
  const Rooms& rooms_;
};

}  // namespace

std::unique_ptr<grpc::CallbackGenericService> make_unknown_calls(Rooms& rooms) {
  return std::make_unique<UnknownCalls>(rooms);
}

}  // namespace osteon
