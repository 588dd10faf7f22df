#include "tests/perf/sound_output/machine_watch.hpp"

#include <pthread.h>
#include <sched.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <string>
#include <thread>

namespace osteon::test {
namespace {

constexpr int kAboveAll = 90;

void run_on(unsigned processor, int policy, int priority) {
  cpu_set_t only;
  CPU_ZERO(&only);
  CPU_SET(processor, &only);
  ::pthread_setaffinity_np(::pthread_self(), sizeof only, &only);
  const sched_param wanted{.sched_priority = priority};
  ::pthread_setschedparam(::pthread_self(), policy, &wanted);
}

std::int64_t steady_now_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return 1'000'000'000LL * now.tv_sec + now.tv_nsec;
}

// The eighth number of the first line of /proc/stat.
double stolen_so_far_s() {
  std::ifstream in("/proc/stat");
  std::string name;
  in >> name;
  double ticks = 0;
  for (int i = 0; i < 8; ++i) in >> ticks;
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

}  // namespace

struct AwakeMachine::Impl {
  std::atomic<bool> over{false};
  std::vector<std::jthread> threads;
};

AwakeMachine::AwakeMachine() : impl_(std::make_unique<Impl>()) {
  for (unsigned processor = 0; processor < std::thread::hardware_concurrency(); ++processor)
    impl_->threads.emplace_back([this, processor] {
      run_on(processor, SCHED_IDLE, 0);
      while (!impl_->over.load(std::memory_order_relaxed)) {
      }
    });
}

AwakeMachine::~AwakeMachine() {
  impl_->over = true;
  impl_->threads.clear();
}

struct MachineWatch::Impl {
  std::atomic<bool> over{false};
  double stolen_before_s = stolen_so_far_s();
  std::vector<std::vector<Stall>> stalls;  // of each processor, by its thread
  std::vector<std::jthread> threads;

  void look(unsigned processor) {
    run_on(processor, SCHED_FIFO, kAboveAll);
    std::int64_t due_ns = steady_now_ns();
    while (!over.load(std::memory_order_relaxed)) {
      due_ns += kLook_ns;
      const timespec due{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
      const Stall late{due_ns, steady_now_ns()};
      if (late.ms() < kLeast_ms) continue;
      stalls[processor].push_back(late);
      due_ns = late.to_ns;
    }
  }
};

MachineWatch::MachineWatch() : impl_(std::make_unique<Impl>()) {
  impl_->stalls.resize(std::thread::hardware_concurrency());
  for (unsigned processor = 0; processor < impl_->stalls.size(); ++processor)
    impl_->threads.emplace_back([this, processor] { impl_->look(processor); });
}

MachineWatch::~MachineWatch() { static_cast<void>(stop()); }

std::vector<Stall> MachineWatch::stop() {
  impl_->over = true;
  impl_->threads.clear();
  std::vector<Stall> all;
  for (const std::vector<Stall>& one : impl_->stalls) all.insert(all.end(), one.begin(), one.end());
  return all;
}

double MachineWatch::stolen_s() const { return stolen_so_far_s() - impl_->stolen_before_s; }

}  // namespace osteon::test
