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
#include "haptic_client/net/room_callbacks.hpp"

namespace osteon {

// XDG_CACHE_HOME/osteon/cases, or ~/.cache/osteon/cases.
[[nodiscard]] std::filesystem::path default_case_cache();

struct RoomSessionOptions {
  std::string address;  // HOST:PORT
  std::string room{};   // which of the server's; empty: the only one that is open
  wire::ClientCredentials credentials{};
  std::string name{};  // shown to others, and over plain text who one is; empty: somebody else each time
  std::chrono::milliseconds patience{5000};
  std::filesystem::path cache = default_case_cache();  // one folder per case, named by its hash
  // Sealed datagrams beside the stream: to the port that the server says, to this HOST:PORT instead, or "off".
  std::string fast_path{};
};

// How the fast path fares.
struct FastPathHealth {
  bool offered = false, alive = false;
  double round_trip_ms = 0, loss = 0;  // loss: on the way up
  std::uint64_t packets_sent = 0, bytes_sent = 0, packets_received = 0, bytes_received = 0;
};

class RoomSession {
 public:
  // Cuts that may wait for the network before send() refuses more.
  static constexpr std::size_t kMaxWaitingCuts = 1024;

  // Joins, fetches the case unless the cache has it, and the tools that the room knows and this program does not.
  // Errors: those of wire::join_room; what Case::load says of a fetched case; internal (the cache cannot be written).
  [[nodiscard]] static Result<RoomSession> join(const RoomSessionOptions& options, const std::function<bool()>& stop);
  ~RoomSession();  // closes
  RoomSession(RoomSession&&) noexcept;
  RoomSession& operator=(RoomSession&&) noexcept;

  [[nodiscard]] const wire::JoinedRoom& room()
      const;  // as first joined: the author of all cuts and states, epochs, bounds
  [[nodiscard]] const Case& bone() const;
  [[nodiscard]] const std::shared_ptr<ToolBox>& tools() const;  // that the room knows; grows with its events
  // Sets an item of the room's scene, id 0 for a new one, and returns its id. Waits for the answer. Errors:
  // invalid_input, denied (the hand is stopped, or its tool taken), unavailable.
  [[nodiscard]] Result<std::uint32_t> set_item(const SceneItem& item);

  // Opens the stream; once. From now on `events` are called.
  void open(RoomCallbacks events);
  // Any thread but the haptic and audio ones: these lock and allocate.
  // In order of the calls. False when kMaxWaitingCuts are not decided yet or the session is lost; the cut is then not
  // taken.
  [[nodiscard]] bool send(const Cut& cut);
  // Newest wins: a state that is still waiting is replaced. Cuts that are waiting go first.
  void send(const CuttingState& state);
  // Newest wins; of a room without a mount nothing comes of it. Where datagrams do not get through, 30 a second go.
  void send(const MountLoad& push);
  [[nodiscard]] FastPathHealth fast_path() const;
  // Ends the stream after what is waiting was sent, at most a second, and joins the thread. Again: does nothing.
  void close();

 private:
  struct Impl;
  explicit RoomSession(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
