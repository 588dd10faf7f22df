#include "common/runtime/memory_reserve.hpp"

#include <malloc.h>
#include <unistd.h>

#include <climits>
#include <cstdlib>

namespace osteon {

MemoryReserve::MemoryReserve(std::size_t bytes) : bytes_(bytes) {
  // Blocks of this size must come from the heap, and the heap must keep freed memory. Otherwise refill() would fetch
  // the same pages again.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
  refill();
}

void MemoryReserve::refill() noexcept {
  auto* const memory = static_cast<volatile char*>(std::malloc(bytes_));
  if (memory == nullptr) return;
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  for (std::size_t at = 0; at < bytes_; at += page) memory[at] = 0;
  std::free(const_cast<char*>(memory));
}

}  // namespace osteon
