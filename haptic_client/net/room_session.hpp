// The haptic client's line to its room: joins, fetches the case once, then carries cuts and states up and the field,
// everyone's committed cuts and rejections down.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/field/field_hash.hpp"
#include "common/mechanics/cutting_state.hpp"
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

// What comes down. Called on the session's own thread, one after the other: every leaf, then `complete`, then cuts and
// rejections in room_seq order. `lost` comes at most once and last, and never after close().
struct RoomEvents {
  std::function<void(const FieldLeaf& leaf)> leaf;
  std::function<void(RoomSeq contained)> complete;  // all leaves were sent; they contain every cut up to this one
  std::function<void(RoomSeq place, const Cut& cut)> committed;  // of anyone, the caller's own included
  std::function<void(RoomSeq place, std::uint64_t author_seq, const std::string& reason)> rejected;  // the caller's
  std::function<void(const Error& why)> lost;
};

class RoomSession {
 public:
  // Cuts that may wait for the network before send() refuses more.
  static constexpr std::size_t kMaxWaitingCuts = 1024;

  // Joins and fetches the case unless the cache has it. Errors: those of wire::join_room; what Case::load says of a
  // fetched case; internal (the cache cannot be written).
  [[nodiscard]] static Result<RoomSession> join(const RoomSessionOptions& options, const std::function<bool()>& stop);
  ~RoomSession();  // closes
  RoomSession(RoomSession&&) noexcept;
  RoomSession& operator=(RoomSession&&) noexcept;

  [[nodiscard]] const wire::JoinedRoom& room() const;  // the author of all cuts and states, epochs, bounds
  [[nodiscard]] const Case& bone() const;

  // Opens the stream; once. From now on `events` are called.
  void open(RoomEvents events);
  // Any thread but the haptic and audio ones: these lock and allocate.
  // In order of the calls. False when kMaxWaitingCuts are waiting or the stream is lost; the cut is then not taken.
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
