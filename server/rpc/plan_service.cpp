// The service that sends what a case says beside its bone.
#include <grpcpp/grpcpp.h>

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/wire/plan.hpp"
#include "osteon/v1/plan.grpc.pb.h"
#include "server/rpc/called_room.inl"
#include "server/rpc/services.hpp"
#include "server/storage/case_plan.hpp"

namespace osteon {
namespace {

using PlanMessages = std::vector<Bytes>;

// The plan that was sent last, for the next viewer of the same case. [thread for files]
class LastPlan {
 public:
  Result<std::shared_ptr<const PlanMessages>> get(const KnownCase& served, const Case& bone) {
    if (messages_ && case_ == served.hash) return messages_;
    const Result<SurgicalPlan> plan = load_plan(served.folder, bone);
    if (!plan) return tl::unexpected(plan.error());
    PlanMessages made;
    for (const v1::GetPlanResponse& message : wire::to_wire(*plan)) made.push_back(serialised(message));
    case_ = served.hash;
    messages_ = std::make_shared<const PlanMessages>(std::move(made));
    return messages_;
  }

 private:
  Digest case_{};
  std::shared_ptr<const PlanMessages> messages_;  // shared with the streams that send them
};

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

  std::shared_ptr<const PlanMessages> messages_ OSTEON_GUARDED_BY(mutex_);  // shared with LastPlan
  std::size_t next_ OSTEON_GUARDED_BY(mutex_) = 0;
};

using PlanBase = v1::PlanService::WithRawCallbackMethod_GetPlan<v1::PlanService::Service>;

class PlanServiceImpl final : public PlanBase {
 public:
  explicit PlanServiceImpl(Rooms& rooms) : rooms_(rooms) {}

  WriteReactor* GetPlan(grpc::CallbackServerContext* context, const ByteBuffer* bytes) override {
    if (const auto why = refusal_of<v1::GetPlanRequest>(rooms_, *context)) return refused(*why);
    const auto request = parse<v1::GetPlanRequest>(*bytes);
    if (!request) return refused(invalid("the GetPlanRequest could not be parsed"));
    const AuthorId author{request->author()};
    const Result<std::shared_ptr<OpenRoom>> room = called_room(rooms_, *context, author);
    if (!room) return refused(status_of(room.error()));
    if (!(*room)->runtime().knows(author)) return refused(not_joined("GetPlanRequest", request->author()));
    const std::optional<KnownCase> served = rooms_.find_case((*room)->runtime().bone().hash());
    if (!served) return refused({StatusCode::NOT_FOUND, "this server has the case of the room no more"});
    const Result<Caller> caller = caller_of(rooms_, *context);
    if (!caller) return refused(status_of(caller.error()));
    const auto made = std::make_shared<PlanStream>();  // shared with gRPC
    PlanStream* stream = PlanStream::launch(made, context);
    if (stream->stand_under(rooms_.authorizer, *caller, (*room)->name, {}, "/osteon.v1.PlanService/GetPlan"))
      rooms_.files.run([last = last_, made, room = *room, served = *served] {
        const auto messages = last->get(served, room->runtime().bone());
        if (messages)
          made->send(*messages);
        else
          made->close(status_of(messages.error()));
      });
    return stream;
  }

 private:
  Rooms& rooms_;
  const std::shared_ptr<LastPlan> last_ = std::make_shared<LastPlan>();  // shared with jobs that wait
};

}  // namespace

std::unique_ptr<grpc::Service> make_plan_service(Rooms& rooms) { return std::make_unique<PlanServiceImpl>(rooms); }

}  // namespace osteon
