#include "viewer_client/net/room_subscription.hpp"

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstdio>
#include <set>
#include <thread>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/plan.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/people.grpc.pb.h"
#include "osteon/v1/plan.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"
#include "osteon/v1/watch.grpc.pb.h"
#include "viewer_client/net/field_source.hpp"
#include "viewer_client/net/open_requests.hpp"

namespace osteon {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kRetryPause{200};
constexpr std::chrono::seconds kAnswerTime{10};
constexpr std::chrono::milliseconds kLookPause{250};

std::int64_t mono_ns() { return std::chrono::nanoseconds(Clock::now().time_since_epoch()).count(); }

// Decodes and checks one block.
Result<ReceivedBlock> receive(const v1::MeshBlock& wire_block, double pitch_mm) {
  const Result<BlockKey> key = wire::key_from_wire(wire_block);
  if (!key) return failure(ErrorCode::invalid_input, "the server sent invalid data: " + key.error().message);
  ReceivedBlock block;
  block.key = *key;
  block.version = wire_block.version();

  BlockPayload payload;
  payload.bytes.assign(wire_block.payload().begin(), wire_block.payload().end());
  const Result<Digest> stated = wire::digest_from_wire(wire_block.mesh_hash());
  if (!stated) return tl::unexpected(stated.error());
  block.mesh_hash = mesh_hash(payload);
  if (block.mesh_hash != *stated) {
    return failure(ErrorCode::invalid_input, "a mesh block from the server does not match its hash");
  }
  if (!payload.bytes.empty()) {
    Result<Mesh> mesh = decode_block(block.key, payload, level_pitch_mm(pitch_mm, block.key.level));
    if (!mesh) return tl::unexpected(mesh.error());
    block.mesh = std::move(*mesh);
  }
  return block;
}

// Where requests go.
struct RequestPath {
  std::shared_ptr<grpc::Channel> channel;  // shared with the stub, which may outlive a rejoin
  OpenRequests* open;
};

// One request to the room and its answer.
template <class Stub, class Response, class Request>
Result<Response> ask(const RequestPath& path,
                     grpc::Status (Stub::*call)(grpc::ClientContext*, const Request&, Response*),
                     const Request& request) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kAnswerTime);
  if (!path.open->add(context)) return failure(ErrorCode::cancelled, "the room is being left");
  Response response;
  Stub stub(path.channel);
  const grpc::Status status = (stub.*call)(&context, request, &response);
  path.open->remove(context);
  if (status.ok()) return response;
  switch (status.error_code()) {
    case grpc::StatusCode::INVALID_ARGUMENT:
      return failure(ErrorCode::invalid_input, status.error_message());
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNAUTHENTICATED:
      return failure(ErrorCode::denied, status.error_message());
    case grpc::StatusCode::UNIMPLEMENTED:
      return failure(ErrorCode::unsupported, status.error_message());
    default:
      return failure(ErrorCode::unavailable, status.error_message());
  }
}

template <class Response>
Result<RoomAnswer> answered(const Response& response, std::optional<int> events = {}) {
  return RoomAnswer{RoomSeq{response.room_seq()}, events, {}};
}

// The item's present state in the room.
Result<SceneItem> standing_item(const RequestPath& path, std::uint32_t id) {
  const auto status = ask(path, &v1::RoomService::Stub::GetStatus, v1::GetStatusRequest{});
  if (!status) return tl::unexpected(status.error());
  for (const v1::SceneItem& item : status->items())
    if (item.item() == id) return wire::from_wire(item);
  return failure(ErrorCode::not_found, "item " + std::to_string(id) + " does not stand in the scene");
}

