// Runs a reader of foreign files in a child process, so that a library that aborts on a damaged file costs that file
// instead of the program.
#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::import {

// How the child speaks to its parent. It never returns from a call when the parent is gone.
class ChildChannel {
 public:
  explicit ChildChannel(int descriptor) : descriptor_(descriptor) {}
  void at_file(std::size_t file);  // the one that it opens now
  void progress(double fraction);
  void send(std::string_view message);

 private:
  int descriptor_;
};

struct IsolatedWork {
  std::function<Result<void>(ChildChannel&)> run;            // in the child
  std::function<bool(std::string_view message)> on_message;  // in the parent; false: the message makes no sense
  std::size_t memory_bytes = std::size_t{1} << 30;           // that the child may take beside what it begins with
};

struct IsolatedEnd {
  Result<void> result;
  bool died = false;                // by a signal, for want of memory, or ended after two minutes of silence
  std::optional<std::size_t> file;  // the last that it opened
};

// Writes all of the bytes to a descriptor, however many calls that takes. False: it takes no more.
[[nodiscard]] bool write_all(int descriptor, const void* data, std::size_t size);

// False in builds with sanitizers, which reserve far more memory than they use.
[[nodiscard]] bool limits_memory();

// What libraries print on the way is dropped. Call it before the program has other threads.
// Errors: those of the work, cancelled, internal (no child), invalid_input (it died).
[[nodiscard]] IsolatedEnd run_isolated(const IsolatedWork& work, const KeepGoing& keep_going);

}  // namespace osteon::import
