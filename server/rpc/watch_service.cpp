// The service to which viewers and audio clients subscribe.
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/watch.grpc.pb.h"
#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

class MeshStream final : public OutStream<WriteReactor>, public MeshSubscriber {
 public:
  MeshStream(std::shared_ptr<OpenRoom> room, AuthorId author) : room_(std::move(room)), author_(author) {}

  AuthorId author() const override { return author_; }
  void begin(MeshUpdate whole_surface) override {
    const MutexLock lock(mutex_);
    if (failing()) return;
    send_queue_.emplace(std::move(whole_surface));
    pump();
  }
  void enqueue(const MeshUpdate& update) override {
    const MutexLock lock(mutex_);
    if (closing()) return;
    send_queue_->add(update);
  }
  void send() override {
    const MutexLock lock(mutex_);
    pump();
  }
  void end(const std::string& why) override { close({StatusCode::UNAVAILABLE, why}); }
  std::size_t waiting() const override {
    const MutexLock lock(mutex_);
    return send_queue_ ? send_queue_->waiting() : 0;
  }

 private:
  bool take(ByteBuffer& message) override OSTEON_REQUIRES(mutex_) {
    if (!send_queue_ || !may_receive(StreamContent::surface)) return false;
    const MessageParts parts = send_queue_->take();
    if (!parts.empty()) message = buffer_of(parts);
    return !parts.empty();
  }
  void drop_waiting() override OSTEON_REQUIRES(mutex_) { send_queue_.reset(); }
  void leave() override { room_->runtime().leave(*this); }

  const std::shared_ptr<OpenRoom> room_;  // shared with the rooms and the other streams
  const AuthorId author_;
  std::optional<MeshSendQueue> send_queue_ OSTEON_GUARDED_BY(mutex_);
};

class CuttingStream final : public OutStream<WriteReactor>, public StateSubscriber {
 public:
  CuttingStream(std::shared_ptr<OpenRoom> room, AuthorId author, std::chrono::nanoseconds apart)
      : room_(std::move(room)), author_(author), apart_(apart) {}
  AuthorId author() const override { return author_; }

  std::chrono::nanoseconds apart() const override { return apart_; }
  void enqueue(const ShownNow& now) override {
    const MutexLock lock(mutex_);
    if (closing()) return;
    waiting_ = now;
    pump();
  }
  void end(const std::string& why) override { close({StatusCode::UNAVAILABLE, why}); }
  std::size_t waiting() const override {
    const MutexLock lock(mutex_);
    return waiting_ ? 1 : 0;
  }

 private:
  bool take(ByteBuffer& message) override OSTEON_REQUIRES(mutex_) {
    if (!waiting_) return false;
    // Two messages of one kind, one after the other, are one message with the fields of both.
    MessageParts parts;
    if (may_receive(StreamContent::tool_states)) parts.push_back(waiting_->tools);
    if (may_receive(StreamContent::scene)) parts.push_back(waiting_->scene);
    waiting_.reset();
    if (!parts.empty()) message = buffer_of(parts);
    return !parts.empty();
  }
  void leave() override { room_->runtime().leave(*this); }

  const std::shared_ptr<OpenRoom> room_;  // shared with the rooms and the other streams
  const AuthorId author_;
  const std::chrono::nanoseconds apart_;
  std::optional<ShownNow> waiting_ OSTEON_GUARDED_BY(mutex_);
};

using WatchBase =
    v1::WatchService::WithRawCallbackMethod_WatchMesh<v1::WatchService::WithRawCallbackMethod_WatchCutting<
        v1::WatchService::WithCallbackMethod_LookFrom<v1::WatchService::Service>>>;

class WatchServiceImpl final : public WatchBase {
 public:
  explicit WatchServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  WriteReactor* WatchMesh(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    if (const auto why = refusal_of<v1::WatchMeshRequest>(rooms_, *context)) return refused(*why);
    const auto request = parse<v1::WatchMeshRequest>(*bytes);
    if (!request) return refused(invalid("the WatchMeshRequest could not be parsed"));
    const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context, AuthorId{request->author()});
    if (!room) return refused(status_of(room.error()));
    if (!(*room)->runtime().knows(AuthorId{request->author()}))
      return refused(not_joined("WatchMeshRequest", request->author()));
    std::optional<ViewFrustum> look;
    if (request->has_look()) {
      const Result<ViewFrustum> stated = wire::from_wire(request->look());
      if (!stated) return refused(invalid(stated.error().message));
      look = *stated;
    }
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused(status_of(caller.error()));
    MeshStream* stream = MeshStream::launch(std::make_shared<MeshStream>(*room, AuthorId{request->author()}), context);
    if (stream->stand_under(rooms_.authorizer, *caller, (*room)->name, AuthorId{request->author()},
                            "/osteon.v1.WatchService/WatchMesh"))
      (*room)->runtime().watch_mesh(*stream, look);
    return stream;
  }

  grpc::ServerUnaryReactor* LookFrom(grpc::CallbackServerContext* context, const v1::LookFromRequest* request,
                                     v1::LookFromResponse*) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::LookFromRequest>(rooms_, *context, reactor)) return reactor;
    const Result<ViewFrustum> look = wire::from_wire(request->look());
    const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context, AuthorId{request->author()});
    if (!room) {
      reactor->Finish(status_of(room.error()));
    } else if (!(*room)->runtime().knows(AuthorId{request->author()})) {
      reactor->Finish(not_joined("LookFromRequest", request->author()));
    } else if (!look) {
      reactor->Finish(invalid(look.error().message));
    } else {
      (*room)->runtime().look(AuthorId{request->author()}, *look);
      reactor->Finish(Status::OK);
    }
    return reactor;
  }

  WriteReactor* WatchCutting(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    if (const auto why = refusal_of<v1::WatchCuttingRequest>(rooms_, *context)) return refused(*why);
    const auto request = parse<v1::WatchCuttingRequest>(*bytes);
    if (!request) return refused(invalid("the WatchCuttingRequest could not be parsed"));
    const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context, AuthorId{request->author()});
    if (!room) return refused(status_of(room.error()));
    if (!(*room)->runtime().knows(AuthorId{request->author()}))
      return refused(not_joined("WatchCuttingRequest", request->author()));
    const std::chrono::nanoseconds apart{request->most_hz() == 0 ? 0 : 1'000'000'000 / request->most_hz()};
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused(status_of(caller.error()));
    CuttingStream* stream =
        CuttingStream::launch(std::make_shared<CuttingStream>(*room, AuthorId{request->author()}, apart), context);
    if (stream->stand_under(rooms_.authorizer, *caller, (*room)->name, AuthorId{request->author()},
                            "/osteon.v1.WatchService/WatchCutting"))
      (*room)->runtime().watch_cutting(*stream);
    return stream;
  }

 private:
  Rooms& rooms_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_watch_service(Rooms& rooms) { return std::make_unique<WatchServiceImpl>(rooms); }

}  // namespace osteon
