#include "tests/fuzz/calls_target.hpp"

#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "common/core/check.hpp"
#include "osteon/v1/cutting.grpc.pb.h"
#include "server/rpc/room_server.hpp"
#include "server/rpc/services.hpp"
#include "tests/fuzz/calls_messages.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::fuzz {
namespace {

using google::protobuf::MethodDescriptor;

constexpr std::size_t kMostRooms = 3;
constexpr std::size_t kUnderWay = 192;  // concurrent calls
constexpr std::size_t kLines = 4;       // connections; each takes 64 streams
constexpr int kMostAnswerBytes =
    64 * 1024;  // of a status with its message: more than allowed, so that the whole message is read
constexpr std::size_t kMostSaidBytes = 1100;
constexpr std::size_t kHands = 8;              // whose sessions are opened before the input is sent
constexpr std::uint64_t kRenewEvery = 10'000;  // a room keeps all its events, so it is replaced from time to time
constexpr std::uint64_t kLookEvery = 16;
constexpr long kSessionRounds = 10;  // opening a session is as expensive as fifty other calls
constexpr int kTries = 100;          // attempts to make a room while other calls make or delete it
constexpr const char* kSecret = "of a hand";

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

std::string hex_of(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) text += {kDigits[byte >> 4], kDigits[byte & 15]};
  return text;
}

// One call, from its start until its slot is free for another.
struct Call {
  enum class Step { free, unary, opening, opened, said, answered, ended };
  Step step = Step::free;
  Bytes input;
  const MethodDescriptor* method = nullptr;
  std::optional<grpc::ClientContext> context;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> line;
  std::unique_ptr<grpc::GenericClientAsyncResponseReader> answer_of_one;
  std::string request;
  grpc::ByteBuffer answer;
  grpc::Status status;
  AuthorId hand;  // of a session that was opened before
  bool answered = false;
};

std::array<Call, kUnderWay> slots;

