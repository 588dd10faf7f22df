// A thread for slow jobs. They run one after another, in the order in which they came.
#pragma once
#include <deque>
#include <functional>
#include <thread>

#include "common/core/mutex.hpp"

namespace osteon {

class JobThread {
 public:
  using Job = std::function<void()>;
  JobThread() = default;
  ~JobThread() { stop(); }
  JobThread(const JobThread&) = delete;
  JobThread& operator=(const JobThread&) = delete;

  void start();
  // Any thread. Before start() and after stop() the job runs within the call, so that everybody who waits for an answer
  // gets one.
  void run(Job job);
  void stop();  // finishes the waiting jobs first; must not be called from a job

 private:
  void work();

  Mutex mutex_{LockRank::leaf};
  CondVar wake_;
  std::deque<Job> jobs_ OSTEON_GUARDED_BY(mutex_);
  bool running_ OSTEON_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace osteon
