// Restricts a process before it reads untrusted files. Linux only; needs no privileges.
#pragma once
#include <filesystem>

namespace osteon {

struct Confinement {
  bool files = false;  // opens, makes and changes files in its folder only
  bool calls = false;  // opens no socket, starts no program, reaches no other process
};

// Restricts the calling thread and the threads that it starts, permanently. Omits what the kernel does not support; the
// result says what holds. Open descriptors stay usable. Call it before any other thread is started.
[[nodiscard]] Confinement confine_to(const std::filesystem::path& folder);

}  // namespace osteon
