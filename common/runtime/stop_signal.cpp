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

// Signal handlers can use only static storage. StopSignal owns both variables during its lifetime.
std::atomic<int> stop_requests{0};
std::atomic<int> wake_descriptor{-1};

void raise_flag() noexcept {
  stop_requests.fetch_add(1, std::memory_order_acq_rel);
  const std::uint64_t one = 1;
  const int descriptor = wake_descriptor.load(std::memory_order_acquire);
  if (descriptor >= 0) [[maybe_unused]]
    const auto written = ::write(descriptor, &one, sizeof one);
}

void on_signal(int) { raise_flag(); }

// Waits until this many requests have arrived, or the time is over. The descriptor becomes readable with each request.
bool wait_for_requests(int wanted, std::chrono::milliseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (stop_requests.load(std::memory_order_acquire) < wanted) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd wake{wake_descriptor.load(), POLLIN, 0};
    ::poll(&wake, 1, static_cast<int>(left.count()));
    // Reads the descriptor, so that an earlier request does not wake again.
    std::uint64_t seen = 0;
    [[maybe_unused]] const auto read = ::read(wake.fd, &seen, sizeof seen);
  }
  return true;
}

}  // namespace

StopSignal::StopSignal(HangUp hang_up) {
  OSTEON_CHECK(wake_descriptor.load() < 0);
  stop_requests = 0;
  wake_descriptor = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  struct sigaction before {};
  if (hang_up == HangUp::stops && ::sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
    ::sigaction(SIGHUP, &action, nullptr);
  ::signal(SIGPIPE, SIG_IGN);
}

StopSignal::~StopSignal() {
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  struct sigaction now {};
  if (::sigaction(SIGHUP, nullptr, &now) == 0 && now.sa_handler == on_signal) ::signal(SIGHUP, SIG_DFL);
  ::close(wake_descriptor.exchange(-1));
}

bool StopSignal::requested() const noexcept { return stop_requests.load(std::memory_order_acquire) > 0; }

void StopSignal::request() noexcept { raise_flag(); }

bool StopSignal::wait_for(std::chrono::milliseconds time) const { return wait_for_requests(1, time); }

bool StopSignal::wait_for_second(std::chrono::milliseconds time) const { return wait_for_requests(2, time); }

}  // namespace osteon
