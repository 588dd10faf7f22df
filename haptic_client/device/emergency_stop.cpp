#include "haptic_client/device/emergency_stop.hpp"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <mutex>

#include "common/core/check.hpp"

namespace osteon::haptic {
namespace {

// Signal handlers reach only static storage.
struct Place {
  std::atomic<EmergencyStop::Stop> stop{nullptr};
  std::atomic<void*> what{nullptr};
};
std::array<Place, 8> places;
std::atomic<bool> ends{false};

void stop_all() noexcept {
  ends = true;
  for (Place& place : places)
    if (const EmergencyStop::Stop stop = place.stop.exchange(nullptr)) stop(place.what.load());
}

void on_end(int number) {
  // A motor that cannot be stopped must not keep the process alive: the alarm ends it.
  ::signal(SIGALRM, SIG_DFL);
  ::alarm(1);
  stop_all();
  // SA_RESETHAND has restored the default.
  ::raise(number);
}

void install_once() {
  static std::once_flag once;
  std::call_once(once, [] {
    std::atexit([] { stop_all(); });
    for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGQUIT, SIGHUP, SIGXCPU}) {
      struct sigaction before {};
      ::sigaction(number, nullptr, &before);
      if (before.sa_handler != SIG_DFL) continue;  // another's handler: a sanitizer, a debugger
      struct sigaction action {};
      action.sa_handler = on_end;
      action.sa_flags = SA_RESETHAND | SA_NODEFER;
      ::sigaction(number, &action, nullptr);
    }
  });
}

}  // namespace

EmergencyStop::EmergencyStop(Stop stop, void* what) : stop_(stop), what_(what), place_(-1) {
  install_once();
  for (std::size_t i = 0; i < places.size() && place_ < 0; ++i) {
    void* nobody = nullptr;
    if (!places[i].what.compare_exchange_strong(nobody, what)) continue;
    places[i].stop.store(stop);
    place_ = static_cast<int>(i);
  }
  OSTEON_CHECK(place_ >= 0);
}

// Either stop_all() comes after the start and stops the motors, or it was first and `ends` is seen here.
void EmergencyStop::started() const noexcept {
  if (ends) stop_(what_);
}

bool EmergencyStop::process_ends() noexcept { return ends; }

EmergencyStop::~EmergencyStop() {
  Place& place = places[static_cast<std::size_t>(place_)];
  place.stop.store(nullptr);
  place.what.store(nullptr);
}

}  // namespace osteon::haptic
