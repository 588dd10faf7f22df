// The service for the people of a room: who is there, and what they decide about each other, draw, say, shoot and show.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/people.grpc.pb.h"
#include "server/rooms/demonstration.hpp"
#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"

namespace osteon {
namespace {

class PeopleStream final : public OutStream<WriteReactor>, public PresenceSubscriber {
 public:
  PeopleStream(std::shared_ptr<OpenRoom> room, AuthorId author) : room_(std::move(room)), author_(author) {}
  void begin() {
    begun_ = true;
    room_->runtime().people().came(author_);
    room_->runtime().people().watch(*this);
  }

  void changed() override {
    const MutexLock lock(mutex_);
    pump();
  }
  void end(const std::string& why) override { close({StatusCode::UNAVAILABLE, why}); }
  std::size_t waiting() const override { return 0; }

 private:
  bool take(ByteBuffer& message) override OSTEON_REQUIRES(mutex_) {
    const PeopleRights rights{.people = may_receive(StreamContent::people),
                              .drawings = may_receive(StreamContent::scene),
                              .own_supervision = may_receive(StreamContent::own_supervision),
                              .others_supervision = may_receive(StreamContent::others_supervision),
                              .own_words = may_receive(StreamContent::own_words),
                              .others_words = may_receive(StreamContent::others_words),
                              .shots = may_receive(StreamContent::shots)};
    const Bytes news = room_->runtime().people().news(cursor_, author_, rights);
    if (news) message = buffer_of({news});
    return news != nullptr;
  }
  void leave() override {
    if (!begun_) return;
    room_->runtime().people().leave(*this);
    room_->runtime().people().went(author_);
  }

  const std::shared_ptr<OpenRoom> room_;  // shared with the rooms and the other streams
  const AuthorId author_;
  bool begun_ = false;
  PresenceCursor cursor_ OSTEON_GUARDED_BY(mutex_);
};

using PeopleBase = v1::PeopleService::WithRawCallbackMethod_WatchPeople<v1::PeopleService::WithCallbackMethod_Supervise<
    v1::PeopleService::WithCallbackMethod_Annotate<v1::PeopleService::WithCallbackMethod_Say<
        v1::PeopleService::WithCallbackMethod_ShareShots<v1::PeopleService::WithCallbackMethod_Demonstrate<
            v1::PeopleService::WithCallbackMethod_EndDemonstration<v1::PeopleService::Service>>>>>>>;

class PeopleServiceImpl final : public PeopleBase {
 public:
  explicit PeopleServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  WriteReactor* WatchPeople(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    if (const auto why = refusal_of<v1::WatchPeopleRequest>(rooms_, *context)) return refused(*why);
    const auto request = parse<v1::WatchPeopleRequest>(*bytes);
    if (!request) return refused(invalid("the WatchPeopleRequest could not be parsed"));
    const AuthorId author{request->author()};
    const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context, author);
    if (!room) return refused(status_of(room.error()));
    if (!(*room)->runtime().knows(author)) return refused(not_joined("WatchPeopleRequest", request->author()));
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused(status_of(caller.error()));
    PeopleStream* stream = PeopleStream::launch(std::make_shared<PeopleStream>(*room, author), context);
    if (stream->stand_under(rooms_.authorizer, *caller, (*room)->name, author, "/osteon.v1.PeopleService/WatchPeople"))
      stream->begin();
    return stream;
  }

  grpc::ServerUnaryReactor* Supervise(grpc::CallbackServerContext* context, const v1::SuperviseRequest* request,
                                      v1::SuperviseResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::SuperviseRequest>(rooms_, *context, reactor)) return reactor;
    const Result<Restrictions> word = wire::from_wire(request->supervision());
    if (!word) return refuse(reactor, invalid(word.error().message));
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    const AuthorId by{request->author()};
    std::vector<AuthorId> subjects{AuthorId{request->subject()}};
    if (request->subject() == 0) {
      subjects = room->runtime().people().supervised_hands();
      std::erase(subjects, by);
      if (subjects.empty()) return refuse(reactor, {StatusCode::NOT_FOUND, "nobody else has a tool in this room"});
    }
    // One event for each subject, all in one tick. The call is answered with the last event. If everybody is meant,
    // people are skipped for whom nothing changes, since most who ever had a tool here have left for good. A room that
    // closes meanwhile answers the rest on this thread.
    struct Answer {
      explicit Answer(std::size_t subjects) : left(subjects) {}
      Mutex mutex{LockRank::leaf};
      std::size_t left OSTEON_GUARDED_BY(mutex);
      RoomSeq seq OSTEON_GUARDED_BY(mutex);  // of the newest event that makes it valid, also of earlier ones
      std::optional<Error> failed OSTEON_GUARDED_BY(mutex);
    };
    const auto answer = std::make_shared<Answer>(subjects.size());  // shared by the queued events
    const bool all = request->subject() == 0;
    for (const AuthorId subject : subjects)
      room->runtime().queue_event(
          [by, subject, word = *word, all, answer](Room& r) -> Result<RoomEvent> {
            const People::Supervised& now = r.people().supervised(subject);
            const bool holds = all && now.supervision == word && r.people().supervises(by);
            if (!holds) return r.supervise(by, subject, word);
            const MutexLock lock(answer->mutex);
            answer->seq = std::max(answer->seq, now.seq);
            return RoomEvent{};
          },
          [answer, room, reactor, response](const Result<RoomEvent>& decided) {
            MutexLock lock(answer->mutex);
            if (decided)
              answer->seq = std::max(answer->seq, decided->room_seq);
            else if (!answer->failed)
              answer->failed = decided.error();
            if (--answer->left > 0) return;
            // For people about whom nothing was ever decided, it holds from the beginning.
            response->set_room_seq(answer->seq ? answer->seq.value : room->runtime().room_seq().value);
            const Status status = answer->failed ? status_of(*answer->failed) : Status::OK;
            lock.unlock();
            reactor->Finish(status);
          });
    return reactor;
  }

