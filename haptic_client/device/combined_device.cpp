#include "haptic_client/device/combined_device.hpp"

#include <algorithm>

namespace osteon::haptic {

Result<std::unique_ptr<CombinedDevice>> CombinedDevice::make(std::vector<std::unique_ptr<HapticDevice>> parts) {
  auto result = std::unique_ptr<CombinedDevice>(new CombinedDevice);
  std::string names;
  for (const auto& part : parts) names += (names.empty() ? "" : "+") + std::string(part->name());
  const auto wrong = [&](const std::string& why) {
    return failure(ErrorCode::invalid_input, "--device " + names + ": " + why);
  };
  if (parts.empty()) return wrong("it names no device; name one, e.g. phantom");
  if (!parts[0]->info().places)
    return wrong("the first device must be one for the hand, such as phantom, falcon or spacemouse");
  for (std::size_t i = 1; i < parts.size(); ++i) {
    HapticDevice& part = *parts[i];
    const DeviceInfo info = part.info();
    if (info.pedals) {
      if (result->pedal_) return wrong("two devices for the spindle; name one pedal");
      result->pedal_ = &part;
    } else if (info.turns && info.force_axes == 0) {
      if (part.name() == parts[0]->name()) return wrong(std::string(part.name()) + " is named twice; name it once");
      if (result->turning_) return wrong("two devices for the rotation; name one");
      result->turning_ = &part;
    } else {
      return wrong(std::string(part.name()) + " cannot be added to " + std::string(parts[0]->name()) +
                   "; add a spacemouse for the rotation or a pedal for the spindle");
    }
  }
  result->name_ = names;
  result->parts_ = std::move(parts);
  return result;
}

DeviceLimits CombinedDevice::limits() const {
  DeviceLimits limits = parts_[0]->limits();
  if (turning_) limits.peak_nmm = limits.continuous_nmm = 0.0;
  return limits;
}

DeviceInfo CombinedDevice::info() const {
  DeviceInfo info = parts_[0]->info();
  for (std::size_t i = 1; i < parts_.size(); ++i) {
    const DeviceInfo more = parts_[i]->info();
    info.model += (info.model.empty() ? "" : " + ") + more.model;
  }
  if (turning_) {
    info.turns = true;
    info.torque_axes = 0;
  }
  info.pedals = pedal_ != nullptr;
  return info;
}

DeviceReading CombinedDevice::read() noexcept {
  DeviceReading reading = parts_[0]->read();
  if (!turning_ && !pedal_) return reading;
  const auto join_buttons = [&](std::uint32_t buttons) {
    if (pedal_ && (buttons & kSpindlePedal))
      buttons = (buttons & ~static_cast<std::uint32_t>(kSpindlePedal)) | kClutchButton;
    return buttons;
  };
  reading.buttons = join_buttons(reading.buttons);
  if (turning_) {
    const DeviceReading turn = turning_->read();
    reading.pose_device_tool.rotation = turn.pose_device_tool.rotation;
    reading.buttons |= join_buttons(turn.buttons);
    reading.status = std::max(reading.status, turn.status);
    reading.calibration = std::max(reading.calibration, turn.calibration);
  }
  if (pedal_) {
    const DeviceReading foot = pedal_->read();
    if (foot.usable()) {
      reading.buttons |= foot.buttons & (kSpindlePedal | kIrrigation | kSuction);
      reading.pedal = std::max(reading.pedal, foot.pedal);
    }
  }
  return reading;
}

void CombinedDevice::write(const DeviceOutput& output) noexcept {
  parts_[0]->write(turning_ ? DeviceOutput(output.force_n) : output);
}

}  // namespace osteon::haptic
