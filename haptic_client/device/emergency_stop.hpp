// The last resort for motors: what stops them is called when the process ends in any way that it can notice: a normal
// exit, a failed check, a crash, a hang-up. SIGINT and SIGTERM are orderly stops and not the concern of this file;
// SIGKILL and a power cut cannot be noticed, against those stands the device's own watchdog.
#pragma once

namespace osteon::haptic {

// While it lives, `stop(what)` is called once if the process ends. On a signal it runs in the handler, so it may only
// do what ends the motors; whatever it does, the process is gone a second later. At most eight live at a time; more are
// a broken promise.
class EmergencyStop {
 public:
  using Stop = void (*)(void* what);
  EmergencyStop(Stop stop, void* what);
  ~EmergencyStop();
  EmergencyStop(const EmergencyStop&) = delete;
  EmergencyStop& operator=(const EmergencyStop&) = delete;

 private:
  int place_;
};

}  // namespace osteon::haptic
