// A person's own hand at a device, without a plan. The handle drives the tool. Its pedal or button drives the spindle.
// Its clutch moves the handle without the tool. While the device is missing, the tool waits where it is, as with a held
// clutch.
#pragma once
#include <optional>

#include "haptic_client/simulation/session.hpp"

namespace osteon::haptic {

struct FreeHandOptions {
  std::string tool;
  double spindle_rpm = 0;  // with the pedal fully down; 0: the tool's own
  double wear = 1;
  std::string law = {};       // force law by which the tool resists; empty: the tool's own
  Vec3 toward{0, 1, 0};       // viewing direction of the user, patient's frame: from the front unless given otherwise
  std::optional<Vec3> at_mm;  // the tool waits above this point; none: above the bone nearest to the middle
};

// "front", "back", "left", "right", "top", "bottom" of the patient: where the user looks from. Or "x,y,z": the viewing
// direction. Error invalid_input: lists the permitted values.
[[nodiscard]] Result<Vec3> read_view(std::string_view text);
// "x,y,z" in millimetres. Error invalid_input: names `option`.
[[nodiscard]] Result<Vec3> read_point(std::string_view text, std::string_view option);

// Whether a person can use this tool by hand. Error invalid_input: the tool takes no bone; says what it is for.
[[nodiscard]] Result<void> check_held(const Tool& tool);

// A plan of one endless step: the tool, and where it is taken up. Error invalid_input or not_found.
[[nodiscard]] Result<ReadyPlan> make_free_hand(const FreeHandOptions& options, const Case& bone,
                                               const ToolFinder& find = find_tool);

class FreeHandSession final : public Session {
 public:
  // `plan`: from make_free_hand(). `device`: open, outlives the session. A device without force is treated as one that
  // shows all force, but is sent none.
  FreeHandSession(ReadyPlan plan, HapticDevice& device, const ForceScaling& scaling);

  SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                   const std::vector<PlacedGuide>* room_guides = nullptr) noexcept override;
  // True when its device has ended; a person continues until asked to stop.
  [[nodiscard]] bool done() const noexcept override { return device_.over(); }
  [[nodiscard]] bool endless() const noexcept override { return true; }
  [[nodiscard]] HapticLoop& loop() noexcept override { return loop_; }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return plan_; }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return results_; }
  [[nodiscard]] const std::vector<PlacedItem>& left() const noexcept override { return left_; }
  [[nodiscard]] const HapticDevice& device() const noexcept override { return device_; }

 private:
  void take_up(const DeviceReading& reading, SurgeonOrder& order) noexcept;

  ReadyPlan plan_;
  HapticDevice& device_;
  DeviceLimits limits_;
  HapticLoop loop_;
  std::vector<StepResult> results_{1};
  std::vector<PlacedItem> left_;
  bool taken_up_ = false;
};

}  // namespace osteon::haptic
