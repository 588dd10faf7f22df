// The stream of viewers that show the inside of the bone.
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/field/kernel.hpp"
#include "osteon/v1/field.grpc.pb.h"
#include "server/publish/session_messages.hpp"
#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

constexpr const char* kWatchField = "/osteon.v1.FieldService/WatchField";

// [A] Of events that wait for one reader. All readers share most of them.
constexpr std::size_t kMostEntryMiB = 256;

// Sends what a session is sent of the field, in the same bytes. At most SessionSendQueue::kMaxEntries events, of at
// most kMostEntryMiB, wait for a slow reader, which then has to ask again.
class FieldStream final : public OutStream<WriteReactor>, public FieldSubscriber {
 public:
  FieldStream(std::shared_ptr<OpenRoom> room, AuthorId author) : room_(std::move(room)), author_(author) {}

  // On the thread for slow requests, because all leaves are copied.
  void start() {
    room_->runtime().run_slowly([this, keep = self()] {
      if (over()) return;
      const std::shared_ptr<FieldSubscriber> reader(keep, this);
      if (const Result<void> watched = room_->runtime().watch_field(reader); !watched)
        return close(status_of(watched.error()));
      // A reader that left meanwhile has left the runtime's list before it was in it.
      if (over()) leave();
    });
  }

  AuthorId author() const override { return author_; }
  void begin(SessionStart start) override {
    MessageParts before;
    for (const SessionMessage& message : start.before) before.push_back(message.bytes);
    const MutexLock lock(mutex_);
    if (failing()) return;
    send_queue_.begin(start.contained, std::move(before), std::move(start.complete), start.leaf_bytes);
    pump();
  }
  void set_leaves(std::vector<FieldLeaf> leaves) override {
    const MutexLock lock(mutex_);
    if (failing()) return;
    send_queue_.set_leaves(std::move(leaves));
    pump();
  }
  // [committing thread]
  void enqueue(const SessionMessage& message) override {
    const Bytes entry = field_entry(message, may_receive(StreamContent::field));
    const MutexLock lock(mutex_);
    if (closing()) return;
    if (send_queue_.add(message.seq, entry)) return pump();
    close_locked({StatusCode::RESOURCE_EXHAUSTED,
                  "the reader is more than " + std::to_string(SessionSendQueue::kMaxEntries) + " events or " +
                      std::to_string(kMostEntryMiB) + " MiB behind the room; ask again"});
  }
  void end(const std::string& why) override { close({StatusCode::ABORTED, why}); }
  void replaced(const std::string& why) override { close({StatusCode::UNAVAILABLE, why}); }
  std::size_t waiting() const override {
    const MutexLock lock(mutex_);
    return send_queue_.waiting();
  }
  std::size_t leaf_bytes() const override {
    const MutexLock lock(mutex_);
    return send_queue_.leaf_bytes();
  }

 private:
  [[nodiscard]] bool over() const {
    const MutexLock lock(mutex_);
    return done() || failing();
  }
  bool take(ByteBuffer& message) override OSTEON_REQUIRES(mutex_) {
    const MessageParts parts = send_queue_.take();
    if (!parts.empty()) message = buffer_of(parts);
    return !parts.empty();
  }
  void drop_waiting() override OSTEON_REQUIRES(mutex_) { send_queue_ = {}; }
  void leave() override { room_->runtime().leave(*this); }

  const std::shared_ptr<OpenRoom> room_;  // shared with the rooms and the other streams
  const AuthorId author_;
  SessionSendQueue send_queue_ OSTEON_GUARDED_BY(mutex_){kMostEntryMiB * 1024 * 1024};
};

// OK if the caller computes cuts as this server does.
Status judge_kernel(std::uint32_t version) {
  if (version == kKernelVersion) return Status::OK;
  return {StatusCode::FAILED_PRECONDITION, "WatchFieldRequest.kernel_version is " + std::to_string(version) +
                                               " and the server's " + std::to_string(kKernelVersion) +
                                               "; install the same Osteon release on both"};
}

class FieldServiceImpl final : public v1::FieldService::WithRawCallbackMethod_WatchField<v1::FieldService::Service> {
 public:
  explicit FieldServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  WriteReactor* WatchField(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    if (const auto why = refusal_of<v1::WatchFieldRequest>(rooms_, *context)) return refused(*why);
    const auto request = parse<v1::WatchFieldRequest>(*bytes);
    if (!request) return refused(invalid("the WatchFieldRequest could not be parsed"));
    const AuthorId author{request->author()};
    const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context, author);
    if (!room) return refused(status_of(room.error()));
    if (!(*room)->runtime().knows(author)) return refused(not_joined("WatchFieldRequest", request->author()));
    if (const Status judged = judge_kernel(request->kernel_version()); !judged.ok()) return refused(judged);
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused(status_of(caller.error()));
    FieldStream* stream = FieldStream::launch(std::make_shared<FieldStream>(*room, author), context);
    if (stream->stand_under(rooms_.authorizer, *caller, (*room)->name, author, kWatchField)) stream->start();
    return stream;
  }

 private:
  Rooms& rooms_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_field_service(Rooms& rooms) { return std::make_unique<FieldServiceImpl>(rooms); }

}  // namespace osteon
