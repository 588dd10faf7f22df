#include "common/core/large_pages.hpp"

#include <sys/mman.h>

#include <memory>

namespace osteon {

void ask_for_large_pages(void* begin, std::size_t bytes) {
  constexpr std::size_t page = std::size_t{2} << 20;
  if (std::align(page, page, begin, bytes) == nullptr) return;
  ::madvise(begin, bytes / page * page, MADV_HUGEPAGE);
}

}  // namespace osteon
