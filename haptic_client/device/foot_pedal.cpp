#include "haptic_client/device/foot_pedal.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>

#include "common/input/hid_port.hpp"
#include "haptic_client/device/device_exchange.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t kSwitchVendor = 0x05f3, kSwitchModel = 0x00ff;
constexpr std::uint16_t kDesktop = 1, kSimulation = 2, kJoystick = 4;
constexpr std::size_t kSwitchReport = 2;
constexpr std::uint8_t kSwitches = 7;
constexpr auto kPause = 5ms;  // the haptic thread wants to hear from the device more often than it reports
// As pedals are wired: accelerator, brake, throttle, slider, z, its rotation, x, y and theirs.
constexpr std::array<HidUsage, 10> kAxes{{{kSimulation, 0xc4},
                                          {kSimulation, 0xc5},
                                          {kSimulation, 0xbb},
                                          {kDesktop, 0x36},
                                          {kDesktop, 0x32},
                                          {kDesktop, 0x35},
                                          {kDesktop, 0x30},
                                          {kDesktop, 0x31},
                                          {kDesktop, 0x33},
                                          {kDesktop, 0x34}}};

bool is_switch(const HidFound& device) { return device.vendor == kSwitchVendor && device.model == kSwitchModel; }
bool is_joystick(const HidFound& device) { return device.usage_page == kDesktop && device.usage == kJoystick; }

std::string described(const HidFound& device, const std::string& kind) {
  return (device.product.empty() ? kind : device.product + " (" + kind + ")") + ", " + device.path;
}

class FootPedal final : public HapticDevice {
 public:
  explicit FootPedal(const FootPedalOptions& options) : options_(options), axis_(options.axis) {}
  ~FootPedal() override { close(); }

  [[nodiscard]] std::string_view name() const override { return options_.proportional ? "pedal-axis" : "pedal"; }
  [[nodiscard]] DeviceLimits limits() const override { return {}; }
  [[nodiscard]] DeviceInfo info() const override { return info_; }

  Result<void> open() override {
    close();
    const std::vector<HidFound> all = list_hid_devices();
    const auto found = std::find_if(all.begin(), all.end(), options_.proportional ? is_joystick : is_switch);
    if (found == all.end())
      return failure(ErrorCode::not_found, options_.proportional ? "no joystick whose axis could be a pedal is there; plug it in"
                                                                 : "no foot pedal is there; plug it in");
    Result<HidPort> port = HidPort::open(*found, "the foot pedal");
    if (!port) return tl::unexpected(port.error());
    if (options_.proportional) {
      const std::vector<HidField> fields = hid_input_fields(port->descriptor());
      const HidUsage wanted{kDesktop, options_.axis_usage};
      const auto field = options_.axis_usage != 0 ? find_field(fields, {&wanted, 1}) : find_field(fields, kAxes);
      if (!field)
        return failure(ErrorCode::unsupported,
                       found->product + " at " + found->path + " has no such axis; choose another joystick");
      field_ = *field;
    }
    info_.model = found->product.empty() ? "foot pedal" : found->product;
    info_.serial = found->serial;
    axis_.forget();
    armed_ = !options_.proportional;
    down_ = 0;
    reader_.start(std::move(*port), kPause,
                  {.take = [this](std::span<const std::uint8_t> report) { take(report); },
                   .at_end = [this] { exchange_.go(DeviceStatus::fault); },
                   .before_close = {}});
    return {};
  }
  void close() noexcept override {
    reader_.stop();
    exchange_.go_absent();
  }
  Result<void> tend() override { return reader_.health(); }
  [[nodiscard]] std::string advice() const override {
    return armed_ ? "" : "let the foot pedal go once; until then it turns nothing";
  }

  DeviceReading read() noexcept override { return exchange_.read(); }
  void write(const DeviceOutput&) noexcept override {}

 private:
  // The reading thread.
  void take(std::span<const std::uint8_t> report) {
    DeviceReading reading;
    if (options_.proportional) {
      if (const std::optional<double> share = field_.share(report)) axis_.take(*share);
      armed_ = axis_.armed();
      reading.pedal = axis_.value();
    } else {
      if (const std::optional<std::uint8_t> down = take_pedal_report(report)) down_ = *down;
      if (down_ & options_.switches) reading.buttons = kSpindlePedal;
    }
    exchange_.publish(reading);
  }

  const FootPedalOptions options_;
  HidField field_;
  PedalAxis axis_;           // reading thread, while it runs
  std::uint8_t down_ = 0;    // reading thread
  std::atomic<bool> armed_{true};
  DeviceInfo info_{.model = "foot pedal",
                   .serial = {},
                   .driver = "hidapi",
                   .places = false,
                   .turns = false,
                   .pedals = true,
                   .force_axes = 0};
  DeviceExchange exchange_;
  HidReader reader_;         // last: its thread ends before what it uses
};

}  // namespace

std::optional<std::uint8_t> take_pedal_report(std::span<const std::uint8_t> report) noexcept {
  if (report.size() != kSwitchReport) return std::nullopt;
  return static_cast<std::uint8_t>(report[0] & kSwitches);
}

void PedalAxis::take(double share) noexcept {
  const double way = params_.inverted ? 1.0 - share : share;
  const double value = std::clamp((way - params_.play) / (1.0 - 2.0 * params_.play), 0.0, 1.0);
  if (value == 0.0) armed_ = true;
  value_ = armed_ ? value : 0.0;
}

std::unique_ptr<HapticDevice> make_foot_pedal(const FootPedalOptions& options) { return std::make_unique<FootPedal>(options); }

DeviceFinding look_for_foot_pedals(bool proportional) {
  DeviceFinding finding;
  for (const HidFound& device : list_hid_devices())
    if (proportional ? is_joystick(device) : is_switch(device))
      finding.found.push_back(described(device, proportional ? "joystick" : "foot pedal"));
  return finding;
}

}  // namespace osteon::haptic
