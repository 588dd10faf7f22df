#include "haptic_client/device/space_mouse.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <optional>

#include "common/runtime/latest_value.hpp"
#include "haptic_client/device/device_exchange.hpp"
#include "haptic_client/device/hid_port.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::uint16_t kLogitech = 0x046d, k3Dconnexion = 0x256f;
constexpr std::array<std::uint16_t, 12> kLogitechModels{0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625,
                                                        0xc626, 0xc627, 0xc628, 0xc629, 0xc62b, 0xc640};
constexpr std::array<std::uint16_t, 10> k3DconnexionModels{0xc62e, 0xc62f, 0xc631, 0xc632, 0xc633,
                                                           0xc635, 0xc636, 0xc638, 0xc63a, 0xc652};
constexpr std::uint16_t kDesktopPage = 1, kMultiAxis = 8;
constexpr std::array<std::uint8_t, 2> kLightOn{4, 1}, kLightOff{4, 0};
constexpr auto kPause = 1ms;
// A cap held out of its middle reports again and again; silence means that its reports were lost.
constexpr auto kDeflectionHeld = 500ms;
constexpr double kLongestStep_s = 0.02;  // after a stall of this machine the tool does not leap

bool is_space_mouse(const HidFound& device) {
  const auto known = [&](const auto& models) { return std::find(models.begin(), models.end(), device.model) != models.end(); };
  const bool one = (device.vendor == kLogitech && known(kLogitechModels)) || (device.vendor == k3Dconnexion && known(k3DconnexionModels));
  // A receiver has other collections beside the cap's; where the system tells no usage it is the only one.
  return one && (device.usage_page == 0 || (device.usage_page == kDesktopPage && device.usage == kMultiAxis));
}

std::optional<HidFound> find_space_mouse() {
  for (const HidFound& device : list_hid_devices())
    if (is_space_mouse(device)) return device;
  return std::nullopt;
}

std::string described(const HidFound& device) {
  return (device.product.empty() ? "SpaceMouse" : device.product) + (device.serial.empty() ? "" : ", serial " + device.serial) + ", " + device.path;
}

// What both uses share: the port, its thread, the state of the cap.
class Cap {
 public:
  // `then` on the reading thread, after each report or pause; `at_end` when it has gone.
  Result<HidFound> open(bool light, std::function<void(const SpaceMouseState&)> then, std::function<void()> at_end) {
    const std::optional<HidFound> found = find_space_mouse();
    if (!found) return failure(ErrorCode::not_found, "no SpaceMouse is there; plug it in");
    Result<HidPort> port = HidPort::open(*found, "the SpaceMouse");
    if (!port) return tl::unexpected(port.error());
    if (light)
      if (Result<void> lit = port->write(kLightOn); !lit) return tl::unexpected(lit.error());
    state_ = {};
    moved_ = Clock::now();
    reader_.start(std::move(*port), kPause,
                  {.take = [this, then = std::move(then)](std::span<const std::uint8_t> report) {
                     const auto now = Clock::now();
                     if (!report.empty() && take_report(state_, report)) moved_ = now;
                     if (now - moved_ > kDeflectionHeld) state_.push = state_.twist = Vec3::Zero();
                     battery_ = state_.battery_percent;
                     then(state_);
                   },
                   .at_end = std::move(at_end),
                   .before_close = [light](HidPort& open_port) {
                     if (light) (void)open_port.write(kLightOff);
                   }});
    return *found;
  }
  void close() noexcept { reader_.stop(); }
  [[nodiscard]] Result<void> tend() const { return reader_.health(); }
  [[nodiscard]] int battery_percent() const noexcept { return battery_; }

 private:
  SpaceMouseState state_;     // reading thread, while it runs
  Clock::time_point moved_;
  std::atomic<int> battery_{-1};
  HidReader reader_;          // last: its thread ends before what it uses
};

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
    const Result<HidFound> found = cap_.open(
        options_.light, [this](const SpaceMouseState& state) { move(state); }, [this] { exchange_.go(DeviceStatus::fault); });
    if (!found) return tl::unexpected(found.error());
    info_.model = found->product.empty() ? "SpaceMouse" : found->product;
    info_.serial = found->serial;
    return {};
  }
  void close() noexcept override {
    cap_.close();
    exchange_.go_absent();
  }
  Result<void> tend() override { return cap_.tend(); }
  [[nodiscard]] std::string advice() const override {
    constexpr int kLow = 15;
    const int percent = cap_.battery_percent();
    return percent >= 0 && percent < kLow ? "charge the SpaceMouse: its battery has " + std::to_string(percent) + " %" : "";
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
  RateControl rate_;           // reading thread, while it runs; keeps its place when the device comes back
  Clock::time_point stepped_;
  DeviceInfo info_{.model = "SpaceMouse", .serial = {}, .driver = "hidapi", .force_axes = 0};
  DeviceExchange exchange_;
  Cap cap_;                    // last, see there
};

class CapForCamera final : public SpaceMouseCap {
 public:
  explicit CapForCamera(bool light) : light_(light) {}
  ~CapForCamera() override { close(); }
  Result<void> open() override {
    close();
    const Result<HidFound> found = cap_.open(
        light_, [this](const SpaceMouseState& state) { states_.store(state); }, [this] { states_.store({}); });
    if (!found) return tl::unexpected(found.error());
    return {};
  }
  void close() noexcept override {
    cap_.close();
    states_.store({});
  }
  Result<void> tend() override { return cap_.tend(); }
  SpaceMouseState cap() noexcept override {
    states_.refresh();
    return states_.value();
  }

 private:
  const bool light_;
  LatestValue<SpaceMouseState> states_;
  Cap cap_;
};

}  // namespace

std::unique_ptr<HapticDevice> make_space_mouse(const SpaceMouseOptions& options) { return std::make_unique<SpaceMouse>(options); }
std::unique_ptr<SpaceMouseCap> make_space_mouse_cap(bool light) { return std::make_unique<CapForCamera>(light); }

DeviceFinding look_for_space_mouse() {
  DeviceFinding finding;
  for (const HidFound& device : list_hid_devices())
    if (is_space_mouse(device)) finding.found.push_back(described(device));
  return finding;
}

}  // namespace osteon::haptic
