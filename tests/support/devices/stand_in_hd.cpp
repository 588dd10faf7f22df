// Our stand-in for OpenHaptics' libHD.so, with a simulated arm and the failures that a test asks for. It follows the
// vendor's rules for callers, and counts every breach.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <mutex>
#include <thread>
#include <vector>

#include "tests/support/devices/arm.hpp"

namespace {

using osteon::test::Arm;
using osteon::test::ArmControl;

struct HDErrorInfo {
  unsigned code;
  int internal;
  unsigned device;
};

constexpr unsigned kHandle = 1, kBadHandle = 0xFFFFFFFFu;

struct World {
  ArmControl* control = nullptr;
  Arm arm;
  std::mutex errors_mutex;
  std::vector<unsigned> errors;  // newest last
  std::atomic<bool> open{false}, in_frame{false}, running{false};
  std::thread scheduler;
  std::atomic<unsigned (*)(void*)> callback{nullptr};
  std::atomic<void*> data{nullptr};
  std::array<double, 3> force{}, torque{};
};

World& world() {
  static auto* const the = new World;  // outlives every static of the program, because a scheduler's thread may too
  return *the;
}

void push(unsigned code) {
  World& w = world();
  const std::lock_guard lock(w.errors_mutex);
  w.errors.push_back(code);
}

void misuse(unsigned code) {
  if (world().control) ++world().control->misuse;
  push(code);
}

bool opened(unsigned code = 0x0104) {
  if (world().open) return true;
  misuse(code);
  return false;
}

void scheduler_thread() {
  World& w = world();
  auto due = std::chrono::steady_clock::now();
  while (w.running) {
    if (!w.control->fast || w.control->stalled || !w.callback.load()) {
      due += std::chrono::milliseconds(1);
      std::this_thread::sleep_until(due);
    }
    if (w.control->stalled) continue;
    const auto callback = w.callback.load();
    if (callback && callback(w.data.load()) == 0) w.callback = nullptr;
  }
}

}  // namespace

