// What is done to rooms as a whole.
#include <grpcpp/grpcpp.h>

#include <optional>
#include <string>
#include <utility>

#include "common/wire/convert.hpp"
#include "osteon/v1/rooms.grpc.pb.h"
#include "server/net/called_room.inl"
#include "server/net/gate.hpp"
#include "server/net/services.hpp"

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
  info.set_kept(listing.kept);
  info.set_replay(listing.replay);
  return info;
}

class RoomsServiceImpl final : public v1::RoomsService::CallbackService {
 public:
  explicit RoomsServiceImpl(Rooms& rooms) : rooms_(rooms) {}
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
    rooms_.files.run([this, reactor, context, response] {
      for (const RoomListing& listing : rooms_.list())
        if (caller_in(rooms_, *context, listing.name, method("ListRooms"))) *response->add_rooms() = to_wire(listing);
      reactor->Finish(Status::OK);
    });
    return reactor;
  }
  Reactor* CreateRoom(Context* context, const v1::CreateRoomRequest* request, v1::CreateRoomResponse* response) override {
    return slowly(context, "CreateRoom", request->name(), [this, request, response] {
      std::optional<Digest> hash;
      if (!request->case_hash().empty()) {
        const Result<Digest> named = wire::digest_from_wire(request->case_hash());
        if (!named) return invalid("case_hash is not a digest of 32 bytes");
        hash = *named;
      }
      return told(rooms_.create(request->name(), hash ? &*hash : nullptr), response->mutable_room());
    });
  }
  Reactor* CloseRoom(Context* context, const v1::CloseRoomRequest* request, v1::CloseRoomResponse* response) override {
    return slowly(context, "CloseRoom", request->name(), [this, request, response] {
      const Result<RoomSummary> closed = rooms_.close(request->name());
      if (!closed) return status_of(closed.error());
      if (rooms_.gate) rooms_.gate->forget_room(request->name());
      response->mutable_room()->set_name(request->name());
      for (const RoomListing& listing : rooms_.list())
        if (listing.name == request->name()) *response->mutable_room() = to_wire(listing);
      return Status(Status::OK);
    });
  }
  Reactor* ResumeRoom(Context* context, const v1::ResumeRoomRequest* request, v1::ResumeRoomResponse* response) override {
    return slowly(context, "ResumeRoom", request->name(), [this, request, response] { return told(rooms_.resume(request->name()), response->mutable_room()); });
  }
  Reactor* BranchRoom(Context* context, const v1::BranchRoomRequest* request, v1::BranchRoomResponse* response) override {
    return slowly(context, "BranchRoom", request->name(), [this, request, response] {
      return told(rooms_.branch(request->name(), request->new_name(), RoomSeq{request->room_seq()}), response->mutable_room());
    });
  }
  Reactor* DeleteRoom(Context* context, const v1::DeleteRoomRequest* request, v1::DeleteRoomResponse* response) override {
    return slowly(context, "DeleteRoom", request->name(), [this, context, request, response] {
      // Of every branch too it is asked whether the caller may.
      const auto may = [&](const std::string& room) -> Result<void> {
        const Result<Caller> caller = caller_in(rooms_, *context, room, method("DeleteRoom"));
        return caller ? Result<void>{} : tl::unexpected(caller.error());
      };
      const Result<std::vector<std::string>> gone = rooms_.remove(request->name(), request->with_branches(), may);
      if (!gone) return status_of(gone.error());
      for (const std::string& name : *gone) {
        if (rooms_.gate) rooms_.gate->forget_room(name);
        response->add_deleted(name);
      }
      return Status(Status::OK);
    });
  }
  Reactor* VerifyRoom(Context* context, const v1::VerifyRoomRequest* request, v1::VerifyRoomResponse* response) override {
    return slowly(context, "VerifyRoom", request->name(), [this, request, response] {
      const auto report = rooms_.verify(request->name());
      if (!report) return status_of(report.error());
      response->set_room_seq(report->head.place.value);
      response->set_chain(wire::to_wire(report->head.chain));
      response->set_field_hash(wire::to_wire(report->replayed.field_hash));
      response->set_checkpoints(static_cast<std::uint32_t>(report->checkpoints));
      for (const std::string& fault : report->faults) response->add_faults(fault);
      return Status(Status::OK);
    });
  }
  Reactor* BackUpRoom(Context* context, const v1::BackUpRoomRequest* request, v1::BackUpRoomResponse* response) override {
    return slowly(context, "BackUpRoom", request->name(), [this, request, response] {
      std::filesystem::path file;
      const Result<JournalHead> copied = rooms_.back_up(request->name(), request->file_name(), file);
      if (!copied) return status_of(copied.error());
      response->set_room_seq(copied->place.value);
      response->set_chain(wire::to_wire(copied->chain));
      response->set_file(file.string());
      return Status(Status::OK);
    });
  }
  Reactor* ReplayRoom(Context* context, const v1::ReplayRoomRequest* request, v1::ReplayRoomResponse* response) override {
    return slowly(context, "ReplayRoom", request->name(), [this, request, response] {
      return told(rooms_.replay(request->name(), request->new_name(), RoomSeq{request->from_room_seq()},
                                RoomSeq{request->to_room_seq()}, request->speed()),
                  response->mutable_room());
    });
  }

 private:
  static std::string method(const char* name) { return std::string("/osteon.v1.RoomsService/") + name; }

  // Judged by the room that the message names, at once and again when its turn comes: others may take minutes before it.
  Reactor* slowly(Context* context, const char* name, const std::string& room, std::function<Status()> work) {
    Reactor* reactor = context->DefaultReactor();
    if (std::optional<Status> why = refusal_of(rooms_, *context, method(name))) return refuse(reactor, std::move(*why));
    const auto refusal = [this, context, name, room]() -> std::optional<Status> {
      const Result<Caller> caller = caller_in(rooms_, *context, room, method(name));
      return caller ? std::nullopt : std::optional(status_of(caller.error()));
    };
    // A call that names none would be about the only one that is open, whichever that is when its turn comes.
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
  Status told(const Result<std::shared_ptr<OpenRoom>>& room, v1::RoomInfo* info) {
    if (!room) return status_of(room.error());
    for (const RoomListing& listing : rooms_.list())
      if (listing.name == (*room)->name) *info = to_wire(listing);
    return Status::OK;
  }

  Rooms& rooms_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_rooms_service(Rooms& rooms) { return std::make_unique<RoomsServiceImpl>(rooms); }

}  // namespace osteon
