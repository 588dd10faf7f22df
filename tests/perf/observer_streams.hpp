// Many observers of one room in one process, each as cheap as possible. Messages are counted and timed, but not
// decoded.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/core/id.hpp"

namespace osteon::test {

// A message that an observer has received, on the machine's clock, which all processes share.
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

// Each observer has a connection of its own, as people on different machines would. The first `stalled` of them never
// read. They ask for the tools' states `states_hz` times a second. 0: all states.
class Observers {
 public:
  Observers(const std::string& address, int count, int stalled, int states_hz);
  ~Observers();  // ends all streams
  Observers(const Observers&) = delete;
  Observers& operator=(const Observers&) = delete;

  // Waits until every reading observer has the whole surface, at this sequence number or a later one. False: not in
  // time.
  [[nodiscard]] bool wait_for(RoomSeq place, std::chrono::milliseconds patience) const;
  // Ends all streams and returns what the reading observers have received.
  [[nodiscard]] std::vector<Received> finish();

 private:
  struct Observer;
  std::vector<std::unique_ptr<Observer>> observers_;
};

}  // namespace osteon::test
