#include "common/runtime/stop_signal.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdint>

#include "common/core/check.hpp"

namespace osteon {
namespace {

// Signal handlers reach only static storage; StopSignal owns both for the time of its life.
std::atomic<bool> stop_requested{false};
std::atomic<int> wake_descriptor{-1};

void raise_flag() noexcept {
  stop_requested.store(true, std::memory_order_release);
  const std::uint64_t one = 1;
  const int descriptor = wake_descriptor.load(std::memory_order_acquire);
  if (descriptor >= 0) [[maybe_unused]] const auto written = ::write(descriptor, &one, sizeof one);
}

void on_signal(int) { raise_flag(); }

}  // namespace

StopSignal::StopSignal() {
  OSTEON_CHECK(wake_descriptor.load() < 0);
  stop_requested = false;
  wake_descriptor = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

StopSignal::~StopSignal() {
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  ::close(wake_descriptor.exchange(-1));
}

bool StopSignal::requested() const noexcept { return stop_requested.load(std::memory_order_acquire); }

void StopSignal::request() noexcept { raise_flag(); }

bool StopSignal::wait_for(std::chrono::milliseconds time) const {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!requested()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd wake{wake_descriptor.load(), POLLIN, 0};
    ::poll(&wake, 1, static_cast<int>(left.count()));
  }
  return true;
}

}  // namespace osteon
