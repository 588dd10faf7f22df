#include "haptic_client/device/openhaptics.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <thread>

#include "haptic_client/device/device_exchange.hpp"
#include "haptic_client/device/dynamic_library.hpp"
#include "haptic_client/device/emergency_stop.hpp"
#include "haptic_client/device/openhaptics_abi.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;

constexpr const char* kNames[] = {"libHD.so", "libHD.so.3.4", "libHD.so.3.3", "libHD.so.3.2", "libHD.so.3.0"};
constexpr const char* kRemedy =
    "install the vendor's OpenHaptics for Linux and the driver of your device, or name the library with --libhd";
constexpr int kWarmSamples = 2000;        // [A] after a warning the motors count as warm for two seconds
constexpr double kHottest = 0.9;          // [A] of the motors' temperature; 1 is too hot
constexpr int kTemperatureSamples = 100;  // between two readings of it
constexpr int kBadFramesToLose = 50;      // [A] without a good one between them
constexpr int kMostErrors = 16;           // taken off the library's stack at a time

using Library = VendorLibrary<hd::Api>;

Result<const Library*> load(const std::filesystem::path& file) {
  const auto bind = [](hd::Api& c, const auto& need) {
    need("hdInitDevice", c.init_device);
    need("hdMakeCurrentDevice", c.make_current_device);
    need("hdDisableDevice", c.disable_device);
    need("hdBeginFrame", c.begin_frame);
    need("hdEndFrame", c.end_frame);
    need("hdGetError", c.get_error);
    need("hdGetErrorString", c.get_error_string);
    need("hdEnable", c.enable);
    need("hdDisable", c.disable);
    need("hdGetIntegerv", c.get_integers);
    need("hdGetDoublev", c.get_doubles);
    need("hdSetDoublev", c.set_doubles);
    need("hdGetString", c.get_string);
    need("hdCheckCalibration", c.check_calibration);
    need("hdUpdateCalibration", c.update_calibration);
    need("hdStartScheduler", c.start_scheduler);
    need("hdStopScheduler", c.stop_scheduler);
    need("hdScheduleAsynchronous", c.schedule_asynchronous);
    need("hdUnschedule", c.unschedule);
  };
  return load_vendor<hd::Api>({"OpenHaptics (libHD.so)", file, kNames, kRemedy}, "OpenHaptics' libHD", bind);
}

// Takes the library's errors, newest first. Returns the first that is not kNoError; that one is reported.
unsigned take_error(const hd::Api& call) {
  unsigned first = hd::kNoError;
  for (int i = 0; i < kMostErrors; ++i) {
    const unsigned code = call.get_error().code;
    if (code == hd::kNoError) break;
    if (first == hd::kNoError) first = code;
  }
  return first;
}

std::string text_of(const hd::Api& call, hd::Enum what) {
  const char* text = call.get_string(what);
  return text ? text : "";
}

std::atomic<bool> in_use{false};

class OpenHaptics final : public HapticDevice {
 public:
  explicit OpenHaptics(const OpenHapticsOptions& options) : options_(options) {}
  ~OpenHaptics() override { close(); }

