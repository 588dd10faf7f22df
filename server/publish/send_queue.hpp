// What waits for one subscriber while a message to it is in flight. The queue is bounded, and the newest value wins.
// Free of gRPC, so that tests of slow readers need no gRPC.
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

// Serialised once. Shared by every subscriber that it waits for or is sent to.
using Bytes = std::shared_ptr<const std::string>;
[[nodiscard]] Bytes serialised(const google::protobuf::MessageLite& message);

// One message in parts that are sent one after another; empty if there is nothing to send.
using MessageParts = std::vector<Bytes>;

// Changed blocks. Each is a serialised WatchMeshResponse with that block alone.
struct MeshUpdate {
  RoomSeq room_seq;
  std::map<BlockKey, Bytes> blocks;
};

// What waits for a mesh subscriber: at most one version of every block.
class MeshSendQueue {
 public:
  static constexpr std::size_t kMessageBytes = 256 * 1024;

  explicit MeshSendQueue(MeshUpdate snapshot);
  void add(const MeshUpdate& update);
  // The next message, of about kMessageBytes at most. Blocks leave in a cycle in the order of their keys. So no block
  // waits for ever behind blocks that change all the time.
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
  bool news_ = true;      // newest_ was not sent yet
};

// What a session sends: the tools, scene and field as they were at joining, then entries in room_seq order. Nothing is
// sent before the leaves are given, which is when all of it is durable. Entries cannot be skipped, so a reader that
// falls too far behind is given up instead.
class SessionSendQueue {
 public:
  static constexpr std::size_t kMaxEntries = 8192;

  SessionSendQueue() = default;
  explicit SessionSendQueue(std::size_t most_entry_bytes) : most_entry_bytes_(most_entry_bytes) {}

  // `before`: sent before the leaves, once the leaves are given. `complete`: sent after them. `leaf_bytes`: expected.
  void begin(RoomSeq contained, MessageParts before, Bytes complete, std::size_t leaf_bytes = 0);
  // The leaves may be copied after entries have come: every leaf contains at least the events up to `contained`. What a
  // leaf contains beyond that changes nothing when its entry is applied again. A cut field is a minimum over its cuts,
  // and all other entries set leaves to their values at that entry.
  void set_leaves(std::vector<FieldLeaf> leaves);
  // Adds an entry of the room. Skips an entry up to `contained`. Returns false, and does not add the entry, if
  // kMaxEntries wait already, or if more than `most_entry_bytes` would wait. Added entries are counted from 1 on and
  // carry this index.
  [[nodiscard]] bool add(RoomSeq seq, Bytes entry);
  [[nodiscard]] bool takes(RoomSeq seq) const { return seq > contained_; }
  // Index of the newest entry that was added.
  [[nodiscard]] std::uint64_t index() const { return index_; }
  // The reader has received entries up to this index by another way, so those that still wait are not sent. Returns the
  // sequence number of the newest entry that the reader is known to have; null: unknown.
  RoomSeq arrived(std::uint64_t index);
  // Everything before the entries has been taken.
  [[nodiscard]] bool begun() const { return leaves_known_ && !complete_; }
  // An answer outside the room's order: the first result of a cut that was sent again.
  [[nodiscard]] bool add_answer(Bytes entry);
  [[nodiscard]] MessageParts take();
  [[nodiscard]] std::size_t waiting() const { return entries_.size(); }
  [[nodiscard]] std::size_t leaf_bytes() const { return leaf_bytes_; }  // that wait, or are expected

 private:
  [[nodiscard]] bool has_space(const Bytes& entry) const;
  void put(std::uint64_t index, Bytes entry);

  std::size_t most_entry_bytes_ = SIZE_MAX, entry_bytes_ = 0, leaf_bytes_ = 0;
  std::vector<FieldLeaf> leaves_;
  std::size_t next_leaf_ = 0;
  RoomSeq contained_;
  bool leaves_known_ = false;
  std::deque<Bytes> before_;
  Bytes complete_;  // null: sent
  struct Entry {
    std::uint64_t index = 0;  // 0: an answer outside the order
    Bytes bytes;
  };
  std::deque<Entry> entries_;
  std::deque<std::pair<std::uint64_t, RoomSeq>> seqs_;  // of entries that the reader is not known to have
  std::uint64_t index_ = 0;
};

// The newest states of others' tools that go over a session's stream because datagrams do not get through.
class PartnerSendQueue {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 16;  // as many as a link sends
  static constexpr std::chrono::nanoseconds kApart{1'000'000'000 / 30};

  // Takes all current states; absent tools are not sent any more. `by_stream` false: they are sent another way, so
  // nothing waits.
  void enqueue(const std::vector<CuttingState>& all, bool by_stream);
  // The next state that is due.
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
