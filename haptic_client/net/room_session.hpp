// The haptic client's line to its room: joins, fetches the case once, then carries cuts and states up and the field,
// everyone's committed cuts and rejections down.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/field/field_hash.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"
#include "common/tools/tool_box.hpp"
#include "common/volume/case.hpp"
#include "common/wire/room_client.hpp"

namespace osteon {

// XDG_CACHE_HOME/osteon/cases, or ~/.cache/osteon/cases.
[[nodiscard]] std::filesystem::path default_case_cache();

struct RoomSessionOptions {
  std::string address;                  // HOST:PORT
  std::string name = "haptic";          // shown to others
  std::chrono::milliseconds patience{5000};
  std::filesystem::path cache = default_case_cache();  // one folder per case, named by its hash
};

// Where a room stands when all leaves were sent: they contain every event up to this place.
struct RoomAtJoin {
  RoomSeq contained;
  std::vector<BodyId> bodies;
  std::uint64_t lease_epoch = 0;
  std::uint64_t decided_author_seq = 0;  // the caller's cuts up to this one were decided: they are in the leaves or rejected
};

// A part of an event that changed the bone otherwise than by a cut: leaves to set, of bodies to hold.
struct BonePart {
  RoomSeq place;
  std::vector<BodyId> bodies;      // any other is gone
  std::uint64_t lease_epoch = 0;   // cuts of an earlier one will be rejected
  std::vector<FieldLeaf> leaves;
  bool last = false;               // part of the event
};

// What comes down. Called on the session's own thread, one after the other: the scene, every leaf, then `complete`, then
// events in room_seq order; one may come as a change and as a scene. When the line breaks, `interrupted`, and once it is
// made again, all of that anew: the scene, every leaf, `complete`, and cuts that were sent and not decided are sent again.
// `lost` comes at most once and last, and never after close(). Tools go to tools() before anything that names them.
struct RoomEvents {
  std::function<void(const FieldLeaf& leaf)> leaf;
  std::function<void(const RoomAtJoin& room)> complete;
  std::function<void(RoomSeq place, const Cut& cut)> committed;  // of anyone, the caller's own included
  // The caller's; what he cut on top of it falls too, and `lease_epoch` is that of his lease from now on.
  std::function<void(RoomSeq place, std::uint64_t author_seq, std::uint64_t lease_epoch, const std::string& reason)> rejected;
  std::function<void(BonePart&& part)> change;
  std::function<void(RoomSeq place, const std::vector<SceneItem>& items)> scene;  // all that stand from now on
  std::function<void(RoomSeq place)> tool;  // one was added
  std::function<void(const Error& why)> interrupted;
  std::function<void(const Error& why)> lost;  // for good: the room is over, or knows this client no more
};

class RoomSession {
 public:
  // Cuts that may wait for the network before send() refuses more.
  static constexpr std::size_t kMaxWaitingCuts = 1024;

  // Joins, fetches the case unless the cache has it, and the tools that the room knows and this program does not. Errors:
  // those of wire::join_room; what Case::load says of a fetched case; internal (the cache cannot be written).
  [[nodiscard]] static Result<RoomSession> join(const RoomSessionOptions& options, const std::function<bool()>& stop);
  ~RoomSession();  // closes
  RoomSession(RoomSession&&) noexcept;
  RoomSession& operator=(RoomSession&&) noexcept;

  [[nodiscard]] const wire::JoinedRoom& room() const;  // as first joined: the author of all cuts and states, epochs, bounds
  [[nodiscard]] const Case& bone() const;
  [[nodiscard]] const std::shared_ptr<ToolBox>& tools() const;  // that the room knows; grows with its events
  // Sets an item of the room's scene, id 0 for a new one, and returns its id. Waits for the answer. Errors:
  // invalid_input, unavailable.
  [[nodiscard]] Result<std::uint32_t> set_item(const SceneItem& item);

  // Opens the stream; once. From now on `events` are called.
  void open(RoomEvents events);
  // Any thread but the haptic and audio ones: these lock and allocate.
  // In order of the calls. False when kMaxWaitingCuts are not decided yet or the session is lost; the cut is then not taken.
  [[nodiscard]] bool send(const Cut& cut);
  // Newest wins: a state that is still waiting is replaced. Cuts that are waiting go first.
  void send(const CuttingState& state);
  // Ends the stream after what is waiting was sent, at most a second, and joins the thread. Again: does nothing.
  void close();

 private:
  struct Impl;
  explicit RoomSession(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
