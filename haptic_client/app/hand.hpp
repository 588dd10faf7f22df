// Who holds the tool: the simulated hand with a plan, a recording of one, or a person at a device, as the command line says.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "haptic_client/control/free_hand.hpp"
#include "haptic_client/device/connection.hpp"
#include "haptic_client/device/device_list.hpp"
#include "haptic_client/device/recorded_device.hpp"

namespace osteon::haptic {

struct HandOptions {
  std::string device = "simulated";
  std::filesystem::path plan;     // a simulated hand's, or a recording's
  std::string tool;               // a person's, or of a person's recording
  std::string view = "front", at; // read_view(), read_point(); `at` empty: the bone's middle
  double spindle_rpm = 0;         // 0: the tool's own
  std::string law;                // a person's: force law of the tool; empty: the tool's own
  double wear = 1;                // a person's
  DeviceOptions devices;
};

class HandChoice {
 public:
  // Checks what can be checked without a room, opens the person's devices and keeps them connected from then on. Errors
  // are sentences with the remedy.
  [[nodiscard]] static Result<HandChoice> make(const HandOptions& options, DeviceNotice notice);

  // The session on a bone; `force_scale` 0: from the device, or as it was recorded. Lives no longer than this choice.
  // Error: the plan or the tool does not suit the bone.
  [[nodiscard]] Result<std::unique_ptr<Session>> on(const Case& bone, double force_scale);

  [[nodiscard]] std::string_view device_name() const;
  // How often devices were lost.
  [[nodiscard]] int losses() const;
  // Force and devices end.
  void disconnect() noexcept { connections_.clear(); }

 private:
  HandChoice() = default;
  // Checks what a hand without a plan was told.
  Result<void> take_tool();
  // Opens a person's devices.
  Result<void> connect(const DeviceNotice& notice);

  HandOptions options_;
  std::vector<PlanStep> plan_;
  SimulatedDeviceParams simulated_;
  FreeHandOptions free_;
  std::unique_ptr<RecordedDevice> recorded_;
  std::unique_ptr<CombinedDevice> person_;
  std::vector<std::unique_ptr<DeviceConnection>> connections_;  // end before the devices
};

}  // namespace osteon::haptic
