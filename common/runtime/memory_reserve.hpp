// Memory that the system has already provided, for a thread whose work must not wait for new pages.
#pragma once
#include <cstddef>

namespace osteon {

// For a thread that applies cuts. The cuts of one tick take less. One cut takes about 0.2 MB.
inline constexpr std::size_t kCutReserve = std::size_t{4} << 20;

// Belongs to the thread that makes and refills it, because every thread allocates from its own part of the heap. Small
// blocks that the thread allocates later reuse this memory. The first reserve tells the heap to keep freed memory.
class MemoryReserve {
 public:
  explicit MemoryReserve(std::size_t bytes);
  // Allocates the memory, touches every page and frees it to the heap. Call it in a pause of the work. Pages that were
  // used up since cost a microsecond or two each, other pages almost nothing.
  void refill() noexcept;

 private:
  std::size_t bytes_;
};

}  // namespace osteon
