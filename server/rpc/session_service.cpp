// The streams of haptic clients, and the fast path beside each stream.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/version.hpp"
#include "osteon/v1/cutting.grpc.pb.h"
#include "server/publish/session_messages.hpp"
#include "server/rpc/called_room.inl"
#include "server/rpc/link_server.hpp"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

// One haptic client's session. Reading stops while kMaxQueuedCuts of its cuts wait for a tick. So the network slows
// down a client that sends faster than the room cuts, and memory stays bounded. Datagrams cannot be slowed down. So a
// session ends if its client sends more unacknowledged cuts than a haptic client does.
class SessionStream final : public OutStream<BidiReactor>, public SessionSubscriber, private SessionLink::Receiver {
 public:
  static constexpr int kMaxQueuedCuts = 256;
  static constexpr int kMostUnacknowledged = 1024;  // cuts that a haptic client sends before the first is acknowledged
  static constexpr std::string_view kMethod = "/osteon.v1.CuttingService/Session";

  SessionStream(std::shared_ptr<OpenRoom> room, LinkServer* links, Authorizer* authorizer, Caller caller)
      : room_(std::move(room)),
        runtime_(room_->runtime()),
        links_(links),
        authorizer_(authorizer),
        caller_(std::move(caller)) {}
  void start() {
    if (stand_under(authorizer_, caller_, room_->name, {}, kMethod)) StartRead(&request_);
  }

  AuthorId author() const override { return author_; }
  void begin(SessionStart start) override {
    MessageParts before;
    if (links_) {
      std::shared_ptr<SessionLink> link = links_->add(author_, start.decided_author_seq + 1, *this);
      const MutexLock lock(mutex_);
      link_ = std::move(link);
      before.push_back(link_message(link_->keys(), links_->port()).bytes);
    }
    for (const SessionMessage& message : start.before)
      if (receives(message)) before.push_back(message.bytes);
    const MutexLock lock(mutex_);
    taken_ = start.decided_author_seq;
    if (failing()) return;
    send_queue_.begin(start.contained, std::move(before), std::move(start.complete));
    pump();
  }
  void set_leaves(std::vector<FieldLeaf> leaves) override {
    if (!may_receive(StreamContent::field)) leaves.clear();
    const MutexLock lock(mutex_);
    if (failing()) return;
    send_queue_.set_leaves(std::move(leaves));
    pump();
  }
  // [committing thread]
  void enqueue(const SessionMessage& message) override {
    const bool whole = receives(message);
    // Without the content that the client may not receive, the message says only that there was an event.
    const Bytes entry = whole ? message.bytes : noted_message(message.seq, {}).bytes;
    std::uint64_t index = 0;
    {
      const MutexLock lock(mutex_);
      if (closing()) return;
      const std::uint64_t before = send_queue_.index();
      send_or_give_up(send_queue_.add(message.seq, entry));
      if (send_queue_.index() > before) index = send_queue_.index();
    }
    // Beside the stream, which carries everything.
    const bool goes = whole && may_carry(content_of(message.fast));
    if (link_)
      link_->enqueue(
          index,
          goes ? message.fast : wire::SessionEntry{.room_seq = message.seq, .kind = wire::SessionEntryKind::streamed});
  }
  void hold(const wire::SessionEntry& supervised) override {
    if (link_ && !is_closing() && may_carry(DatagramContent::supervision)) link_->enqueue(0, supervised);
  }
  bool show_partners(const std::vector<CuttingState>& states) override {
    if (is_closing()) return false;  // nor do they get them by datagram
    std::vector<CuttingState> others;
    std::ranges::copy_if(states, std::back_inserter(others),
                         [&](const CuttingState& state) { return state.author != author_; });
    const bool by_link = link_ && may_carry(DatagramContent::partners) && link_->set_partners(others);
    const MutexLock lock(mutex_);
    if (closing() || !may_receive(StreamContent::tool_states)) return false;
    partners_.enqueue(others, !by_link);
    pump();
    return partners_.waits();
  }
  void show_bone(const MountPose& seen) override {
    if (is_closing() || !may_carry(DatagramContent::bone_seen)) return;
    const bool by_link = link_ && link_->set_bone(seen);
    const MutexLock lock(mutex_);
    const auto now = PartnerSendQueue::Clock::now();
    if (by_link || closing() || now < next_bone_) return;
    next_bone_ = now + PartnerSendQueue::kApart;
    bone_ = seen;
    pump();
  }
  void know_tool(std::uint32_t number, const Digest& tool) override {
    if (link_) link_->know_tool(number, tool);
  }
  void answer(const SessionMessage& message) override {
    if (!knows(message)) return;
    const MutexLock lock(mutex_);
    if (!closing()) send_or_give_up(send_queue_.add_answer(message.bytes));
  }
  void refuse(const Error& why) override { close(invalid(why.message)); }
  void decided() override {
    const MutexLock lock(mutex_);
    --queued_;
    if (closing()) return;
    if (reading_ended_ && queued_ == 0) {
      close_locked(Status::OK);
    } else if (paused_ && queued_ < kMaxQueuedCuts) {
      paused_ = false;
      StartRead(&request_);
    }
  }
  // The room ended the session, so the client must not try again as after a broken connection.
  void end(const std::string& why) override { close({StatusCode::ABORTED, why}); }
  void replaced(const std::string& why) override { close({StatusCode::UNAVAILABLE, why}); }
  std::size_t waiting() const override {
    const MutexLock lock(mutex_);
    return send_queue_.waiting();
  }