// Sets a pose, or what the server needs to find a pose on its bone. `before`: a placed item keeps its orientation about
// the axis.
void put(const ItemPlace& where, const Pose& before, v1::SetSceneItemRequest& request) {
  const Vec3 across = where.across.value_or(before.direction(Vec3::UnitX()));
  if (!where.on_bone) {
    *request.mutable_item()->mutable_pose_bone_item() = wire::to_wire(pose_of(where, across));
    return;
  }
  *request.mutable_item()->mutable_pose_bone_item() = wire::to_wire(before);
  *request.mutable_onto_bone()->mutable_near_mm() = wire::to_wire(where.point_mm);
  if (where.along) *request.mutable_onto_bone()->mutable_axis() = wire::to_wire(*where.along);
  *request.mutable_onto_bone()->mutable_across() = wire::to_wire(across);
}

// A request that changes nothing of an item.
v1::SetSceneItemRequest request_for(const SceneItem& standing, std::uint64_t author) {
  v1::SetSceneItemRequest request;
  request.set_author(author);
  *request.mutable_item() = wire::to_wire(standing);
  return request;
}

// `more`: text for the answer in addition to the item's position.
template <class More>
Result<RoomAnswer> set_item(const RequestPath& path, const v1::SetSceneItemRequest& request, More more) {
  const auto answer = ask(path, &v1::RoomService::Stub::SetSceneItem, request);
  if (!answer) return tl::unexpected(answer.error());
  const auto now = wire::from_wire(answer->set());
  if (!now) return tl::unexpected(now.error());
  return RoomAnswer{RoomSeq{answer->room_seq()}, {}, standing_text(*now) + more(*answer, *now)};
}

Result<RoomAnswer> set_item(const RequestPath& path, const v1::SetSceneItemRequest& request) {
  return set_item(path, request, [](const auto&, const auto&) { return std::string(); });
}

// The tools that the window can draw already, without a request to the server.
class KnownTools {
 public:
  KnownTools() {
    for (const Tool& tool : builtin_tools()) add(tool);
  }
  void add(const Tool& tool) {
    names_.insert(tool.name);
    hashes_.insert(tool.hash());
  }
  [[nodiscard]] bool has(const std::string& name) const { return names_.contains(name); }
  [[nodiscard]] bool has(const Digest& hash) const { return hashes_.contains(hash); }
  // True only the first time: a room is not asked repeatedly for a tool that it does not have.
  bool miss(const std::string& name) { return !has(name) && missed_names_.insert(name).second; }
  bool miss(const Digest& hash) { return !has(hash) && missed_hashes_.insert(hash).second; }

 private:
  std::set<std::string> names_, missed_names_;
  std::set<Digest> hashes_, missed_hashes_;
};

}  // namespace

struct RoomSubscription::Impl {
  RoomSubscriptionOptions options;
  RenderQueue& render_queue;
  std::function<bool()> asked_to_stop;
  WatchedRoom room;
  std::atomic<bool> ending{false};
  std::atomic<bool> interrupted{false};
  mutable OpenRequests requests;

  // Guards what both readers and the owner use. Never held during a call to the server.
  mutable Mutex mutex{LockRank::leaf};
  CondVar changed;
  wire::JoinedRoom joined OSTEON_GUARDED_BY(mutex);
  std::uint64_t joins OSTEON_GUARDED_BY(mutex) =
      0;  // rises with every join; shows the second reader that the first has rejoined
  grpc::ClientContext* mesh_context OSTEON_GUARDED_BY(mutex) = nullptr;
  grpc::ClientContext* cutting_context OSTEON_GUARDED_BY(mutex) = nullptr;
  grpc::ClientContext* look_context OSTEON_GUARDED_BY(mutex) = nullptr;
  grpc::ClientContext* plan_context OSTEON_GUARDED_BY(mutex) = nullptr;
  std::optional<Error> failed OSTEON_GUARDED_BY(mutex);
  std::shared_ptr<HeldBone> held OSTEON_GUARDED_BY(mutex);  // shared with whoever looks at it
  std::optional<ViewFrustum> newest_look OSTEON_GUARDED_BY(mutex), said_look OSTEON_GUARDED_BY(mutex);

