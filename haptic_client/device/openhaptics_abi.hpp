// The used part of OpenHaptics' HDAPI, declared anew: types as the vendor's library passes them, and numbers of its
// parameters and errors. Source: published uses of HDAPI 3.x. The vendor's library is loaded, never linked.
#pragma once
#include <cstdint>

namespace osteon::haptic::hd {

using Handle = unsigned int;
using Enum = unsigned int;
using CallbackCode = unsigned int;
using SchedulerHandle = unsigned long;
using Boolean = unsigned char;
using Callback = CallbackCode (*)(void*);

struct ErrorInfo {
  unsigned int code;
  int internal;
  unsigned int device;
};
static_assert(sizeof(ErrorInfo) == 12, "returned by value");

inline constexpr Handle kNoDevice = 0xFFFFFFFFu;
inline constexpr CallbackCode kDone = 0, kContinue = 1;
inline constexpr unsigned short kHighestPriority = 65535;

// Parameters to read.
inline constexpr Enum kButtons = 0x2000, kTransform = 0x2052, kModel = 0x2501, kDriverVersion = 0x2502,
                      kSerial = 0x2504, kUsableWorkspace = 0x2551, kCalibrationStyle = 0x2555, kMaxStiffness = 0x2602,
                      kMaxForce = 0x2603, kMaxContinuousForce = 0x2604, kMotorTemperature = 0x2605,
                      kMaxDamping = 0x2609;
// Parameters to write.
inline constexpr Enum kForce = 0x2700;
// Capabilities to enable.
inline constexpr Enum kForceOutput = 0x4000, kForceClamping = 0x4001, kForceRamping = 0x4002;
// Calibration: states, and bits of the styles.
inline constexpr Enum kCalibrated = 0x5000, kNeedsUpdate = 0x5001, kNeedsManual = 0x5002;
inline constexpr Enum kEncoderReset = 1, kAutomatic = 2, kInkwell = 4;
// Errors.
inline constexpr unsigned kNoError = 0, kWarmMotors = 0x0200, kForceExceeded = 0x0201, kForceErrorsEnd = 0x0204,
                          kDeviceFault = 0x0300, kDeviceInUse = 0x0301, kCommunication = 0x0302,
                          kCommunicationSetup = 0x0303, kTimer = 0x0304, kBadHandle = 0x0104, kSchedulerFull = 0x0501,
                          kLicence = 0x0600;

// The functions of the library.
struct Api {
  Handle (*init_device)(const char* name);
  void (*make_current_device)(Handle);
  void (*disable_device)(Handle);
  void (*begin_frame)(Handle);
  void (*end_frame)(Handle);
  ErrorInfo (*get_error)();
  const char* (*get_error_string)(unsigned code);
  void (*enable)(Enum);
  void (*disable)(Enum);
  void (*get_integers)(Enum, int*);
  void (*get_doubles)(Enum, double*);
  void (*set_doubles)(Enum, const double*);
  const char* (*get_string)(Enum);
  Enum (*check_calibration)();
  void (*update_calibration)(Enum style);
  void (*start_scheduler)();
  void (*stop_scheduler)();
  SchedulerHandle (*schedule_asynchronous)(Callback, void*, unsigned short priority);
  void (*unschedule)(SchedulerHandle);
};

}  // namespace osteon::haptic::hd