  void OnReadDone(bool ok) override {
    if (!ok) {
      // The client will send no more. What it queued is still decided and published.
      const MutexLock lock(mutex_);
      reading_ended_ = true;
      if (queued_ == 0) close_locked(Status::OK);
      return;
    }
    auto request = parse<v1::SessionRequest>(request_);
    if (!request) return close(invalid("a SessionRequest could not be parsed"));
    if (request->message_case() == v1::SessionRequest::kOpen) return open(request->open());
    if (!opened_) return close(invalid("the first SessionRequest must be open"));
    switch (request->message_case()) {
      case v1::SessionRequest::kAcknowledged:
        return hear(RoomSeq{request->acknowledged().room_seq()});
      case v1::SessionRequest::kCut:
        return queue(request->cut());
      case v1::SessionRequest::kState:
        return show(request->state());
      case v1::SessionRequest::kPush:
        return push(request->push());
      default:
        return close(invalid("SessionRequest.message is not set"));
    }
  }

 private:
  void open(const v1::SessionOpen& request) {
    if (opened_) return close(invalid("open was sent before"));
    if (!stand_under(authorizer_, caller_, room_->name, AuthorId{request.author()}, kMethod)) return;
    if (request.server_epoch() != room_->server_epoch)
      // The client joined a server that was killed meanwhile. This server will know it if it joins again.
      return close({StatusCode::UNAVAILABLE, "open.server_epoch is " + std::to_string(request.server_epoch()) +
                                                 " and the server's " + std::to_string(room_->server_epoch) +
                                                 "; join again"});
    opened_ = true;
    author_ = AuthorId{request.author()};
    version_ = room_->version_of(author_);
    const Digest secret = digest_of_secret(request.secret());
    // Reading goes on after the leaves were taken, so that they contain no cut of this author.
    runtime_.run_slowly([this, keep = self(), secret] {
      const std::shared_ptr<SessionSubscriber> subscriber(keep, this);
      if (const Result<void> opened = runtime_.open_session(subscriber, secret); !opened)
        return close(invalid(opened.error().message));
      // If the reader left while the session was being opened, it left the runtime's list before it was in it.
      if (!read_on()) leave();
    });
  }

  void queue(const v1::Cut& message) {
    Result<Cut> cut = wire::from_wire(message);
    if (!cut) return close(invalid(cut.error().message));
    if (cut->author != author_) return close(invalid("cut.author is not the author who opened the session"));
    // A cut that was taken before is answered with its first result. A cut ahead of its turn may follow others that
    // come in datagrams.
    const bool again = [&] {
      const MutexLock lock(mutex_);
      return cut->author_seq <= taken_;
    }();
    if (link_ && !again)
      link_->insert(*cut);
    else
      take(std::move(*cut));
    read_on();
  }

