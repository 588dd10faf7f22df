#include "haptic_client/net/room_session.hpp"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <deque>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "common/core/check.hpp"
#include "common/core/mutex.hpp"
#include "common/link/backoff.hpp"
#include "common/volume/case_cache.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/case_files.hpp"
#include "common/wire/convert.hpp"
#include "haptic_client/net/cuts_underway.hpp"
#include "haptic_client/net/fast_path.hpp"
#include "haptic_client/net/session_reader.hpp"
#include "osteon/v1/cutting.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"

namespace osteon {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr auto kCloseTime = 1s;
constexpr std::chrono::milliseconds kLongestRedial = 10s;  // of a waiting time that a server requests
constexpr auto kPushesApart = 33ms;                        // over the stream
constexpr auto kAcknowledgeEvery = 250ms;  // between two acknowledgements of what this client has received

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

Result<Case> fetch_case(const wire::JoinedRoom& room, const fs::path& cache, const std::function<bool()>& stop) {
  Result<Case> fetched = cached_case(cache, room.case_hash, [&](const fs::path& folder) {
    return wire::fetch_case_files(room, folder, {.stop = stop});
  });
  if (!fetched && fetched.error().code == ErrorCode::internal)
    fetched.error().message += "; give another folder with --cache";
  return fetched;
}

Result<void> fetch_tools(const wire::JoinedRoom& room, ToolBox& tools) {
  constexpr auto kPatience = 10s;
  const auto stub = v1::RoomService::NewStub(room.channel);
  const auto lost = [](const grpc::Status& status) {
    return failure(ErrorCode::unavailable, "the server does not list its tools: " + status.error_message() +
                                               "; see whether osteon-server still runs");
  };
  v1::ListToolsRequest list;
  v1::ListToolsResponse listed;
  list.set_author(room.author.value);
  grpc::ClientContext listing;
  listing.set_deadline(std::chrono::system_clock::now() + kPatience);
  if (const grpc::Status status = stub->ListTools(&listing, list, &listed); !status.ok()) return lost(status);
  for (const v1::KnownTool& known : listed.tools()) {
    const Result<Digest> hash = wire::digest_from_wire(known.tool_hash());
    if (!hash) return tl::unexpected(hash.error());
    if (tools.find(*hash)) continue;
    v1::GetToolRequest request;
    v1::GetToolResponse answer;
    request.set_author(room.author.value);
    request.set_tool_hash(known.tool_hash());
    grpc::ClientContext getting;
    getting.set_deadline(std::chrono::system_clock::now() + kPatience);
    if (const grpc::Status status = stub->GetTool(&getting, request, &answer); !status.ok()) return lost(status);
    const Result<Tool> tool = wire::from_wire(answer.tool());
    if (!tool) return tl::unexpected(tool.error());
    tools.add(*tool);
  }
  return {};
}

}  // namespace

struct RoomSession::Impl {
  Impl(wire::JoinedRoom r, Case b, RoomSessionOptions o)
      : room(std::move(r)), bone(std::move(b)), options(std::move(o)), joined(room) {}

  // A stream, from its opening to its end.
  struct Line {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReaderWriter<v1::SessionRequest, v1::SessionResponse>> stream;
  };

  void run();
  // Reads until the stream ends; returns the reason.
  grpc::Status serve(Line& line, std::optional<Error>& broken);
  void write(Line& line);
  // Handles what a stream sends for the session itself.
  void follow(const v1::SessionResponse& response) OSTEON_REQUIRES(read_mutex);
  // [fast path] A log entry of a datagram.
  void take(wire::IndexedEntry entry);
  void open_fast_path(std::uint64_t decided);
  void close_fast_path();
  // Tries until it succeeds or the session is closed. Error: the server answers and refuses.
  Result<void> join_again();
  [[nodiscard]] std::shared_ptr<FastPath> fast_path() const {
    const MutexLock lock(fast_mutex);
    return fast;
  }
  [[nodiscard]] bool ends() const {
    const MutexLock lock(mutex);
    return over || closing;
  }

