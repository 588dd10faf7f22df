// The last resort to stop motors. The stop function is called when the process ends in any way that it can notice: a
// normal exit, a failed check, a crash, a hang-up. SIGINT and SIGTERM are orderly stops and not handled here. SIGKILL
// and a power cut cannot be noticed; the device's own watchdog protects against them.
#pragma once

namespace osteon::haptic {

// While it lives, `stop(what)` is called once if the process ends. On a signal it runs in the handler, so it may only
// do what stops the motors. In any case the process ends a second later. At most eight may live at a time; more are a
// programming error.
class EmergencyStop {
 public:
  using Stop = void (*)(void* what);
  EmergencyStop(Stop stop, void* what);
  ~EmergencyStop();
  // To be called after the motors were started. Stops them if the process has ended meanwhile: other threads still run
  // then, and may open a device anew.
  void started() const noexcept;
  // Whether the process ends, so that no motor may be started. Any thread.
  [[nodiscard]] static bool process_ends() noexcept;
  EmergencyStop(const EmergencyStop&) = delete;
  EmergencyStop& operator=(const EmergencyStop&) = delete;

 private:
  Stop stop_;
  void* what_;
  int place_;
};

}  // namespace osteon::haptic