  // Cuts in order of their author_seq, from the stream or from datagrams.
  void take(Cut cut) override {
    {
      const MutexLock lock(mutex_);
      if (closing()) return;
      if (!may_carry(DatagramContent::cuts)) return close_locked(not_allowed());
      // Besides the new cuts, after a broken connection as many again may be read from the stream.
      if (queued_ >= kMaxQueuedCuts + kMostUnacknowledged) return close_locked(too_many_cuts());
      ++queued_;
      taken_ = std::max(taken_, cut.author_seq);
    }
    runtime_.queue_cut(std::shared_ptr<SessionSubscriber>(self(), this), std::move(cut), RoomRuntime::Clock::now());
  }
  void take(CuttingState state) override {
    if (may_carry(DatagramContent::tool_state)) runtime_.publish_state(std::move(state));
  }
  void pushed(const MountLoad& push) override {
    if (may_carry(DatagramContent::bone_push)) runtime_.push_bone(author_, push);
  }
  void arrived(std::uint64_t index) override {
    const RoomSeq newest = [&] {
      const MutexLock lock(mutex_);
      return send_queue_.arrived(index);
    }();
    if (newest) runtime_.people().acknowledged(author_, newest);
  }
  // A client may have received more events than there are, from a server whose journal has lost its end. It then counts
  // as having received everything that is left. Such a loss is found by the client's witness at its next join, and is
  // no reason to refuse it here.
  void hear(RoomSeq newest) {
    runtime_.people().acknowledged(author_, std::min(newest, runtime_.room_seq()));
    read_on();
  }

  void show(const v1::CuttingState& message) {
    Result<CuttingState> state = wire::from_wire(message);
    if (!state) return close(invalid(state.error().message));
    if (state->author != author_) return close(invalid("state.author is not the author who opened the session"));
    if (!may_carry(DatagramContent::tool_state)) return close(not_allowed());
    runtime_.publish_state(std::move(*state));
    read_on();
  }

  void push(const v1::MountLoad& message) {
    const Result<MountLoad> push = wire::from_wire(message);
    if (!push) return close(invalid(push.error().message));
    if (!may_carry(DatagramContent::bone_push)) return close(not_allowed());
    runtime_.push_bone(author_, *push);
    read_on();
  }

  // For a streamed entry, the datagram names only its kind and has no content.
  [[nodiscard]] DatagramContent content_of(const wire::SessionEntry& entry) const {
    if (entry.kind == wire::SessionEntryKind::supervised) return DatagramContent::supervision;
    const bool others = entry.kind == wire::SessionEntryKind::committed && entry.cut.author != author_;
    return others ? DatagramContent::committed_cuts : DatagramContent::acknowledgements;
  }

  // Whether this client's version of the protocol has such a message.
  [[nodiscard]] bool knows(const SessionMessage& message) const { return version_ >= message.since_version; }
  [[nodiscard]] bool receives(const SessionMessage& message) const {
    return knows(message) && (!message.content || may_receive(*message.content));
  }

  [[nodiscard]] static Status too_many_cuts() {
    return {StatusCode::RESOURCE_EXHAUSTED, std::to_string(kMaxQueuedCuts + kMostUnacknowledged) +
                                                " cuts of this session wait to be decided; send no more than " +
                                                std::to_string(kMostUnacknowledged) +
                                                " before the first is acknowledged"};
  }
  [[nodiscard]] static Status not_allowed() {
    return {StatusCode::PERMISSION_DENIED, "your role does not hold a tool any more"};
  }

  // Reads the next request, or waits for decided() to do so. Returns false when gRPC has released the stream.
  bool read_on() {
    const MutexLock lock(mutex_);
    if (done()) return false;
    paused_ = queued_ >= kMaxQueuedCuts;
    if (!closing() && !paused_) StartRead(&request_);
    return true;
  }