extern "C" {

unsigned hdInitDevice(const char* name) {
  World& w = world();
  if (!w.control) w.control = osteon::test::find_arm();
  if (!w.control || !w.control->plugged || (name && std::strcmp(name, "no such name") == 0)) {
    push(0x0300);
    return kBadHandle;
  }
  if (const int wanted = w.control->open_error) {
    push(static_cast<unsigned>(wanted));
    return kBadHandle;
  }
  if (w.open.exchange(true)) {
    misuse(0x0301);
    return kBadHandle;
  }
  ++w.control->opened;
  w.control->is_open = 1;
  w.force = {};
  w.torque = {};
  w.control->motors_on = 0;
  return kHandle;
}

void hdMakeCurrentDevice(unsigned device) {
  if (opened() && device != kHandle) misuse(0x0104);
}

void hdDisableDevice(unsigned device) {
  World& w = world();
  if (!opened() || device != kHandle) return;
  if (w.running) misuse(0x0102);  // the caller must stop the scheduler first
  w.open = false;
  w.control->is_open = 0;
  w.control->motors_on = 0;
  ++w.control->closed;
}

void hdBeginFrame(unsigned device) {
  World& w = world();
  if (!opened()) return;
  if (device != kHandle || w.in_frame.exchange(true)) misuse(0x0400);
}

void hdEndFrame(unsigned device) {
  World& w = world();
  if (!opened()) return;
  if (device != kHandle || !w.in_frame.exchange(false)) misuse(0x0401);
  ArmControl& c = *w.control;
  if (const int once = c.next_error.exchange(0)) push(static_cast<unsigned>(once));
  if (c.error_cycles > 0) {
    --c.error_cycles;
    push(static_cast<unsigned>(c.lasting_error.load()));
  }
  if (!c.plugged) {
    push(0x0302);
    for (auto& f : c.force_n) f = 0.0;  // the cable is pulled, so there is no motor
    ++c.cycles;
    return;
  }
  w.arm.step(c, w.force, w.torque);
}

HDErrorInfo hdGetError() {
  World& w = world();
  const std::lock_guard lock(w.errors_mutex);
  if (w.errors.empty()) return {0, 0, kBadHandle};
  const unsigned code = w.errors.back();
  w.errors.pop_back();
  return {code, -1, kHandle};
}

const char* hdGetErrorString(unsigned code) {
  return code == 0 ? "no error" : code == 0x0200 ? "stand-in: warm" : "stand-in: error";
}

void hdEnable(unsigned what) {
  if (!opened()) return;
  if (what == 0x4000)
    world().control->motors_on = 1;
  else if (what != 0x4001 && what != 0x4002)
    misuse(0x0100);
}

void hdDisable(unsigned what) {
  if (opened() && what == 0x4000) world().control->motors_on = 0;
}

void hdGetIntegerv(unsigned what, int* values) {
  if (!opened()) return;
  ArmControl& c = *world().control;
  switch (what) {
    case 0x2000:
      values[0] = c.plugged ? c.buttons.load() : 0;
      break;
    case 0x2554:
      values[0] = c.output_axes;
      break;
    case 0x2555:
      values[0] = c.style;
      break;
    default:
      misuse(0x0100);
  }
}

void hdGetDoublev(unsigned what, double* values) {
  World& w = world();
  if (!opened()) return;
  ArmControl& c = *w.control;
  const auto limit = [&](double v) { values[0] = c.silent_limits ? 0.0 : v; };
  switch (what) {
    case 0x2052: {
      if (!w.in_frame) misuse(0x0102);
      const double q[4] = {c.rotation[0], c.rotation[1], c.rotation[2], c.rotation[3]};
      const double s = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
      const double m[16] = {1 - s * (q[2] * q[2] + q[3] * q[3]),
                            s * (q[1] * q[2] + q[3] * q[0]),
                            s * (q[1] * q[3] - q[2] * q[0]),
                            0,
                            s * (q[1] * q[2] - q[3] * q[0]),
                            1 - s * (q[1] * q[1] + q[3] * q[3]),
                            s * (q[2] * q[3] + q[1] * q[0]),
                            0,
                            s * (q[1] * q[3] + q[2] * q[0]),
                            s * (q[2] * q[3] - q[1] * q[0]),
                            1 - s * (q[1] * q[1] + q[2] * q[2]),
                            0,
                            w.arm.position_mm()[0],
                            w.arm.position_mm()[1],
                            w.arm.position_mm()[2],
                            1};
      std::copy(m, m + 16, values);
      break;
    }
    case 0x2551: {
      const double box[6] = {-80, -60, -35, 80, 60, 45};
      std::copy(box, box + 6, values);
      break;
    }
    case 0x2602:
      limit(Arm::kStiffness_n_per_mm);
      break;
    case 0x2603:
      limit(Arm::kPeak_n);
      break;
    case 0x2604:
      limit(Arm::kContinuous_n);
      break;
    case 0x2605:
      std::fill(values, values + 3, c.temperature.load());
      break;
    case 0x2609:
      limit(0.002);
      break;
    default:
      misuse(0x0100);
  }
}

void hdSetDoublev(unsigned what, const double* values) {
  World& w = world();
  if (!opened()) return;
  if (!w.in_frame) misuse(0x0102);
  if (what == 0x2700)
    std::copy(values, values + 3, w.force.begin());
  else if (what == 0x2701)
    std::copy(values, values + 3, w.torque.begin());
  else
    misuse(0x0100);
}

const char* hdGetString(unsigned what) {
  if (!opened()) return nullptr;
  switch (what) {
    case 0x2501:
      return "Stand-in Arm";
    case 0x2502:
      return "1.0";
    case 0x2504:
      return "0001";
    default:
      misuse(0x0100);
      return nullptr;
  }
}

unsigned hdCheckCalibration() {
  if (!opened()) return 0x5002;
  return 0x5000u + static_cast<unsigned>(world().control->calibration.load());
}

void hdUpdateCalibration(unsigned style) {
  World& w = world();
  if (!opened()) return;
  ArmControl& c = *w.control;
  if (!(static_cast<unsigned>(c.style.load()) & style)) misuse(0x0101);
  // An encoder reset takes the handle's present pose. Other styles are possible only if the device has asked for them.
  if (c.calibration == 1 || style == 1) c.calibration = 0;
}

void hdStartScheduler() {
  World& w = world();
  if (!opened()) return;
  if (w.running.exchange(true)) {
    misuse(0x0102);
    return;
  }
  ++w.control->scheduler_starts;
  w.scheduler = std::thread(scheduler_thread);
}

void hdStopScheduler() {
  World& w = world();
  if (!w.running.exchange(false)) return;
  ++w.control->scheduler_stops;
  if (w.scheduler.get_id() == std::this_thread::get_id())
    w.scheduler.detach();
  else
    w.scheduler.join();
  for (auto& f : w.control->force_n) f = 0.0;  // the vendor's servo loop ends with the motors off
}

unsigned long hdScheduleAsynchronous(unsigned (*callback)(void*), void* data, unsigned short) {
  World& w = world();
  if (!opened()) return 0;
  if (w.callback.load()) misuse(0x0501);
  w.data = data;
  w.callback = callback;
  return 7;
}

void hdUnschedule(unsigned long handle) {
  World& w = world();
  if (handle != 7) misuse(0x0101);
  w.callback = nullptr;
}

}  // extern "C"
