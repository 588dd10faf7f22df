// Gives memory back to Linux that a program does not need any more.
#pragma once
#include <cstddef>
#include <vector>

namespace osteon {

// Gives back what was freed, but what the heap keeps for later. For the end of a stage of long work, after which the
// next needs its memory elsewhere. Takes milliseconds.
void give_back_freed_memory();

// For the start of a program that works on volumes: from now on, the heap keeps no freed block of a megabyte or more.
void keep_no_large_freed_blocks();

// Gives back whole pages of memory that its owner no longer reads. Their content is lost.
void give_back_pages(void* begin, std::size_t bytes);

// Gives back the memory of a vector beyond its last value. shrink_to_fit() would need memory for a copy.
template <class T>
void give_back_unused(std::vector<T>& values) {
  give_back_pages(values.data() + values.size(), (values.capacity() - values.size()) * sizeof(T));
}

}  // namespace osteon