  std::thread mesh_thread, cutting_thread, look_thread, plan_thread;

  Impl(RoomSubscriptionOptions o, RenderQueue& i, std::function<bool()> s)
      : options(std::move(o)), render_queue(i), asked_to_stop(std::move(s)) {}

  bool stopping() const { return ending.load() || asked_to_stop(); }
  Result<void> join(wire::ReachPatience patience);
  Result<void> rejoin();
  void read_mesh();
  void read_cutting();
  void say_looks();
  void read_plan();
  template <class Request, class Response>
  using OnceCall = std::unique_ptr<grpc::ClientReader<Response>> (v1::PlanService::Stub::*)(grpc::ClientContext*,
                                                                                            const Request&);
  template <class Reader, class Request, class Response>
  auto read_once(OnceCall<Request, Response> call) -> std::optional<decltype(std::declval<Reader>().finish())>;
  Result<void> read_mesh_stream();
  void fetch_tools(const RequestPath& path, std::uint64_t author, KnownTools& known);
  // The same request in the name of the viewer's author.
  template <class Stub, class Response, class Request>
  Result<Response> ask_as_author(grpc::Status (Stub::*call)(grpc::ClientContext*, const Request&, Response*),
                                 Request request) const {
    const auto [path, author] = line();
    request.set_author(author);
    return ask(path, call, request);
  }
  // Path and author of the newest join.
  std::pair<RequestPath, std::uint64_t> line() const {
    const MutexLock lock(mutex);
    return {{joined.channel, &requests}, joined.author.value};
  }
  [[nodiscard]] wire::JoinedRoom newest_join() const {
    const MutexLock lock(mutex);
    return joined;
  }
  // The member that holds the context of one stream.
  using Slot = grpc::ClientContext* Impl::*;
  bool enter(Slot slot, grpc::ClientContext& context);
  void leave(Slot slot);
};

Result<void> RoomSubscription::Impl::join(wire::ReachPatience patience) {
  auto answer = wire::join_room(
      options.address, wire::ClientKind::viewer, options.name, patience, [this] { return stopping(); }, options.room,
      options.credentials);
  if (!answer) return tl::unexpected(answer.error());
  const MutexLock lock(mutex);
  joined = std::move(*answer);
  ++joins;
  changed.notify_all();
  return {};
}

// Joins anew after the connection was lost, because a restarted server does not know the authors of the old one.
Result<void> RoomSubscription::Impl::rejoin() {
  const Digest case_before = newest_join().case_hash;
  do {
    auto again = join(options.patience);
    if (again) {
      if (newest_join().case_hash == case_before) return {};
      return failure(ErrorCode::unsupported,
                     "the server at " + options.address + " now has another case: join the room again to see it");
    }
    if (again.error().code != ErrorCode::unavailable || !options.keep_trying) return again;
  } while (!stopping());
  return failure(ErrorCode::cancelled, "stopped");
}

// Gives the stream's context to end(), which cancels it. False: it was called already.
bool RoomSubscription::Impl::enter(Slot slot, grpc::ClientContext& context) {
  const MutexLock lock(mutex);
  if (ending) return false;
  this->*slot = &context;
  return true;
}

void RoomSubscription::Impl::leave(Slot slot) {
  const MutexLock lock(mutex);
  this->*slot = nullptr;
}

