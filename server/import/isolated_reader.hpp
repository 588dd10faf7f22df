// Runs a reader of foreign files in a child process. If a library aborts on a damaged file, only that file is lost and
// not the program.
#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon::import {

// The child's connection to its parent. If the parent is gone, a call ends the child and does not return.
class ChildChannel {
 public:
  explicit ChildChannel(int descriptor) : descriptor_(descriptor) {}
  void at_file(std::size_t file);  // the file that it opens now
  void progress(double fraction);
  void send(std::string_view message);

 private:
  int descriptor_;
};

struct IsolatedWork {
  std::function<Result<void>(ChildChannel&)> run;            // in the child
  std::function<bool(std::string_view message)> on_message;  // in the parent; false: the message makes no sense
  std::size_t memory_bytes = std::size_t{1} << 30;  // memory that the child may take beyond what it begins with
};

struct IsolatedEnd {
  Result<void> result;
  bool died = false;                // killed by a signal, out of memory, or ended after two minutes of silence
  std::optional<std::size_t> file;  // the last file that it opened
};

// Writes all bytes to a descriptor, in as many calls as needed. False: the descriptor accepts no more.
[[nodiscard]] bool write_all(int descriptor, const void* data, std::size_t size);

// False in builds with sanitizers, because these reserve far more memory than they use.
[[nodiscard]] bool limits_memory();

// Drops everything that libraries print. Call it before the program has other threads.
// Errors: those of the work, cancelled, internal (no child), invalid_input (the child died).
[[nodiscard]] IsolatedEnd run_isolated(const IsolatedWork& work, const KeepGoing& keep_going);

}  // namespace osteon::import