  [[nodiscard]] std::string_view name() const override { return "phantom"; }
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }
  [[nodiscard]] DeviceInfo info() const override { return info_; }

  Result<void> open() override {
    close();
    const Result<const Library*> library = load(options_.library);
    if (!library) return tl::unexpected(library.error());
    if (in_use.exchange(true))
      return failure(ErrorCode::exists, "a PHANToM is already open in this program; name one only");
    owns_ = true;
    call_ = &(*library)->call;
    take_error(*call_);  // left by an earlier user of the library
    device_ = call_->init_device(options_.device.empty() ? nullptr : options_.device.c_str());
    if (const unsigned code = take_error(*call_); code != hd::kNoError || device_ == hd::kNoDevice) {
      const Error why = sentence(code == hd::kNoError ? hd::kDeviceFault : code);
      close();
      return failure(ErrorCode::unavailable,
                     "the PHANToM " +
                         (options_.device.empty() ? std::string("set up as default") : '"' + options_.device + '"') +
                         " cannot be opened: " + why.message);
    }
    call_->make_current_device(device_);
    if (Result<void> read = read_itself(); !read) {
      close();
      return read;
    }
    return start();
  }

  void close() noexcept override {
    if (!call_) {
      release();
      return;
    }
    if (running_) {
      // The force ends in the next frame. Where no frame comes any more, there is no force to end.
      closing_ = true;
      const std::uint64_t frames = frames_;
      for (int i = 0; i < 50 && frames_ < frames + 2; ++i) std::this_thread::sleep_for(1ms);
      call_->stop_scheduler();
      if (scheduled_) call_->unschedule(scheduled_);
      scheduled_ = 0;
      running_ = false;
    }
    emergency_.reset();
    if (device_ != hd::kNoDevice) call_->disable_device(device_);
    take_error(*call_);
    device_ = hd::kNoDevice;
    call_ = nullptr;
    exchange_.forget_output();
    exchange_.go_absent();
    release();
  }

  Result<void> tend() override {
    if (!running_) return failure(ErrorCode::unavailable, "the PHANToM is not open");
    const std::uint64_t frames = frames_;
    if (const unsigned code = lost_; code != hd::kNoError) return tl::unexpected(sentence(code));
    silent_ = frames == frames_seen_ ? silent_ + 1 : 0;
    frames_seen_ = frames;
    if (silent_ >= 3)
      return failure(ErrorCode::unavailable, "the PHANToM's servo loop has stopped; check its cable and power");
    calibrate();
    return {};
  }

  [[nodiscard]] std::string advice() const override { return advice_; }
  [[nodiscard]] DeviceReading read() noexcept override { return exchange_.read(); }
  void write(const DeviceOutput& output) noexcept override { exchange_.write(output); }

 private:
  [[nodiscard]] Error sentence(unsigned code) const { return openhaptics_error(code, call_->get_error_string(code)); }

  void release() noexcept {
    if (owns_) in_use = false;
    owns_ = false;
  }

  // Limits and names; outside the scheduler.
  Result<void> read_itself() {
    info_.model = text_of(*call_, hd::kModel);
    info_.serial = text_of(*call_, hd::kSerial);
    info_.driver = text_of(*call_, hd::kDriverVersion);
    // The few devices with six motors are driven as if they had three: their torque is not published.
    info_.torque_axes = 0;
    // Arrays longer than any that the library fills, in case a device has more motors than we know of.
    std::array<double, 16> value{};
    const auto number = [&](hd::Enum what) {
      value.fill(0.0);
      call_->get_doubles(what, value.data());
      return value[0];
    };
    limits_ = {};
    limits_.peak_n = number(hd::kMaxForce);
    limits_.continuous_n = number(hd::kMaxContinuousForce);
    limits_.stiffness_n_per_mm = number(hd::kMaxStiffness);
    limits_.damping_n_s_per_mm = number(hd::kMaxDamping);
    number(hd::kUsableWorkspace);
    double radius_mm = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = value[static_cast<std::size_t>(axis)], high = value[static_cast<std::size_t>(axis) + 3];
      limits_.workspace_middle_mm[axis] = 0.5 * (low + high);
      radius_mm = std::min(radius_mm, 0.5 * (high - low));
    }
    limits_.workspace_radius_mm = radius_mm;
    std::array<int, 16> integers{};
    call_->get_integers(hd::kCalibrationStyle, integers.data());
    styles_ = static_cast<hd::Enum>(integers[0]);
    if (const unsigned code = take_error(*call_); code != hd::kNoError) return tl::unexpected(sentence(code));
    const auto sensible = [](double v, double most) { return std::isfinite(v) && v > 0.0 && v <= most; };
    if (!sensible(limits_.peak_n, 100.0) || !sensible(limits_.stiffness_n_per_mm, 100.0) ||
        !sensible(limits_.workspace_radius_mm, 2000.0))
      return failure(
          ErrorCode::unsupported,
          "the PHANToM \"" + info_.model + "\" does not report its force, stiffness and workspace; update its driver");
    // For a device that does not report its continuous force, a quarter of its peak is assumed. [A]
    if (!sensible(limits_.continuous_n, limits_.peak_n)) limits_.continuous_n = 0.25 * limits_.peak_n;
    return {};
  }

  Result<void> start() {
    lost_ = hd::kNoError;
    closing_ = false;
    frames_ = frames_seen_ = 0;
    silent_ = bad_frames_ = warm_left_ = 0;
    calibrated_ = false;
    advice_.clear();
    exchange_.forget_output();
    call_->enable(hd::kForceOutput);
    call_->enable(hd::kForceClamping);
    call_->enable(hd::kForceRamping);
    // Before anything can go wrong: motors must not outlive us. A scheduler that was never stopped leaves some devices
    // in error 0x0303.
    emergency_.emplace([](void* call) { static_cast<const hd::Api*>(call)->stop_scheduler(); },
                       const_cast<hd::Api*>(call_));
    scheduled_ = call_->schedule_asynchronous([](void* self) { return static_cast<OpenHaptics*>(self)->servo(); }, this,
                                              hd::kHighestPriority);
    running_ = true;
    call_->start_scheduler();
    emergency_->started();
    if (const unsigned code = take_error(*call_); code != hd::kNoError && code != hd::kWarmMotors) {
      const Error why = sentence(code);
      close();
      return tl::unexpected(why);
    }
    calibrate();
    return {};
  }

  // [connection] Checks the calibration. Calibrates what the device can do by itself; for the rest there is advice().
  void calibrate() {
    call_->make_current_device(device_);
    hd::Enum state = call_->check_calibration();
    if (state == hd::kNeedsUpdate ||
        (state == hd::kNeedsManual && (styles_ & hd::kEncoderReset) && reset_pressed_.exchange(false))) {
      call_->update_calibration(styles_ & hd::kAutomatic ? hd::kAutomatic
                                : styles_ & hd::kInkwell ? hd::kInkwell
                                                         : hd::kEncoderReset);
      state = call_->check_calibration();
    }
    reset_pressed_ = false;
    if (state == hd::kCalibrated)
      advice_.clear();
    else if (state == hd::kNeedsManual && (styles_ & hd::kInkwell))
      advice_ = "put the stylus into its inkwell for a second, then take it out";
    else if (state == hd::kNeedsManual)
      advice_ = "hold the PHANToM's arms at right angles, as in its manual, and press the front button";
    else
      advice_ = "move the PHANToM's handle slowly until it has found its position";
    calibrated_ = state == hd::kCalibrated;
  }

  // On the vendor's thread, a thousand times a second. No allocation, lock or log of ours.
  hd::CallbackCode servo() noexcept {
    const bool closing = closing_;
    std::array<int, 16> buttons{};
    std::array<double, 16> matrix{};
    call_->begin_frame(device_);
    call_->get_integers(hd::kButtons, buttons.data());
    call_->get_doubles(hd::kTransform, matrix.data());
    if (++samples_ % kTemperatureSamples == 0) {
      std::array<double, 16> heat{};
      call_->get_doubles(hd::kMotorTemperature, heat.data());
      for (const double h : heat)
        if (h > kHottest) warm_left_ = kWarmSamples;
    }
    DeviceOutput output;
    if (!closing && calibrated_ && bad_frames_ == 0) output = exchange_.demanded(std::chrono::steady_clock::now());
    const double most_n = warm_left_ > 0 ? limits_.continuous_n : limits_.peak_n;
    const Vec3 force_n = output.force_n.allFinite() ? clamped(output.force_n, most_n) : Vec3(Vec3::Zero());
    call_->set_doubles(hd::kForce, force_n.data());
    call_->end_frame(device_);
    note_errors();
    publish(static_cast<unsigned>(buttons[0]), matrix);
    frames_.store(frames_ + 1);
    return closing ? hd::kDone : hd::kContinue;
  }

  void note_errors() noexcept {
    bool bad = false;
    for (int i = 0; i < kMostErrors; ++i) {
      const unsigned code = call_->get_error().code;
      if (code == hd::kNoError) break;
      if (code >= hd::kWarmMotors && code <= hd::kForceErrorsEnd) {
        // The motors are warm, or the force is more than the library wants. The continuous force is safe in both cases.
        warm_left_ = kWarmSamples;
        continue;
      }
      bad = true;
      last_bad_ = code;
    }
    if (warm_left_ > 0) --warm_left_;
    bad_frames_ = bad ? bad_frames_ + 1 : 0;
    if (bad_frames_ >= kBadFramesToLose) lost_ = last_bad_;
  }

  void publish(unsigned buttons, const std::array<double, 16>& matrix) noexcept {
    DeviceReading reading = last_;
    // Column-major: three columns of the handle's axes, then its position.
    Eigen::Matrix3d axes;
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) axes(row, column) = matrix[static_cast<std::size_t>(4 * column + row)];
    const Vec3 place(matrix[12], matrix[13], matrix[14]);
    const bool sound = axes.allFinite() && place.allFinite() && std::abs(axes.determinant() - 1.0) < 0.05;
    if (bad_frames_ == 0 && sound) {
      // The stylus points along −z of its own frame; a tool points along +z. (Unverified on a device.)
      reading.pose_device_tool = {place, (Eigen::Quaterniond(axes) * pointing_away()).normalized()};
      reading.status = warm_left_ > 0 ? DeviceStatus::warm : DeviceStatus::ok;
      // Front button: the spindle; the other one: the clutch.
      reading.buttons = (buttons & 1 ? kSpindlePedal : 0u) | (buttons & 2 ? kClutchButton : 0u);
      if (buttons & 1) reset_pressed_ = true;
    } else {
      reading.status = DeviceStatus::fault;
      reading.buttons = 0;
    }
    reading.calibration = calibrated_ ? Calibration::done : Calibration::pending;
    last_ = reading;
    exchange_.publish(reading);
  }

  OpenHapticsOptions options_;
  // Connection thread.
  const hd::Api* call_ = nullptr;
  hd::Handle device_ = hd::kNoDevice;
  hd::SchedulerHandle scheduled_ = 0;
  hd::Enum styles_ = 0;
  bool owns_ = false, running_ = false;
  DeviceLimits limits_;
  DeviceInfo info_;
  std::string advice_;
  std::uint64_t frames_seen_ = 0;
  int silent_ = 0;
  std::optional<EmergencyStop> emergency_;
  // Both threads.
  std::atomic<bool> closing_{false}, calibrated_{false}, reset_pressed_{false};
  std::atomic<unsigned> lost_{hd::kNoError};
  std::atomic<std::uint64_t> frames_{0};
  DeviceExchange exchange_;
  // Servo thread.
  DeviceReading last_;
  std::uint64_t samples_ = 0;
  int warm_left_ = 0, bad_frames_ = 0;
  unsigned last_bad_ = hd::kNoError;
};

}  // namespace

