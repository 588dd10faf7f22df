#include "tests/perf/observer_streams.hpp"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "common/core/check.hpp"
#include "common/wire/convert.hpp"
#include "osteon/v1/room.grpc.pb.h"
#include "osteon/v1/watch.pb.h"

namespace osteon::test {
namespace {

using grpc::ByteBuffer;

// The numbers of a WatchMeshResponse or a WatchCuttingResponse. The parser skips all other fields.
struct Head {
  std::uint64_t room_seq = 0;
  bool snapshot_complete = false;
};

Head head_of(const ByteBuffer& message) {
  std::vector<grpc::Slice> slices;
  OSTEON_CHECK(message.Dump(&slices).ok());
  std::string joined;
  const std::uint8_t *at = nullptr, *end = nullptr;
  if (slices.size() == 1) {
    at = slices[0].begin(), end = slices[0].end();
  } else {
    for (const grpc::Slice& slice : slices) joined.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    at = reinterpret_cast<const std::uint8_t*>(joined.data()), end = at + joined.size();
  }
  const auto number = [&] {
    std::uint64_t value = 0;
    for (int shift = 0; at < end; shift += 7) {
      value |= static_cast<std::uint64_t>(*at & 0x7f) << shift;
      if (!(*at++ & 0x80)) break;
    }
    return value;
  };
  Head head;
  while (at < end) {
    const std::uint64_t tag = number();
    const std::uint64_t value = number();  // both messages have only numbers and length-delimited fields
    if (tag == (1 << 3)) head.room_seq = value;
    if (tag == (3 << 3)) head.snapshot_complete = value != 0;
    if ((tag & 7) == 2) at += value;
  }
  return head;
}

// One subscription. It reads as fast as messages come, or never.
class Stream final : public grpc::ClientBidiReactor<ByteBuffer, ByteBuffer> {
 public:
  Stream(const std::shared_ptr<grpc::Channel>& channel, const char* method, const google::protobuf::Message& request,
         bool reads)
      : stub_(channel), reads_(reads) {
    const std::string bytes = request.SerializeAsString();
    const grpc::Slice slice(bytes);
    request_ = ByteBuffer(&slice, 1);
    stub_.PrepareBidiStreamingCall(&context_, method, {}, this);
    StartWriteLast(&request_, {});
    if (reads_) StartRead(&message_);
    StartCall();
  }
  void end() {
    context_.TryCancel();
    std::unique_lock lock(mutex_);
    over_.wait(lock, [&] { return ended_; });
  }
  [[nodiscard]] bool has(RoomSeq place) const { return complete_ && newest_ >= place.value; }
  std::vector<Arrival> received;

 private:
  void OnReadDone(bool ok) override {
    if (!ok) return;
    const auto now = machine_time();
    const Head head = head_of(message_);
    received.push_back({now, RoomSeq{head.room_seq}, message_.Length()});
    newest_ = head.room_seq;
    complete_ = head.snapshot_complete;
    StartRead(&message_);
  }
  void OnDone(const grpc::Status&) override {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    over_.notify_all();
  }

  grpc::TemplatedGenericStub<ByteBuffer, ByteBuffer> stub_;
  const bool reads_;
  grpc::ClientContext context_;
  ByteBuffer request_, message_;
  std::atomic<std::uint64_t> newest_{0};
  std::atomic<bool> complete_{false};
  std::mutex mutex_;
  std::condition_variable over_;
  bool ended_ = false;
};

}  // namespace

struct Observers::Observer {
  bool reads;
  std::shared_ptr<grpc::Channel> channel;
  std::optional<Stream> mesh, states;
};

Observers::Observers(const std::string& address, int count, int stalled, int states_hz) {
  for (int i = 0; i < count; ++i) {
    auto observer = std::make_unique<Observer>();
    observer->reads = i >= stalled;
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // otherwise all would share one connection
    arguments.SetMaxReceiveMessageSize(4 << 20);
    observer->channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
    v1::JoinRequest join;
    join.set_protocol_version(wire::kProtocolVersion);
    join.set_kind(v1::CLIENT_KIND_VIEWER);
    join.set_name("observer " + std::to_string(i));
    v1::JoinResponse joined;
    grpc::ClientContext context;
    const grpc::Status status = v1::RoomService::NewStub(observer->channel)->Join(&context, join, &joined);
    OSTEON_CHECK(status.ok());
    v1::WatchMeshRequest mesh;
    mesh.set_author(joined.author());
    v1::WatchCuttingRequest states;
    states.set_author(joined.author());
    states.set_most_hz(static_cast<std::uint32_t>(states_hz));
    observer->mesh.emplace(observer->channel, "/osteon.v1.WatchService/WatchMesh", mesh, observer->reads);
    observer->states.emplace(observer->channel, "/osteon.v1.WatchService/WatchCutting", states, observer->reads);
    observers_.push_back(std::move(observer));
  }
}

Observers::~Observers() { (void)finish(); }

bool Observers::wait_for(RoomSeq place, std::chrono::milliseconds patience) const {
  const auto until = machine_time() + patience;
  for (const auto& observer : observers_)
    while (observer->reads && !observer->mesh->has(place)) {
      if (machine_time() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
  return true;
}

std::vector<Received> Observers::finish() {
  std::vector<Received> received;
  for (const auto& observer : observers_) {
    observer->mesh->end();
    observer->states->end();
    if (observer->reads)
      received.push_back({std::move(observer->mesh->received), std::move(observer->states->received)});
  }
  observers_.clear();
  return received;
}

}  // namespace osteon::test
