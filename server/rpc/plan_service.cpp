// The service that sends what a case says beside its bone.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstddef>
#include <deque>
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

// What was sent of the newest cases, for their next viewers. A case that cannot be sent is remembered too, so that
// asking again costs nothing. Made on the thread for plans; after that has ended, on any thread.
class SentCases {
 public:
  // `make`: what is sent of a case.
  using Make = std::function<Result<PlanMessages>(const KnownCase& served, const Case& bone)>;
  using Messages = Result<std::shared_ptr<const PlanMessages>>;
  explicit SentCases(Make make) : make_(std::move(make)) {}

  Messages get(const KnownCase& served, const Case& bone) {
    {
      const MutexLock lock(mutex_);
      const auto known = std::ranges::find(cases_, served.hash, &Sent::hash);
      if (known != cases_.end()) return known->messages;
    }
    Result<PlanMessages> made = make_(served, bone);
    // A disk that cannot be read now may be readable later.
    if (!made && made.error().code != ErrorCode::exhausted && made.error().code != ErrorCode::invalid_input)
      return tl::unexpected(made.error());
    const MutexLock lock(mutex_);
    if (cases_.size() == kMostCases) cases_.pop_front();
    cases_.push_back({served.hash, made ? Messages(std::make_shared<const PlanMessages>(std::move(*made)))
                                        : Messages(tl::unexpected(made.error()))});
    return cases_.back().messages;
  }

 private:
  static constexpr std::size_t kMostCases = 4;  // of up to 100 MB each
  struct Sent {
    Digest hash;
    Messages messages;  // shared with the streams that send them
  };
  const Make make_;
  Mutex mutex_{LockRank::leaf};
  std::deque<Sent> cases_ OSTEON_GUARDED_BY(mutex_);  // oldest first
};

template <class Message>
PlanMessages all_serialised(const std::vector<Message>& messages) {
  PlanMessages made;
  for (const Message& message : messages) made.push_back(serialised(message));
  return made;
}

class PlanStream final : public OutStream<WriteReactor> {
 public:
  // The reader has left, or may not have it any more.
  [[nodiscard]] bool over() const {
    const MutexLock lock(mutex_);
    return done() || failing();
  }

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

  std::shared_ptr<const PlanMessages> messages_ OSTEON_GUARDED_BY(mutex_);  // shared with SentCases
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
                     const std::shared_ptr<SentCases>& last) {
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
      rooms_.plans.run([last, made, room = *room, served = *served] {
        if (made->over()) return;
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
  const std::shared_ptr<SentCases> plan_ =
      std::make_shared<SentCases>([](const KnownCase& served, const Case& bone) -> Result<PlanMessages> {
        const Result<SurgicalPlan> plan = load_plan(served.folder, bone);
        if (!plan) return tl::unexpected(plan.error());
        return all_serialised(wire::to_wire(*plan));
      });
  const std::shared_ptr<SentCases> density_ =
      std::make_shared<SentCases>([](const KnownCase&, const Case& bone) -> Result<PlanMessages> {
        return all_serialised(wire::to_wire(density_of(bone)));
      });
};

}  // namespace

std::unique_ptr<grpc::Service> make_plan_service(Rooms& rooms) { return std::make_unique<PlanServiceImpl>(rooms); }

}  // namespace osteon