// Returns when the stream ends. No error: the server ended it or is gone. Error: the server sent invalid data.
Result<void> RoomSubscription::Impl::read_mesh_stream() {
  grpc::ClientContext context;
  if (!enter(&Impl::mesh_context, context)) return {};
  const auto [path, author] = line();
  v1::WatchMeshRequest request;
  request.set_author(author);
  {
    const MutexLock lock(mutex);
    if (newest_look) *request.mutable_look() = wire::to_wire(*newest_look);
    said_look = newest_look;
  }
  const auto stub = v1::WatchService::NewStub(path.channel);
  const auto reader = stub->WatchMesh(&context, request);

  Result<void> outcome;
  render_queue.begin_stream();
  v1::WatchMeshResponse message;
  while (outcome && reader->Read(&message)) {
    const std::int64_t received = mono_ns();
    interrupted = false;
    std::vector<ReceivedBlock> blocks;
    blocks.reserve(static_cast<std::size_t>(message.blocks_size()));
    for (const v1::MeshBlock& wire_block : message.blocks()) {
      Result<ReceivedBlock> block = receive(wire_block, room.pitch_mm);
      if (!block) {
        outcome = tl::unexpected(block.error());
        context.TryCancel();
        break;
      }
      blocks.push_back(std::move(*block));
    }
    if (outcome) {
      render_queue.put_mesh(RoomSeq{message.room_seq()}, std::move(blocks), message.snapshot_complete(),
                            message.snapshot_blocks(), received);
    }
  }
  const grpc::Status ended = reader->Finish();
  leave(&Impl::mesh_context);
  if (outcome && !stopping()) {
    log::warn("mesh stream ended", {{"server", options.address}, {"reason", ended.error_message()}});
    // A retry would push out whoever replaced this viewer, or be refused forever.
    if (ended.error_code() == grpc::StatusCode::PERMISSION_DENIED ||
        ended.error_code() == grpc::StatusCode::UNAUTHENTICATED)
      return failure(ErrorCode::denied, "the server ended the session: " + ended.error_message());
  }
  return outcome;
}

// [mesh thread] Only this thread rejoins; the other follows.
void RoomSubscription::Impl::read_mesh() {
  const auto give_up = [this](Error error) {
    const MutexLock lock(mutex);
    failed = std::move(error);
    changed.notify_all();
  };
  while (!stopping()) {
    if (Result<void> outcome = read_mesh_stream(); !outcome) return give_up(outcome.error());
    if (stopping()) return;
    interrupted = true;
    std::this_thread::sleep_for(kRetryPause);
    if (Result<void> again = rejoin(); !again) {
      if (again.error().code == ErrorCode::unavailable) {
        return give_up({ErrorCode::unavailable, "the server at " + options.address +
                                                    " went away and did not come back: start it again, then the "
                                                    "viewer"});
      }
      return give_up(again.error());
    }
  }
}

// [cutting thread] Fetches the tools that the room has and this program does not.
void RoomSubscription::Impl::fetch_tools(const RequestPath& path, std::uint64_t author, KnownTools& known) {
  v1::ListToolsRequest list;
  list.set_author(author);
  const auto tools = ask(path, &v1::RoomService::Stub::ListTools, list);
  if (!tools) return;
  for (const v1::KnownTool& listed : tools->tools()) {
    const Result<Digest> hash = wire::digest_from_wire(listed.tool_hash());
    if (!hash || known.has(*hash)) continue;
    v1::GetToolRequest request;
    request.set_author(author);
    request.set_tool_hash(listed.tool_hash());
    const auto answer = ask(path, &v1::RoomService::Stub::GetTool, request);
    const Result<Tool> tool = answer ? wire::from_wire(answer->tool()) : tl::unexpected(answer.error());
    if (!tool) {
      log::warn("a tool of the room cannot be drawn", {{"name", listed.name()}, {"reason", tool.error().message}});
      continue;
    }
    known.add(*tool);
    render_queue.put_tool(*tool);
  }
}

