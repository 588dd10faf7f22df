// A simulated surgeon at a simulated device at the haptic loop: one tick of the whole, on whatever time the caller keeps.
#pragma once
#include "haptic_client/control/surgeon.hpp"
#include "haptic_client/device/simulated_device.hpp"

namespace osteon::haptic {

struct SessionTick {
  SurgeonOrder order;
  DeviceReading reading;   // what the loop was given
  double commanded_rpm = 0;
  LoopReport report;
};

class SimulatedSession {
 public:
  // `dt_s`: of a tick.
  SimulatedSession(ReadyPlan plan, const SimulatedDeviceParams& device, double force_scale, double dt_s = 1e-3);

  // [haptic] `link_ok` false ends force and spindle; `periods`: of 1 ms since the last tick, 1 when on time. The
  // simulated hand lives on these ticks: while none comes, as when the machine stalls, no time passes for it.
  // `room_guides`: those of the room's scene. Null: the plan's own, from the step on that places them.
  SessionTick tick(const Patch& patch, bool link_ok, int periods = 1, const std::vector<PlacedGuide>* room_guides = nullptr) noexcept;
  [[nodiscard]] bool done() const noexcept { return surgeon_.done(); }
  // Before the first tick: the handle moves as this device says, and the simulated hand lets go. The plan still says
  // which tools are taken up when; with a recording of the same plan on the same bone everything happens again.
  void play(HapticDevice& device) noexcept { played_ = &device; }

  [[nodiscard]] HapticLoop& loop() noexcept { return loop_; }
  [[nodiscard]] const Surgeon& surgeon() const noexcept { return surgeon_; }
  [[nodiscard]] const SimulatedDevice& device() const noexcept { return device_; }

 private:
  Surgeon surgeon_;
  SimulatedDevice device_;
  HapticLoop loop_;
  LoopReport last_;
  HapticDevice* played_ = nullptr;
};

}  // namespace osteon::haptic
