// A person's own hand at a device: no plan, the handle drives the tool, its pedal or button the spindle, its clutch
// moves the handle without the tool. While the device is not there the tool waits where it is, as under a held clutch.
#pragma once
#include <optional>

#include "haptic_client/control/session.hpp"

namespace osteon::haptic {

struct FreeHandOptions {
  std::string tool;
  double spindle_rpm = 0;  // with the pedal all the way down; 0: the tool's own
  double wear = 1;
  std::string law = {};       // force law by which the tool resists; empty: the tool's own
  Vec3 toward{0, 1, 0};       // where the user looks, patient's frame: from the front unless said otherwise
  std::optional<Vec3> at_mm;  // the tool waits over this place; none: over the bone's middle
};

// "front", "back", "left", "right", "top", "bottom", of the patient, from where the user looks; or "x,y,z", where to.
// Error invalid_input: what may be said.
[[nodiscard]] Result<Vec3> read_view(std::string_view text);
// "x,y,z" in millimetres. Error invalid_input; `option` is named in it.
[[nodiscard]] Result<Vec3> read_point(std::string_view text, std::string_view option);

// Whether a person's hand can do anything with a tool. Error invalid_input: it takes no bone, and what it is for.
[[nodiscard]] Result<void> check_held(const Tool& tool);

// A plan of one step without end: the tool, and where it is taken up. Error invalid_input or not_found.
[[nodiscard]] Result<ReadyPlan> make_free_hand(const FreeHandOptions& options, const Case& bone,
                                               const ToolFinder& find = find_tool);

class FreeHandSession final : public Session {
 public:
  // `plan`: of make_free_hand(). `device`: open, outlives the session. A device without force is used as one that shows
  // all of it, and shown none.
  FreeHandSession(ReadyPlan plan, HapticDevice& device, double force_scale);

  SessionTick tick(const Patch& patch, RoomLink room, int periods = 1,
                   const std::vector<PlacedGuide>* room_guides = nullptr) noexcept override;
  // When its device is over; a person goes on until asked to stop.
  [[nodiscard]] bool done() const noexcept override { return device_.over(); }
  [[nodiscard]] bool endless() const noexcept override { return true; }
  [[nodiscard]] HapticLoop& loop() noexcept override { return loop_; }
  [[nodiscard]] const ReadyPlan& plan() const noexcept override { return plan_; }
  [[nodiscard]] const std::vector<StepResult>& results() const noexcept override { return results_; }
  [[nodiscard]] const std::vector<LeftItem>& left() const noexcept override { return left_; }
  [[nodiscard]] const HapticDevice& device() const noexcept override { return device_; }

 private:
  void take_up(const DeviceReading& reading, SurgeonOrder& order) noexcept;

  ReadyPlan plan_;
  HapticDevice& device_;
  DeviceLimits limits_;
  HapticLoop loop_;
  std::vector<StepResult> results_{1};
  std::vector<LeftItem> left_;
  bool taken_up_ = false;
};

}  // namespace osteon::haptic