  const wire::JoinedRoom room;
  Case bone;
  const RoomSessionOptions options;
  std::shared_ptr<ToolBox> tools = builtin_tool_box();  // shared with the replica's fields
  RoomCallbacks callbacks;

  std::unique_ptr<v1::CuttingService::Stub> stub;
  std::thread thread;
  // Used by that thread only.
  wire::JoinedRoom joined;             // newest
  std::optional<v1::LinkOffer> offer;  // of the present stream, like the next two
  std::string redial_why;              // the reason that a draining server gives
  std::vector<std::pair<std::uint32_t, Digest>> numbered_tools;

  Mutex read_mutex{LockRank::received};  // received messages are passed on by one thread at a time
  std::optional<SessionReader> reader OSTEON_GUARDED_BY(read_mutex);
  mutable Mutex fast_mutex{LockRank::leaf};
  std::shared_ptr<FastPath> fast
      OSTEON_GUARDED_BY(fast_mutex);  // of the present stream; held by those who use it at the moment

  // Sequence number of the newest event that was passed on, over the present stream.
  std::atomic<std::uint64_t> passed_on{0};
  std::atomic<bool> received_leaves{false};  // no datagram acknowledges the leaves

  mutable Mutex mutex{LockRank::haptic_session};
  CondVar wake;
  Line* line OSTEON_GUARDED_BY(mutex) = nullptr;  // the open one
  CutsUnderway underway OSTEON_GUARDED_BY(mutex){kMaxWaitingCuts};
  std::optional<MountLoad> push OSTEON_GUARDED_BY(mutex);  // to be sent over the stream
  std::chrono::steady_clock::time_point next_push OSTEON_GUARDED_BY(mutex){};
  std::optional<std::chrono::milliseconds> redial OSTEON_GUARDED_BY(mutex);  // the server drains: when to connect again
  bool closing OSTEON_GUARDED_BY(mutex) = false, over OSTEON_GUARDED_BY(mutex) = false;
};

// On the line's writer thread.
void RoomSession::Impl::write(Line& open) {
  v1::SessionRequest request;
  request.mutable_open()->set_author(joined.author.value);
  request.mutable_open()->set_server_epoch(joined.server_epoch);
  request.mutable_open()->set_secret(joined.secret);
  bool written = open.stream->Write(request);
  std::optional<Cut> cut;
  std::optional<CuttingState> state;
  std::optional<MountLoad> push_now;
  std::uint64_t acknowledged = 0;
  auto acknowledge_at = std::chrono::steady_clock::now();
  while (written) {
    {
      MutexLock lock(mutex);
      wake.wait_until(lock, acknowledge_at, [&]() OSTEON_REQUIRES(mutex) {
        return underway.something_to_send() || push || closing || over || line != &open || redial;
      });
      // A draining server decides what it has received and no more. The rest is sent when the session continues.
      if (over || line != &open || redial) break;
      cut = underway.take_cut();
      state = cut ? std::nullopt : underway.take_state();
      push_now = std::exchange(push, std::nullopt);
      if (!cut && !state && closing) break;
    }
    if (push_now) {
      *request.mutable_push() = wire::to_wire(*push_now);
      if (written = open.stream->Write(request); !written) break;
    }
    const std::shared_ptr<FastPath> path = fast_path();
    // Datagrams themselves acknowledge the received log entries.
    if (const auto now = std::chrono::steady_clock::now(); now >= acknowledge_at) {
      acknowledge_at = now + kAcknowledgeEvery;
      const bool leaves = received_leaves.exchange(false);
      if (const std::uint64_t newest = passed_on;
          newest != acknowledged && (leaves || !(path && path->health().alive))) {
        request.mutable_acknowledged()->set_room_seq(acknowledged = newest);
        if (written = open.stream->Write(request); !written) break;
      }
    }
    if (!cut && !state) continue;
    if (path && (cut ? path->send(*cut) : path->send(*state))) continue;
    if (cut)
      *request.mutable_cut() = wire::to_wire(*cut);
    else
      *request.mutable_state() = wire::to_wire(*state);
    written = open.stream->Write(request);
  }
  open.stream->WritesDone();
}

