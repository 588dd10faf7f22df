#include "server/rooms/job_thread.hpp"

#include <utility>

namespace osteon {

void JobThread::start() {
  {
    const MutexLock lock(mutex_);
    running_ = true;
  }
  thread_ = std::thread([this] { work(); });
}

void JobThread::run(Job job) {
  {
    const MutexLock lock(mutex_);
    if (running_) {
      jobs_.push_back(std::move(job));
      wake_.notify_one();
      return;
    }
  }
  job();
}

void JobThread::stop() {
  {
    const MutexLock lock(mutex_);
    running_ = false;
    wake_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void JobThread::work() {
  while (true) {
    Job job;
    {
      MutexLock lock(mutex_);
      while (jobs_.empty() && running_) wake_.wait(lock);
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job();
  }
}

}  // namespace osteon
