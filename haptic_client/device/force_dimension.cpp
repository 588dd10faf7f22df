#include "haptic_client/device/force_dimension.hpp"

#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <thread>

#include "common/runtime/periodic.hpp"
#include "haptic_client/device/device_exchange.hpp"
#include "haptic_client/device/dynamic_library.hpp"
#include "haptic_client/device/emergency_stop.hpp"
#include "haptic_client/device/force_dimension_abi.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;

// libdrd includes all of libdhd.
constexpr const char* kNames[] = {"libdhd.so", "libdhd.so.3", "libdrd.so", "libdrd.so.3"};
constexpr const char* kRemedy = "install the vendor's Force Dimension SDK, or name the library with --libdhd";
constexpr int kBadCyclesToLose = 20;  // [A]
constexpr int kPriority = 79;         // below the haptic thread

using Library = VendorLibrary<dhd::Api>;

Result<const Library*> load(const std::filesystem::path& file) {
  const auto bind = [](dhd::Api& c, const auto& need) {
    need("dhdGetDeviceCount", c.device_count);
    need("dhdOpenID", c.open_id);
    need("dhdClose", c.close);
    need("dhdGetSystemType", c.system_type);
    need("dhdGetSystemName", c.system_name);
    need("dhdGetSerialNumber", c.serial_number);
    need("dhdGetSDKVersion", c.sdk_version);
    need("dhdGetStatus", c.status);
    need("dhdEnableForce", c.enable_force);
    need("dhdStop", c.stop);
    need("dhdHasWrist", c.has_wrist);
    need("dhdHasActiveWrist", c.has_active_wrist);
    need("dhdGetPosition", c.position);
    need("dhdGetPositionAndOrientationFrame", c.position_and_frame);
    need("dhdSetForceAndTorque", c.set_force_and_torque);
    need("dhdGetButtonMask", c.button_mask);
    need("dhdErrorGetLast", c.last_error);
    need("dhdErrorGetStr", c.error_text);
  };
  return load_vendor<dhd::Api>({"Force Dimension's libdhd", file, kNames, kRemedy},
                               "a Force Dimension library of version 3", bind);
}

// The library does not report a device's limits. These are the vendor's figures for its kinds, as published programs
// use them. The continuous force of a kind is not published: a third of its peak is assumed. [A]
std::optional<DeviceLimits> limits_of(int type) {
  DeviceLimits limits;
  switch (type) {
    case dhd::kDelta3:
      limits = {.peak_n = 20.0, .stiffness_n_per_mm = 5.0, .workspace_radius_mm = 150.0};
      break;
    case dhd::kDelta6:
      limits = {.peak_n = 20.0, .stiffness_n_per_mm = 5.0, .workspace_radius_mm = 150.0, .peak_nmm = 200.0};
      break;
    case dhd::kOmega:
    case dhd::kOmega3:
    case dhd::kOmega6:
    case dhd::kOmega6Left:
    case dhd::kOmega7:
    case dhd::kOmega7Left:
      limits = {.peak_n = 12.0, .stiffness_n_per_mm = 5.0, .workspace_radius_mm = 75.0};
      break;
    case dhd::kSigma6:
    case dhd::kSigma6Left:
    case dhd::kSigma7:
    case dhd::kSigma7Left:
      limits = {.peak_n = 12.0, .stiffness_n_per_mm = 4.0, .workspace_radius_mm = 90.0, .peak_nmm = 200.0};
      break;
    case dhd::kFalcon:
      limits = {.peak_n = 8.0, .stiffness_n_per_mm = 3.0, .workspace_radius_mm = 40.0};
      break;
    default:
      return std::nullopt;
  }
  limits.damping_n_s_per_mm = 0.03;
  limits.continuous_n = limits.peak_n / 3.0;
  limits.continuous_nmm = limits.peak_nmm / 3.0;
  return limits;
}

std::string text(const char* vendors) { return vendors ? vendors : ""; }

class ForceDimension final : public HapticDevice {
 public:
  explicit ForceDimension(const ForceDimensionOptions& options) : options_(options), exchange_(options.force_held) {}
  ~ForceDimension() override { close(); }

