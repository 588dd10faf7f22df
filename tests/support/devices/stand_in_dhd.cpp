// Our stand-in for Force Dimension's libdhd.so, with a simulated arm and the failures that a test asks for. Metres and
// newton-metres; x to the user, y to the right, z up.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include "tests/support/devices/arm.hpp"

namespace {

using osteon::test::Arm;
using osteon::test::ArmControl;

struct World {
  ArmControl* control = nullptr;
  Arm arm;
  std::atomic<int> error{0};
};

World& world() {
  static auto* const the = new World;
  if (!the->control) the->control = osteon::test::find_arm();
  return *the;
}

int fail(int code) {
  world().error = code;
  return -1;
}

// Whether this device answers the call.
bool answers(char id) {
  World& w = world();
  if (!w.control || !w.control->is_open || id != 0) {
    if (w.control) ++w.control->misuse;
    w.error = 15;
    return false;
  }
  if (!w.control->plugged) {
    for (auto& f : w.control->force_n) f = 0.0;
    w.error = 2;
    return false;
  }
  return true;
}

}  // namespace

extern "C" {

int dhdGetDeviceCount() { return world().control && world().control->plugged ? 1 : 0; }

int dhdOpenID(char id) {
  World& w = world();
  if (!w.control || !w.control->plugged || id != 0) return fail(5);
  if (const int wanted = w.control->open_error) return fail(wanted);
  if (w.control->is_open.exchange(1)) {
    ++w.control->misuse;
    return fail(20);
  }
  ++w.control->opened;
  w.control->motors_on = 0;
  return 0;
}

int dhdClose(char id) {
  World& w = world();
  if (!w.control || !w.control->is_open || id != 0) return fail(5);
  w.control->is_open = 0;
  w.control->motors_on = 0;
  ++w.control->closed;
  return 0;
}

int dhdGetSystemType(char id) { return answers(id) ? world().control->type.load() : -1; }
const char* dhdGetSystemName(char id) { return answers(id) ? "stand-in omega" : nullptr; }

int dhdGetSerialNumber(unsigned short* serial, char id) {
  if (!answers(id)) return -1;
  *serial = 4242;
  return 0;
}

void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  *major = 3;
  *minor = 7;
  *release = 0;
  *revision = 1;
}

int dhdGetStatus(int* status, char id) {
  if (!answers(id)) return -1;
  std::fill(status, status + 16, 0);
  status[0] = status[1] = 1;
  status[3] = world().control->calibration == 0;
  status[5] = world().control->motors_on;
  return 0;
}

int dhdEnableForce(unsigned char on, char id) {
  if (!answers(id)) return -1;
  if (on && world().control->calibration != 0) {
    ++world().control->misuse;
    return fail(12);
  }
  world().control->motors_on = on;
  return 0;
}

int dhdStop(char id) {
  if (!answers(id)) return -1;
  world().control->motors_on = 0;
  for (auto& f : world().control->force_n) f = 0.0;
  ++world().control->emergency_stops;
  return 0;
}

bool dhdHasWrist(char id) { return answers(id) && world().control->type != 33; }
bool dhdHasActiveWrist(char id) { return answers(id) && world().control->output_axes >= 6; }

int dhdGetPosition(double* x, double* y, double* z, char id) {
  if (!answers(id)) return -1;
  // The first call of each cycle.
  while (world().control->cycles >= world().control->until) std::this_thread::sleep_for(std::chrono::microseconds(20));
  const auto& p = world().arm.position_mm();
  *x = 1e-3 * p[2];
  *y = 1e-3 * p[0];
  *z = 1e-3 * p[1];
  return 0;
}

int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double (*m)[3], char id) {
  if (dhdGetPosition(x, y, z, id) < 0) return -1;
  const ArmControl& c = *world().control;
  const double q[4] = {c.rotation[0], c.rotation[1], c.rotation[2], c.rotation[3]};
  const double s = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double rows[3][3] = {
      {1 - s * (q[2] * q[2] + q[3] * q[3]), s * (q[1] * q[2] - q[3] * q[0]), s * (q[1] * q[3] + q[2] * q[0])},
      {s * (q[1] * q[2] + q[3] * q[0]), 1 - s * (q[1] * q[1] + q[3] * q[3]), s * (q[2] * q[3] - q[1] * q[0])},
      {s * (q[1] * q[3] - q[2] * q[0]), s * (q[2] * q[3] + q[1] * q[0]), 1 - s * (q[1] * q[1] + q[2] * q[2])}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) m[row][column] = rows[row][column];
  return 0;
}

int dhdSetForceAndTorque(double fx, double fy, double fz, double tx, double ty, double tz, char id) {
  World& w = world();
  if (w.control && w.control->stalled) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  if (!answers(id)) return -1;
  ArmControl& c = *w.control;
  if (const int once = c.next_error.exchange(0)) return fail(once);
  if (c.error_cycles > 0) {
    --c.error_cycles;
    return fail(c.lasting_error);
  }
  w.arm.step(c, {fy, fz, fx}, {1e3 * ty, 1e3 * tz, 1e3 * tx});
  return fx * fx + fy * fy + fz * fz > Arm::kPeak_n * Arm::kPeak_n ? 2 : 0;
}

unsigned dhdGetButtonMask(char id) { return answers(id) ? static_cast<unsigned>(world().control->buttons.load()) : 0u; }
int dhdErrorGetLast() { return world().error; }
const char* dhdErrorGetStr(int code) { return code == 0 ? "no error" : "stand-in: error"; }

}  // extern "C"
