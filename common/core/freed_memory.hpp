// Memory that was freed, but that the heap keeps for later.
#pragma once

namespace osteon {

// Gives it back to Linux. For the end of a stage of long work, after which the next needs its memory elsewhere. Takes
// milliseconds.
void give_back_freed_memory();

// For the start of a program that works on volumes: from now on, the heap keeps no freed block of a megabyte or more.
void keep_no_large_freed_blocks();

}  // namespace osteon
