#include "haptic_client/device/space_mouse.hpp"

#include <algorithm>
#include <chrono>

#include "common/input/space_mouse.hpp"
#include "haptic_client/device/device_exchange.hpp"

namespace osteon::haptic {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kLongestStep_s = 0.02;  // after a stall of this machine the tool does not jump

class SpaceMouse final : public HapticDevice {
 public:
  explicit SpaceMouse(const SpaceMouseOptions& options) : options_(options), rate_(options.rate) {
    rate_.place({Vec3::Zero(), pointing_away()});
  }
  ~SpaceMouse() override { close(); }

  [[nodiscard]] std::string_view name() const override { return "spacemouse"; }
  [[nodiscard]] DeviceLimits limits() const override { return {.workspace_radius_mm = options_.rate.reach_mm}; }
  [[nodiscard]] DeviceInfo info() const override { return info_; }

  Result<void> open() override {
    close();
    stepped_ = Clock::now();
    const Result<HidFound> found =
        cap_.open(options_.light, {.moved = [this](const SpaceMouseState& state) { move(state); },
                                   .lost = [this] { exchange_.go(DeviceStatus::fault); }});
    if (!found) return tl::unexpected(found.error());
    info_.model = found->product.empty() ? "SpaceMouse" : found->product;
    info_.serial = found->serial;
    return {};
  }
  void close() noexcept override {
    cap_.close();
    exchange_.go_absent();
  }
  Result<void> tend() override { return cap_.health(); }
  [[nodiscard]] std::string advice() const override {
    constexpr int kLow = 15;
    const int percent = cap_.battery_percent();
    return percent >= 0 && percent < kLow ? "charge the SpaceMouse: its battery has " + std::to_string(percent) + " %"
                                          : "";
  }

  DeviceReading read() noexcept override { return exchange_.read(); }
  void write(const DeviceOutput&) noexcept override {}

 private:
  void move(const SpaceMouseState& state) {
    const auto now = Clock::now();
    rate_.step(state, std::min(kLongestStep_s, std::chrono::duration<double>(now - stepped_).count()));
    stepped_ = now;
    DeviceReading reading;
    reading.pose_device_tool = rate_.pose();
    if (state.buttons & 1) reading.buttons |= kSpindlePedal;
    if (state.buttons & ~1u) reading.buttons |= kClutchButton;
    exchange_.publish(reading);
  }

  const SpaceMouseOptions options_;
  RateControl rate_;  // reading thread, while it runs; keeps its pose when the device comes back
  Clock::time_point stepped_;
  DeviceInfo info_{.model = "SpaceMouse", .serial = {}, .driver = "hidapi", .force_axes = 0};
  DeviceExchange exchange_;
  SpaceMousePort cap_;  // last: its thread ends before the members that it uses
};

}  // namespace

std::unique_ptr<HapticDevice> make_space_mouse(const SpaceMouseOptions& options) {
  return std::make_unique<SpaceMouse>(options);
}

DeviceFinding look_for_space_mouse() {
  DeviceFinding finding;
  for (const HidFound& device : list_space_mice()) {
    finding.found.push_back((device.product.empty() ? "SpaceMouse" : device.product) +
                            (device.serial.empty() ? "" : ", serial " + device.serial) + ", " + device.path);
  }
  return finding;
}

}  // namespace osteon::haptic
