// What waits for one subscriber while a message to it is in flight: bounded, newest wins. Free of gRPC, so that a slow
// reader is tested without one.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/id.hpp"
#include "common/field/field_hash.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/surface/mesh_block.hpp"

namespace google::protobuf {
class MessageLite;
}

namespace osteon {

// Serialised once and shared by every subscriber that it waits for or travels to.
using Bytes = std::shared_ptr<const std::string>;
[[nodiscard]] Bytes serialised(const google::protobuf::MessageLite& message);

// One message in pieces that are sent behind each other; empty when there is nothing to send.
using MessageParts = std::vector<Bytes>;

// Changed blocks, each a serialised WatchMeshResponse of that block alone.
struct MeshUpdate {
  RoomSeq room_seq;
  std::map<BlockKey, Bytes> blocks;
};

// The waiting set of a mesh subscriber: at most one version of every block.
class MeshSendQueue {
 public:
  static constexpr std::size_t kMessageBytes = 256 * 1024;

  explicit MeshSendQueue(MeshUpdate snapshot);
  void add(const MeshUpdate& update);
  // The next message, of about kMessageBytes at most. Blocks leave in the order of their keys, round and round, so
  // none starves behind others that change all the time.
  [[nodiscard]] MessageParts take();
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  std::map<BlockKey, Bytes> waiting_;
  BlockKey cursor_;       // the last block taken
  bool started_ = false;  // cursor_ is set
  std::size_t snapshot_blocks_;
  bool snapshot_sent_ = false;
  RoomSeq snapshot_seq_;  // what the first whole surface contains
  RoomSeq newest_;        // contained once nothing waits
  RoomSeq said_;          // contained in what was sent so far
  bool news_ = true;      // newest_ was not said yet
};

// What a session sends: the tools, scene and field as they were on joining, then entries in room_seq order. Nothing of it
// before the leaves are given, which is when all that it tells of is kept. Rows cannot be skipped, so a reader that
// falls too far behind is given up instead.
class SessionSendQueue {
 public:
  static constexpr std::size_t kMaxEntries = 8192;

  // `before`: sent before the leaves, once they are given; `complete` after them.
  void begin(RoomSeq contained, MessageParts before, Bytes complete);
  // Copied while entries may have come already: every leaf contains at least the order up to `contained`. What it contains
  // beyond that changes nothing when its entry is applied again, since a cut field is a minimum over its cuts and all
  // other entries set leaves as they are at their place.
  void set_leaves(std::vector<FieldLeaf> leaves);
  // An entry of the room's order; one up to `contained` is skipped. False when kMaxEntries wait already; the entry is then
  // not taken. Rows that are taken count from 1 on, and carry their number.
  [[nodiscard]] bool add(RoomSeq place, Bytes entry);
  [[nodiscard]] bool takes(RoomSeq place) const { return place > contained_; }
  // Of the newest entry that was taken.
  [[nodiscard]] std::uint64_t index() const { return index_; }
  // The reader has entries up to this number by another way: those that still wait need not be sent. Gives the place of
  // the newest entry that it is known to have; null: nobody knows.
  RoomSeq arrived(std::uint64_t index);
  // All that goes before the entries has been taken.
  [[nodiscard]] bool begun() const { return leaves_known_ && !complete_; }
  // An answer outside the order: the first outcome of a cut that was sent again.
  [[nodiscard]] bool add_answer(Bytes entry);
  [[nodiscard]] MessageParts take();
  [[nodiscard]] std::size_t waiting() const { return entries_.size(); }

 private:
  std::vector<FieldLeaf> leaves_;
  std::size_t next_leaf_ = 0;
  RoomSeq contained_;
  bool leaves_known_ = false;
  std::deque<Bytes> before_;
  Bytes complete_;  // null: said
  struct Entry {
    std::uint64_t index = 0;  // 0: an answer outside the order
    Bytes bytes;
  };
  std::deque<Entry> entries_;
  std::deque<std::pair<std::uint64_t, RoomSeq>> places_;  // of entries that the reader is not known to have
  std::uint64_t index_ = 0;
};

// Newest states of others' tools that go over a session's stream, where datagrams do not get through.
class PartnerSendQueue {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 16;  // as many as a link tells of
  static constexpr std::chrono::nanoseconds kApart{1'000'000'000 / 30};

  // All there are; those that are gone need not be told. `by_stream` false: they go another way, so that nothing waits.
  void offer(const std::vector<CuttingState>& all, bool by_stream);
  // The next one that is due.
  [[nodiscard]] std::optional<CuttingState> take(Clock::time_point now);
  [[nodiscard]] bool waits() const;

 private:
  struct Partner {
    CuttingState state;
    bool waits = true;
    Clock::time_point next{};
  };
  std::map<AuthorId, Partner> partners_;
};

}  // namespace osteon
