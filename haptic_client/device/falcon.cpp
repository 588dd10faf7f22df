#include "haptic_client/device/falcon.hpp"

#include <atomic>
#include <chrono>
#include <fstream>
#include <optional>
#include <thread>

#include "common/core/mutex.hpp"
#include "common/runtime/periodic.hpp"
#include "haptic_client/device/device_exchange.hpp"
#include "haptic_client/device/emergency_stop.hpp"
#include "haptic_client/device/falcon_usb.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// continuous_n [A]: see make_falcon().
const DeviceLimits kLimits{.peak_n = 8.0, .continuous_n = 4.5, .stiffness_n_per_mm = 3.0, .workspace_radius_mm = 40.0};
constexpr auto kRunsPatience = 200ms;     // for firmware that is already running
constexpr auto kStartsPatience = 2000ms;  // for firmware just loaded
constexpr auto kFramePatience = 20ms, kSilencePatience = 300ms;
constexpr std::uintmax_t kLargestImage = 256 * 1024;  // [A] several times the memory of its processor
constexpr double kMmPerM = 1000.0;

class Falcon final : public HapticDevice {
 public:
  explicit Falcon(FalconOptions options) : options_(std::move(options)) {}
  ~Falcon() override { close(); }

  [[nodiscard]] std::string_view name() const override { return "falcon"; }
  [[nodiscard]] DeviceLimits limits() const override { return kLimits; }
  [[nodiscard]] DeviceInfo info() const override {
    return {.model = "Novint Falcon", .serial = serial_, .driver = "libusb", .turns = false};
  }

  Result<void> open() override {
    close();
    std::vector<std::uint8_t> image;
    if (!options_.firmware.empty()) {
      Result<std::vector<std::uint8_t>> read = read_falcon_firmware(options_.firmware);
      if (!read) return tl::unexpected(read.error());
      image = std::move(*read);
    }
    Result<FalconUsb> usb = FalconUsb::open();
    if (!usb) return tl::unexpected(usb.error());
    Result<bool> runs = usb->runs(kRunsPatience);
    if (runs && !*runs) {
      if (image.empty())
        return failure(ErrorCode::not_found,
                       "the Falcon waits for its firmware; name the file of its driver with --falcon-firmware, as the "
                       "licence allows no copy here");
      if (Result<void> loaded = usb->load(image); !loaded) return loaded;
      runs = usb->runs(kStartsPatience);
      if (runs && !*runs)
        return failure(ErrorCode::unsupported,
                       "the Falcon took " + options_.firmware.string() +
                           " but nothing in it answers; name the image that belongs to the device");
    }
    if (!runs) return tl::unexpected(runs.error());
    serial_ = usb->serial();
    usb_.emplace(std::move(*usb));
    emergency_.emplace([](void* wire) { static_cast<FalconUsb*>(wire)->stop_motors(); }, &*usb_);
    emergency_->started();  // the thread below starts the motors, unless they were stopped
    exchange_.forget_output();
    stopping_ = false;
    homed_ = false;
    lost_ = false;
    io_ = std::thread([this] { run(); });
    return {};
  }

  void close() noexcept override {
    stopping_ = true;
    if (io_.joinable()) io_.join();
    emergency_.reset();
    usb_.reset();
    homed_ = false;
    exchange_.go_absent();
  }

  Result<void> tend() override {
    if (!lost_) return {};
    const MutexLock lock(mutex_);
    return tl::unexpected(why_lost_);
  }

  [[nodiscard]] std::string advice() const override {
    if (!io_.joinable() || lost_ || homed_) return {};
    return "move the Falcon's grip slowly all the way in and out until its light turns from red to blue";
  }

  DeviceReading read() noexcept override { return exchange_.read(); }
  void write(const DeviceOutput& output) noexcept override { exchange_.write(output); }

 private:
  // The I/O thread.
  void run() {
    if (options_.priority > 0) (void)try_realtime(options_.priority);
    FalconCommand command{.homing = true, .lights = kFalconRed};
    auto received_at = Clock::now();
    while (!stopping_) {
      const Result<std::optional<FalconState>> state = usb_->exchange(command, kFramePatience);
      const auto now = Clock::now();
      if (!state) return lose(state.error());
      if (!*state) {
        // Stops any force that the device still shows.
        command.motors = {};
        exchange_.go(DeviceStatus::fault);
        if (now - received_at > kSilencePatience)
          return lose(
              {ErrorCode::unavailable,
               "the Falcon has stopped answering; unplug it, switch its power off and on, and plug it in again"});
        continue;
      }
      received_at = now;
      command = follow(**state, now);
    }
    (void)usb_->exchange({}, kFramePatience);  // without force, lights out
  }