  [[nodiscard]] std::string_view name() const override { return "force-dimension"; }
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }
  [[nodiscard]] DeviceInfo info() const override { return info_; }
  [[nodiscard]] std::string advice() const override { return advice_; }
  [[nodiscard]] DeviceReading read() noexcept override { return exchange_.read(); }
  void write(const DeviceOutput& output) noexcept override { exchange_.write(output); }

  Result<void> open() override {
    close();
    const Result<const Library*> library = load(options_.library);
    if (!library) return tl::unexpected(library.error());
    call_ = &(*library)->call;
    const int there = call_->device_count();
    if (options_.number >= there) {
      call_ = nullptr;
      return failure(ErrorCode::not_found, "there " +
                                               std::string(there == 1 ? "is 1 Force Dimension device"
                                                                      : "are " + std::to_string(std::max(0, there)) +
                                                                            " Force Dimension devices") +
                                               " and number " + std::to_string(options_.number) +
                                               " is wanted; check power, cable and its USB permissions");
    }
    const int id = call_->open_id(static_cast<char>(options_.number));
    if (id < 0) {
      const Error why = last_error();
      call_ = nullptr;
      return failure(ErrorCode::unavailable, "the Force Dimension device cannot be opened: " + why.message);
    }
    id_ = static_cast<char>(id);
    open_ = true;
    info_ = {};
    info_.model = text(call_->system_name(id_));
    unsigned short serial = 0;
    if (call_->serial_number(&serial, id_) >= 0) info_.serial = std::to_string(serial);
    int version[4] = {};
    call_->sdk_version(version, version + 1, version + 2, version + 3);
    info_.driver = std::to_string(version[0]) + '.' + std::to_string(version[1]) + '.' + std::to_string(version[2]);
    info_.turns = call_->has_wrist(id_);
    const int type = call_->system_type(id_);
    const std::optional<DeviceLimits> known = limits_of(type);
    if (!known) {
      close();
      return failure(ErrorCode::unsupported, "the device \"" + info_.model +
                                                 "\" is of a kind that is not known here (type " +
                                                 std::to_string(type) + "); use another device");
    }
    limits_ = *known;
    info_.torque_axes = limits_.peak_nmm > 0.0 && call_->has_active_wrist(id_) ? 3 : 0;
    if (info_.torque_axes == 0) limits_.peak_nmm = limits_.continuous_nmm = 0.0;
    start();
    Result<void> well = tend();
    if (!well) close();
    return well;
  }

  void close() noexcept override {
    if (thread_.joinable()) {
      stopping_ = true;
      thread_.join();
    }
    emergency_.reset();
    if (open_) {
      call_->set_force_and_torque(0, 0, 0, 0, 0, 0, id_);
      call_->enable_force(0, id_);
      call_->close(id_);
    }
    open_ = false;
    call_ = nullptr;
    exchange_.forget_output();
    exchange_.go_absent();
  }

  Result<void> tend() override {
    if (!open_) return failure(ErrorCode::unavailable, "the Force Dimension device is not open");
    if (lost_)
      return failure(ErrorCode::unavailable, "the Force Dimension device is lost: " +
                                                 force_dimension_error(error_, call_->error_text(error_)).message);
    const bool calibrated = calibrated_;
    advice_ = calibrated ? ""
                         : "move the device's handle gently to all ends of its range until its light stops blinking, "
                           "or run the vendor's HapticInit";
    // Motors are enabled once the device knows its position.
    if (calibrated && !force_on_) {
      if (call_->enable_force(1, id_) < 0)
        return failure(ErrorCode::unavailable,
                       "the Force Dimension device does not switch its motors on: " + last_error().message);
      force_on_ = true;
      emergency_->started();
    }
    return {};
  }

 private:
  [[nodiscard]] Error last_error() const {
    const int code = call_->last_error();
    return force_dimension_error(code, call_->error_text(code));
  }

  void start() {
    stopping_ = false;
    lost_ = false;
    force_on_ = false;
    calibrated_ = look_calibrated();
    advice_.clear();
    exchange_.forget_output();
    stop_ = {call_, id_};
    emergency_.emplace(
        [](void* what) {
          const auto* stop = static_cast<const Stop*>(what);
          stop->call->stop(stop->id);
        },
        &stop_);
    thread_ = std::thread([this] { cycle_thread(); });
  }

  [[nodiscard]] bool look_calibrated() const noexcept {
    std::array<int, 2 * dhd::kMostStatus> status{};  // newer libraries may write more
    return call_->status(status.data(), id_) >= 0 && status[dhd::kReset] == 1;
  }

  void cycle_thread() {
    TickStats stats;
    const bool paced = options_.period.count() > 0;
    if (paced) try_realtime(kPriority);  // a thread that never sleeps would occupy the core
    PeriodicTimer timer(paced ? std::chrono::nanoseconds(options_.period) : 1ms);
    int bad = 0;
    for (std::uint64_t cycle = 0; !stopping_; ++cycle) {
      if (paced) timer.wait(stats);
      // Slowly changing values are read ten times a second.
      if (cycle % 100 == 99) calibrated_ = look_calibrated();
      if (exchange_once()) {
        bad = 0;
      } else if (++bad >= kBadCyclesToLose) {
        error_ = call_->last_error();
        lost_ = true;
        std::this_thread::sleep_for(1ms);
      }
    }
  }

  // Exchanges one reading and one force; returns false when the device did not take part.
  bool exchange_once() noexcept {
    DeviceReading reading = last_;
    double x = 0, y = 0, z = 0;
    double frame[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const int got = info_.turns ? call_->position_and_frame(&x, &y, &z, frame, id_) : call_->position(&x, &y, &z, id_);
    Eigen::Matrix3d axes;
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) axes(row, column) = frame[row][column];
    const Vec3 place(x, y, z);
    bool good = got >= 0 && place.allFinite() && axes.allFinite() && std::abs(axes.determinant() - 1.0) < 0.05;
    if (good) {
      // The handle's −x is assumed to point to its tip. Its frame is assumed to be the device's when it points away.
      // (Unverified on a device.)
      Eigen::Matrix3d ours;
      for (int column = 0; column < 3; ++column)
        ours.col(column) = from_force_dimension(axes * to_force_dimension(Vec3::Unit(column)));
      reading.pose_device_tool = {1e3 * from_force_dimension(place),
                                  (Eigen::Quaterniond(ours) * pointing_away()).normalized()};
      const unsigned buttons = call_->button_mask(id_);
      reading.buttons = (buttons & 1 ? kSpindlePedal : 0u) | (buttons & 2 ? kClutchButton : 0u);
    }
    // Ready once its motors are enabled, so that no force waits for them.
    const bool calibrated = calibrated_ && force_on_;
    DeviceOutput output;
    if (good && calibrated) output = exchange_.demanded(std::chrono::steady_clock::now());
    if (!output.force_n.allFinite() || !output.torque_nmm.allFinite()) output = {};
    const Vec3 force = to_force_dimension(clamped(output.force_n, limits_.peak_n));
    const Vec3 torque = 1e-3 * to_force_dimension(clamped(output.torque_nmm, limits_.peak_nmm));
    // A positive answer says that a motor is at its limit, or that the library waited: both are normal.
    good &= call_->set_force_and_torque(force.x(), force.y(), force.z(), torque.x(), torque.y(), torque.z(), id_) >= 0;
    reading.status = good ? DeviceStatus::ok : DeviceStatus::fault;
    if (!good) reading.buttons = 0;
    reading.calibration = calibrated ? Calibration::done : Calibration::pending;
    last_ = reading;
    exchange_.publish(reading);
    return good;
  }

  struct Stop {
    const dhd::Api* call;
    char id;
  };

  ForceDimensionOptions options_;
  // Connection thread; the device's own thread only reads them.
  const dhd::Api* call_ = nullptr;
  char id_ = -1;
  bool open_ = false;
  DeviceLimits limits_;
  DeviceInfo info_;
  std::string advice_;
  Stop stop_{};
  std::optional<EmergencyStop> emergency_;
  std::thread thread_;
  // Both threads.
  std::atomic<bool> stopping_{false}, lost_{false}, calibrated_{false}, force_on_{false};
  std::atomic<int> error_{0};
  DeviceExchange exchange_;
  // The device's own thread.
  DeviceReading last_;
};

}  // namespace

