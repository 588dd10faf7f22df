// Makes what a room has decided durable before anyone is told of it: one transaction for all entries of a tick, on a
// thread of its own, while the room goes on.
#pragma once
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "common/core/result.hpp"
#include "common/runtime/tick_stats.hpp"
#include "server/room/log_entry.hpp"

namespace osteon {

class Committer {
 public:
  // Returns when the entries will survive whatever comes; blocks. After an error it is not called again.
  using Write = std::function<Result<void>(std::span<const LogEntry>)>;
  // What is to be said of a decision once it is durable; with an error where it never will be.
  using Tell = std::function<void(const Result<void>& durable)>;

  // Without a `write` nothing is kept, and all is told at once on the caller's thread. `failed`: called once, on the
  // committing thread, before anyone is told of the error. `apart` false: no thread; drain() writes and tells.
  explicit Committer(Write write, std::function<void(const Error&)> failed = {}, bool apart = true);
  ~Committer();  // commits what was handed over; without a thread it is lost, as when a process is killed
  Committer(const Committer&) = delete;
  Committer& operator=(const Committer&) = delete;

  // [tick] In the order of the calls: the entries, then what tells of them. Either may be empty.
  void commit(std::vector<LogEntry> entries, std::vector<Tell> tells);
  // Returns when all that was handed over is durable and told.
  void drain();

  [[nodiscard]] std::size_t waiting() const;             // entries
  [[nodiscard]] DurationHistogram commit_times() const;  // of the transactions
  [[nodiscard]] std::optional<Error> failure() const;    // why nothing more is kept

 private:
  void run();
  // Writes and tells, without the mutex.
  void keep(const std::vector<LogEntry>& entries, const std::vector<Tell>& tells);

  const Write write_;
  const std::function<void(const Error&)> failed_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<LogEntry> entries_;
  std::vector<Tell> tells_;
  std::size_t writing_ = 0;  // entries in the transaction under way
  bool busy_ = false, end_ = false;
  DurationHistogram times_;
  std::optional<Error> failure_;
  std::thread thread_;
};

}  // namespace osteon
