// Members of a room for tests: haptic clients with their replicas, and viewers without a window.
#pragma once
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/volume/replica.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/room_client.hpp"
#include "haptic_client/net/room_session.hpp"
#include "osteon/v1/cutting.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"
#include "osteon/v1/watch.grpc.pb.h"
#include "server/rooms/room_runtime.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {

inline constexpr std::chrono::seconds kPatience{20};

inline wire::JoinedRoom join(const std::string& address, wire::ClientKind kind, const std::string& named = {}) {
  auto room = wire::join_room(address, kind, "test", std::chrono::seconds{5}, {}, named);
  EXPECT_TRUE(room.has_value()) << room.error().message;
  return room.value();
}

inline v1::GetStatusResponse status_of(const wire::JoinedRoom& room) {
  v1::GetStatusResponse response;
  grpc::ClientContext context;
  const grpc::Status status = v1::RoomService::NewStub(room.channel)->GetStatus(&context, {}, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

// A haptic client with a replica, as osteon-haptic has one.
class Surgeon {
 public:
  Surgeon(const std::string& address, const std::filesystem::path& cache, const std::string& fast_path = {},
          const std::string& in_room = {}, const wire::ClientCredentials& credentials = {}) {
    auto joined = RoomSession::join(
        {.address = address, .room = in_room, .credentials = credentials, .cache = cache, .fast_path = fast_path}, {});
    EXPECT_TRUE(joined.has_value()) << joined.error().message;
    session_.emplace(std::move(*joined));
    replica_.emplace(session_->bone(), BodyId{0}, session_->tools());
    session_->open({
        .message =
            [this](const RoomMessage& message) {
              const std::lock_guard lock(mutex_);
              std::visit([this](const auto& one) { take(one); }, message);
            },
        .lost = [this](const Error& why) { on([&] { lost_ = why.message; }); },
    });
  }
  ~Surgeon() { session_->close(); }

  RoomSession& session() { return *session_; }
  AuthorId author() const { return session_->room().author; }
  bool complete() { return read(complete_); }
  RoomSeq seq() { return read(seq_); }
  std::uint64_t own() { return read(own_); }
  // Called for every committed cut that is received, with a lock held.
  void on_cut(std::function<void(const Cut&)> heard) {
    on([&] { heard_ = std::move(heard); });
  }
  // The sequence numbers that the room gave the own cuts.
  std::map<std::uint64_t, RoomSeq> acknowledged() { return read(acknowledged_); }
  bool stands() { return read(complete_) && !read(interrupted_); }
  int interruptions() { return read(interruptions_); }
  std::string rejected() { return read(rejected_); }
  std::string lost() { return read(lost_); }
  std::uint64_t lease() { return read(lease_); }
  std::vector<BodyId> bodies() { return read(bodies_); }
  std::vector<SceneItem> items() { return read(items_); }
  Digest hash() {
    const std::lock_guard lock(mutex_);
    return replica_->hash();
  }

 private:
  void take(const FieldLeaf& leaf) { interrupted_ ? renewed_.push_back(leaf) : replica_->restore(leaf); }
  void take(const RoomAtJoin& room) {
    if (interrupted_) replica_->renew(room.contained, room.bodies, renewed_, room.decided_author_seq);
    replica_->settle();
    renewed_.clear();
    interrupted_ = false;
    complete_ = true, seq_ = room.contained, lease_ = room.lease_epoch, bodies_ = room.bodies;
    own_ = std::max(own_, room.decided_author_seq);
    for (std::uint64_t own = 1; own <= room.decided_author_seq; ++own) {
      const RoomSeq seq = room.seq_of(own).value_or(RoomSeq{});
      if (!seq) continue;
      EXPECT_EQ(acknowledged_.emplace(own, seq).first->second, seq) << "the cut had another sequence number before";
    }
  }
  void take(const CutCommitted& committed) {
    EXPECT_TRUE(complete_);
    EXPECT_GT(committed.seq, seq_) << "committed cuts come in order";
    if (heard_) heard_(committed.cut);
    replica_->commit(committed.seq, committed.cut, false);
    seq_ = committed.seq;
    if (committed.cut.author != session_->room().author) return;
    ++own_;
    EXPECT_TRUE(acknowledged_.emplace(committed.cut.author_seq, committed.seq).second) << "acknowledged twice";
  }
  void take(const CutRejected& rejected) { rejected_ = rejected.sentence, lease_ = rejected.lease_epoch; }
  void take(const BonePart& part) {
    replica_->change(part.seq, part.bodies, part.leaves);
    if (part.last) seq_ = part.seq, lease_ = std::max(lease_, part.lease_epoch), bodies_ = part.bodies;
  }
  void take(const SceneSet& scene) { items_ = scene.items, seq_ = std::max(seq_, scene.seq); }
  void take(const HandSupervised&) {}
  void take(const ChatReceived&) {}
  void take(const EventNoted& noted) { seq_ = std::max(seq_, noted.seq); }
  void take(const Interrupted&) { interrupted_ = complete_, ++interruptions_; }

  template <class Call>
  void on(Call call) {
    const std::lock_guard lock(mutex_);
    call();
  }
  template <class T>
  T read(const T& value) {
    const std::lock_guard lock(mutex_);
    return value;
  }

  std::mutex mutex_;
  std::optional<RoomSession> session_;
  std::optional<Replica> replica_;
  bool complete_ = false, interrupted_ = false;
  int interruptions_ = 0;
  std::vector<FieldLeaf> renewed_;
  std::map<std::uint64_t, RoomSeq> acknowledged_;
  std::function<void(const Cut&)> heard_;
  RoomSeq seq_;
  std::uint64_t own_ = 0, lease_ = 0;
  std::vector<BodyId> bodies_;
  std::vector<SceneItem> items_;
  std::string rejected_, lost_;
};

// Whether the room has come to rest, with all fragments found, and every replica is at its sequence number.
inline bool settled(RoomRuntime& room, const std::vector<Surgeon*>& holders) {
  const RoomSeq before = room.room_seq();
  room.find_pieces();
  return room.room_seq() == before &&
         std::ranges::all_of(holders, [&](Surgeon* holder) { return holder->complete() && holder->seq() == before; });
}

// The surface as a viewer has it.
class MeshReader {
 public:
  explicit MeshReader(const std::string& address, const std::string& room = {})
      : room_(join(address, wire::ClientKind::viewer, room)) {
    v1::WatchMeshRequest request;
    request.set_author(room_.author.value);
    stream_ = v1::WatchService::NewStub(room_.channel)->WatchMesh(&context_, request);
  }
  ~MeshReader() {
    context_.TryCancel();
    status_ = stream_->Finish();
  }
  // Reads until the surface contains this sequence number.
  bool read_to(RoomSeq seq) {
    v1::WatchMeshResponse message;
    while ((!complete_ || seq_ < seq) && stream_->Read(&message)) {
      largest_ = std::max(largest_, message.ByteSizeLong());
      for (const v1::MeshBlock& b : message.blocks()) {
        const BlockKey key{BodyId{b.body()}, b.level(), wire::from_wire(b.index())};
        const BlockPayload payload{{b.payload().begin(), b.payload().end()}};
        EXPECT_EQ(b.mesh_hash(), wire::to_wire(mesh_hash(payload)));
        if (payload.bytes.empty())
          hashes_.erase(key);
        else
          hashes_[key] = b.mesh_hash();
      }
      complete_ = message.snapshot_complete();
      seq_ = RoomSeq{message.room_seq()};
    }
    return complete_ && seq_ >= seq;
  }
  const std::map<BlockKey, std::string>& hashes() const { return hashes_; }
  std::size_t largest_message() const { return largest_; }

 private:
  wire::JoinedRoom room_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchMeshResponse>> stream_;
  std::map<BlockKey, std::string> hashes_;
  bool complete_ = false;
  RoomSeq seq_;
  std::size_t largest_ = 0;
  grpc::Status status_;
};

}  // namespace osteon::test
