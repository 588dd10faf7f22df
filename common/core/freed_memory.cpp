#include "common/core/freed_memory.hpp"

#include <malloc.h>

namespace osteon {

void give_back_freed_memory() { ::malloc_trim(0); }

void keep_no_large_freed_blocks() { ::mallopt(M_MMAP_THRESHOLD, 1 << 20); }

}  // namespace osteon
