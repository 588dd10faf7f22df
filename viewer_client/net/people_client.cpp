#include "viewer_client/net/people_client.hpp"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <map>
#include <thread>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/people.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"

namespace osteon {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeopleRetryPause{200};
constexpr std::chrono::seconds kPeopleAnswerTime{30};
constexpr std::size_t kMostWords = 64, kMostRuns = 64;

Error error_of(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::INVALID_ARGUMENT:
      return {ErrorCode::invalid_input, status.error_message()};
    case grpc::StatusCode::NOT_FOUND:
      return {ErrorCode::not_found, status.error_message()};
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNAUTHENTICATED:
      return {ErrorCode::denied, status.error_message()};
    default:
      return {ErrorCode::unavailable, status.error_message()};
  }
}

// An old server does not know the kind "console" and refuses it.
Error console_refused(const Error& why, const PeopleClientOptions& options) {
  if (options.window || why.code != ErrorCode::invalid_input || !why.message.starts_with("kind ")) return why;
  return {ErrorCode::unsupported, "the server at " + options.address +
                                      " is older than this console and does not let it in (" + why.message +
                                      "); install a newer Osteon where the server runs"};
}

Result<PersonSeen> person_of(const v1::Person& sent) {
  PersonSeen person;
  person.author = AuthorId{sent.author()};
  person.name = sent.name();
  person.role = static_cast<Role>(std::clamp(static_cast<int>(sent.role()), 0, kRoles - 1));
  person.here = sent.here();
  person.hand = sent.hand();
  if (sent.has_supervision()) {
    Result<Restrictions> supervision = wire::from_wire(sent.supervision());
    if (!supervision) return tl::unexpected(supervision.error());
    person.supervision = std::move(*supervision);
  }
  person.decided = RoomSeq{sent.decided_room_seq()};
  person.decided_by = AuthorId{sent.decided_by()};
  person.acknowledged = RoomSeq{sent.acknowledged_room_seq()};
  if (sent.has_look()) {
    const Result<ViewFrustum> look = wire::from_wire(sent.look());
    if (!look) return tl::unexpected(look.error());
    person.look = *look;
  }
  person.cuts = sent.session_cuts();
  if (sent.has_session_shots()) {
    const Result<ShotTotals> shots = wire::from_wire(sent.session_shots());
    if (!shots) return tl::unexpected(shots.error());
    person.shots = *shots;
  }
  return person;
}

}  // namespace

struct PeopleClient::Impl {
  PeopleClientOptions options;
  std::function<bool()> stop;
  std::atomic<bool> ending{false};

  mutable Mutex mutex{LockRank::leaf};
  mutable CondVar changed;
  wire::JoinedRoom joined OSTEON_GUARDED_BY(mutex);
  std::map<AuthorId, PersonSeen> people OSTEON_GUARDED_BY(mutex);
  std::map<std::uint32_t, Annotation> annotations OSTEON_GUARDED_BY(mutex);
  std::deque<WordsSeen> words OSTEON_GUARDED_BY(mutex);
  std::deque<ShotRun> runs OSTEON_GUARDED_BY(mutex);
  bool complete OSTEON_GUARDED_BY(mutex) = false;
  std::optional<Error> failure OSTEON_GUARDED_BY(mutex);
  std::shared_ptr<grpc::ClientContext> stream
      OSTEON_GUARDED_BY(mutex);  // shared with the reader thread, so that it can be cancelled

  std::thread reader;

  [[nodiscard]] bool stopping() const { return ending || (stop && stop()); }
  [[nodiscard]] wire::JoinedRoom room() const {
    const MutexLock lock(mutex);
    return joined;
  }
  [[nodiscard]] std::uint64_t author() const { return room().author.value; }

  void fail(const Error& why) {
    const MutexLock lock(mutex);
    failure = why;
    changed.notify_all();
  }
  Result<void> take(const v1::WatchPeopleResponse& news);
  void read();
  void read_beside_window();
  grpc::Status read_stream();

  // One request to a service and its answer.
  template <class Service, class Response, class Request>
  Result<Response> ask(grpc::Status (Service::Stub::*call)(grpc::ClientContext*, const Request&, Response*),
                       const Request& request) const {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPeopleAnswerTime);
    Response response;
    const auto stub = Service::NewStub(room().channel);
    const grpc::Status status = (stub.get()->*call)(&context, request, &response);
    if (!status.ok()) return tl::unexpected(error_of(status));
    return response;
  }
};

