#include "common/core/mutex.hpp"
#include "server/rpc/services.hpp"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "common/field/kernel.hpp"
#include "common/link/random_bytes.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/room.grpc.pb.h"
#include "server/auth/connections.hpp"
#include "server/rpc/called_room.inl"

namespace osteon {
namespace {

// Sends the case's files, read in parts on the thread for files.
class CaseStream final : public OutStream<WriteReactor> {
 public:
  static constexpr std::size_t kPieceBytes = 1024 * 1024;

  CaseStream(JobThread& files, std::filesystem::path folder) : files_(files), folder_(std::move(folder)) {}
  void start() { read_next_later(); }

 private:
  static constexpr std::array<const char*, 2> kFiles{"case.json", "bone.vdb"};

  void read_next_later() {
    files_.run([this, keep = self()] { read_next(); });
  }
  void read_next() {
    const std::filesystem::path path = folder_ / kFiles[file_index_];
    if (!file_.is_open()) {
      std::error_code failed;
      file_size_ = std::filesystem::file_size(path, failed);
      file_.open(path, std::ios::binary);
      if (failed || !file_)
        return close({StatusCode::INTERNAL, "the server cannot read its case's " + path.filename().string()});
      sent_ = 0;
    }
    v1::GetCaseResponse response;
    response.set_file(kFiles[file_index_]);
    response.set_file_size(file_size_);
    std::string& data = *response.mutable_data();
    data.resize(std::min<std::uintmax_t>(kPieceBytes, file_size_ - sent_));
    if (!file_.read(data.data(), static_cast<std::streamsize>(data.size())))
      return close({StatusCode::INTERNAL, "the server cannot read its case's " + path.filename().string()});
    sent_ += data.size();
    if (sent_ == file_size_) {
      file_.close();
      ++file_index_;
    }
    Bytes piece = serialised(response);
    const MutexLock lock(mutex_);
    waiting_ = std::move(piece);
    pump();
    if (file_index_ == kFiles.size()) close_locked(Status::OK);
  }
  bool take(ByteBuffer& message) override OSTEON_REQUIRES(mutex_) {
    if (!waiting_) return false;
    message = buffer_of({std::exchange(waiting_, nullptr)});
    if (file_index_ < kFiles.size()) read_next_later();
    return true;
  }
  void leave() override {}