  grpc::ServerUnaryReactor* Annotate(grpc::CallbackServerContext* context, const v1::AnnotateRequest* request,
                                     v1::AnnotateResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::AnnotateRequest>(rooms_, *context, reactor)) return reactor;
    const AuthorId by{request->author()};
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    const auto fill = [response](const RoomEvent& event) {
      response->set_room_seq(event.room_seq.value);
      response->set_annotation(std::get<AnnotationEntry>(event.people).id);
    };
    if (request->has_drawn()) {
      const Result<Annotation> drawn = wire::from_wire(request->drawn());
      if (!drawn) return refuse(reactor, invalid(drawn.error().message));
      return change_room(
          *room, reactor, [by, drawn = *drawn](Room& r) { return r.annotate(by, drawn); }, fill);
    }
    if (request->wipe_off() != 0)
      return change_room(
          *room, reactor, [by, id = request->wipe_off()](Room& r) { return r.wipe_off(by, id); }, fill);
    // Erases all drawings of the caller: one event for each, answered with the last.
    wipe_next(room, by, reactor, response);
    return reactor;
  }

  grpc::ServerUnaryReactor* Say(grpc::CallbackServerContext* context, const v1::SayRequest* request,
                                v1::SayResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::SayRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    return change_room(
        *room, reactor,
        [by = AuthorId{request->author()}, to = AuthorId{request->to()}, words = request->words()](Room& r) {
          return r.say(by, to, words);
        },
        [response](const RoomEvent& event) { response->set_room_seq(event.room_seq.value); });
  }

  // No event: it changes nothing in the room, and comes several times a second.
  grpc::ServerUnaryReactor* ShareShots(grpc::CallbackServerContext* context, const v1::ShareShotsRequest* request,
                                       v1::ShareShotsResponse*) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::ShareShotsRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    const Result<ShotRun> run = wire::from_wire(request->run());
    if (!run) return refuse(reactor, invalid(run.error().message));
    const Result<ShotTotals> session = wire::from_wire(request->session());
    if (!session) return refuse(reactor, invalid(session.error().message));
    room->runtime().people().shot(AuthorId{request->author()}, *run, *session);
    reactor->Finish(Status::OK);
    return reactor;
  }

  grpc::ServerUnaryReactor* Demonstrate(grpc::CallbackServerContext* context, const v1::DemonstrateRequest* request,
                                        v1::DemonstrateResponse* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::DemonstrateRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    // Cuts of another room belong to that room.
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refuse(reactor, status_of(caller.error()));
    if (!request->room().empty())
      if (const Result<Caller> there =
              caller_in(rooms_, *context, request->room(), "/osteon.v1.PeopleService/Demonstrate");
          !there)
        return refuse(reactor, status_of(there.error()));
    // Reading a journal takes a while. Other calls do not wait for it.
    rooms_.recordings.run([this, room, reactor, request, response, caller = *caller] {
      const Result<Shown> shown = rooms_.demonstrate(*room, AuthorId{request->author()}, caller,
                                                     {.room = request->room(),
                                                      .of = AuthorId{request->of_author()},
                                                      .from = RoomSeq{request->from_room_seq()},
                                                      .to = RoomSeq{request->to_room_seq()},
                                                      .speed = request->speed()});
      if (!shown) return reactor->Finish(status_of(shown.error()));
      response->set_demonstrator(shown->demonstrator.value);
      response->set_cuts(static_cast<std::uint32_t>(shown->cuts));
      reactor->Finish(Status::OK);
    });
    return reactor;
  }

  grpc::ServerUnaryReactor* EndDemonstration(grpc::CallbackServerContext* context,
                                             const v1::EndDemonstrationRequest* request,
                                             v1::EndDemonstrationResponse*) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (!admitted<v1::EndDemonstrationRequest>(rooms_, *context, reactor)) return reactor;
    const std::shared_ptr<OpenRoom> room = room_of_member(rooms_, *context, reactor, *request);
    if (!room) return reactor;
    // Does not wait behind demonstrations that are about to begin.
    room->runtime().run_slowly([room, reactor, which = AuthorId{request->demonstrator()}] {
      const Result<void> ended = room->demonstrations().end(which);
      reactor->Finish(ended ? Status::OK : status_of(ended.error()));
    });
    return reactor;
  }

 private:
  // Repeats until none of the caller's drawings is left.
  static void wipe_next(const std::shared_ptr<OpenRoom>& room, AuthorId by, grpc::ServerUnaryReactor* reactor,
                        v1::AnnotateResponse* response) {
    room->runtime().queue_event(
        [by](Room& r) -> Result<RoomEvent> {
          for (const auto& [id, drawn] : r.people().annotations())
            if (drawn.author == by) return r.wipe_off(by, id);
          return RoomEvent{};
        },
        [room, by, reactor, response](const Result<RoomEvent>& decided) {
          if (!decided) return reactor->Finish(status_of(decided.error()));
          if (!decided->room_seq) return reactor->Finish(Status::OK);
          response->set_room_seq(decided->room_seq.value);
          response->set_annotation(std::get<AnnotationEntry>(decided->people).id);
          wipe_next(room, by, reactor, response);
        });
  }

  Rooms& rooms_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_people_service(Rooms& rooms) { return std::make_unique<PeopleServiceImpl>(rooms); }

}  // namespace osteon