Result<void> PeopleClient::Impl::take(const v1::WatchPeopleResponse& news) {
  std::vector<PersonSeen> persons;
  for (const v1::Person& sent : news.people()) {
    Result<PersonSeen> person = person_of(sent);
    if (!person) return tl::unexpected(person.error());
    persons.push_back(std::move(*person));
  }
  std::vector<Annotation> drawn;
  for (const v1::Annotation& sent : news.annotations()) {
    Result<Annotation> one = wire::from_wire(sent);
    if (!one) return tl::unexpected(one.error());
    drawn.push_back(std::move(*one));
  }
  std::vector<ShotRun> shot;
  for (const v1::ShotRun& sent : news.shots()) {
    const Result<ShotRun> run = wire::from_wire(sent);
    if (!run) return tl::unexpected(run.error());
    shot.push_back(*run);
  }
  const MutexLock lock(mutex);
  if (news.complete()) {
    people.clear();
    annotations.clear();
  }
  for (PersonSeen& person : persons) people[person.author] = std::move(person);
  for (Annotation& one : drawn) annotations[one.id] = std::move(one);
  for (const std::uint32_t gone : news.wiped()) annotations.erase(gone);
  for (const v1::Words& said : news.words()) {
    // already received before the connection was lost
    if (!words.empty() && said.room_seq() <= words.back().place.value) continue;
    words.push_back({RoomSeq{said.room_seq()}, AuthorId{said.from()}, AuthorId{said.to()}, said.words()});
    if (words.size() > kMostWords) words.pop_front();
  }
  for (const ShotRun& run : shot) {
    std::erase_if(runs, [&](const ShotRun& known) { return same_press(known, run); });
    runs.push_back(run);
    if (runs.size() > kMostRuns) runs.erase(surplus_run(runs));
  }
  complete = true;
  changed.notify_all();
  return {};
}

grpc::Status PeopleClient::Impl::read_stream() {
  const auto context = std::make_shared<grpc::ClientContext>();
  wire::JoinedRoom in;
  {
    const MutexLock lock(mutex);
    if (ending) return grpc::Status::CANCELLED;
    stream = context;
    in = joined;
  }
  v1::WatchPeopleRequest request;
  request.set_author(in.author.value);
  const auto reads = v1::PeopleService::NewStub(in.channel)->WatchPeople(context.get(), request);
  v1::WatchPeopleResponse news;
  while (reads->Read(&news))
    if (const Result<void> taken = take(news); !taken) {
      context->TryCancel();
      (void)reads->Finish();
      return {grpc::StatusCode::INTERNAL, "the server sent invalid data: " + taken.error().message};
    }
  return reads->Finish();
}

// A window that lost its room reports this itself, or joins again. Until then a refusal here means nothing.
void PeopleClient::Impl::read_beside_window() {
  while (!stopping()) {
    {
      const wire::JoinedRoom now = options.window();
      const MutexLock lock(mutex);
      joined = now;
    }
    const grpc::Status ended = read_stream();
    if (ended.error_code() == grpc::StatusCode::UNIMPLEMENTED || ended.error_code() == grpc::StatusCode::INTERNAL)
      return fail(error_of(ended));
    if (!stopping()) std::this_thread::sleep_for(kPeopleRetryPause);
  }
}

void PeopleClient::Impl::read() {
  if (options.window) return read_beside_window();
  while (!stopping()) {
    const grpc::Status ended = read_stream();
    if (stopping()) return;
    if (ended.error_code() == grpc::StatusCode::PERMISSION_DENIED ||
        ended.error_code() == grpc::StatusCode::UNAUTHENTICATED ||
        ended.error_code() == grpc::StatusCode::UNIMPLEMENTED || ended.error_code() == grpc::StatusCode::INTERNAL)
      return fail(error_of(ended));
    log::warn("people stream ended", {{"server", options.address}, {"reason", ended.error_message()}});
    while (!stopping()) {
      std::this_thread::sleep_for(kPeopleRetryPause);
      Result<wire::JoinedRoom> again = wire::join_again(room(), wire::ClientKind::console, {});
      if (again) {
        const MutexLock lock(mutex);
        joined = std::move(*again);
        break;
      }
      if (again.error().code != ErrorCode::unavailable) return fail(again.error());
    }
  }
}

