// Many observers of one room in one process, as cheap as they can be: what arrives is counted and timed, never decoded.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/core/id.hpp"

namespace osteon::test {

// A message that an observer has received, on the clock that all processes of a machine share.
struct Arrival {
  std::chrono::nanoseconds at{};
  RoomSeq contains;
  std::size_t bytes = 0;
};

// What one observer has received on its two streams, in order.
struct Received {
  std::vector<Arrival> mesh, states;
};

[[nodiscard]] inline std::chrono::nanoseconds machine_time() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

// Each has a connection of its own, as people on different machines would. The first `stalled` of them never read. They
// want the tools' states `states_hz` times a second, 0: all.
class Observers {
 public:
  Observers(const std::string& address, int count, int stalled, int states_hz);
  ~Observers();  // ends all streams
  Observers(const Observers&) = delete;
  Observers& operator=(const Observers&) = delete;

  // Until everyone who reads has the whole surface, at this place of the room's order or a later one. False: not in
  // time.
  [[nodiscard]] bool wait_for(RoomSeq place, std::chrono::milliseconds patience) const;
  // Ends all streams and says what those who read have received.
  [[nodiscard]] std::vector<Received> finish();

 private:
  struct Observer;
  std::vector<std::unique_ptr<Observer>> observers_;
};

}  // namespace osteon::test