  JobThread& files_;
  const std::filesystem::path folder_;
  Bytes waiting_ OSTEON_GUARDED_BY(mutex_);
  // Used by the reading job. The next job is queued only after this one has handed over its part.
  std::size_t file_index_ = 0;
  std::ifstream file_;
  std::uintmax_t file_size_ = 0, sent_ = 0;
};

constexpr std::uint64_t kLongestUndoMs = 1'000'000'000'000;  // longer than any room

// Why a program of these versions cannot join; OK if it can.
Status judge(const v1::JoinRequest& request) {
  if (const Result<void> known = wire::check_protocol_version(request.protocol_version()); !known)
    return status_of(known.error());
  const bool needs_kernel = request.kind() == v1::CLIENT_KIND_HAPTIC;
  if (request.kernel_version() != kKernelVersion && (needs_kernel || request.kernel_version() != 0))
    return {StatusCode::FAILED_PRECONDITION,
            "the client speaks cut kernel version " + std::to_string(request.kernel_version()) +
                " and the server cut kernel version " + std::to_string(kKernelVersion) +
                "; install the same Osteon release on both"};
  if (!v1::ClientKind_IsValid(request.kind()) || request.kind() == v1::CLIENT_KIND_UNSPECIFIED)
    return invalid("kind is not a kind of client that this server knows");
  if (request.name().size() > 256) return invalid("name is longer than 256 bytes");
  return Status::OK;
}

template <class Base>
using WithTools = v1::RoomService::WithCallbackMethod_ListTools<
    v1::RoomService::WithCallbackMethod_GetTool<v1::RoomService::WithCallbackMethod_AddTool<Base>>>;
template <class Base>
using WithEvents = v1::RoomService::WithCallbackMethod_Undo<v1::RoomService::WithCallbackMethod_Redo<
    v1::RoomService::WithCallbackMethod_Mark<v1::RoomService::WithCallbackMethod_RemoveBody<
        v1::RoomService::WithCallbackMethod_SetSceneItem<v1::RoomService::WithCallbackMethod_RemoveSceneItem<
            v1::RoomService::WithCallbackMethod_SaveFields<Base>>>>>>>;
using RoomBase =
    WithTools<WithEvents<v1::RoomService::WithCallbackMethod_Join<v1::RoomService::WithCallbackMethod_GetStatus<
        v1::RoomService::WithRawCallbackMethod_GetCase<v1::RoomService::Service>>>>>;

class RoomServiceImpl final : public RoomBase {
 public:
  explicit RoomServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  grpc::ServerUnaryReactor* Join(grpc::CallbackServerContext* context, const v1::JoinRequest* request,
                                 v1::JoinResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::JoinRequest>(rooms_, *context, reactor)) return reactor;
    if (Status status = judge(*request); !status.ok()) {
      rooms_.refusals.note(status.error_code() == StatusCode::FAILED_PRECONDITION ? "version" : "request",
                           address_of(context->peer()), status.error_message());
      return refuse(reactor, std::move(status));
    }
    if (const std::optional<std::string> why = rooms_.draining()) {
      rooms_.refusals.count("draining");
      return refuse(reactor, {StatusCode::UNAVAILABLE, *why});
    }
    const std::shared_ptr<OpenRoom> room = room_of(rooms_, *context, reactor);
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!room || !caller) {
      rooms_.refusals.note("room", address_of(context->peer()),
                           caller ? "there is no such room" : caller.error().message);
      return room ? refuse(reactor, status_of(caller.error())) : reactor;
    }
    if (Result<void> may = may_join(*caller, *request); !may) {
      rooms_.refusals.note("role", address_of(context->peer()), may.error().message);
      return refuse(reactor, status_of(may.error()));
    }
    room->runtime().run_slowly([this, room, reactor, context, request, response, caller = *caller] {
      RoomRuntime& runtime = room->runtime();
      const bool again = request->resume_author() != 0;
      const Authorizer::Coming coming = again ? Authorizer::Coming::again : Authorizer::Coming::anew;
      // First checks what was acknowledged to the caller: after a loss, the caller's number may belong to another
      // person.
      if (const Result<void> kept = again ? check_witness(runtime, *request) : Result<void>(); !kept) {
        rooms_.refusals.note("loss", address_of(context->peer()), kept.error().message);
        return reactor->Finish(status_of(kept.error()));
      }
      // Not sooner, since others may have joined while this call waited for its turn. A caller that was displaced must
      // not change the room.
      if (const Result<void> may = again ? may_resume(caller, *room, *request) : Result<void>(); !may) {
        rooms_.refusals.note("role", address_of(context->peer()), may.error().message);
        return reactor->Finish(status_of(may.error()));
      }
      const std::optional<Role> role = rooms_.authorizer ? std::optional(caller.role) : std::nullopt;
      const Result<AuthorId> author =
          again ? come_back(runtime, *request, role) : come(runtime, *request, *response, caller);
      if (!author) {
        rooms_.refusals.note("room", address_of(context->peer()), author.error().message);
        return reactor->Finish(status_of(author.error()));
      }
      if (rooms_.authorizer)
        if (const Result<void> seated = rooms_.authorizer->joined(caller, room->name, request->kind(), *author, coming);
            !seated)
          return reactor->Finish(status_of(seated.error()));
      room->note_version(*author, request->protocol_version());
      log::info("joined", {{"room", room->name},
                           {"author", author->value},
                           {"kind", v1::ClientKind_Name(request->kind())},
                           {"again", again},
                           {"protocol_version", request->protocol_version()}});
      describe(*room, *author, caller.role, *response);
      reactor->Finish(Status::OK);
    });
    return reactor;
  }