void RoomSession::Impl::take(wire::IndexedEntry entry) {
  const MutexLock lock(read_mutex);
  if (!reader->take(std::move(entry))) {
    const MutexLock of_line(mutex);
    if (line) line->context.TryCancel();
  }
  passed_on = reader->seq().value;
}

void RoomSession::Impl::follow(const v1::SessionResponse& response) {
  if (response.has_link()) offer = response.link();
  if (response.has_redial()) {
    redial_why = response.redial().why();
    const MutexLock lock(mutex);
    redial =
        std::min<std::chrono::milliseconds>(std::chrono::milliseconds(response.redial().after_ms()), kLongestRedial);
    wake.notify_all();
  }
  if (response.has_tool() && response.tool().tool_number() != 0)
    if (const Result<Digest> tool = wire::digest_from_wire(response.tool().tool().tool_hash())) {
      numbered_tools.emplace_back(response.tool().tool_number(), *tool);
      if (const std::shared_ptr<FastPath> path = fast_path()) path->know_tool(response.tool().tool_number(), *tool);
    }
  if (response.has_complete()) open_fast_path(response.complete().decided_author_seq());
  const std::shared_ptr<FastPath> path = fast_path();
  if (path && response.index() != 0) path->received(response.index());
}

// Where there is no fast path, the stream carries everything.
void RoomSession::Impl::open_fast_path(std::uint64_t decided) {
  if (!offer || options.fast_path == "off") return;
  const std::optional<SealKey> up = key_of(bytes_of(offer->key_up())), down = key_of(bytes_of(offer->key_down()));
  if (!up || !down) return;
  const std::string& at = options.fast_path.empty() ? options.address : options.fast_path;
  std::string host = at.substr(0, at.rfind(':'));
  if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  const std::uint32_t port =
      options.fast_path.empty() ? offer->udp_port()
                                : static_cast<std::uint32_t>(std::strtoul(at.c_str() + at.rfind(':') + 1, nullptr, 10));
  Result<std::unique_ptr<FastPath>> opened =
      FastPath::open(host, static_cast<std::uint16_t>(port), {offer->session(), *up, *down}, decided + 1,
                     {.entry = [this](wire::IndexedEntry entry) { take(std::move(entry)); },
                      .dead =
                          [this] {
                            const MutexLock lock(mutex);
                            underway.again();
                            wake.notify_all();
                          },
                      .partner =
                          [this](const CuttingState& partner) {
                            const MutexLock lock(read_mutex);
                            reader->take(partner);
                          },
                      .bone = callbacks.bone,
                      .stop_flag = callbacks.stop_flag});
  if (!opened) return;
  for (const auto& [number, tool] : numbered_tools) (*opened)->know_tool(number, tool);
  const MutexLock lock(fast_mutex);
  fast = std::move(*opened);
}

void RoomSession::Impl::close_fast_path() {
  std::shared_ptr<FastPath> closing_path;
  {
    const MutexLock lock(fast_mutex);
    closing_path = std::move(fast);
  }
  // Stop it before it is released: another owner at this moment may be its own thread.
  if (closing_path) closing_path->stop();
}