Error openhaptics_error(unsigned code, const char* vendors_text) {
  const auto say = [&](ErrorCode kind, const std::string& what) {
    char number[16];
    std::snprintf(number, sizeof number, "0x%04x", code);
    std::string own = vendors_text && *vendors_text ? std::string(": ") + vendors_text : "";
    return Error{kind, what + " (OpenHaptics error " + number + own + ")"};
  };
  switch (code) {
    case hd::kWarmMotors:
      return say(ErrorCode::unavailable, "the motors are warm; rest the device for some minutes");
    case hd::kForceExceeded:
    case 0x0202:
    case 0x0203:
    case hd::kForceErrorsEnd:
      return say(ErrorCode::unavailable,
                 "the device was asked for more force than it allows; it works on with its continuous force");
    case hd::kDeviceFault:
      return say(ErrorCode::unavailable,
                 "no device answers; check its power and cable, and name it as in the vendor's setup program");
    case hd::kDeviceInUse:
      return say(ErrorCode::unavailable, "another program uses the device; end that program");
    case hd::kCommunication:
      return say(ErrorCode::unavailable, "the device does not answer any more; check its cable and power");
    case hd::kCommunicationSetup:
      return say(ErrorCode::unavailable,
                 "the device's connection is not set up, as after a program that was killed; unplug it, plug it in and "
                 "run the vendor's setup program");
    case hd::kTimer:
      return say(ErrorCode::unavailable, "the driver's timer failed; end what loads this computer, or restart it");
    case hd::kBadHandle:
      return say(ErrorCode::unavailable, "the driver does not know the device any more; open it again");
    case hd::kSchedulerFull:
      return say(ErrorCode::unavailable, "the driver's scheduler is full; end other programs that use the device");
    case hd::kLicence:
      return say(ErrorCode::unavailable, "OpenHaptics finds no licence; install the vendor's licence file");
    default:
      return say(ErrorCode::internal, "the driver reports an error that it should not; report it with this number");
  }
}

