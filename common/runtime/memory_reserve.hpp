// Memory that the system has given already, for a thread whose work must not wait for new pages.
#pragma once
#include <cstddef>

namespace osteon {

// For a thread that applies cuts: those of a tick or of a moment take less. One cut takes about 0.2 MB.
inline constexpr std::size_t kCutReserve = std::size_t{4} << 20;

// Of the thread that makes and refills it: what a thread takes comes from its own part of the heap. Small blocks that
// it takes later are then memory that it has held before. The first reserve tells the heap to keep what it was given.
class MemoryReserve {
 public:
  explicit MemoryReserve(std::size_t bytes);
  // Takes that much, touches every page and gives it back to the heap. In a pause of the work: pages that were used up
  // since cost a microsecond or two each, the others nearly nothing.
  void refill() noexcept;

 private:
  std::size_t bytes_;
};

}  // namespace osteon
