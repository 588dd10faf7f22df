// The used part of Force Dimension's libdhd, declared anew from published uses of its C API (3.x). Lengths are metres,
// torques newton-metres; the device's x points to the user, y to the right, z up. Nothing here was tested on a device.
// Facts that only other programs' use supports are marked unverified where they are used.
#pragma once

namespace osteon::haptic::dhd {

inline constexpr int kMostStatus = 16;
// Indices in the status.
inline constexpr int kPower = 0, kConnected = 1, kReset = 3, kErrorStatus = 9;
// System types.
inline constexpr int kOmega = 32, kOmega3 = 33, kOmega6 = 34, kOmega7 = 35, kOmega6Left = 36, kOmega7Left = 37,
                     kFalcon = 60, kDelta3 = 63, kDelta6 = 64, kSigma7 = 104, kSigma7Left = 105, kSigma6 = 106,
                     kSigma6Left = 107;
// Errors.
inline constexpr int kNoError = 0, kCommunication = 2, kBusy = 3, kNoDriver = 4, kNoDevice = 5, kTimeout = 7,
                     kNotReady = 12, kInUse = 20;

struct Api {
  int (*device_count)();
  int (*open_id)(char id);
  int (*close)(char id);
  int (*system_type)(char id);
  const char* (*system_name)(char id);
  int (*serial_number)(unsigned short* serial, char id);
  void (*sdk_version)(int* major, int* minor, int* release, int* revision);
  int (*status)(int* status, char id);
  int (*enable_force)(unsigned char on, char id);
  int (*stop)(char id);
  bool (*has_wrist)(char id);
  bool (*has_active_wrist)(char id);
  int (*position)(double* x, double* y, double* z, char id);
  int (*position_and_frame)(double* x, double* y, double* z, double (*matrix)[3], char id);
  int (*set_force_and_torque)(double fx, double fy, double fz, double tx, double ty, double tz, char id);
  unsigned (*button_mask)(char id);
  int (*last_error)();
  const char* (*error_text)(int error);
};

}  // namespace osteon::haptic::dhd
