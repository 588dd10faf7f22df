// The audio client's subscription to its room: the newest cutting state of every tool.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/core/result.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/wire/room_client.hpp"

namespace osteon {

// One reader thread from start() to the destructor.
class StateSubscription {
 public:
  // Called from the reader thread; `received` is taken as soon as the message has arrived.
  using OnStates =
      std::function<void(const std::vector<CuttingState>& states, std::chrono::steady_clock::time_point received)>;

  [[nodiscard]] static std::unique_ptr<StateSubscription> start(wire::JoinedRoom room, OnStates on_states);
  ~StateSubscription();  // cancels the stream

  // Why the stream has ended; none while it runs. One sentence.
  [[nodiscard]] std::optional<Error> ended() const;

 private:
  struct Impl;
  explicit StateSubscription(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
