#include "haptic_client/device/recorded_device.hpp"

#include <cmath>
#include <optional>

#include "common/input/pointer_link.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/recording/recording_reader.hpp"

namespace osteon::haptic {
namespace {

constexpr double kMostRpm = 1e6;

DeviceLimits limits_of(RecordingReader& reader) {
  const char* g = recording::kMetadata;
  DeviceLimits limits;
  limits.peak_n = reader.number(g, recording::kPeak);
  limits.continuous_n = reader.number(g, recording::kContinuous);
  limits.stiffness_n_per_mm = reader.number(g, recording::kStiffness);
  limits.workspace_radius_mm = reader.number(g, recording::kWorkspace);
  limits.damping_n_s_per_mm = reader.number(g, recording::kDamping);
  limits.peak_nmm = reader.number(g, recording::kPeakTorque);
  limits.continuous_nmm = reader.number(g, recording::kContinuousTorque);
  limits.workspace_middle_mm = {reader.number(g, recording::kMiddleX), reader.number(g, recording::kMiddleY),
                                reader.number(g, recording::kMiddleZ)};
  return limits;
}

// x, y, z, qx, qy, qz, qw.
Pose pose_of(const double* p) { return {{p[0], p[1], p[2]}, {p[6], p[3], p[4], p[5]}}; }
bool good(const Pose& pose) {
  return pose.position_mm.allFinite() && std::abs(pose.rotation.squaredNorm() - 1.0) < 1e-6;
}

// Reads the readings tick by tick, and the bone's poses. A gap in the ticks' numbers is filled with the preceding
// reading.
void read_rows(RecordingReader& reader, RecordedSession& session) {
  std::vector<DeviceReading>& readings = session.readings;
  const std::size_t rows = reader.rows();
  const auto poses = reader.values<double>(recording::kHandlePose, rows, 7);
  const auto buttons = reader.values<std::uint32_t>(recording::kButtons, rows, 1);
  const auto pedal = reader.values<double>(recording::kPedal, rows, 1);
  const auto status = reader.values<std::uint8_t>(recording::kDeviceStatus, rows, 1);
  const auto calibration = reader.values<std::uint8_t>(recording::kCalibration, rows, 1);
  const auto ticks = reader.values<std::uint64_t>(recording::kTick, rows, 1);
  std::vector<double> bone;
  if (reader.has_dataset(recording::kBonePose)) bone = reader.values<double>(recording::kBonePose, rows, 7);
  if (!reader.ok()) return;
  bool moves = false;
  std::vector<Pose>& places = session.pose_rest_bone;
  if (rows == 0)
    reader.wrong(ErrorCode::invalid_input, reader.name() + " holds no complete row; its session ended too soon");
  constexpr std::uint64_t kMostLost = 60'000;
  for (std::size_t i = 0; i < rows && reader.ok(); ++i) {
    DeviceReading reading;
    reading.pose_device_tool = pose_of(&poses[7 * i]);
    const Pose place = bone.empty() ? Pose() : pose_of(&bone[7 * i]);
    moves |= place.position_mm != Vec3::Zero() || place.rotation.vec() != Vec3::Zero();
    reading.buttons = buttons[i];
    reading.pedal = pedal[i];
    reading.status = static_cast<DeviceStatus>(status[i]);
    reading.calibration = static_cast<Calibration>(calibration[i]);
    reading.sample = i + 1;
    const bool well = good(reading.pose_device_tool) && good(place) && pedal[i] >= 0.0 && pedal[i] <= 1.0 &&
                      status[i] <= static_cast<int>(DeviceStatus::absent) &&
                      calibration[i] <= static_cast<int>(Calibration::pending) &&
                      (i == 0 || (ticks[i] > ticks[i - 1] && ticks[i] - ticks[i - 1] < kMostLost));
    if (!well) {
      reader.wrong(ErrorCode::invalid_input,
                   reader.name() + ": row " + std::to_string(i) + " is no reading of a device; the file is damaged");
      break;
    }
    const std::uint64_t lost = i > 0 ? ticks[i] - ticks[i - 1] - 1 : 0;
    if (lost > 0) {
      readings.resize(readings.size() + lost, DeviceReading(readings.back()));
      places.resize(places.size() + lost, Pose(places.back()));
    }
    readings.push_back(reading);
    places.push_back(place);
  }
  if (!moves) places = {};
}

void read_take_ups(RecordingReader& reader, RecordedSession& session) {
  const std::size_t count = reader.rows(recording::kTakeUpRow);
  if (count == 0) return;
  const auto rows = reader.values<std::uint64_t>(recording::kTakeUpRow, count, 1);
  const auto tools = reader.values<std::uint8_t>(recording::kTakeUpTool, count, 1);
  const auto poses = reader.values<double>(recording::kTakeUpPose, count, 7);
  const auto views = reader.values<double>(recording::kTakeUpView, count, 4);
  const auto scales = reader.values<double>(recording::kTakeUpScale, count, 1);
  const auto devices = reader.values<double>(recording::kTakeUpDevice, count, 3);
  const auto bones = reader.values<double>(recording::kTakeUpBone, count, 3);
  if (!reader.ok()) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (rows[i] >= session.pointer.size()) break;  // of a row that is not complete
    RecordedTakeUp taken{.tool = tools[i],
                         .pose_bone_tool = pose_of(&poses[7 * i]),
                         .view = {views[4 * i + 3], views[4 * i], views[4 * i + 1], views[4 * i + 2]},
                         .scale = scales[i],
                         .device_mm = Vec3(&devices[3 * i]),
                         .bone_mm = Vec3(&bones[3 * i])};
    const bool well = good(taken.pose_bone_tool) && good({Vec3::Zero(), taken.view}) && taken.scale > 0.0 &&
                      std::isfinite(taken.scale) && taken.device_mm.allFinite() && taken.bone_mm.allFinite() &&
                      static_cast<std::size_t>(taken.tool) < session.tools.size();
    if (!well) {
      reader.wrong(ErrorCode::invalid_input, reader.name() + ": row " + std::to_string(i) +
                                                 " of burr_change is no tool that was taken up; the file is damaged");
      return;
    }
    session.pointer[rows[i]].take_up = static_cast<int>(session.take_ups.size());
    session.take_ups.push_back(taken);
  }
}

// What the hand of a pointer did besides moving the handle.
void read_pointer(RecordingReader& reader, RecordedSession& session) {
  if (!reader.ok() || session.device != recording::kPointer) return;
  if (!reader.has_dataset(recording::kPointerSource)) {
    reader.wrong(ErrorCode::unsupported, reader.name() +
                                             " is of a pointer and does not say when its hand cut, because an older "
                                             "osteon-haptic wrote it; record it again");
    return;
  }
  const std::size_t rows = reader.rows();
  const auto ticks = reader.values<std::uint64_t>(recording::kTick, rows, 1);
  if (!reader.ok()) return;
  if (rows != session.readings.size() || ticks.front() != 1) {
    reader.wrong(ErrorCode::unsupported, reader.name() +
                                             " is of a pointer and lacks some ticks, so its tool cannot be led as it "
                                             "was; record it again on a machine with less load");
    return;
  }
  const auto rpm = reader.values<double>(recording::kCommandedRpm, rows, 1);
  const auto phase = reader.values<std::uint8_t>(recording::kPhase, rows, 1);
  const auto source = reader.values<std::uint8_t>(recording::kPointerSource, rows, 1);
  const auto law = reader.values<std::uint8_t>(recording::kLaw, rows, 1);
  const auto wear = reader.values<double>(recording::kWear, rows, 1);
  session.laws = reader.texts(recording::kLaws);
  if (!reader.ok()) return;
  const auto in_hand = reader.enumerator(recording::kPhase, "free_hand");
  for (std::size_t i = 0; i < rows && reader.ok(); ++i) {
    if (!(rpm[i] >= 0.0 && rpm[i] <= kMostRpm)) reader.damaged(recording::kCommandedRpm);
    if (session.tools.empty()) reader.damaged(recording::kTools);
    if (law[i] >= session.laws.size()) reader.damaged(recording::kLaw);
    if (!(wear[i] >= kSharp && wear[i] <= kBluntest)) reader.damaged(recording::kWear);
    session.pointer.push_back(
        {.commanded_rpm = rpm[i], .in_hand = phase[i] == in_hand, .source = source[i], .law = law[i], .wear = wear[i]});
  }
  read_take_ups(reader, session);
}

}  // namespace