  grpc::ServerUnaryReactor* GetStatus(grpc::CallbackServerContext* context, const v1::GetStatusRequest*,
                                      v1::GetStatusResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::GetStatusRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of(rooms_, *context, reactor);
    if (!room) return reactor;
    room->runtime().run_slowly([room, reactor, response] {
      const BoneStatus status = room->runtime().bone_status();
      const RuntimeHealth health = room->runtime().health();
      response->set_room_seq(status.room_seq.value);
      response->set_field_hash(wire::to_wire(status.field_hash));
      response->set_removed_mm3(status.removed_mm3);
      response->set_rejected(status.counts.rejected);
      response->set_subscribers(static_cast<std::uint32_t>(health.mesh_streams + health.cutting_streams));
      for (const BodyId body : status.bodies) response->add_bodies(body.value);
      for (const SceneItem& item : room->runtime().items()) *response->add_items() = wire::to_wire(item);
      for (const auto& [seq, label] : room->runtime().marks()) {
        v1::RoomMark& mark = *response->add_marks();
        mark.set_room_seq(seq.value);
        mark.set_label(label);
      }
      v1::TickHealth& tick = *response->mutable_tick();
      tick.set_ticks(health.tick.work.count());
      tick.set_missed(health.tick.missed);
      tick.set_late_p50_us(health.tick.lateness.percentile_us(50));
      tick.set_late_p99_us(health.tick.lateness.percentile_us(99));
      tick.set_late_max_us(health.tick.lateness.max_us());
      tick.set_work_p50_us(health.tick.work.percentile_us(50));
      tick.set_work_p99_us(health.tick.work.percentile_us(99));
      reactor->Finish(Status::OK);
    });
    return reactor;
  }