grpc::Status RoomSession::Impl::serve(Line& open, std::optional<Error>& broken) {
  {
    const MutexLock lock(mutex);
    if (closing || over) return grpc::Status::CANCELLED;
    open.stream = stub->Session(&open.context);
    line = &open;
    redial.reset();
    underway.stop();
  }
  {
    const MutexLock lock(read_mutex);
    reader->begin();
    passed_on = 0;
    received_leaves = false;
  }
  offer.reset();
  redial_why.clear();
  numbered_tools.clear();
  std::thread writer([&] { write(open); });
  v1::SessionResponse response;
  while (open.stream->Read(&response)) {
    {
      const MutexLock lock(mutex);
      if (over) break;
    }
    const bool delivered = [&] {
      // Under one lock, so that no log entry of a datagram comes between. Such an entry may name a tool that only the
      // fast path knows yet, or follow leaves that are not complete.
      const MutexLock lock(read_mutex);
      follow(response);
      const bool complete = response.has_complete();
      const Result<void> taken = reader->take(std::move(response));
      passed_on = reader->seq().value;
      if (complete) received_leaves = true;
      return taken.has_value();
    }();
    if (!delivered) {
      open.context.TryCancel();
      break;
    }
  }
  {
    const MutexLock lock(mutex);
    line = nullptr;
    wake.notify_all();
  }
  close_fast_path();
  {
    const MutexLock lock(read_mutex);
    broken = reader->fault();
  }
  if (broken) broken->message = "the server sent an invalid message: " + broken->message;
  // Finish waits for the status, which is received once the writer has stopped.
  writer.join();
  return open.stream->Finish();
}

namespace {

// A broken connection can be made again. A decision of the server itself is final.
bool may_come_again(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::OK:
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::CANCELLED:
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return true;
    default:
      return false;
  }
}

}  // namespace

Result<void> RoomSession::Impl::join_again() {
  Backoff backoff(
      room.author.value ^ static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count()),
      {.least = 20ms, .most = 2s});
  while (true) {
    {
      MutexLock lock(mutex);
      const std::chrono::nanoseconds asked = std::exchange(redial, std::nullopt).value_or(0ms);
      wake.wait_for(lock, asked + backoff.next(), [&]() OSTEON_REQUIRES(mutex) { return closing || over; });
      if (closing || over) return {};
    }
    const auto kept = [&] {
      const MutexLock lock(read_mutex);
      return reader->kept();
    }();
    Result<wire::JoinedRoom> again = wire::join_again(joined, wire::ClientKind::haptic, kept);
    if (again) {
      joined = std::move(*again);
      return {};
    }
    if (again.error().code != ErrorCode::unavailable) return tl::unexpected(again.error());
  }
}

void RoomSession::Impl::run() {
  std::optional<Error> why;
  while (!why) {
    Line open;
    std::optional<Error> broken;
    const grpc::Status status = serve(open, broken);
    if (ends()) break;
    const std::string end = redial_why.empty() ? "it closed the connection" : redial_why;
    const std::string said = status.error_message().empty() ? end : status.error_message();
    if (broken) {
      why = broken;
    } else if (!may_come_again(status)) {
      why = Error{ErrorCode::unavailable,
                  "the server ended the session: " + said + "; see whether osteon-server still runs, then join again"};
    } else {
      if (callbacks.message) callbacks.message(Interrupted{{ErrorCode::unavailable, said}});
      const Result<void> again = join_again();
      if (ends()) break;
      if (!again) why = again.error();
    }
  }
  bool closed = false;
  {
    const MutexLock lock(mutex);
    closed = closing;
    over = true;
    wake.notify_all();
  }
  if (why && !closed && callbacks.lost) callbacks.lost(*why);
}

