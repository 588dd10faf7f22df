// Adapts an open stream to gRPC. Only for the source files of the services, since gRPC stays out of headers.
#pragma once
#include <grpcpp/alarm.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/bounded_text.hpp"
#include "common/core/mutex.hpp"
#include "server/auth/authorizer.hpp"
#include "server/publish/send_queue.hpp"

namespace osteon {

using grpc::ByteBuffer;
using grpc::Status;
using grpc::StatusCode;

// A slice that shares the bytes instead of copying them.
inline grpc::Slice slice_of(const Bytes& bytes) {
  auto* keep = new Bytes(bytes);
  return {const_cast<char*>(bytes->data()), bytes->size(), [](void* kept) { delete static_cast<Bytes*>(kept); }, keep};
}

inline ByteBuffer buffer_of(const MessageParts& parts) {
  std::vector<grpc::Slice> slices;
  slices.reserve(parts.size());
  for (const Bytes& part : parts) slices.push_back(slice_of(part));
  return {slices.data(), slices.size()};
}

template <class Message>
std::optional<Message> parse(const ByteBuffer& bytes) {
  ByteBuffer copy(bytes);  // shares the slices
  Message message;
  if (!grpc::SerializationTraits<Message>::Deserialize(&copy, &message).ok()) return std::nullopt;
  return message;
}

// A status may quote input of any length. A client's gRPC reads 8 kB of a status, with three bytes for each of some
// letters. After a longer one it reads no more answers on that connection. Paths on the server must not be shown to
// clients.
inline std::string short_words(std::string_view why) { return bounded_text(without_paths(why), 1000); }

inline Status invalid(std::string_view why) { return {StatusCode::INVALID_ARGUMENT, short_words(why)}; }

inline Status status_of(const Refusal& why) {
  if (why.is_for_now) return {StatusCode::RESOURCE_EXHAUSTED, why.sentence};
  return {why.is_known ? StatusCode::PERMISSION_DENIED : StatusCode::UNAUTHENTICATED, why.sentence};
}

inline Status not_joined(const char* message, std::uint64_t author) {
  return invalid(std::string(message) + ".author " + std::to_string(author) +
                 " has not joined this room; call Join first");
}

// A stream that owns at most the message in flight. The derived class has the bounded set that waits behind it. Exactly
// one path calls Finish; this is decided under the mutex.
template <class Reactor>
class OutStream : public Reactor {
 public:
  // How long a reader may take to read the end of the stream.
  static constexpr std::chrono::milliseconds kCancelAfter{1000};

  // Hands the stream to gRPC, which holds it until OnDone. Queued jobs and cuts may hold it longer. `context`: of its
  // call, which is cancelled if the reader does not read; null: it is never cancelled.
  template <class Stream>
  static Stream* launch(std::shared_ptr<Stream> stream, grpc::CallbackServerContext* context = nullptr) {
    Stream* raw = stream.get();
    {
      const MutexLock lock(raw->context_mutex_);
      raw->context_ = context;
    }
    raw->can_cancel_ = context != nullptr;
    raw->self_ = std::move(stream);
    return raw;
  }

  // From now on `authorizer` ends the stream when its caller may no longer have it, or has joined again. Null, over
  // plain text: nothing ends it. Call it before the stream is given to gRPC, or in its reactions to reads. Returns
  // false if the caller, or `author` if not null, may not have the stream now; the stream then ends with the reason.
  [[nodiscard]] bool stand_under(Authorizer* authorizer, const Caller& caller, const std::string& room, AuthorId author,
                                 std::string_view method) {
    if (authorizer == nullptr) return true;
    auto entered =
        authorizer->enter(caller, room, author, method, [this, weak = std::weak_ptr<void>(self_)](const Refusal& why) {
          if (const std::shared_ptr<void> keep = weak.lock()) close(status_of(why));
        });
    if (entered)
      watched_ = std::move(*entered);
    else
      close(status_of(entered.error()));
    return entered.has_value();
  }

  void close(const Status& status) {
    const MutexLock lock(mutex_);
    close_locked(status);
  }

  void OnWriteDone(bool ok) final {
    const MutexLock lock(mutex_);
    writing_ = false;
    message_.Clear();
    if (!ok) close_locked({StatusCode::CANCELLED, "the reader is gone"});
    pump();
  }
  void OnCancel() final { close({StatusCode::CANCELLED, "the reader is gone"}); }
  void OnDone() final {
    {
      const MutexLock lock(mutex_);
      done_ = true;
      alarm_.reset();
    }
    {
      const MutexLock lock(context_mutex_);
      context_ = nullptr;  // invalid after this
    }
    leave();
    watched_.reset();  // not needed any more: everything beside the stream has ended too
    const std::shared_ptr<void> last = std::move(self_);
  }

