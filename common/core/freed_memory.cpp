#include "common/core/freed_memory.hpp"

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <memory>

namespace osteon {

void give_back_freed_memory() { ::malloc_trim(0); }

void keep_no_large_freed_blocks() { ::mallopt(M_MMAP_THRESHOLD, 1 << 20); }

void give_back_pages(void* begin, std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  if (std::align(page, page, begin, bytes) == nullptr) return;
  ::madvise(begin, bytes / page * page, MADV_DONTNEED);
}

}  // namespace osteon
