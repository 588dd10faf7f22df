// Plays the recording of a pointer's hand. Each tick of the recording has the pose of the handle, and each take-up of a
// tool has its mapping. So the loop gets the same inputs again, and no hand is simulated.
#pragma once
#include <vector>

#include "haptic_client/device/recorded_device.hpp"
#include "haptic_client/simulation/session.hpp"

namespace osteon::haptic {

class PlayedPointerSession final : public Session {
 public:
  // `plan`: from make_pointed_hand(), with the tools and the start of the recording. `device`: of a pointer's
  // recording; outlives the session. On the same bone it makes the same cuts and forces, under the conditions of
  // SimulatedSession::play().
  PlayedPointerSession(ReadyPlan plan, RecordedDevice& device, const ForceScaling& scaling, double dt_s = 1e-3);

  // [haptic]
  SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                   const std::vector<PlacedGuide>* room_guides = nullptr) noexcept override;
  [[nodiscard]] bool done() const noexcept override { return device_.over(); }
  [[nodiscard]] bool endless() const noexcept override { return true; }
  // As of the hand that was recorded.
  [[nodiscard]] bool simulated_time() const noexcept override { return true; }
  [[nodiscard]] HapticLoop& loop() noexcept override { return loop_; }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return plan_; }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return results_; }
  [[nodiscard]] const std::vector<PlacedItem>& left() const noexcept override { return left_; }
  [[nodiscard]] const HapticDevice& device() const noexcept override { return device_; }

 private:
  void take_up(const RecordedTakeUp& taken, SurgeonOrder& order) noexcept;
  void take_wear_and_law(const PointerTick& now) noexcept;  // wear and law of the tool in hand

  ReadyPlan plan_;
  RecordedDevice& device_;
  HapticLoop loop_;
  std::vector<const ForceLaw*> laws_;  // as the recording numbers them; null: there is no law of that name
  int tool_ = 0;                       // in hand
  std::vector<StepResult> results_{1};
  std::vector<PlacedItem> left_;
};

}  // namespace osteon::haptic