RoomSession::RoomSession(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RoomSession::RoomSession(RoomSession&&) noexcept = default;
RoomSession& RoomSession::operator=(RoomSession&& other) noexcept {
  if (this != &other) {
    close();
    impl_ = std::move(other.impl_);
  }
  return *this;
}
RoomSession::~RoomSession() { close(); }

Result<RoomSession> RoomSession::join(const RoomSessionOptions& options, const std::function<bool()>& stop) {
  Result<wire::JoinedRoom> room = wire::join_room(options.address, wire::ClientKind::haptic, options.name,
                                                  options.patience, stop, options.room, options.credentials);
  if (!room) return tl::unexpected(room.error());
  Result<Case> bone = fetch_case(*room, options.cache, stop);
  if (!bone) return tl::unexpected(bone.error());
  auto impl = std::make_unique<Impl>(std::move(*room), std::move(*bone), options);
  if (Result<void> fetched = fetch_tools(impl->room, *impl->tools); !fetched) return tl::unexpected(fetched.error());
  return RoomSession(std::move(impl));
}

const wire::JoinedRoom& RoomSession::room() const { return impl_->room; }
const Case& RoomSession::bone() const { return impl_->bone; }

const std::shared_ptr<ToolBox>& RoomSession::tools() const { return impl_->tools; }

Result<std::uint32_t> RoomSession::set_item(const SceneItem& item) {
  v1::SetSceneItemRequest request;
  v1::SetSceneItemResponse response;
  request.set_author(impl_->room.author.value);
  *request.mutable_item() = wire::to_wire(item);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 5s);
  const grpc::Status status = v1::RoomService::NewStub(impl_->room.channel)->SetSceneItem(&context, request, &response);
  if (status.ok()) return response.item();
  return failure(status.error_code() == grpc::StatusCode::INVALID_ARGUMENT    ? ErrorCode::invalid_input
                 : status.error_code() == grpc::StatusCode::PERMISSION_DENIED ? ErrorCode::denied
                                                                              : ErrorCode::unavailable,
                 "the server does not set the item: " + status.error_message());
}

void RoomSession::open(RoomCallbacks callbacks) {
  OSTEON_CHECK(!impl_->stub);
  Impl& impl = *impl_;
  // Called for datagrams and for the stream: one at a time.
  if (callbacks.bone)
    callbacks.bone = [this_one = std::make_shared<Mutex>(LockRank::mount_pose),
                      tell = std::move(callbacks.bone)](const MountPose& seen) {
      const MutexLock lock(*this_one);
      tell(seen);
    };
  {
    const MutexLock reading(impl.read_mutex);
    impl.reader.emplace(
        impl.room.author, impl.tools, callbacks,
        [&impl](std::uint64_t author_seq) {
          if (const std::shared_ptr<FastPath> path = impl.fast_path()) path->decided(author_seq);
          const MutexLock lock(impl.mutex);
          impl.underway.decided(author_seq);
        },
        [&impl](std::uint64_t author_seq) {
          const MutexLock lock(impl.mutex);
          impl.underway.go_on(author_seq);
          impl.wake.notify_all();
        });
  }
  impl_->callbacks = std::move(callbacks);
  impl_->stub = v1::CuttingService::NewStub(impl_->room.channel);
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

bool RoomSession::send(const Cut& cut) {
  const MutexLock lock(impl_->mutex);
  if (impl_->closing || impl_->over || !impl_->underway.push(cut)) return false;
  impl_->wake.notify_all();
  return true;
}

void RoomSession::send(const CuttingState& state) {
  const MutexLock lock(impl_->mutex);
  impl_->underway.push(state);
  impl_->wake.notify_all();
}

void RoomSession::send(const MountLoad& push) {
  if (const std::shared_ptr<FastPath> path = impl_->fast_path(); path && path->send(push)) return;
  const auto now = std::chrono::steady_clock::now();
  const MutexLock lock(impl_->mutex);
  if (now < impl_->next_push || !impl_->underway.may_go()) return;
  impl_->next_push = now + kPushesApart;
  impl_->push = push;
  impl_->wake.notify_all();
}

FastPathHealth RoomSession::fast_path() const {
  const std::shared_ptr<FastPath> path = impl_->fast_path();
  return path ? path->health() : FastPathHealth{};
}

void RoomSession::close() {
  if (!impl_ || !impl_->thread.joinable()) return;
  {
    MutexLock lock(impl_->mutex);
    impl_->closing = true;
    impl_->underway.again();  // including what was sent only in datagrams
    impl_->wake.notify_all();
    // The server ends the stream when it has decided what was sent. A server that does not is not waited for.
    impl_->wake.wait_for(lock, kCloseTime, [&]() OSTEON_REQUIRES(impl_->mutex) { return impl_->over; });
    impl_->over = true;
    impl_->wake.notify_all();
    if (impl_->line) impl_->line->context.TryCancel();
  }
  impl_->thread.join();
}

}  // namespace osteon
