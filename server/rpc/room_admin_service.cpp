// The service for rooms as a whole.
#include <grpcpp/grpcpp.h>

#include <optional>
#include <string>
#include <utility>

#include "common/wire/convert.hpp"
#include "osteon/v1/rooms.grpc.pb.h"
#include "server/auth/authorizer.hpp"
#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

v1::RoomInfo to_wire(const RoomListing& listing) {
  v1::RoomInfo info;
  info.set_name(listing.name);
  info.set_open(listing.open);
  if (listing.case_hash != Digest{}) info.set_case_hash(wire::to_wire(listing.case_hash));
  info.set_case_title(listing.case_title);
  info.set_room_seq(listing.room_seq.value);
  info.set_sessions(static_cast<std::uint32_t>(listing.sessions));
  info.set_watchers(static_cast<std::uint32_t>(listing.watchers));
  info.set_parent(listing.parent);
  info.set_parent_room_seq(listing.parent_room_seq.value);
  info.set_persisted(listing.kept);
  info.set_replay(listing.replay);
  return info;
}

class RoomAdminServiceImpl final : public v1::RoomsService::CallbackService {
 public:
  explicit RoomAdminServiceImpl(Rooms& rooms) : rooms_(rooms) {}
  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  Reactor* ListRooms(Context* context, const v1::ListRoomsRequest*, v1::ListRoomsResponse* response) override {
    Reactor* reactor = context->DefaultReactor();
    if (!admitted<v1::ListRoomsRequest>(rooms_, *context, reactor)) return reactor;
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) {
      reactor->Finish(status_of(caller.error()));
      return reactor;
    }
    rooms_.files.run([this, reactor, context, response, caller = *caller] {
      for (const RoomListing& listing : rooms_.list())
        if (caller_in(rooms_, *context, listing.name, method("ListRooms")) || is_owner(caller, listing.name))
          *response->add_rooms() = to_wire(listing);
      reactor->Finish(Status::OK);
    });
    return reactor;
  }
  Reactor* CreateRoom(Context* context, const v1::CreateRoomRequest* request,
                      v1::CreateRoomResponse* response) override {
    return slowly(context, "CreateRoom", request->name(), [this, context, request, response] {
      std::optional<Digest> hash;
      if (!request->case_hash().empty()) {
        const Result<Digest> named = wire::digest_from_wire(request->case_hash());
        if (!named) return invalid("case_hash is not a digest of 32 bytes");
        hash = *named;
      }
      const Result<Requester> by = requester(*context, "CreateRoom", request->name());
      if (!by) return status_of(by.error());
      return answer_with(rooms_.create(request->name(), hash ? &*hash : nullptr, *by), response->mutable_room());
    });
  }
  Reactor* CloseRoom(Context* context, const v1::CloseRoomRequest* request, v1::CloseRoomResponse* response) override {
    return slowly(context, "CloseRoom", request->name(), [this, request, response] {
      const Result<RoomSummary> closed = rooms_.close(request->name());
      if (!closed) return status_of(closed.error());
      if (rooms_.authorizer) rooms_.authorizer->forget_room(request->name());
      response->mutable_room()->set_name(request->name());
      for (const RoomListing& listing : rooms_.list())
        if (listing.name == request->name()) *response->mutable_room() = to_wire(listing);
      return Status(Status::OK);
    });
  }
  Reactor* ResumeRoom(Context* context, const v1::ResumeRoomRequest* request,
                      v1::ResumeRoomResponse* response) override {
    return slowly(context, "ResumeRoom", request->name(), [this, request, response] {
      return answer_with(rooms_.resume(request->name()), response->mutable_room());
    });
  }
  Reactor* BranchRoom(Context* context, const v1::BranchRoomRequest* request,
                      v1::BranchRoomResponse* response) override {
    return slowly(context, "BranchRoom", request->name(), [this, context, request, response] {
      const Result<Requester> by = requester(*context, "BranchRoom", request->name());
      if (!by) return status_of(by.error());
      return answer_with(rooms_.branch(request->name(), request->new_name(), RoomSeq{request->room_seq()}, *by),
                         response->mutable_room());
    });
  }
  Reactor* DeleteRoom(Context* context, const v1::DeleteRoomRequest* request,
                      v1::DeleteRoomResponse* response) override {
    const auto work = [this, context, request, response] {
      // The right is checked for every branch too.
      const auto may = [&](const std::string& room) { return may_delete(*context, room); };
      const Result<std::vector<std::string>> gone = rooms_.remove(request->name(), request->with_branches(), may);
      if (!gone) return status_of(gone.error());
      for (const std::string& name : *gone) {
        if (rooms_.authorizer) rooms_.authorizer->forget_room(name);
        response->add_deleted(name);
      }
      return Status(Status::OK);
    };
    return slowly(context, "DeleteRoom", request->name(), work,
                  [this, context, request] { return may_delete(*context, request->name()); });
  }
  Reactor* VerifyRoom(Context* context, const v1::VerifyRoomRequest* request,
                      v1::VerifyRoomResponse* response) override {
    return slowly(context, "VerifyRoom", request->name(), [this, request, response] {
      const auto report = rooms_.verify(request->name());
      if (!report) return status_of(report.error());
      response->set_room_seq(report->head.seq.value);
      response->set_chain(wire::to_wire(report->head.chain));
      response->set_field_hash(wire::to_wire(report->replayed.field_hash));
      response->set_checkpoints(static_cast<std::uint32_t>(report->checkpoints));
      for (const std::string& fault : report->faults) {
        log::warn("a room is damaged", {{"room", request->name()}, {"fault", fault}});
        response->add_faults(short_words(fault));
      }
      return Status(Status::OK);
    });
  }
  Reactor* BackUpRoom(Context* context, const v1::BackUpRoomRequest* request,
                      v1::BackUpRoomResponse* response) override {
    return slowly(context, "BackUpRoom", request->name(), [this, context, request, response] {
      const Result<Requester> by = requester(*context, "BackUpRoom", request->name());
      if (!by) return status_of(by.error());
      std::filesystem::path file;
      const Result<JournalHead> copied = rooms_.back_up(request->name(), request->file_name(), file, *by);
      if (!copied) return status_of(copied.error());
      response->set_room_seq(copied->seq.value);
      response->set_chain(wire::to_wire(copied->chain));
      response->set_file(file.filename().string());
      return Status(Status::OK);
    });
  }
  Reactor* ReplayRoom(Context* context, const v1::ReplayRoomRequest* request,
                      v1::ReplayRoomResponse* response) override {
    return slowly(context, "ReplayRoom", request->name(), [this, context, request, response] {
      const Result<Requester> by = requester(*context, "ReplayRoom", request->name());
      if (!by) return status_of(by.error());
      return answer_with(rooms_.replay(request->name(), request->new_name(), RoomSeq{request->from_room_seq()},
                                       RoomSeq{request->to_room_seq()}, request->speed(), *by),
                         response->mutable_room());
    });
  }

 private:
  static std::string method(const char* name) { return std::string("/osteon.v1.RoomsService/") + name; }

  [[nodiscard]] Result<Requester> requester(Context& context, const char* name, const std::string& room) const {
    const Result<Caller> caller = caller_in(rooms_, context, room, method(name));
    if (!caller) return tl::unexpected(caller.error());
    return Requester{caller->user, caller->role == Role::operator_};
  }
  [[nodiscard]] bool is_owner(const Caller& caller, const std::string& name) const {
    return !caller.user.empty() && rooms_.owner(name) == caller.user;
  }
  // Operators may delete it, and so may the person who made it. The person's ticket may be for another room, as it is
  // after making a branch.
  [[nodiscard]] Result<void> may_delete(Context& context, const std::string& name) const {
    if (!rooms_.authorizer) return {};
    const std::string call = method("DeleteRoom");
    const Result<Caller> in_room = caller_in(rooms_, context, name, call), caller = caller_of(rooms_, context);
    if (!caller) return tl::unexpected(caller.error());
    if (in_room && in_room->role == Role::operator_) return {};
    if (is_owner(*caller, name) && may_call(rooms_.authorizer->role_in(*caller, name), call)) return {};
    if (!in_room) return tl::unexpected(in_room.error());
    return failure(ErrorCode::denied, name + " is not yours; only who made it, or an operator, may delete it");
  }

  // Runs slow work. The right is checked for the room that the message names, or by `may`: at once, and again when the
  // work begins, since other work may take minutes before it.
  Reactor* slowly(Context* context, const char* name, const std::string& room, std::function<Status()> work,
                  const std::function<Result<void>()>& may = {}) {
    Reactor* reactor = context->DefaultReactor();
    if (std::optional<Status> why = refusal_of(rooms_, *context, method(name), room))
      return refuse(reactor, std::move(*why));
    const auto refusal = [this, context, name, room, may]() -> std::optional<Status> {
      const auto in_room = [&] { return caller_in(rooms_, *context, room, method(name)).map([](const Caller&) {}); };
      const Result<void> allowed = may ? may() : in_room();
      return allowed ? std::nullopt : std::optional(status_of(allowed.error()));
    };
    // A call without a name would mean the only open room, which may be another one when its turn comes.
    std::optional<Status> refused = room.empty() ? std::optional(invalid("the request names no room")) : refusal();
    if (refused) {
      reactor->Finish(std::move(*refused));
      return reactor;
    }
    rooms_.jobs.run([reactor, refusal, work = std::move(work)] {
      std::optional<Status> refused_now = refusal();
      reactor->Finish(refused_now ? std::move(*refused_now) : work());
    });
    return reactor;
  }
  Status answer_with(const Result<std::shared_ptr<OpenRoom>>& room, v1::RoomInfo* info) {
    if (!room) return status_of(room.error());
    for (const RoomListing& listing : rooms_.list())
      if (listing.name == (*room)->name) *info = to_wire(listing);
    return Status::OK;
  }

  Rooms& rooms_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_room_admin_service(Rooms& rooms) {
  return std::make_unique<RoomAdminServiceImpl>(rooms);
}

}  // namespace osteon