  WriteReactor* GetCase(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    if (const auto why = refusal_of<v1::GetCaseRequest>(rooms_, *context)) return refused(*why);
    const auto request = parse<v1::GetCaseRequest>(*bytes);
    if (!request) return refused(invalid("the GetCaseRequest could not be parsed"));
    const Result<Digest> hash = wire::digest_from_wire(request->case_hash());
    if (!hash) return refused(invalid("case_hash is not a digest of 32 bytes"));
    const std::optional<KnownCase> served = rooms_.find_case(*hash);
    if (!served) return refused({StatusCode::NOT_FOUND, "this server has no case " + to_hex(*hash)});
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused(status_of(caller.error()));
    std::string of_room;
    if (rooms_.authorizer) {
      // A ticket for a room gives no access to another room's case.
      const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context);
      if (!room) return refused(status_of(room.error()));
      if ((*room)->runtime().bone().hash() != *hash)
        return refused(
            {StatusCode::PERMISSION_DENIED, "case " + to_hex(*hash) + " is not that of room " + (*room)->name});
      of_room = (*room)->name;
    }
    CaseStream* stream = CaseStream::launch(std::make_shared<CaseStream>(rooms_.files, served->folder), context);
    if (stream->stand_under(rooms_.authorizer, *caller, of_room, {}, "/osteon.v1.RoomService/GetCase")) stream->start();
    return stream;
  }

  grpc::ServerUnaryReactor* ListTools(grpc::CallbackServerContext* context, const v1::ListToolsRequest* request,
                                      v1::ListToolsResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::ListToolsRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    for (const ToolBox::Entry* entry : room->runtime().tools().entries()) {
      v1::KnownTool& tool = *response->add_tools();
      tool.set_tool_hash(wire::to_wire(entry->hash));
      tool.set_name(entry->tool.name);
      tool.set_title(entry->tool.title);
      tool.set_cuts(entry->body.cuts());
    }
    reactor->Finish(Status::OK);
    return reactor;
  }

  grpc::ServerUnaryReactor* GetTool(grpc::CallbackServerContext* context, const v1::GetToolRequest* request,
                                    v1::GetToolResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::GetToolRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    const Result<Digest> hash = wire::digest_from_wire(request->tool_hash());
    if (!hash) return refuse(reactor, invalid("tool_hash is not a digest of 32 bytes"));
    const ToolBox::Entry* entry = room->runtime().tools().find(*hash);
    if (!entry) return refuse(reactor, {StatusCode::NOT_FOUND, "the room knows no tool " + to_hex(*hash)});
    *response->mutable_tool() = wire::to_wire(entry->tool);
    reactor->Finish(Status::OK);
    return reactor;
  }

  grpc::ServerUnaryReactor* AddTool(grpc::CallbackServerContext* context, const v1::AddToolRequest* request,
                                    v1::AddToolResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::AddToolRequest>(rooms_, *context, reactor)) return reactor;
    Result<Tool> tool = wire::from_wire(request->tool());
    if (!tool) return refuse(reactor, invalid(tool.error().message));
    return change(
        *context, reactor, request->author(),
        [by = AuthorId{request->author()}, tool = *tool](Room& room) { return room.add_tool(by, tool); },
        [response](const RoomEvent& event) {
          response->set_room_seq(event.room_seq.value);
          response->set_tool_hash(wire::to_wire(event.tool->hash));
        });
  }

  grpc::ServerUnaryReactor* Undo(grpc::CallbackServerContext* context, const v1::UndoRequest* request,
                                 v1::UndoResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::UndoRequest>(rooms_, *context, reactor)) return reactor;
    std::vector<RoomSeq> seqs;
    for (const std::uint64_t seq : request->room_seqs()) seqs.push_back(RoomSeq{seq});
    const bool by_count = request->count() != 0 || request->of_author() != 0;
    const std::chrono::milliseconds newest(std::min<std::uint64_t>(request->newest_ms(), kLongestUndoMs));
    if (int{by_count} + int{!seqs.empty()} + int{request->to_mark() != 0} + int{newest.count() > 0} +
            int{request->all()} >
        1)
      return refuse(reactor, invalid("an UndoRequest has one of count, room_seqs, to_mark, newest_ms and all"));
    return change(
        *context, reactor, request->author(),
        [by = AuthorId{request->author()}, of = AuthorId{request->of_author()}, count = request->count(), seqs,
         mark = RoomSeq{request->to_mark()}, newest, all = request->all()](Room& room) -> Result<RoomEvent> {
          if (all && !room.people().supervises(by))
            return failure(ErrorCode::denied, "only an instructor takes everything back, to the imported bone");
          if (all) return room.undo_to(by, RoomSeq{});
          if (newest.count() > 0) return room.undo_since(by, room.time() - newest);
          if (mark) return room.undo_to(by, mark);
          return seqs.empty() ? room.undo_last(by, count, of) : room.undo(by, seqs);
        },
        [response](const RoomEvent& event) {
          response->set_room_seq(event.room_seq.value);
          for (const RoomSeq seq : event.seqs) response->add_undone(seq.value);
        });
  }

  grpc::ServerUnaryReactor* Redo(grpc::CallbackServerContext* context, const v1::RedoRequest* request,
                                 v1::RedoResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::RedoRequest>(rooms_, *context, reactor)) return reactor;
    return change(
        *context, reactor, request->author(),
        [by = AuthorId{request->author()}, count = request->count()](Room& room) { return room.redo_last(by, count); },
        [response](const RoomEvent& event) {
          response->set_room_seq(event.room_seq.value);
          for (const RoomSeq seq : event.seqs) response->add_redone(seq.value);
        });
  }

  grpc::ServerUnaryReactor* Mark(grpc::CallbackServerContext* context, const v1::MarkRequest* request,
                                 v1::MarkResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::MarkRequest>(rooms_, *context, reactor)) return reactor;
    return change(
        *context, reactor, request->author(),
        [by = AuthorId{request->author()}, label = request->label()](Room& room) { return room.mark(by, label); },
        [response](const RoomEvent& event) { response->set_room_seq(event.room_seq.value); });
  }

  grpc::ServerUnaryReactor* RemoveBody(grpc::CallbackServerContext* context, const v1::RemoveBodyRequest* request,
                                       v1::RemoveBodyResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::RemoveBodyRequest>(rooms_, *context, reactor)) return reactor;
    return change(
        *context, reactor, request->author(),
        [by = AuthorId{request->author()}, body = BodyId{request->body()}](Room& room) {
          return room.remove_body(by, body);
        },
        [response](const RoomEvent& event) { response->set_room_seq(event.room_seq.value); });
  }

  grpc::ServerUnaryReactor* SetSceneItem(grpc::CallbackServerContext* context, const v1::SetSceneItemRequest* request,
                                         v1::SetSceneItemResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::SetSceneItemRequest>(rooms_, *context, reactor)) return reactor;
    const Result<SceneItem> item = wire::from_wire(request->item());
    if (!item) return refuse(reactor, invalid(item.error().message));
    const Result<Placing> placing = wire::placing_from_wire(*request);
    if (!placing) return refuse(reactor, invalid(placing.error().message));
    return change(
        *context, reactor, request->author(),
        [by = AuthorId{request->author()}, item = *item, placing = *placing](Room& room) {
          return room.set_item(by, item, placing);
        },
        [response](const RoomEvent& event) {
          response->set_room_seq(event.room_seq.value);
          response->set_item(event.item);
          *response->mutable_set() = wire::to_wire(event.set->item);
          response->set_contact_fraction(event.set->contact_fraction);
        });
  }

  grpc::ServerUnaryReactor* RemoveSceneItem(grpc::CallbackServerContext* context,
                                            const v1::RemoveSceneItemRequest* request,
                                            v1::RemoveSceneItemResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::RemoveSceneItemRequest>(rooms_, *context, reactor)) return reactor;
    return change(
        *context, reactor, request->author(),
        [by = AuthorId{request->author()}, item = request->item()](Room& room) { return room.remove_item(by, item); },
        [response](const RoomEvent& event) { response->set_room_seq(event.room_seq.value); });
  }

  grpc::ServerUnaryReactor* SaveFields(grpc::CallbackServerContext* context, const v1::SaveFieldsRequest* request,
                                       v1::SaveFieldsResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::SaveFieldsRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    if (room->save.empty())
      return refuse(reactor,
                    {StatusCode::FAILED_PRECONDITION, "this server saves nothing; start it with --save FILE.vdb"});
    // A client may not name a folder, as it could then write anywhere on the server's disk.
    const std::filesystem::path name = request->file_name();
    if (!name.empty() && (name != name.filename() || name.extension() != ".vdb" || request->file_name().front() == '.'))
      return refuse(reactor, invalid("file_name is not a plain name that ends in .vdb"));
    const std::filesystem::path file = name.empty() ? room->save : room->save.parent_path() / name;
    room->runtime().run_slowly([room, reactor, response, file] {
      room->runtime().find_pieces();
      const SavedFields saved = room->runtime().saved_fields();
      if (const Result<void> written = save_fields(file, saved); !written)
        return reactor->Finish(status_of(written.error()));
      response->set_room_seq(saved.room_seq.value);
      response->set_field_hash(wire::to_wire(field_hash(saved.leaves, room->runtime().bone().pitch_mm())));
      response->set_file(file.filename().string());
      reactor->Finish(Status::OK);
    });
    return reactor;
  }

 private:
  // A new identity, and the secret that proves it.
  static Result<AuthorId> come(RoomRuntime& runtime, const v1::JoinRequest& request, v1::JoinResponse& response,
                               const Caller& caller) {
    const MemberKind kind = request.kind() == v1::CLIENT_KIND_HAPTIC ? MemberKind::surgeon : MemberKind::watcher;
    std::array<std::uint8_t, 32> secret{};
    system_random()(secret);
    response.set_secret(secret.data(), secret.size());
    // Others see the name in the certificate, if there is one.
    return runtime.join(kind, caller.user.empty() ? request.name() : caller.user, digest_of_secret(response.secret()),
                        caller.role);
  }
  static Result<void> check_witness(RoomRuntime& runtime, const v1::JoinRequest& request) {
    if (request.durable_room_seq() == 0) return {};
    const Result<Digest> chain = wire::digest_from_wire(request.durable_chain());
    if (!chain) return failure(ErrorCode::invalid_input, "durable_chain is not a digest of 32 bytes");
    // Programs from before there were seals send none.
    const Result<Digest> seal = wire::digest_from_wire(request.durable_seal());
    return runtime.check_witness({{RoomSeq{request.durable_room_seq()}, *chain}, seal ? *seal : Digest{}});
  }
  // What a client needs to know of the room that it has joined.
  static void describe(OpenRoom& room, AuthorId author, Role role, v1::JoinResponse& response) {
    const Case& bone = room.runtime().bone();
    response.set_author(author.value);
    response.set_room(room.name);
    response.set_server_epoch(room.server_epoch);
    response.set_lease_epoch(room.runtime().lease_epoch(author));
    response.set_case_hash(wire::to_wire(bone.hash()));
    response.set_case_title(bone.info().title);
    response.set_pitch_mm(bone.pitch_mm());
    const Box bounds = bone.bounds();
    *response.mutable_bounds_min_mm() = wire::to_wire(bounds.min_mm);
    *response.mutable_bounds_max_mm() = wire::to_wire(bounds.max_mm);
    response.set_room_seq(room.runtime().room_seq().value);
    response.set_role(static_cast<v1::Role>(role));
  }
  // Called after check_witness(). `role`: the caller's role now; nothing: not checked.
  static Result<AuthorId> come_back(RoomRuntime& runtime, const v1::JoinRequest& request, std::optional<Role> role) {
    const AuthorId author{request.resume_author()};
    const Result<void> may = runtime.resume(author, digest_of_secret(request.secret()), {}, role);
    if (!may) return tl::unexpected(may.error());
    return author;
  }
  [[nodiscard]] Result<void> may_resume(const Caller& caller, const OpenRoom& room,
                                        const v1::JoinRequest& request) const {
    if (!rooms_.authorizer) return {};
    return rooms_.authorizer->check_resume(caller, room.name, request.kind(), AuthorId{request.resume_author()});
  }
  // The checks that do not follow from the name of the call.
  [[nodiscard]] Result<void> may_join(const Caller& caller, const v1::JoinRequest& request) const {
    if (rooms_.authorizer && request.kind() == v1::CLIENT_KIND_HAPTIC && !has_right(caller.role, Right::hold_a_tool))
      return failure(ErrorCode::denied, "your role here, " + std::string(to_string(caller.role)) +
                                            ", holds no tool; join as a viewer, or ask for a ticket of another role");
    return {};
  }
  template <class Fill>
  grpc::ServerUnaryReactor* change(const grpc::CallbackServerContext& context, grpc::ServerUnaryReactor* reactor,
                                   std::uint64_t author, std::function<Result<RoomEvent>(Room&)> event, Fill fill) {
    const std::shared_ptr<OpenRoom> room = room_of(rooms_, context, reactor, AuthorId{author});
    return room ? change_room(*room, reactor, std::move(event), fill) : reactor;
  }

  Rooms& rooms_;
};

}  // namespace

Digest digest_of_secret(std::string_view secret) {
  Hasher hasher;
  hasher.text(secret);
  return hasher.finish();
}

std::unique_ptr<grpc::Service> make_room_service(Rooms& rooms) { return std::make_unique<RoomServiceImpl>(rooms); }

}  // namespace osteon
