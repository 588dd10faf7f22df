// Counts the heap allocations of the calling thread, by `new` and by `malloc`. Tests use it to prove that a real-time
// loop makes none. Linking it replaces the program's allocation functions.
#pragma once
#include <cstdint>

namespace osteon::test {

class AllocationCounter {
 public:
  AllocationCounter();
  // Allocations of this thread since construction.
  [[nodiscard]] std::int64_t count() const;

 private:
  std::int64_t start_;
};

}  // namespace osteon::test