 protected:
  // Fills the next message. Returns false when nothing waits.
  virtual bool take(ByteBuffer& message) OSTEON_REQUIRES(mutex_) = 0;
  virtual void leave() = 0;
  // What waits will not be sent.
  virtual void drop_waiting() OSTEON_REQUIRES(mutex_) {}

  // Ends the stream after the message in flight. An OK end sends what waits first, unless an error comes before that.
  void close_locked(const Status& status) OSTEON_REQUIRES(mutex_) {
    const bool cuts_off = !status.ok() && !finished_ && !failing();
    if (!closing_ || cuts_off) closing_ = Status(status.error_code(), short_words(status.error_message()));
    if (cuts_off) {
      drop_waiting();
      cancel_later();
    }
    pump();
  }
  void pump() OSTEON_REQUIRES(mutex_) {
    if (writing_ || finished_) return;
    if ((!closing_ || closing_->ok()) && take(message_)) {
      writing_ = true;
      this->StartWrite(&message_);
    } else if (closing_) {
      finished_ = true;
      this->Finish(*closing_);
    }
  }
  // Whether its caller may send that now.
  [[nodiscard]] bool may_carry(DatagramContent kind) const {
    return !watched_ || osteon::may_carry(watched_->role(), kind);
  }
  // Whether its caller may receive that now.
  [[nodiscard]] bool may_receive(StreamContent content) const {
    return !watched_ || osteon::may_receive(watched_->role(), content);
  }
  [[nodiscard]] bool closing() const OSTEON_REQUIRES(mutex_) { return closing_.has_value(); }
  [[nodiscard]] bool failing() const OSTEON_REQUIRES(mutex_) {  // nothing more is sent
    return closing_ && !closing_->ok();
  }
  [[nodiscard]] bool done() const OSTEON_REQUIRES(mutex_) { return done_; }  // gRPC has let go of the stream
  [[nodiscard]] std::shared_ptr<void> self() const { return self_; }

  mutable Mutex mutex_{LockRank::stream};

 private:
  // The message in flight, and the end itself, wait for the reader for a short time only.
  void cancel_later() OSTEON_REQUIRES(mutex_) {
    if (done_ || !can_cancel_) return;
    alarm_ = std::make_unique<grpc::Alarm>();
    alarm_->Set(std::chrono::system_clock::now() + kCancelAfter, [this, weak = std::weak_ptr<void>(self_)](bool rang) {
      if (const std::shared_ptr<void> keep = rang ? weak.lock() : nullptr) cancel();
    });
  }
  void cancel() {
    const MutexLock lock(context_mutex_);
    if (context_) context_->TryCancel();
  }

  Mutex context_mutex_{LockRank::leaf};
  grpc::CallbackServerContext* context_ OSTEON_GUARDED_BY(context_mutex_) = nullptr;
  bool can_cancel_ = false;  // set before anybody else has the stream
  std::unique_ptr<grpc::Alarm> alarm_ OSTEON_GUARDED_BY(mutex_);
  std::shared_ptr<void> self_;
  std::shared_ptr<OpenStream> watched_;  // shared with the authorizer while it ends the stream
  std::optional<Status> closing_ OSTEON_GUARDED_BY(mutex_);
  bool writing_ OSTEON_GUARDED_BY(mutex_) = false, finished_ OSTEON_GUARDED_BY(mutex_) = false,
                done_ OSTEON_GUARDED_BY(mutex_) = false;
  ByteBuffer message_ OSTEON_GUARDED_BY(mutex_);
};

using WriteReactor = grpc::ServerWriteReactor<ByteBuffer>;
using BidiReactor = grpc::ServerBidiReactor<ByteBuffer, ByteBuffer>;

// A stream that is refused at once.
template <class Reactor>
class RefusedStream final : public OutStream<Reactor> {
  bool take(ByteBuffer&) override OSTEON_REQUIRES(this->mutex_) { return false; }
  void leave() override {}
};

template <class Reactor = WriteReactor>
Reactor* refused(const Status& status) {
  auto* stream = RefusedStream<Reactor>::launch(std::make_shared<RefusedStream<Reactor>>());
  stream->close(status);
  return stream;
}

}  // namespace osteon
