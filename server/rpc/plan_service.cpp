// The service that sends what a case says beside its bone.
#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/wire/plan.hpp"
#include "osteon/v1/plan.grpc.pb.h"
#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"
#include "server/storage/case_density.hpp"
#include "server/storage/case_plan.hpp"

namespace osteon {
namespace {

using PlanMessages = std::vector<Bytes>;

// What was sent last, for the next viewer of the same case. [thread for files]
class LastSent {
 public:
  // `make`: what is sent of a case.
  using Make = std::function<Result<PlanMessages>(const KnownCase& served, const Case& bone)>;
  explicit LastSent(Make make) : make_(std::move(make)) {}

  Result<std::shared_ptr<const PlanMessages>> get(const KnownCase& served, const Case& bone) {
    if (messages_ && case_ == served.hash) return messages_;
    Result<PlanMessages> made = make_(served, bone);
    if (!made) return tl::unexpected(made.error());
    case_ = served.hash;
    messages_ = std::make_shared<const PlanMessages>(std::move(*made));
    return messages_;
  }

 private:
  const Make make_;
  Digest case_{};
  std::shared_ptr<const PlanMessages> messages_;  // shared with the streams that send them
};

template <class Message>
PlanMessages all_serialised(const std::vector<Message>& messages) {
  PlanMessages made;
  for (const Message& message : messages) made.push_back(serialised(message));
  return made;
}

class PlanStream final : public OutStream<WriteReactor> {
 public:
  void send(std::shared_ptr<const PlanMessages> messages) {
    const MutexLock lock(mutex_);
    messages_ = std::move(messages);
    pump();
    close_locked(Status::OK);
  }

 private:
  bool take(ByteBuffer& message) override OSTEON_REQUIRES(mutex_) {
    if (!messages_ || next_ == messages_->size()) return false;
    message = buffer_of({(*messages_)[next_++]});
    return true;
  }
  void leave() override {}

  std::shared_ptr<const PlanMessages> messages_ OSTEON_GUARDED_BY(mutex_);  // shared with LastSent
  std::size_t next_ OSTEON_GUARDED_BY(mutex_) = 0;
};

using PlanBase = v1::PlanService::WithRawCallbackMethod_GetPlan<
    v1::PlanService::WithRawCallbackMethod_GetDensity<v1::PlanService::Service>>;

class PlanServiceImpl final : public PlanBase {
 public:
  explicit PlanServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  WriteReactor* GetPlan(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    return send<v1::GetPlanRequest>(context, *bytes, "/osteon.v1.PlanService/GetPlan", plan_);
  }
  WriteReactor* GetDensity(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    return send<v1::GetDensityRequest>(context, *bytes, "/osteon.v1.PlanService/GetDensity", density_);
  }

 private:
  template <class Request>
  WriteReactor* send(grpc::CallbackServerContext* context, const ByteBuffer& bytes, const char* method,
                     const std::shared_ptr<LastSent>& last) {
    if (const auto why = refusal_of<Request>(rooms_, *context)) return refused(*why);
    const std::string name = Request::descriptor()->name();
    const auto request = parse<Request>(bytes);
    if (!request) return refused(invalid("the " + name + " could not be parsed"));
    const AuthorId author{request->author()};
    const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context, author);
    if (!room) return refused(status_of(room.error()));
    if (!(*room)->runtime().knows(author)) return refused(not_joined(name.c_str(), request->author()));
    const std::optional<KnownCase> served = rooms_.find_case((*room)->runtime().bone().hash());
    if (!served) return refused({StatusCode::NOT_FOUND, "this server has the case of the room no more"});
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused(status_of(caller.error()));
    const auto made = std::make_shared<PlanStream>();  // shared with gRPC
    PlanStream* stream = PlanStream::launch(made, context);
    if (stream->stand_under(rooms_.authorizer, *caller, (*room)->name, {}, method))
      rooms_.files.run([last, made, room = *room, served = *served] {
        const auto messages = last->get(served, room->runtime().bone());
        if (messages)
          made->send(*messages);
        else
          made->close(status_of(messages.error()));
      });
    return stream;
  }

  Rooms& rooms_;
  // Shared with jobs that wait.
  const std::shared_ptr<LastSent> plan_ =
      std::make_shared<LastSent>([](const KnownCase& served, const Case& bone) -> Result<PlanMessages> {
        const Result<SurgicalPlan> plan = load_plan(served.folder, bone);
        if (!plan) return tl::unexpected(plan.error());
        return all_serialised(wire::to_wire(*plan));
      });
  const std::shared_ptr<LastSent> density_ =
      std::make_shared<LastSent>([](const KnownCase&, const Case& bone) -> Result<PlanMessages> {
        return all_serialised(wire::to_wire(density_of(bone)));
      });
};

}  // namespace

std::unique_ptr<grpc::Service> make_plan_service(Rooms& rooms) { return std::make_unique<PlanServiceImpl>(rooms); }

}  // namespace osteon