  // Publishes the device's state to the haptic thread and returns the next command for the device.
  FalconCommand follow(const FalconState& state, Clock::time_point now) {
    const DeviceOutput wanted = exchange_.demanded(now);
    const bool homed = (state.homed & kFalconAllHomed) == kFalconAllHomed;
    homed_ = homed;
    DeviceReading reading;
    reading.pose_device_tool = {kMmPerM * (place_m_ - kMiddle_m), pointing_away()};
    reading.calibration = homed ? Calibration::done : Calibration::pending;
    if (state.buttons & kFalconCentre) reading.buttons |= kSpindlePedal;
    if (state.buttons & (kFalconPlus | kFalconMinus | kFalconForward)) reading.buttons |= kClutchButton;

    FalconCommand command{.homing = !homed, .lights = homed ? kFalconBlue : kFalconRed};
    Eigen::Vector3d angles;
    for (int i = 0; i < 3; ++i) angles[i] = falcon_angle_rad(state.encoders[static_cast<std::size_t>(i)]);
    std::optional<Eigen::Vector3d> place = falcon_place(angles, place_m_);
    if (!place) place = falcon_place(angles, kMiddle_m);
    if (place) {
      place_m_ = *place;
      reading.pose_device_tool.position_mm = kMmPerM * (place_m_ - kMiddle_m);
      if (homed && wanted.force_n.squaredNorm() > 0.0 && wanted.force_n.allFinite()) {
        command.motors = falcon_motors(falcon_torques(angles, place_m_, clamped(wanted.force_n, kLimits.peak_n)));
        command.lights = kFalconGreen;
      }
    } else if (homed) {
      reading.status = DeviceStatus::fault;  // angles that the arms cannot have
    }
    exchange_.publish(reading);
    return command;
  }

  void lose(Error why) {
    {
      const MutexLock lock(mutex_);
      why_lost_ = std::move(why);
    }
    exchange_.go(DeviceStatus::fault);
    lost_ = true;
  }

  static inline const Eigen::Vector3d kMiddle_m{0.0, 0.0, kFalconOriginZ_m};

  const FalconOptions options_;
  std::string serial_;            // connection thread
  std::optional<FalconUsb> usb_;  // connection thread until the I/O thread runs
  std::optional<EmergencyStop> emergency_;
  std::thread io_;
  Eigen::Vector3d place_m_ = kMiddle_m;  // I/O thread
  DeviceExchange exchange_;
  std::atomic<bool> stopping_{false}, homed_{false}, lost_{false};
  Mutex mutex_{LockRank::leaf};  // never taken by the haptic thread
  Error why_lost_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace

std::unique_ptr<HapticDevice> make_falcon(FalconOptions options) {
  return std::make_unique<Falcon>(std::move(options));
}

DeviceFinding look_for_falcon(const FalconOptions& options) {
  DeviceFinding finding = FalconUsb::look();
  if (options.firmware.empty()) return finding;
  if (const auto image = read_falcon_firmware(options.firmware); !image) {
    finding.missing += (finding.missing.empty() ? "" : "; ") + image.error().message;
    finding.wrong_file = true;
  }
  return finding;
}

Result<std::vector<std::uint8_t>> read_falcon_firmware(const std::filesystem::path& file) {
  const std::string named = "the Falcon's firmware " + file.string();
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status))
    return failure(ErrorCode::not_found, named + " is not there; correct the path of --falcon-firmware");
  if (!std::filesystem::is_regular_file(status))
    return failure(ErrorCode::invalid_input, named + " is not a file; name the image itself with --falcon-firmware");
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size == 0 || size > kLargestImage)
    return failure(
        ErrorCode::invalid_input,
        named + " has " + (error ? std::string("an unknown number of") : std::to_string(size)) +
            " bytes, which no image of it has; name the image that belongs to the device with --falcon-firmware");
  std::vector<std::uint8_t> image(static_cast<std::size_t>(size));
  std::ifstream in(file, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(image.data()), static_cast<std::streamsize>(image.size())))
    return failure(ErrorCode::invalid_input, named + " cannot be read; look at its permissions");
  return image;
}

}  // namespace osteon::haptic
