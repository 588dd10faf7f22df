#include "audio_client/net/state_subscription.hpp"

#include <grpcpp/grpcpp.h>

#include <thread>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/watch.grpc.pb.h"

namespace osteon {

struct StateSubscription::Impl {
  wire::JoinedRoom room;
  OnStates on_states;
  grpc::ClientContext context;
  mutable Mutex mutex{LockRank::leaf};
  std::optional<Error> ended OSTEON_GUARDED_BY(mutex);
  std::thread reader;

  void run();
  Error read();
};

void StateSubscription::Impl::run() {
  Error why = read();
  const MutexLock lock(mutex);
  ended = std::move(why);
}

// Reads until the stream ends; returns the reason.
Error StateSubscription::Impl::read() {
  v1::WatchCuttingRequest request;
  request.set_author(room.author.value);
  const auto stub = v1::WatchService::NewStub(room.channel);
  const auto stream = stub->WatchCutting(&context, request);

  v1::WatchCuttingResponse message;
  std::vector<CuttingState> states;
  while (stream->Read(&message)) {
    const auto received = std::chrono::steady_clock::now();
    states.clear();
    for (const v1::CuttingState& wire_state : message.states()) {
      Result<CuttingState> state = wire::from_wire(wire_state);
      if (!state) {
        context.TryCancel();
        return {state.error().code, "the server sent a cutting state that cannot be: " + state.error().message};
      }
      states.push_back(std::move(*state));
    }
    on_states(states, received);
  }
  const grpc::Status status = stream->Finish();
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED)
    return {ErrorCode::unsupported,
            "the server does not stream cutting states; it is not an Osteon server of this version"};
  if (status.error_code() == grpc::StatusCode::PERMISSION_DENIED ||
      status.error_code() == grpc::StatusCode::UNAUTHENTICATED)
    return {ErrorCode::denied, "the server ended the session: " + status.error_message()};
  return {ErrorCode::unavailable, "the server went away; start it again and then osteon-audio"};
}

StateSubscription::StateSubscription(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

std::unique_ptr<StateSubscription> StateSubscription::start(wire::JoinedRoom room, OnStates on_states) {
  auto impl = std::make_unique<Impl>();
  impl->room = std::move(room);
  impl->on_states = std::move(on_states);
  impl->reader = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<StateSubscription>(new StateSubscription(std::move(impl)));
}

StateSubscription::~StateSubscription() {
  impl_->context.TryCancel();
  impl_->reader.join();
}

std::optional<Error> StateSubscription::ended() const {
  const MutexLock lock(impl_->mutex);
  return impl_->ended;
}

}  // namespace osteon
