#include "haptic_client/device/foot_pedal.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <iterator>

#include "common/input/hid_port.hpp"
#include "haptic_client/device/device_exchange.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t kSwitchVendor = 0x05f3, kSwitchModel = 0x00ff;
constexpr std::uint16_t kDesktop = 1, kSimulation = 2, kJoystick = 4;
constexpr std::size_t kSwitchReport = 2;
constexpr std::uint8_t kSwitches = 7;
constexpr auto kPause = 5ms;  // the haptic thread needs readings more often than the device reports
struct Axis {
  std::string_view name;
  HidUsage usage;
};
// The usages of common pedals.
constexpr std::array<Axis, 10> kAxes{{{"accelerator", {kSimulation, 0xc4}},
                                      {"brake", {kSimulation, 0xc5}},
                                      {"throttle", {kSimulation, 0xbb}},
                                      {"slider", {kDesktop, 0x36}},
                                      {"z", {kDesktop, 0x32}},
                                      {"rz", {kDesktop, 0x35}},
                                      {"x", {kDesktop, 0x30}},
                                      {"y", {kDesktop, 0x31}},
                                      {"rx", {kDesktop, 0x33}},
                                      {"ry", {kDesktop, 0x34}}}};

bool is_switch(const HidFound& device) { return device.vendor == kSwitchVendor && device.model == kSwitchModel; }
bool is_joystick(const HidFound& device) { return device.usage_page == kDesktop && device.usage == kJoystick; }

std::optional<HidUsage> read_axis(std::string_view word) {
  if (const auto known = std::ranges::find(kAxes, word, &Axis::name); known != kAxes.end()) return known->usage;
  const bool hexadecimal = word.starts_with("0x");
  if (hexadecimal) word.remove_prefix(2);
  std::uint16_t usage = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), usage, hexadecimal ? 16 : 10);
  if (error != std::errc{} || end != word.data() + word.size() || usage == 0) return std::nullopt;
  return HidUsage{kDesktop, usage};
}

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
      return failure(ErrorCode::not_found, options_.proportional
                                               ? "no joystick whose axis could be a pedal is there; plug it in"
                                               : "no foot pedal is there; plug it in");
    Result<HidPort> port = HidPort::open(*found, "the foot pedal");
    if (!port) return tl::unexpected(port.error());
    if (options_.proportional) {
      const std::vector<HidField> fields = hid_input_fields(port->descriptor());
      std::vector<HidUsage> wanted;
      if (options_.axis_usage)
        wanted.push_back(*options_.axis_usage);
      else
        std::ranges::transform(kAxes, std::back_inserter(wanted), &Axis::usage);
      const auto field = find_field(fields, wanted);
      if (!field)
        return failure(ErrorCode::unsupported,
                       found->product + " at " + found->path +
                           " has no such axis; name another (pedal-axis:z) or choose another joystick");
      field_ = *field;
    }
    info_.model = found->product.empty() ? "foot pedal" : found->product;
    info_.serial = found->serial;
    axis_.forget();
    elsewhere_ = false;
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
    if (armed_) return "";
    if (!elsewhere_) return "release the foot pedal once; until then the spindle does not turn";
    return std::string(
               "the foot pedal was down at its first reading, so the spindle does not turn; if nobody pressed it, it "
               "rests "
               "at "
               "the other end of its axis: ") +
           (options_.axis.inverted ? "leave out \"inverted\"" : "name it pedal-axis:inverted") +
           "; else release it and plug it in again";
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
      elsewhere_ = axis_.elsewhere();
      reading.pedal = axis_.value();
    } else {
      if (const std::optional<std::uint8_t> down = take_pedal_report(report)) down_ = *down;
      if (down_ & options_.switches) reading.buttons = kSpindlePedal;
      reading.buttons |= other_hand((down_ & options_.irrigation) != 0, (down_ & options_.suction) != 0);
    }
    exchange_.publish(reading);
  }

  const FootPedalOptions options_;
  HidField field_;
  PedalAxis axis_;         // reading thread, while it runs
  std::uint8_t down_ = 0;  // reading thread
  std::atomic<bool> armed_{true}, elsewhere_{false};
  DeviceInfo info_{.model = "foot pedal",
                   .serial = {},
                   .driver = "hidapi",
                   .places = false,
                   .turns = false,
                   .pedals = true,
                   .force_axes = 0};
  DeviceExchange exchange_;
  HidReader reader_;  // last: its thread ends before the members that it uses
};

}  // namespace