  void send_or_give_up(bool taken) OSTEON_REQUIRES(mutex_) {
    if (taken)
      pump();
    else
      close_locked({StatusCode::RESOURCE_EXHAUSTED, "the reader is more than " +
                                                        std::to_string(SessionSendQueue::kMaxEntries) +
                                                        " events behind the room; join again"});
  }
  [[nodiscard]] bool is_closing() const {
    const MutexLock lock(mutex_);
    return closing();
  }
  void drop_waiting() override OSTEON_REQUIRES(mutex_) {
    send_queue_ = {};
    partners_ = {};
    bone_.reset();
  }
  bool take(ByteBuffer& message) override OSTEON_REQUIRES(mutex_) {
    MessageParts parts = send_queue_.take();
    if (parts.empty() && send_queue_.begun() && bone_) {
      if (const SessionMessage bone = bone_message(*bone_); knows(bone)) parts = {bone.bytes};
      bone_.reset();
    }
    // Poses of others' tools come after all entries, so that they delay no entry.
    while (parts.empty() && send_queue_.begun()) {
      const std::optional<CuttingState> partner = partners_.take(PartnerSendQueue::Clock::now());
      if (!partner) break;
      if (const SessionMessage tool = partner_message(*partner); knows(tool)) parts = {tool.bytes};
    }
    if (!parts.empty()) message = buffer_of(parts);
    return !parts.empty();
  }
  void leave() override {
    runtime_.leave(*this);
    if (opened_) log::info("session over", {{"room", room_->name}, {"author", author_.value}});
    // The reader may leave while the session is being opened.
    const auto link = [&] {
      const MutexLock lock(mutex_);
      return link_;
    }();
    if (link) links_->remove(link);
  }

  const std::shared_ptr<OpenRoom> room_;  // shared with the rooms and the other streams
  RoomRuntime& runtime_;                  // of room_
  LinkServer* const links_;
  Authorizer* const authorizer_;  // null: plain text
  const Caller caller_;
  std::shared_ptr<SessionLink> link_;  // shared with the link server; set before the runtime sends entries
  ByteBuffer request_;
  AuthorId author_;  // set before the runtime knows the stream, as is the next
  std::uint32_t version_ = wire::kProtocolVersion;
  bool opened_ = false;  // used only by reactions to reads, which come one by one
  SessionSendQueue send_queue_ OSTEON_GUARDED_BY(mutex_);
  PartnerSendQueue partners_ OSTEON_GUARDED_BY(mutex_);
  std::optional<MountPose> bone_ OSTEON_GUARDED_BY(mutex_);  // newest pose of the bone that the stream shall send
  PartnerSendQueue::Clock::time_point next_bone_ OSTEON_GUARDED_BY(mutex_){};
  int queued_ OSTEON_GUARDED_BY(mutex_) = 0;  // cuts between reading and decision
  std::uint64_t taken_ OSTEON_GUARDED_BY(mutex_) =
      0;  // newest author_seq that was queued, here or in an earlier session
  bool paused_ OSTEON_GUARDED_BY(mutex_) = false, reading_ended_ OSTEON_GUARDED_BY(mutex_) = false;
};

class CuttingServiceImpl final : public v1::CuttingService::WithRawCallbackMethod_Session<v1::CuttingService::Service> {
 public:
  CuttingServiceImpl(Rooms& rooms, LinkServer* links) : rooms_(rooms), links_(links) {}

  BidiReactor* Session(grpc::CallbackServerContext* context) override {
    if (const auto why = refusal_of<v1::SessionRequest>(rooms_, *context)) return refused<BidiReactor>(*why);
    Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context);
    if (!room) return refused<BidiReactor>(status_of(room.error()));
    Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused<BidiReactor>(status_of(caller.error()));
    SessionStream* stream = SessionStream::launch(
        std::make_shared<SessionStream>(std::move(*room), links_, rooms_.authorizer, std::move(*caller)), context);
    stream->start();
    return stream;
  }

 private:
  Rooms& rooms_;
  LinkServer* const links_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_cutting_service(Rooms& rooms, LinkServer* links) {
  return std::make_unique<CuttingServiceImpl>(rooms, links);
}

}  // namespace osteon