Result<RecordedSession> read_recording(const std::filesystem::path& file) {
  RecordingReader reader(file);
  if (!reader.open()) return tl::unexpected(reader.error());
  RecordedSession session;
  const char* g = recording::kMetadata;
  session.device = reader.text(g, recording::kDevice);
  session.device_model = reader.text(g, recording::kModel);
  session.case_hash = reader.text(g, recording::kCaseHash);
  session.case_title = reader.text(g, recording::kCaseTitle);
  if (reader.has(recording::kPlanDigest, g)) session.plan_digest = reader.text(g, recording::kPlanDigest);
  session.tools = reader.texts(recording::kTools);
  session.force_scale = reader.number(g, recording::kForceScale);
  if (reader.has(recording::kForceChoice, g)) session.force_choice = reader.text(g, recording::kForceChoice);
  session.limits = limits_of(reader);
  session.info.model = "a recording of " + (session.device_model.empty() ? session.device : session.device_model);
  session.info.force_axes = static_cast<int>(reader.number(g, recording::kForceAxes));
  session.info.torque_axes = static_cast<int>(reader.number(g, recording::kTorqueAxes));
  read_rows(reader, session);
  read_pointer(reader, session);
  if (!reader.ok()) return tl::unexpected(reader.error());

  session.start_hash = reader.digits(recording::kStartHash);
  session.field_hash = reader.digits(recording::kFieldHash);
  return session;
}