// Prints the calls that were under way when the process crashed. One of them, with those before it, is the cause.
void tell_calls(int signal) {
  static std::atomic<bool> told = false;
  if (!told.exchange(true))
    for (const Call& call : slots) {
      if (call.step == Call::Step::free) continue;
      const std::string line = "under way: OSTEON_FUZZ_INPUT=" + hex_of(call.input) + "\n";
      (void)!::write(STDERR_FILENO, line.data(), line.size());
    }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// A server in this process, with a room, an author in it, and simulated hands.
class Server {
 public:
  Server() : bone_(served_bone()) {
    OSTEON_CHECK(bone_.save(dir_ / "case").has_value());
    // Accepts no cases: each upload would be validated in a process of its own. The target `upload` gives any bytes to
    // that validation.
    RoomsOptions options{.cases = {{bone_, dir_ / "case"}}};
    options.rates.tick = std::chrono::milliseconds(2);  // shortens the wait for a tick
    auto started = RoomServer::start(std::make_unique<Rooms>(std::move(options)), "127.0.0.1:0");
    OSTEON_CHECK(started.has_value());
    server_ = std::move(*started);
    for (std::size_t i = 0; i < kLines; ++i) {
      grpc::ChannelArguments own;
      own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      own.SetInt(GRPC_ARG_MAX_METADATA_SIZE, kMostAnswerBytes);
      stubs_.push_back(std::make_unique<grpc::GenericStub>(
          grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), own)));
    }
    for (Call& call : slots) free_.push_back(&call);
    for (const int fault : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) std::signal(fault, tell_calls);
    renew();
    reader_ = std::thread([this] { read_all(); });
  }
  ~Server() {
    settle();
    queue_.Shutdown();
    reader_.join();
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Starts a call. Every call must be answered: an open stream by its first message or its end. The server must go on.
  // Returns while the call is under way.
  void call(std::span<const std::uint8_t> data) {
    if (data.empty()) return;
    if (calls_++ % kRenewEvery == kRenewEvery - 1) {
      settle();
      renew();
    }
    if (calls_ % kLookEvery == 0) look_after();
    const bool in_session = is_in_session(data[0]);
    const MethodDescriptor* method = &method_of(data[0]);
    ++counts_[in_session ? "SessionRequest in a session" : method->input_type()->name()];
    Call& call = take_slot(in_session);
    call.method = method;
    call.input.assign(data.begin(), data.end());
    call.request.assign(data.begin() + 1, data.end());
    call.answered = false;
    call.status = grpc::Status();
    call.context.emplace();
    call.context->AddMetadata("osteon-room-bin", kRoom);
    call.context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    begin(call);
  }

  void settle() {
    std::unique_lock lock(mutex_);
    freed_.wait(lock, [&] { return free_.size() == kUnderWay; });
  }

  [[nodiscard]] std::string figures() {
    settle();
    const auto least = std::ranges::min_element(counts_, {}, &std::pair<const std::string, std::uint64_t>::second);
    std::string text = std::to_string(calls_) + " calls of " + std::to_string(counts_.size()) + " kinds of request";
    if (least != counts_.end()) text += ", the fewest " + std::to_string(least->second) + " of " + least->first;
    for (const auto& [status, count] : statuses_)
      text += "; status " + std::to_string(status) + ": " + std::to_string(count);
    return text;
  }

 private:
  using Step = Call::Step;

  Call& take_slot(bool with_hand) {
    std::unique_lock lock(mutex_);
    freed_.wait(lock, [&] { return !free_.empty() && (!with_hand || !hands_.empty()); });
    Call& call = *free_.back();
    free_.pop_back();
    call.hand = {};
    if (with_hand) {
      call.hand = hands_.back();
      hands_.pop_back();
    }
    return call;
  }

  void begin(Call& call) {
    grpc::GenericStub& stub = *stubs_[calls_ % kLines];
    const std::string name = "/" + call.method->service()->full_name() + "/" + call.method->name();
    if (!call.method->client_streaming() && !call.method->server_streaming()) {
      call.step = Step::unary;
      call.answer_of_one = stub.PrepareUnaryCall(&*call.context, name, buffer_of(call.request), &queue_);
      call.answer_of_one->StartCall();
      call.answer_of_one->Finish(&call.answer, &call.status, &call);
      return;
    }
    call.context->set_initial_metadata_corked(true);  // sent with the first message
    call.line = stub.PrepareCall(&*call.context, name, &queue_);
    call.line->StartCall(nullptr);
    call.step = call.hand ? Step::opening : Step::said;
    if (!call.hand) return call.line->WriteLast(buffer_of(call.request), {}, &call);
    v1::SessionRequest open;
    open.mutable_open()->set_author(call.hand.value);
    open.mutable_open()->set_server_epoch(epoch_);
    open.mutable_open()->set_secret(kSecret);
    call.line->Write(buffer_of(open.SerializeAsString()), &call);
  }

  // [reader] Handles what the server has answered or accepted, and starts the next step.
  void go_on(Call& call, bool ok) {
    switch (call.step) {
      case Step::opening:
        call.step = Step::opened;
        return call.line->Read(&call.answer, &call);
      case Step::opened: {
        if (!ok) return end(call);
        v1::SessionResponse entry;
        OSTEON_CHECK(grpc::SerializationTraits<v1::SessionResponse>::Deserialize(&call.answer, &entry).ok());
        if (!entry.has_complete()) return call.line->Read(&call.answer, &call);
        call.step = Step::said;
        return call.line->WriteLast(buffer_of(as_hand(call, entry.complete())), {}, &call);
      }
      case Step::said:
        call.step = Step::answered;
        return call.line->Read(&call.answer, &call);
      case Step::answered:
        call.answered = call.answered || ok;
        // A session sends all its messages, because the client has said that it sends no more.
        if (ok && call.hand) return call.line->Read(&call.answer, &call);
        if (ok && call.method->server_streaming()) call.context->TryCancel();
        return end(call);
      default:
        return done(call);
    }
  }
  static void end(Call& call) {
    call.step = Step::ended;
    call.line->Finish(&call.status, &call);
  }

  // Replaces author 1 in a cut or state by the hand's own author. The cut becomes the hand's next cut.
  static std::string as_hand(const Call& call, const v1::FieldComplete& told) {
    v1::SessionRequest request;
    if (!request.ParseFromString(call.request)) return call.request;
    if (request.has_cut() && request.cut().author() == 1) {
      v1::Cut& cut = *request.mutable_cut();
      cut.set_author(call.hand.value);
      if (cut.author_seq() == 1) cut.set_author_seq(told.decided_author_seq() + 1);
      if (cut.lease_epoch() == 1) cut.set_lease_epoch(told.lease_epoch());
    } else if (request.has_state() && request.state().author() == 1) {
      request.mutable_state()->set_author(call.hand.value);
    } else {
      return call.request;
    }
    return request.SerializeAsString();
  }

  void done(Call& call) {
    using grpc::StatusCode;
    const StatusCode code = call.status.error_code();
    // No request may cause an internal error of the server, and every request must be answered in time.
    const bool sound =
        code != StatusCode::INTERNAL && code != StatusCode::UNKNOWN && code != StatusCode::DEADLINE_EXCEEDED;
    // gRPC itself refuses bytes that are not a message, and gives no further reason.
    // If the server refuses them, it gives a sentence. The sentence must fit into any client's limit of 8 kB.
    const std::string said = call.status.error_message();
    const bool told = (call.status.ok() || call.answered || !said.empty() || code == StatusCode::UNIMPLEMENTED) &&
                      said.size() <= kMostSaidBytes;
    if (!sound || !told) {
      std::fprintf(stderr, "%s was answered with status %d, %s: OSTEON_FUZZ_INPUT=%s\n",
                   call.method->full_name().c_str(), code, said.c_str(), hex_of(call.input).c_str());
      OSTEON_CHECK(sound && told);
    }
    call.line.reset();
    call.answer_of_one.reset();
    call.context.reset();
    call.answer.Clear();
    const std::lock_guard lock(mutex_);
    ++statuses_[code];
    call.step = Step::free;
    if (call.hand) hands_.push_back(call.hand);
    free_.push_back(&call);
    freed_.notify_one();
  }

  void read_all() {
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) go_on(*static_cast<Call*>(tag), ok);
  }

  // Keeps a room for the calls, and removes rooms that inputs have made.
  void look_after() {
    Rooms& rooms = server_->rooms();
    const auto room = rooms.find(kRoom);
    if (!room || (*room)->server_epoch != epoch_) {
      settle();
      renew();
    }
    const auto open = rooms.open_rooms();
    if (open.size() <= kMostRooms) return;
    for (const auto& other : open)
      if (other->name != kRoom && other->name != kSpare) (void)rooms.remove(other->name, true);
  }

  // Replaces the rooms. The only calls under way are those that lost their connection. They are still carried out, and
  // may make one more room.
  void renew() {
    Rooms& rooms = server_->rooms();
    const auto made = [&](const char* name) {
      auto room = rooms.create(name, nullptr);
      for (int tries = 0; !room && tries < kTries; ++tries) {
        (void)rooms.remove(name, true);
        room = rooms.create(name, nullptr);
      }
      if (!room) std::fprintf(stderr, "no new room %s: %s\n", name, room.error().message.c_str());
      OSTEON_CHECK(room.has_value());
      return *room;
    };
    for (const auto& room : rooms.open_rooms()) (void)rooms.remove(room->name, true);
    const std::shared_ptr<OpenRoom> room = made(kRoom);
    (void)made(kSpare);
    epoch_ = room->server_epoch;
    OSTEON_CHECK(room->runtime().join(MemberKind::surgeon) == AuthorId{1});
    hands_.clear();
    for (std::size_t i = 0; i < kHands; ++i)
      hands_.push_back(*room->runtime().join(MemberKind::surgeon, "hand", digest_of_secret(kSecret)));
  }

  test::TempDir dir_;
  Case bone_;
  std::unique_ptr<RoomServer> server_;
  std::vector<std::unique_ptr<grpc::GenericStub>> stubs_;
  grpc::CompletionQueue queue_;
  std::uint64_t calls_ = 0, epoch_ = 0;          // caller's thread, as the next
  std::map<std::string, std::uint64_t> counts_;  // by request
  std::mutex mutex_;
  std::condition_variable freed_;
  std::vector<Call*> free_;      // under mutex_, as the next two
  std::vector<AuthorId> hands_;  // hands without a session
  std::map<int, std::uint64_t> statuses_;
  std::thread reader_;
};

Server& server() {
  static Server made;
  return made;
}

}  // namespace

Target calls_target() {
  Target target{"calls", [](std::span<const std::uint8_t> data) { server().call(data); }, request_inputs(true)};
  target.mutations = 100;
  target.change = change_request;
  target.rounds = [](const Bytes& seed) { return !seed.empty() && is_in_session(seed[0]) ? kSessionRounds : 1; };
  target.settle = [] { server().settle(); };
  target.figures = [] { return server().figures(); };
  return target;
}

}  // namespace osteon::fuzz
