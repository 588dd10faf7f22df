// Makes the decisions of a room durable before they are sent to anybody. Writes all entries of a tick in one
// transaction, on its own thread, while the room goes on.
#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "common/runtime/tick_stats.hpp"
#include "server/room/log_entry.hpp"

namespace osteon {

class Committer {
 public:
  // Returns when the entries are durable; blocks. It is not called again after an error.
  using Write = std::function<Result<void>(std::span<const LogEntry>)>;
  // Sends a decision once it is durable. Gets an error if it will never be durable.
  using WhenDurable = std::function<void(const Result<void>& durable)>;

  // Without `write` nothing is written, and everything is sent at once on the caller's thread. `failed` is called once,
  // on the committing thread, before the error is sent to anybody. `apart` false: there is no thread, and drain()
  // writes and sends.
  explicit Committer(Write write, std::function<void(const Error&)> failed = {}, bool apart = true);
  ~Committer();  // commits what was handed over; without a thread this is lost, as when a process is killed
  Committer(const Committer&) = delete;
  Committer& operator=(const Committer&) = delete;

  // [tick] Takes entries and then the functions that send them, in the order of the calls. Either may be empty.
  void commit(std::vector<LogEntry> entries, std::vector<WhenDurable> callbacks);
  // Returns when everything handed over is durable and sent.
  void drain();

  [[nodiscard]] std::size_t waiting() const;             // entries
  [[nodiscard]] DurationHistogram commit_times() const;  // of the transactions
  [[nodiscard]] std::optional<Error> failure() const;    // why nothing more is written

 private:
  void run();
  // Writes and sends, without the mutex.
  void keep(const std::vector<LogEntry>& entries, const std::vector<WhenDurable>& callbacks);

  const Write write_;
  const std::function<void(const Error&)> failed_;
  mutable Mutex mutex_{LockRank::leaf};
  CondVar wake_;
  std::vector<LogEntry> entries_ OSTEON_GUARDED_BY(mutex_);
  std::vector<WhenDurable> callbacks_ OSTEON_GUARDED_BY(mutex_);
  std::size_t writing_ OSTEON_GUARDED_BY(mutex_) = 0;  // entries in the current transaction
  bool busy_ OSTEON_GUARDED_BY(mutex_) = false, end_ OSTEON_GUARDED_BY(mutex_) = false;
  DurationHistogram times_ OSTEON_GUARDED_BY(mutex_);
  std::optional<Error> failure_ OSTEON_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace osteon