Result<void> check_played(const RecordedSession& recorded, std::string_view name, std::string_view case_hash,
                          const std::vector<std::string>& tools, std::string_view plan_digest) {
  const std::string is_of = std::string(name) + " is of ";
  if (recorded.case_hash != case_hash)
    return failure(ErrorCode::invalid_input, is_of + "another bone, \"" + recorded.case_title + "\" (case " +
                                                 recorded.case_hash.substr(0, 12) + "); join a room on that case");
  if (recorded.of_pointer() && !tools.empty() && recorded.tools.front() != tools.front())
    return failure(ErrorCode::invalid_input, is_of + "a pointer's hand that began with " + recorded.tools.front() +
                                                 "; give --tool " + recorded.tools.front());
  const auto list = [](const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& one : names) text += (text.empty() ? "" : ", ") + one;
    return text.empty() ? std::string("no tool") : text;
  };
  if (recorded.tools != tools)
    return failure(ErrorCode::invalid_input, is_of + "a session with " + list(recorded.tools) + ", not with " +
                                                 list(tools) + "; give the --plan or --tool that it was made with");
  for (const std::string& law : recorded.laws)
    if (!find_force_law(law))
      return failure(ErrorCode::unsupported,
                     std::string(name) + " used the force law \"" + law +
                         "\", which this osteon-haptic does not know; play it with the release that recorded it");
  if (!recorded.plan_digest.empty() && recorded.plan_digest != plan_digest)
    return failure(
        ErrorCode::invalid_input,
        is_of +
            "another plan or another start of the tool; give the --plan, or --tool, --view, --at, --rpm, --law "
            "and --wear, that it was made with");
  return {};
}

RecordedDevice::RecordedDevice(std::string name, RecordedSession session)
    : name_(std::move(name)), session_(std::move(session)) {}

DeviceReading RecordedDevice::read() noexcept {
  if (!over()) return session_.readings[next_++];
  ended_ = true;
  DeviceReading last = session_.readings.back();
  last.status = DeviceStatus::absent;
  last.buttons = 0;
  last.pedal = 0.0;
  return last;
}

const PointerTick* RecordedDevice::pointer_tick() const noexcept {
  return session_.pointer.empty() || ended_ || next_ == 0 ? nullptr : &session_.pointer[next_ - 1];
}

const Pose* RecordedDevice::pose_rest_bone() const noexcept {
  return session_.pose_rest_bone.empty() || next_ == 0 ? nullptr : &session_.pose_rest_bone[next_ - 1];
}

Result<void> check_played_on(const RecordedDevice& recorded, std::string_view field_hash) {
  const std::string& began_on = recorded.session().start_hash;
  if (began_on.empty() || began_on == field_hash) return {};
  return failure(ErrorCode::invalid_input,
                 "--device " + std::string(recorded.name()) + " began on bone in another state (field " +
                     began_on.substr(0, 12) + ") than the room's (field " + std::string(field_hash.substr(0, 12)) +
                     "); restart osteon-server on the case, or with the --resume that it had then");
}

Result<std::unique_ptr<RecordedDevice>> make_recorded_device(const std::filesystem::path& file) {
  Result<RecordedSession> session = read_recording(file);
  if (!session) return tl::unexpected(session.error());
  return std::make_unique<RecordedDevice>("recorded:" + file.string(), std::move(*session));
}

}  // namespace osteon::haptic
