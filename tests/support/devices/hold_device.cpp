// A program for tests of the motors at a program's end. It holds a haptic device with force on it, and then ends in the
// given way, as soon as standard input has a line.
// hold_device phantom|force-dimension|falcon LIBRARY wait|exit|abort|crash|check (a falcon needs no library)
#include <poll.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "common/core/check.hpp"
#include "common/runtime/stop_signal.hpp"
#include "haptic_client/device/connection.hpp"
#include "haptic_client/device/falcon.hpp"
#include "haptic_client/device/force_dimension.hpp"
#include "haptic_client/device/openhaptics.hpp"

#ifdef __SANITIZE_THREAD__
// The tested handler must get the signals.
extern "C" const char* __tsan_default_options() { return "handle_segv=0"; }  // NOLINT(bugprone-reserved-identifier)
#endif
#ifdef __SANITIZE_ADDRESS__
// It always ends while it holds its device. The tested handler must get the signals, and nothing is freed.
extern "C" const char* __asan_default_options() {
  return "handle_segv=0:detect_leaks=0";
}  // NOLINT(bugprone-reserved-identifier)
#endif

int main(int argc, char** argv) {
  using namespace osteon;
  using namespace osteon::haptic;
  using namespace std::chrono_literals;
  if (argc != 4) return 2;
  const std::string kind = argv[1], end = argv[3];
  std::unique_ptr<HapticDevice> device;
  if (kind == "phantom")
    device = make_openhaptics({argv[2], {}});
  else if (kind == "falcon")
    device = make_falcon({.firmware = {}, .priority = 0});
  else
    device = make_force_dimension({.library = argv[2]});
  const StopSignal stop;
  DeviceConnection connection(*device, [](DeviceEvent, std::string_view, const std::string&) {});
  if (const Result<void> started = connection.start(); !started) {
    std::fprintf(stderr, "%s\n", started.error().message.c_str());
    return 1;
  }
  for (int i = 0; !stop.requested(); ++i) {
    (void)device->read();
    device->write({Vec3(1.0, 0.0, 0.0), Vec3::Zero()});
    if (i == 300) std::puts("holding"), std::fflush(stdout);
    pollfd input{.fd = 0, .events = POLLIN, .revents = 0};
    if (i > 300 && ::poll(&input, 1, 0) > 0) {
      if (end == "exit") std::exit(0);
      if (end == "abort") std::abort();
      if (end == "check") OSTEON_CHECK(kind.empty());
      if (end == "crash") std::raise(SIGSEGV);
    }
    std::this_thread::sleep_for(1ms);
  }
  return 0;
}
