// A thread for slow jobs. They run one after another, in the order in which they came.
#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

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

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  bool running_ = false;
  std::thread thread_;
};

}  // namespace osteon
