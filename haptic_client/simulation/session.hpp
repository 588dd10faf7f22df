// A simulated surgeon with a simulated device and the haptic loop. One call is one tick of the whole. The caller
// provides the time.
#pragma once
#include "haptic_client/device/simulated_device.hpp"
#include "haptic_client/simulation/surgeon.hpp"

namespace osteon::haptic {

struct SessionTick {
  SurgeonOrder order;
  DeviceReading reading;  // input of the loop
  double commanded_rpm = 0;
  LoopReport report;
  bool empty_hand = false;          // it holds no tool: others see none
  std::uint8_t pointer_source = 0;  // 1 and more: a PointerSource; 0: no pointer leads the hand
};

// A session of one tool operator. In each tick the operator moves the handle, and the loop responds.
class Session {
 public:
  virtual ~Session() = default;
  // [haptic] `periods`: of 1 ms since the last tick, 1 when on time. `room_guides`: those of the room's scene. Null:
  // the plan's own guides, from the step on that places them.
  virtual SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                           const std::vector<PlacedGuide>* room_guides = nullptr) noexcept = 0;
  [[nodiscard]] virtual bool done() const noexcept = 0;
  [[nodiscard]] virtual bool endless() const noexcept { return false; }  // continues until it is asked to stop
  // True: no time passes for the hand between two ticks, so that no tick is late for it.
  [[nodiscard]] virtual bool simulated_time() const noexcept { return false; }
  [[nodiscard]] virtual HapticLoop& loop() noexcept = 0;
  // Its steps and tools; a free hand has tools only.
  [[nodiscard]] virtual const ReadyPlan& plan() const noexcept = 0;
  [[nodiscard]] virtual const std::vector<StepResult>& results() const noexcept = 0;
  // Items left on the bone so far, in order. Entries never change: another thread may read those it was given.
  [[nodiscard]] virtual const std::vector<PlacedItem>& left() const noexcept = 0;
  [[nodiscard]] virtual const HapticDevice& device() const noexcept = 0;
};

class SimulatedSession final : public Session {
 public:
  // `dt_s`: of a tick.
  SimulatedSession(ReadyPlan plan, const SimulatedDeviceParams& device, const ForceScaling& scaling,
                   double dt_s = 1e-3);

  // [haptic] The simulated hand's time is counted in these ticks. While no tick comes, for example when the machine
  // stalls, no time passes for it.
  SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                   const std::vector<PlacedGuide>* room_guides = nullptr) noexcept override;
  // True when the plan is done, or when the recording being played is over and nobody moves the handle. Steps that need
  // no handle are completed first: the way out of the bone, the spindle's stop, a wait.
  [[nodiscard]] bool done() const noexcept override;
  // False while a recording is played: its device may have its own time.
  [[nodiscard]] bool simulated_time() const noexcept override { return !played_; }
  // Call before the first tick. This device then moves the handle, and the simulated hand lets go. The plan still says
  // which tools are taken up when. The same cuts and forces are repeated, bit for bit, under these conditions. The
  // recording has the same plan and force scale, and the bone is as it was then. Patches, confirmed cuts, late ticks
  // and silences of the room come in the same ticks as then. Where threads deliver them, as in a running client, cuts
  // are repeated in size, not to the bit.
  void play(HapticDevice& device) noexcept { played_ = &device; }

  [[nodiscard]] HapticLoop& loop() noexcept override { return loop_; }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return surgeon_.plan(); }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return surgeon_.results(); }
  [[nodiscard]] const std::vector<PlacedItem>& left() const noexcept override { return surgeon_.left(); }
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
