// A simulated surgeon at a simulated device at the haptic loop: one tick of the whole, on whatever time the caller
// keeps.
#pragma once
#include "haptic_client/control/surgeon.hpp"
#include "haptic_client/device/simulated_device.hpp"

namespace osteon::haptic {

struct SessionTick {
  SurgeonOrder order;
  DeviceReading reading;  // what the loop was given
  double commanded_rpm = 0;
  LoopReport report;
};

// Whoever holds the handle: a tick at a time it moves, and the loop answers.
class Session {
 public:
  virtual ~Session() = default;
  // [haptic] `periods`: of 1 ms since the last tick, 1 when on time. `room_guides`: those of the room's scene. Null:
  // the plan's own, from the step on that places them.
  virtual SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                           const std::vector<PlacedGuide>* room_guides = nullptr) noexcept = 0;
  [[nodiscard]] virtual bool done() const noexcept = 0;
  [[nodiscard]] virtual bool endless() const noexcept { return false; }  // goes on until it is asked to stop
  [[nodiscard]] virtual HapticLoop& loop() noexcept = 0;
  // Its steps and tools; a hand that is free has tools only.
  [[nodiscard]] virtual const ReadyPlan& plan() const noexcept = 0;
  [[nodiscard]] virtual const std::vector<StepResult>& results() const noexcept = 0;
  // What was left on the bone so far, in order. Entries stay as they are: another thread may read those that it was
  // told of.
  [[nodiscard]] virtual const std::vector<LeftItem>& left() const noexcept = 0;
  [[nodiscard]] virtual const HapticDevice& device() const noexcept = 0;
};

class SimulatedSession final : public Session {
 public:
  // `dt_s`: of a tick.
  SimulatedSession(ReadyPlan plan, const SimulatedDeviceParams& device, double force_scale, double dt_s = 1e-3);

  // [haptic] The simulated hand lives on these ticks: while none comes, as when the machine stalls, no time passes for
  // it.
  SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                   const std::vector<PlacedGuide>* room_guides = nullptr) noexcept override;
  // When the plan is done, or what is played is over: nobody moves the handle any more. What needs no handle (the way
  // out of the bone, the spindle's end, a wait) is gone through first.
  [[nodiscard]] bool done() const noexcept override;
  // Before the first tick: the handle moves as this device says, and the simulated hand lets go. The plan still says
  // which tools are taken up when. The same cuts and forces come again, bit for bit, with a recording of the same plan
  // at the same force scale on bone that is as it was then, if patches, confirmed cuts, late ticks and silences of the
  // room come in the ticks in which they came then; where threads bring them, as in a running client, cuts come again
  // to their size, not to the bit.
  void play(HapticDevice& device) noexcept { played_ = &device; }

  [[nodiscard]] HapticLoop& loop() noexcept override { return loop_; }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return surgeon_.plan(); }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return surgeon_.results(); }
  [[nodiscard]] const std::vector<LeftItem>& left() const noexcept override { return surgeon_.left(); }
  [[nodiscard]] const Surgeon& surgeon() const noexcept { return surgeon_; }
  [[nodiscard]] const SimulatedDevice& device() const noexcept override { return device_; }

 private:
  Surgeon surgeon_;
  SimulatedDevice device_;
  HapticLoop loop_;
  LoopReport last_;
  HapticDevice* played_ = nullptr;
  SurgeonPhase phase_ = SurgeonPhase::take_up;  // of the last tick
};

}  // namespace osteon::haptic
