#include "server/rooms/committer.hpp"

#include <chrono>
#include <iterator>
#include <utility>

namespace osteon {

Committer::Committer(Write write, std::function<void(const Error&)> failed, bool apart)
    : write_(std::move(write)), failed_(std::move(failed)) {
  if (write_ && apart) thread_ = std::thread([this] { run(); });
}

Committer::~Committer() {
  {
    const MutexLock lock(mutex_);
    end_ = true;
    wake_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void Committer::commit(std::vector<LogEntry> entries, std::vector<WhenDurable> callbacks) {
  if (entries.empty() && callbacks.empty()) return;
  if (!write_) return keep(entries, callbacks);
  const MutexLock lock(mutex_);
  std::ranges::move(entries, std::back_inserter(entries_));
  std::ranges::move(callbacks, std::back_inserter(callbacks_));
  wake_.notify_all();
}

void Committer::drain() {
  MutexLock lock(mutex_);
  if (!thread_.joinable()) {
    const std::vector<LogEntry> entries = std::exchange(entries_, {});
    const std::vector<WhenDurable> callbacks = std::exchange(callbacks_, {});
    lock.unlock();
    return keep(entries, callbacks);
  }
  while (busy_ || !entries_.empty() || !callbacks_.empty()) wake_.wait(lock);
}

std::size_t Committer::waiting() const {
  const MutexLock lock(mutex_);
  return entries_.size() + writing_;
}

DurationHistogram Committer::commit_times() const {
  const MutexLock lock(mutex_);
  return times_;
}

std::optional<Error> Committer::failure() const {
  const MutexLock lock(mutex_);
  return failure_;
}

void Committer::keep(const std::vector<LogEntry>& entries, const std::vector<WhenDurable>& callbacks) {
  Result<void> durable;
  if (const std::optional<Error> failed = failure()) durable = tl::unexpected(*failed);
  if (write_ && durable && !entries.empty()) {
    const auto begun = std::chrono::steady_clock::now();
    durable = write_(entries);
    {
      const MutexLock lock(mutex_);
      times_.record(std::chrono::steady_clock::now() - begun);
      if (!durable) failure_ = durable.error();
    }
    if (!durable && failed_) failed_(durable.error());
  }
  for (const WhenDurable& call : callbacks) call(durable);
}

void Committer::run() {
  MutexLock lock(mutex_);
  while (true) {
    while (!end_ && entries_.empty() && callbacks_.empty()) wake_.wait(lock);
    if (entries_.empty() && callbacks_.empty()) return;
    const std::vector<LogEntry> entries = std::exchange(entries_, {});
    const std::vector<WhenDurable> callbacks = std::exchange(callbacks_, {});
    writing_ = entries.size();
    busy_ = true;
    lock.unlock();
    keep(entries, callbacks);
    lock.lock();
    writing_ = 0;
    busy_ = false;
    wake_.notify_all();
  }
}

}  // namespace osteon
