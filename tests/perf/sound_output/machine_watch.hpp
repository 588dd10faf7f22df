// What the machine does to every thread, whatever its priority: a virtual one is stopped by its host.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

namespace osteon::test {

// Keeps every processor busy, with threads that give way to all others. A processor that sleeps is given to another
// machine by the host, and comes back late.
class AwakeMachine {
 public:
  AwakeMachine();
  ~AwakeMachine();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// A processor did not run even a thread of a priority above all of the sound's. Steady clock.
struct Stall {
  std::int64_t from_ns = 0, to_ns = 0;
  [[nodiscard]] double ms() const noexcept { return 1e-6 * static_cast<double>(to_ns - from_ns); }
};

// Looks for stalls, on each processor every millisecond. A stall begins up to a millisecond before `from_ns`.
class MachineWatch {
 public:
  static constexpr double kLeast_ms = 1.5;
  static constexpr std::int64_t kLook_ns = 1'000'000;

  MachineWatch();
  ~MachineWatch();
  // Stops looking. In no order.
  [[nodiscard]] std::vector<Stall> stop();
  // Of all processors together since the start, as the host says.
  [[nodiscard]] double stolen_s() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::test
