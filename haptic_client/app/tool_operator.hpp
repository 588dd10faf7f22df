// Makes the tool operator that the command line names: the simulated hand with a plan, a recording of one, a person at
// a device, or a person with a pointer.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/tools/tool_box.hpp"
#include "haptic_client/app/pointer_feed.hpp"
#include "haptic_client/device/connection.hpp"
#include "haptic_client/device/device_list.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "haptic_client/simulation/free_hand.hpp"

namespace osteon::haptic {

struct ToolOperatorOptions {
  std::string device = "simulated";
  std::filesystem::path plan;  // of a simulated hand or a recording
  std::string tool;            // of a person, or of a person's recording
  // Of a person. Defaults: from the front, above the bone nearest to its middle, the tool's own speed and law, sharp.
  std::optional<std::string> view, at;  // read_view(), read_point()
  std::optional<double> spindle_rpm;
  std::optional<std::string> law;
  std::optional<double> wear;
  DeviceOptions devices;
  std::optional<ForceChoice> force_choice;  // default: proportional, or as it was recorded
};

class ToolOperator {
 public:
  // Checks what can be checked without a room. Opens the person's devices and keeps them connected from then on. Errors
  // are sentences with the remedy.
  [[nodiscard]] static Result<ToolOperator> make(const ToolOperatorOptions& options, const DeviceNotice& notice);

  // Makes the session on a bone, with tools of `tools`, all that the room has. `force_scale` 0: from the device, or as
  // it was recorded. The session must not outlive this object. Errors: there is no such tool; its law does not suit it;
  // plan or tool does not suit the bone; the recording is of another bone, tool or plan.
  [[nodiscard]] Result<std::unique_ptr<Session>> on(const Case& bone, const ToolBox& tools, double force_scale);

  // The recording that moves the handle, if any.
  [[nodiscard]] const RecordedDevice* recorded() const { return recorded_.get(); }
  [[nodiscard]] std::string_view device_name() const;
  // What has pushed at a pointer by now. Empty for other devices.
  [[nodiscard]] std::vector<std::string_view> pushed() const;
  // Number of times that devices were lost.
  [[nodiscard]] int losses() const;
  // Ends force and closes the devices.
  void disconnect() noexcept { connections_.clear(); }

 private:
  ToolOperator() = default;
  // Checks the options of a hand without a plan.
  Result<void> take_tool();
  // The plan's steps, or those of the person's hand.
  Result<ReadyPlan> ready_on(const Case& bone, const ToolFinder& find) const;
  // The plan of a person with a pointer: all tools that a hand can hold.
  Result<ReadyPlan> pointed_ready_on(const Case& bone, const ToolBox& tools) const;
  // The session of a person with a pointer.
  Result<std::unique_ptr<Session>> pointed_on(const Case& bone, const ToolBox& tools, const ForceScaling& scaling);
  // Checks that a recording suits the bone and the plan. Returns how it scaled force. An option for the scale counts
  // more.
  Result<ForceScaling> played_on(const Case& bone, const ReadyPlan& ready, ForceScaling scaling) const;
  // Opens a person's devices.
  Result<void> connect(const DeviceNotice& notice);

  ToolOperatorOptions options_;
  std::vector<PlanStep> plan_;
  SimulatedDeviceParams simulated_;
  FreeHandOptions free_;
  std::unique_ptr<RecordedDevice> recorded_;
  std::unique_ptr<PointerFeed> pointer_;
  std::unique_ptr<CombinedDevice> person_;
  std::vector<std::unique_ptr<DeviceConnection>> connections_;  // destroyed before the devices
};

}  // namespace osteon::haptic
