// What a process gives up before it reads files of strangers. Linux alone; without privileges.
#pragma once
#include <filesystem>

namespace osteon {

struct Confinement {
  bool files = false;  // it opens, makes and changes files below its folder alone
  bool calls = false;  // it opens no socket, starts no program, and reaches no other process
};

// The calling thread and those that it starts, for good. What the kernel cannot do is left out: the result says what
// holds. Descriptors that are open stay usable. Before any other thread is started.
[[nodiscard]] Confinement confine_to(const std::filesystem::path& folder);

}  // namespace osteon