std::optional<std::uint8_t> take_pedal_report(std::span<const std::uint8_t> report) noexcept {
  if (report.size() != kSwitchReport) return std::nullopt;
  return static_cast<std::uint8_t>(report[0] & kSwitches);
}

void PedalAxis::take(double share) noexcept {
  const double way = params_.inverted ? 1.0 - share : share;
  if (rest_ == Rest::unknown) rest_ = way <= params_.near ? Rest::here : Rest::elsewhere;
  const double value = std::clamp((way - params_.play) / (1.0 - 2.0 * params_.play), 0.0, 1.0);
  if (value == 0.0 && rest_ == Rest::here) armed_ = true;
  value_ = armed_ ? value : 0.0;
}

Result<FootPedalOptions> read_pedal_switch(std::string_view argument) {
  constexpr std::array<std::string_view, 3> kSides{"left", "middle", "right"};
  constexpr std::string_view kIrrigates = "irrigation-", kSucks = "suction-";
  FootPedalOptions options;
  if (argument.empty()) return options;
  std::uint8_t spindle = 0, taken = 0;
  std::string_view left = argument;
  while (true) {
    const std::size_t colon = left.find(':');
    std::string_view word = left.substr(0, colon);
    std::uint8_t& use = word.starts_with(kIrrigates) ? options.irrigation
                        : word.starts_with(kSucks)   ? options.suction
                                                     : spindle;
    if (&use == &options.irrigation) word.remove_prefix(kIrrigates.size());
    if (&use == &options.suction) word.remove_prefix(kSucks.size());
    const auto side = std::ranges::find(kSides, word);
    const auto bit = static_cast<std::uint8_t>(1 << (side - kSides.begin()));
    if (side == kSides.end() || use != 0 || (taken & bit))
      return failure(ErrorCode::invalid_input,
                     "--device pedal:" + std::string(argument) +
                         ": the pedal must be left, middle or right; without a colon all three turn the spindle. "
                         "irrigation-right and suction-middle, joined by \":\", are for the other hand, each with a "
                         "pedal of its own");
    use = bit;
    taken = static_cast<std::uint8_t>(taken | bit);
    if (colon == std::string_view::npos) break;
    left = left.substr(colon + 1);
  }
  options.switches = spindle != 0 ? spindle : static_cast<std::uint8_t>(kSwitches & ~taken);
  return options;
}

Result<FootPedalOptions> read_pedal_axis(std::string_view argument) {
  FootPedalOptions options;
  options.proportional = true;
  const auto wrong = [&] {
    std::string names;
    for (const Axis& axis : kAxes) names += std::string(axis.name) + ", ";
    return failure(ErrorCode::invalid_input, "--device pedal-axis:" + std::string(argument) +
                                                 ": what follows must be \"inverted\", an axis (" + names +
                                                 "or a HID usage such as 0x32), or both joined by \":\"");
  };
  std::string_view left = argument;
  while (!left.empty()) {
    const std::size_t colon = left.find(':');
    const std::string_view word = left.substr(0, colon);
    left = colon == std::string_view::npos ? std::string_view() : left.substr(colon + 1);
    if (colon != std::string_view::npos && left.empty()) return wrong();
    if (word == "inverted" && !options.axis.inverted) {
      options.axis.inverted = true;
    } else if (const std::optional<HidUsage> usage = read_axis(word); usage && !options.axis_usage) {
      options.axis_usage = usage;
    } else {
      return wrong();
    }
  }
  return options;
}

std::unique_ptr<HapticDevice> make_foot_pedal(const FootPedalOptions& options) {
  return std::make_unique<FootPedal>(options);
}

DeviceFinding look_for_foot_pedals(bool proportional) {
  DeviceFinding finding;
  for (const HidFound& device : list_hid_devices())
    if (proportional ? is_joystick(device) : is_switch(device))
      finding.found.push_back(described(device, proportional ? "joystick" : "foot pedal"));
  return finding;
}

}  // namespace osteon::haptic