// [cutting thread]
void RoomSubscription::Impl::read_cutting() {
  KnownTools known;
  std::uint64_t of_join = 0;
  while (!stopping()) {
    std::shared_ptr<grpc::Channel> channel;  // shared with the stub, which may outlive a rejoin
    v1::WatchCuttingRequest request;
    {
      // A stream that ended is reopened with the same join after a pause, and with a new join at once.
      MutexLock lock(mutex);
      changed.wait_for(lock, of_join == 0 ? std::chrono::milliseconds(0) : kRetryPause,
                       [&]() OSTEON_REQUIRES(mutex) { return ending.load() || joins != of_join; });
      if (failed) return;
      of_join = joins;
      channel = joined.channel;
      request.set_author(joined.author.value);
      request.set_most_hz(60);  // more cannot be drawn
    }
    if (interrupted) continue;
    grpc::ClientContext context;
    if (!enter(&Impl::cutting_context, context)) return;
    const auto stub = v1::WatchService::NewStub(channel);
    const auto reader = stub->WatchCutting(&context, request);
    v1::WatchCuttingResponse message;
    while (reader->Read(&message)) {
      std::vector<CuttingState> states;
      for (const v1::CuttingState& wire_state : message.states()) {
        // An unreadable state is left out: the next one comes within 10 ms.
        if (Result<CuttingState> state = wire::from_wire(wire_state)) states.push_back(std::move(*state));
      }
      std::vector<SceneItem> items;
      for (const v1::SceneItem& wire_item : message.items())
        if (Result<SceneItem> item = wire::from_wire(wire_item)) items.push_back(std::move(*item));
      std::vector<BodyId> bodies;
      for (const std::uint32_t body : message.bodies()) bodies.push_back(BodyId{body});
      bool missed = false;
      for (const CuttingState& state : states) missed |= !state.tool_name.empty() && known.miss(state.tool_name);
      for (const SceneItem& item : items) missed |= known.miss(item.tool);
      if (missed) fetch_tools({channel, &requests}, request.author(), known);
      render_queue.put_states(std::move(states), std::move(items), std::move(bodies));
    }
    reader->Finish();
    leave(&Impl::cutting_context);
  }
}

// [look thread] A view that cannot be sent now is sent by the next mesh stream.
void RoomSubscription::Impl::say_looks() {
  while (true) {
    v1::LookFromRequest request;
    std::shared_ptr<grpc::Channel> channel;  // shared with the stub, which may outlive a rejoin
    {
      MutexLock lock(mutex);
      while (!ending && !(newest_look && said_look && !nearly_equal(*said_look, *newest_look))) changed.wait(lock);
      if (ending) return;
      said_look = newest_look;
      channel = joined.channel;
      request.set_author(joined.author.value);
      *request.mutable_look() = wire::to_wire(*newest_look);
    }
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kAnswerTime);
    if (!enter(&Impl::look_context, context)) return;
    v1::LookFromResponse response;
    (void)v1::WatchService::NewStub(channel)->LookFrom(&context, request, &response);
    leave(&Impl::look_context);
    MutexLock lock(mutex);
    changed.wait_for(lock, kLookPause, [&] { return ending.load(); });
  }
}

// [plan thread] Plan and density of a case never change, so each is read once. A lost connection is tried again after
// the mesh thread has rejoined. Nothing: the server is older, or the subscription ends.
template <class Reader, class Request, class Response>
auto RoomSubscription::Impl::read_once(OnceCall<Request, Response> call)
    -> std::optional<decltype(std::declval<Reader>().finish())> {
  while (!stopping()) {
    const auto [path, author] = line();
    Request request;
    request.set_author(author);
    grpc::ClientContext context;
    if (!enter(&Impl::plan_context, context)) return {};
    const auto stub = v1::PlanService::NewStub(path.channel);
    const auto reader = (stub.get()->*call)(&context, request);
    Reader whole;
    Result<void> outcome;
    Response message;
    while (outcome && reader->Read(&message)) outcome = whole.add(message);
    if (!outcome) context.TryCancel();
    const grpc::Status ended = reader->Finish();
    leave(&Impl::plan_context);
    if (!outcome) return tl::unexpected(outcome.error());
    if (ended.ok()) return whole.finish();
    if (ended.error_code() == grpc::StatusCode::UNIMPLEMENTED) return {};  // an older server
    // A restarted server knows the author no more, until the mesh thread has joined anew. With tickets it says so by
    // PERMISSION_DENIED, without them by INVALID_ARGUMENT.
    const bool denied = ended.error_code() == grpc::StatusCode::PERMISSION_DENIED;
    if (!denied && ended.error_code() != grpc::StatusCode::UNAVAILABLE &&
        ended.error_code() != grpc::StatusCode::INVALID_ARGUMENT)
      return failure(ErrorCode::unavailable, ended.error_message());
    MutexLock lock(mutex);
    const auto over = [&, author = author]() OSTEON_REQUIRES(mutex) {
      return ending || failed || (denied && joined.author.value != author);
    };
    changed.wait_for(lock, denied ? options.patience : std::chrono::milliseconds(1000), over);
    if (failed) return {};
    if (denied && joined.author.value == author) return failure(ErrorCode::unavailable, ended.error_message());
  }
  return {};
}