std::unique_ptr<HapticDevice> make_openhaptics(const OpenHapticsOptions& options) {
  return std::make_unique<OpenHaptics>(options);
}

DeviceFinding look_for_openhaptics(const OpenHapticsOptions& options) {
  DeviceFinding finding;
  const Result<const Library*> library = load(options.library);
  if (!library) {
    finding.missing = library.error().message;
    finding.wrong_file = !options.library.empty();
    return finding;
  }
  if (in_use.exchange(true)) {
    finding.missing = "this program uses it already";
    return finding;
  }
  const hd::Api& call = (*library)->call;
  take_error(call);
  const hd::Handle device = call.init_device(options.device.empty() ? nullptr : options.device.c_str());
  const unsigned code = take_error(call);
  if (device == hd::kNoDevice || code != hd::kNoError) {
    const unsigned why = code == hd::kNoError ? hd::kDeviceFault : code;
    finding.missing = openhaptics_error(why, call.get_error_string(why)).message;
  } else {
    call.make_current_device(device);
    finding.found.push_back(text_of(call, hd::kModel) + ", serial " + text_of(call, hd::kSerial) + ", driver " +
                            text_of(call, hd::kDriverVersion));
  }
  if (device != hd::kNoDevice) call.disable_device(device);
  take_error(call);
  in_use = false;
  return finding;
}

}  // namespace osteon::haptic