Error force_dimension_error(int code, const char* vendors_text) {
  const auto say = [&](ErrorCode kind, const std::string& what) {
    const std::string own = vendors_text && *vendors_text ? std::string(": ") + vendors_text : "";
    return Error{kind, what + " (libdhd error " + std::to_string(code) + own + ")"};
  };
  switch (code) {
    case dhd::kCommunication:
    case dhd::kTimeout:
      return say(ErrorCode::unavailable, "the device does not answer any more; check its cable and power");
    case dhd::kBusy:
    case dhd::kInUse:
      return say(ErrorCode::unavailable, "another program uses the device; end that program");
    case dhd::kNoDriver:
      return say(ErrorCode::unavailable,
                 "the driver is not installed or this user may not use USB devices; install the vendor's udev rule");
    case dhd::kNoDevice:
      return say(ErrorCode::unavailable, "no device is connected; check its cable and power");
    case dhd::kNotReady:
      return say(ErrorCode::unavailable,
                 "the device is not ready; switch its power on and wait until its light is steady");
    default:
      return say(ErrorCode::internal, "the driver reports an error that it should not; report it with this number");
  }
}

std::unique_ptr<HapticDevice> make_force_dimension(const ForceDimensionOptions& options) {
  return std::make_unique<ForceDimension>(options);
}

DeviceFinding look_for_force_dimension(const ForceDimensionOptions& options) {
  DeviceFinding finding;
  const Result<const Library*> library = load(options.library);
  if (!library) {
    finding.missing = library.error().message;
    finding.wrong_file = !options.library.empty();
    return finding;
  }
  const dhd::Api& call = (*library)->call;
  const int there = call.device_count();
  for (int i = 0; i < there; ++i) {
    const int id = call.open_id(static_cast<char>(i));
    if (id < 0) {
      const int code = call.last_error();
      finding.missing =
          "number " + std::to_string(i) + ": " + force_dimension_error(code, call.error_text(code)).message;
      continue;
    }
    unsigned short serial = 0;
    std::string line = text(call.system_name(static_cast<char>(id)));
    if (call.serial_number(&serial, static_cast<char>(id)) >= 0) line += ", serial " + std::to_string(serial);
    finding.found.push_back(line);
    call.close(static_cast<char>(id));
  }
  if (there <= 0) finding.missing = "no device is connected; check its cable and power, and the vendor's udev rule";
  return finding;
}

}  // namespace osteon::haptic