PeopleClient::PeopleClient(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<PeopleClient>> PeopleClient::start(const PeopleClientOptions& options,
                                                          std::function<bool()> stop) {
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->stop = std::move(stop);
  Result<wire::JoinedRoom> joined =
      options.window ? options.window()
                     : wire::join_room(options.address, wire::ClientKind::console, options.name, options.patience,
                                       impl->stop, options.room, options.credentials);
  if (!joined) return tl::unexpected(console_refused(joined.error(), options));
  {
    const MutexLock lock(impl->mutex);
    impl->joined = std::move(*joined);
  }
  std::unique_ptr<PeopleClient> client(new PeopleClient(std::move(impl)));
  client->impl_->reader = std::thread([inside = client->impl_.get()] { inside->read(); });
  const auto received = [&] {
    const MutexLock lock(client->impl_->mutex);
    return client->impl_->complete || client->impl_->failure;
  };
  const bool in_time = client->wait(received, options.patience);
  if (const auto failed = client->failure_seen()) return tl::unexpected(*failed);
  if (!in_time)
    return failure(ErrorCode::unavailable, "the server at " + options.address + " does not say who is in the room");
  return client;
}

PeopleClient::~PeopleClient() {
  {
    const MutexLock lock(impl_->mutex);
    impl_->ending = true;
    if (impl_->stream) impl_->stream->TryCancel();
  }
  if (impl_->reader.joinable()) impl_->reader.join();
}

std::optional<Error> PeopleClient::failure_seen() const {
  const MutexLock lock(impl_->mutex);
  return impl_->failure;
}

AuthorId PeopleClient::self() const { return impl_->room().author; }

std::vector<PersonSeen> PeopleClient::people() const {
  const MutexLock lock(impl_->mutex);
  std::vector<PersonSeen> all;
  for (const auto& [author, person] : impl_->people) all.push_back(person);
  return all;
}

std::vector<Annotation> PeopleClient::annotations() const {
  const MutexLock lock(impl_->mutex);
  std::vector<Annotation> all;
  for (const auto& [id, drawn] : impl_->annotations) all.push_back(drawn);
  return all;
}

std::vector<WordsSeen> PeopleClient::words() const {
  const MutexLock lock(impl_->mutex);
  return {impl_->words.begin(), impl_->words.end()};
}

std::vector<ShotRun> PeopleClient::shots() const {
  const MutexLock lock(impl_->mutex);
  return {impl_->runs.begin(), impl_->runs.end()};
}

bool PeopleClient::wait(const std::function<bool()>& done, std::chrono::milliseconds patience) const {
  const Clock::time_point until = Clock::now() + patience;
  while (true) {
    if (done()) return true;
    if (Clock::now() >= until || impl_->stopping()) return false;
    MutexLock lock(impl_->mutex);
    impl_->changed.wait_for(lock, std::min<Clock::duration>(kPeopleRetryPause, until - Clock::now()));
  }
}

Result<RoomSeq> PeopleClient::supervise(AuthorId subject, const Restrictions& supervision) {
  v1::SuperviseRequest request;
  request.set_author(impl_->author());
  request.set_subject(subject.value);
  *request.mutable_supervision() = wire::to_wire(supervision);
  const auto answer = impl_->ask<v1::PeopleService>(&v1::PeopleService::Stub::Supervise, request);
  if (!answer) return tl::unexpected(answer.error());
  return RoomSeq{answer->room_seq()};
}

Result<std::pair<RoomSeq, std::size_t>> PeopleClient::undo(const UndoSelection& what) {
  v1::UndoRequest request;
  request.set_author(impl_->author());
  request.set_count(what.count);
  request.set_of_author(what.of.value);
  request.set_to_mark(what.to.value);
  request.set_newest_ms(static_cast<std::uint64_t>(what.newest.count()));
  request.set_all(what.all);
  const auto answer = impl_->ask<v1::RoomService>(&v1::RoomService::Stub::Undo, request);
  if (!answer) return tl::unexpected(answer.error());
  return std::pair(RoomSeq{answer->room_seq()}, static_cast<std::size_t>(answer->undone_size()));
}

Result<std::pair<RoomSeq, std::size_t>> PeopleClient::redo(std::uint32_t count) {
  v1::RedoRequest request;
  request.set_author(impl_->author());
  request.set_count(count);
  const auto answer = impl_->ask<v1::RoomService>(&v1::RoomService::Stub::Redo, request);
  if (!answer) return tl::unexpected(answer.error());
  return std::pair(RoomSeq{answer->room_seq()}, static_cast<std::size_t>(answer->redone_size()));
}

Result<RoomSeq> PeopleClient::mark(const std::string& label) {
  v1::MarkRequest request;
  request.set_author(impl_->author());
  request.set_label(label);
  const auto answer = impl_->ask<v1::RoomService>(&v1::RoomService::Stub::Mark, request);
  if (!answer) return tl::unexpected(answer.error());
  return RoomSeq{answer->room_seq()};
}

Result<std::uint32_t> PeopleClient::draw(const Annotation& drawn) {
  v1::AnnotateRequest request;
  request.set_author(impl_->author());
  *request.mutable_drawn() = wire::to_wire(drawn);
  const auto answer = impl_->ask<v1::PeopleService>(&v1::PeopleService::Stub::Annotate, request);
  if (!answer) return tl::unexpected(answer.error());
  return answer->annotation();
}

Result<void> PeopleClient::wipe_off(std::uint32_t annotation) {
  v1::AnnotateRequest request;
  request.set_author(impl_->author());
  request.set_wipe_off(annotation);
  const auto answer = impl_->ask<v1::PeopleService>(&v1::PeopleService::Stub::Annotate, request);
  if (!answer) return tl::unexpected(answer.error());
  return {};
}

Result<RoomSeq> PeopleClient::say(AuthorId to, const std::string& words) {
  v1::SayRequest request;
  request.set_author(impl_->author());
  request.set_to(to.value);
  request.set_words(words);
  const auto answer = impl_->ask<v1::PeopleService>(&v1::PeopleService::Stub::Say, request);
  if (!answer) return tl::unexpected(answer.error());
  return RoomSeq{answer->room_seq()};
}

Result<std::pair<AuthorId, std::size_t>> PeopleClient::demonstrate(const DemonstrationSource& what) {
  v1::DemonstrateRequest request;
  request.set_author(impl_->author());
  request.set_room(what.room);
  request.set_of_author(what.of.value);
  request.set_from_room_seq(what.from.value);
  request.set_to_room_seq(what.to.value);
  request.set_speed(what.speed);
  const auto answer = impl_->ask<v1::PeopleService>(&v1::PeopleService::Stub::Demonstrate, request);
  if (!answer) return tl::unexpected(answer.error());
  return std::pair(AuthorId{answer->demonstrator()}, std::size_t{answer->cuts()});
}

Result<void> PeopleClient::end_demonstration(AuthorId demonstrator) {
  v1::EndDemonstrationRequest request;
  request.set_author(impl_->author());
  request.set_demonstrator(demonstrator.value);
  const auto answer = impl_->ask<v1::PeopleService>(&v1::PeopleService::Stub::EndDemonstration, request);
  if (!answer) return tl::unexpected(answer.error());
  return {};
}

Result<std::vector<std::pair<std::string, Digest>>> PeopleClient::tools() {
  v1::ListToolsRequest request;
  request.set_author(impl_->author());
  const auto answer = impl_->ask<v1::RoomService>(&v1::RoomService::Stub::ListTools, request);
  if (!answer) return tl::unexpected(answer.error());
  std::vector<std::pair<std::string, Digest>> tools;
  for (const v1::KnownTool& tool : answer->tools()) {
    const Result<Digest> hash = wire::digest_from_wire(tool.tool_hash());
    if (!hash) return tl::unexpected(hash.error());
    tools.emplace_back(tool.name(), *hash);
  }
  return tools;
}

Result<RoomSeen> PeopleClient::status() {
  const auto answer = impl_->ask<v1::RoomService>(&v1::RoomService::Stub::GetStatus, v1::GetStatusRequest{});
  if (!answer) return tl::unexpected(answer.error());
  const Result<Digest> hash = wire::digest_from_wire(answer->field_hash());
  if (!hash) return tl::unexpected(hash.error());
  RoomSeen seen{.name = impl_->room().name,
                .room_seq = RoomSeq{answer->room_seq()},
                .field_hash = *hash,
                .removed_mm3 = answer->removed_mm3(),
                .rejected = answer->rejected(),
                .bodies = {},
                .marks = {}};
  for (const std::uint32_t body : answer->bodies()) seen.bodies.push_back(BodyId{body});
  for (const v1::RoomMark& mark : answer->marks()) seen.marks.emplace_back(RoomSeq{mark.room_seq()}, mark.label());
  return seen;
}

}  // namespace osteon