void RoomSubscription::Impl::read_plan() {
  if (auto plan = read_once<wire::PlanReader>(&v1::PlanService::Stub::GetPlan)) {
    if (*plan) (*plan)->bone_mm = room.bounds;
    if (*plan)
      render_queue.put_plan(std::move(**plan));
    else
      render_queue.put_plan_fault("Structures at risk are not shown: " + plan->error().message);
  }
  if (auto density = read_once<wire::DensityReader>(&v1::PlanService::Stub::GetDensity)) {
    if (*density)
      render_queue.put_density(std::move(**density));
    else
      log::warn("cut faces are painted without density", {{"reason", density->error().message}});
  }
}

RoomSubscription::RoomSubscription(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<RoomSubscription>> RoomSubscription::start(const RoomSubscriptionOptions& options,
                                                                  RenderQueue& render_queue,
                                                                  std::function<bool()> stop) {
  auto impl = std::make_unique<Impl>(options, render_queue, std::move(stop));
  if (Result<void> first = impl->join({options.patience, options.refused_patience}); !first)
    return tl::unexpected(first.error());
  const wire::JoinedRoom joined = impl->newest_join();
  impl->room = {joined.case_title, joined.pitch_mm, joined.bounds};
  if (options.first_look) {
    const MutexLock lock(impl->mutex);
    impl->newest_look = options.first_look(impl->room.bounds);
  }
  impl->mesh_thread = std::thread([&at = *impl] { at.read_mesh(); });
  impl->cutting_thread = std::thread([&at = *impl] { at.read_cutting(); });
  impl->look_thread = std::thread([&at = *impl] { at.say_looks(); });
  impl->plan_thread = std::thread([&at = *impl] { at.read_plan(); });
  return std::unique_ptr<RoomSubscription>(new RoomSubscription(std::move(impl)));
}

void RoomSubscription::end() {
  impl_->requests.cancel_all();
  // Its lock has the rank of this one.
  if (const std::shared_ptr<HeldBone> held = held_bone()) held->end();
  const MutexLock lock(impl_->mutex);
  impl_->ending = true;
  if (impl_->mesh_context != nullptr) impl_->mesh_context->TryCancel();
  if (impl_->cutting_context != nullptr) impl_->cutting_context->TryCancel();
  if (impl_->look_context != nullptr) impl_->look_context->TryCancel();
  if (impl_->plan_context != nullptr) impl_->plan_context->TryCancel();
  impl_->changed.notify_all();
}

RoomSubscription::~RoomSubscription() {
  end();
  hold_bone(false);
  impl_->mesh_thread.join();
  impl_->cutting_thread.join();
  impl_->look_thread.join();
  impl_->plan_thread.join();
}

const WatchedRoom& RoomSubscription::room() const { return impl_->room; }

wire::JoinedRoom RoomSubscription::joined() const {
  const MutexLock lock(impl_->mutex);
  return impl_->joined;
}

std::optional<Error> RoomSubscription::failure_seen() const {
  const MutexLock lock(impl_->mutex);
  return impl_->failed;
}

void RoomSubscription::look(const ViewFrustum& from) {
  const MutexLock lock(impl_->mutex);
  impl_->newest_look = from;
  impl_->changed.notify_all();
}

void RoomSubscription::hold_bone(bool wanted) {
  if (wanted == (held_bone() != nullptr)) return;
  std::shared_ptr<HeldBone> made;  // shared as `held` is
  if (wanted)
    made = HeldBone::start(field_of_server({.room = [&at = *impl_] { return at.newest_join(); },
                                            .cache = impl_->options.cache,
                                            .patience = impl_->options.patience}));
  {
    const MutexLock lock(impl_->mutex);
    std::swap(impl_->held, made);
    if (impl_->ending && impl_->held) std::swap(impl_->held, made);
  }
  // Somebody may share it, so it does not end with this pointer. Its source asks this subscription for the room.
  if (made) made->end_and_join();
}

std::shared_ptr<HeldBone> RoomSubscription::held_bone() const {
  const MutexLock lock(impl_->mutex);
  return impl_->held;
}

bool RoomSubscription::interrupted() const { return impl_->interrupted.load(); }

Result<RoomAnswer> RoomSubscription::ping() {
  v1::ListToolsRequest request;
  const auto answer = impl_->ask_as_author(&v1::RoomService::Stub::ListTools, request);
  return answer ? Result<RoomAnswer>(RoomAnswer{}) : tl::unexpected(answer.error());
}

Result<RoomAnswer> RoomSubscription::share_shots(const ShotRun& run, const ShotTotals& session) {
  v1::ShareShotsRequest request;
  *request.mutable_run() = wire::to_wire(run);
  *request.mutable_session() = wire::to_wire(session);
  const auto answer = impl_->ask_as_author(&v1::PeopleService::Stub::ShareShots, request);
  if (answer) return RoomAnswer{};
  if (answer.error().code != ErrorCode::unsupported) return tl::unexpected(answer.error());
  return failure(ErrorCode::unsupported,
                 "the server is older than this window; install a newer Osteon where the server runs");
}

Result<std::uint32_t> RoomSubscription::draw(const Annotation& drawn) {
  v1::AnnotateRequest request;
  *request.mutable_drawn() = wire::to_wire(drawn);
  const auto answer = impl_->ask_as_author(&v1::PeopleService::Stub::Annotate, request);
  if (!answer) return tl::unexpected(answer.error());
  return answer->annotation();
}

Result<void> RoomSubscription::wipe_off(std::uint32_t annotation) {
  v1::AnnotateRequest request;
  request.set_wipe_off(annotation);
  const auto answer = impl_->ask_as_author(&v1::PeopleService::Stub::Annotate, request);
  if (!answer) return tl::unexpected(answer.error());
  return {};
}

Result<RoomAnswer> RoomSubscription::undo(std::uint32_t count) {
  v1::UndoRequest request;
  request.set_count(count);
  const auto answer = impl_->ask_as_author(&v1::RoomService::Stub::Undo, request);
  return answer ? answered(*answer, answer->undone_size()) : tl::unexpected(answer.error());
}

Result<RoomAnswer> RoomSubscription::undo_to(RoomSeq mark) {
  v1::UndoRequest request;
  request.set_to_mark(mark.value);
  const auto answer = impl_->ask_as_author(&v1::RoomService::Stub::Undo, request);
  return answer ? answered(*answer, answer->undone_size()) : tl::unexpected(answer.error());
}

Result<RoomAnswer> RoomSubscription::mark(const std::string& label) {
  v1::MarkRequest request;
  request.set_label(label);
  const auto answer = impl_->ask_as_author(&v1::RoomService::Stub::Mark, request);
  if (!answer) return tl::unexpected(answer.error());
  return RoomAnswer{RoomSeq{answer->room_seq()}, {}, "mark " + std::to_string(answer->room_seq())};
}

Result<RoomAnswer> RoomSubscription::redo(std::uint32_t count) {
  v1::RedoRequest request;
  request.set_count(count);
  const auto answer = impl_->ask_as_author(&v1::RoomService::Stub::Redo, request);
  return answer ? answered(*answer, answer->redone_size()) : tl::unexpected(answer.error());
}

Result<RoomAnswer> RoomSubscription::remove_body(BodyId body) {
  v1::RemoveBodyRequest request;
  request.set_body(body.value);
  const auto answer = impl_->ask_as_author(&v1::RoomService::Stub::RemoveBody, request);
  return answer ? answered(*answer) : tl::unexpected(answer.error());
}

Result<RoomAnswer> RoomSubscription::place(const std::string& tool, const ItemPlace& where, BodyId body) {
  const auto [path, author] = impl_->line();
  v1::ListToolsRequest list;
  list.set_author(author);
  const auto tools = ask(path, &v1::RoomService::Stub::ListTools, list);
  if (!tools) return tl::unexpected(tools.error());
  v1::SetSceneItemRequest request;
  request.set_author(author);
  for (const v1::KnownTool& known : tools->tools())
    if (known.name() == tool) request.mutable_item()->set_tool_hash(known.tool_hash());
  if (request.item().tool_hash().empty())
    return failure(ErrorCode::not_found, "the room knows no tool of the name " + tool);
  request.mutable_item()->set_body(body.value);
  put(where, Pose{}, request);
  return set_item(path, request);
}

Result<RoomAnswer> RoomSubscription::move_item(std::uint32_t item, const ItemPlace& where) {
  const auto [path, author] = impl_->line();
  const auto standing = standing_item(path, item);
  if (!standing) return tl::unexpected(standing.error());
  v1::SetSceneItemRequest request = request_for(*standing, author);
  put(where, standing->pose_bone_item, request);
  return set_item(path, request);
}

Result<RoomAnswer> RoomSubscription::turn_item(std::uint32_t item, double turns) {
  const auto [path, author] = impl_->line();
  const auto standing = standing_item(path, item);
  if (!standing) return tl::unexpected(standing.error());
  v1::SetSceneItemRequest request = request_for(*standing, author);
  request.set_thread_turns(turns);
  return set_item(path, request);
}

Result<RoomAnswer> RoomSubscription::seat_item(std::uint32_t item, double most_mm) {
  const auto [path, author] = impl_->line();
  const auto standing = standing_item(path, item);
  if (!standing) return tl::unexpected(standing.error());
  v1::SetSceneItemRequest request = request_for(*standing, author);
  request.set_drive_home_mm(most_mm);
  return set_item(path, request, [&](const v1::SetSceneItemResponse& answer, const SceneItem& now) {
    char way[80];
    std::snprintf(way, sizeof way, "; advanced %.2f mm, %.0f %% of it on bone",
                  (now.pose_bone_item.position_mm - standing->pose_bone_item.position_mm).norm(),
                  100.0 * answer.contact_fraction());
    return std::string(way);
  });
}

Result<RoomAnswer> RoomSubscription::remove_item(std::uint32_t item) {
  const auto [path, author] = impl_->line();
  v1::RemoveSceneItemRequest request;
  request.set_author(author);
  request.set_item(item);
  const auto answer = ask(path, &v1::RoomService::Stub::RemoveSceneItem, request);
  return answer ? answered(*answer) : tl::unexpected(answer.error());
}

Result<RoomAnswer> RoomSubscription::save(const std::string& file_name) {
  const auto [path, author] = impl_->line();
  v1::SaveFieldsRequest request;
  request.set_author(author);
  request.set_file_name(file_name);
  const auto answer = ask(path, &v1::RoomService::Stub::SaveFields, request);
  return answer ? answered(*answer) : tl::unexpected(answer.error());
}

}  // namespace osteon
