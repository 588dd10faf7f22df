#include "haptic_client/device/recorded_device.hpp"

#include <hdf5.h>

#include <cmath>
#include <optional>

#include "common/input/pointer_link.hpp"
#include "common/mechanics/force_law.hpp"
#include "haptic_client/device/hdf5_handle.hpp"
#include "haptic_client/device/recording_layout.hpp"

namespace osteon::haptic {
namespace {

constexpr double kMostRpm = 1e6;

// A recording being read, and the message of the first error in it.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : path_(file), name_("the recording " + file.string()) {}

  bool open() {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    std::error_code none;
    if (!std::filesystem::is_regular_file(path_, none))
      return wrong(ErrorCode::not_found, "there is no file " + path_.string() + "; give one that --record wrote");
    if (H5Fis_hdf5(path_.c_str()) <= 0)
      return wrong(ErrorCode::invalid_input, path_.string() + " is not an HDF5 file; give one that --record wrote");
    // A file that is being written, or whose writer was killed, opens only in this mode. A file of another program
    // perhaps opens only in the other mode.
    // In this mode HDF5 reads a part with a wrong checksum again, because a writer may just have changed it. It waits
    // 1 ns, and each time twice as long. Its own limit of 100 attempts never ends in a damaged file; 24 take 17 ms.
    constexpr unsigned kAttempts = 24;
    const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_metadata_read_attempts(access.id(), kAttempts);
    file_ = Hdf5Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.id()), H5Fclose);
    if (!file_.ok()) file_ = Hdf5Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file_.ok())
      return wrong(ErrorCode::invalid_input,
                   name_ + " cannot be opened: it is damaged, or another program has it open");
    return true;
  }

  std::string text(const char* group, const char* name) {
    const Hdf5Handle attribute = find(group, name);
    if (!attribute.ok()) return {};
    const Hdf5Handle type(H5Aget_type(attribute.id()), H5Tclose);
    if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) <= 0) {
      wrong(ErrorCode::invalid_input, name_ + ": the attribute \"" + name + "\" is not a text");
      return {};
    }
    char* read = nullptr;
    if (H5Aread(attribute.id(), type.id(), &read) < 0 || !read) {
      damaged(name);
      return {};
    }
    std::string value = read;
    H5free_memory(read);
    return value;
  }

  double number(const char* group, const char* name) {
    const Hdf5Handle attribute = find(group, name);
    double value = 0.0;
    if (attribute.ok() && (H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, &value) < 0 || !std::isfinite(value)))
      damaged(name);
    return value;
  }

  [[nodiscard]] bool has(const char* name, const char* group = ".") const {
    return H5Aexists_by_name(file_.id(), group, name, H5P_DEFAULT) > 0;
  }

  [[nodiscard]] bool has_dataset(const char* path) const {
    return H5Oexists_by_name(file_.id(), path, H5P_DEFAULT) > 0;
  }

  // A list of strings of one length.
  std::vector<std::string> texts(const char* path) {
    const Hdf5Handle dataset = find_dataset(path);
    if (!dataset.ok()) return {};
    const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose), type(H5Dget_type(dataset.id()), H5Tclose);
    const hssize_t count = H5Sget_simple_extent_npoints(space.id());
    const std::size_t size = H5Tget_size(type.id());
    constexpr hssize_t kMostTexts = 10'000;
    if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) != 0 || count < 0 ||
        count > kMostTexts || size == 0 || size > 4096) {
      wrong(ErrorCode::invalid_input, name_ + ": the dataset \"" + path + "\" is not a list of texts");
      return {};
    }
    std::string all(static_cast<std::size_t>(count) * size, '\0');
    if (count > 0 && H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) < 0) {
      damaged(path);
      return {};
    }
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
      texts.emplace_back(std::string(all.substr(i * size, size).c_str()));
    return texts;
  }

  // A hash; empty if it is missing or was not set.
  [[nodiscard]] std::string digits(const char* path) const {
    const Hdf5Handle dataset(H5Dopen2(file_.id(), path, H5P_DEFAULT), H5Dclose), type(H5Tcopy(H5T_C_S1), H5Tclose);
    char digits[65] = {};
    H5Tset_size(type.id(), 64);
    H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
    H5Tset_cset(type.id(), H5T_CSET_UTF8);
    if (!dataset.ok() || H5Dread(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, digits) < 0) return {};
    return digits;
  }

  // Number of complete rows: those that have their time.
  std::size_t rows(const char* path = recording::kTime) {
    const Hdf5Handle dataset = find_dataset(path);
    if (!dataset.ok()) return 0;
    const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose);
    const hssize_t count = H5Sget_simple_extent_npoints(space.id());
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }

  // The first `rows` rows of a dataset with `width` values in a row.
  template <class T>
  std::vector<T> values(const char* path, hid_t type, std::size_t rows, std::size_t width) {
    const Hdf5Handle dataset = find_dataset(path);
    if (!dataset.ok()) return {};
    const Hdf5Handle space(H5Dget_space(dataset.id()), H5Sclose), stored(H5Dget_type(dataset.id()), H5Tclose);
    hsize_t size[2] = {0, 1};
    const int rank = H5Sget_simple_extent_ndims(space.id());
    if (rank < 1 || rank > 2 || H5Sget_simple_extent_dims(space.id(), size, nullptr) != rank || size[1] != width) {
      wrong(ErrorCode::invalid_input,
            name_ + ": the dataset \"" + path + "\" has not " + std::to_string(width) + " values in a row");
      return {};
    }
    if (size[0] < rows) {
      wrong(ErrorCode::invalid_input,
            name_ + ": the dataset \"" + path + "\" has fewer rows than \"" + recording::kTime + "\"");
      return {};
    }
    const hsize_t from[] = {0, 0}, count[] = {rows, width};
    const Hdf5Handle memory(H5Screate_simple(rank, count, nullptr), H5Sclose);
    // Enumerations are stored as small integers with names; here they are read as integers.
    const bool named = H5Tget_class(stored.id()) == H5T_ENUM;
    std::vector<T> read(rows * width);
    if (H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, from, nullptr, count, nullptr) < 0 ||
        H5Dread(dataset.id(), named ? stored.id() : type, memory.id(), space.id(), H5P_DEFAULT, read.data()) < 0 ||
        (named && H5Tget_size(stored.id()) != sizeof(T)))
      damaged(path);
    return read;
  }

  // The value of a name in an enumeration.
  std::optional<std::uint8_t> enumerator(const char* path, const char* name) {
    const Hdf5Handle dataset = find_dataset(path);
    if (!dataset.ok()) return {};
    const Hdf5Handle type(H5Dget_type(dataset.id()), H5Tclose);
    std::uint8_t value = 0;
    if (H5Tget_class(type.id()) != H5T_ENUM || H5Tget_size(type.id()) != sizeof value ||
        H5Tenum_valueof(type.id(), name, &value) < 0) {
      damaged(path);
      return {};
    }
    return value;
  }

  bool wrong(ErrorCode code, const std::string& sentence) {
    if (!error_) error_ = Error{code, sentence};
    return false;
  }
  bool damaged(const char* what) {
    return wrong(ErrorCode::invalid_input, name_ + ": \"" + what + "\" cannot be read; the file is damaged");
  }
  [[nodiscard]] bool ok() const { return !error_; }
  [[nodiscard]] const Error& error() const { return *error_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  Hdf5Handle find(const char* group, const char* name) {
    Hdf5Handle attribute(H5Aopen_by_name(file_.id(), group, name, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    if (!attribute.ok())
      wrong(ErrorCode::invalid_input,
            name_ + " has no attribute \"" + name + "\" of \"" + group + "\"; it is not what --record writes");
    return attribute;
  }
  Hdf5Handle find_dataset(const char* path) {
    Hdf5Handle dataset(H5Dopen2(file_.id(), path, H5P_DEFAULT), H5Dclose);
    if (!dataset.ok())
      wrong(ErrorCode::invalid_input, name_ + " has no dataset \"" + path + "\"; it is not what --record writes");
    return dataset;
  }

  std::filesystem::path path_;
  std::string name_;
  Hdf5Handle file_;
  std::optional<Error> error_;
};

DeviceLimits limits_of(Reader& reader) {
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
void read_rows(Reader& reader, RecordedSession& session) {
  std::vector<DeviceReading>& readings = session.readings;
  const std::size_t rows = reader.rows();
  const auto poses = reader.values<double>(recording::kHandlePose, H5T_NATIVE_DOUBLE, rows, 7);
  const auto buttons = reader.values<std::uint32_t>(recording::kButtons, H5T_NATIVE_UINT32, rows, 1);
  const auto pedal = reader.values<double>(recording::kPedal, H5T_NATIVE_DOUBLE, rows, 1);
  const auto status = reader.values<std::uint8_t>(recording::kDeviceStatus, H5T_NATIVE_UINT8, rows, 1);
  const auto calibration = reader.values<std::uint8_t>(recording::kCalibration, H5T_NATIVE_UINT8, rows, 1);
  const auto ticks = reader.values<std::uint64_t>(recording::kTick, H5T_NATIVE_UINT64, rows, 1);
  std::vector<double> bone;
  if (reader.has_dataset(recording::kBonePose))
    bone = reader.values<double>(recording::kBonePose, H5T_NATIVE_DOUBLE, rows, 7);
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

void read_take_ups(Reader& reader, RecordedSession& session) {
  const std::size_t count = reader.rows(recording::kTakeUpRow);
  if (count == 0) return;
  const auto rows = reader.values<std::uint64_t>(recording::kTakeUpRow, H5T_NATIVE_UINT64, count, 1);
  const auto tools = reader.values<std::uint8_t>(recording::kTakeUpTool, H5T_NATIVE_UINT8, count, 1);
  const auto poses = reader.values<double>(recording::kTakeUpPose, H5T_NATIVE_DOUBLE, count, 7);
  const auto views = reader.values<double>(recording::kTakeUpView, H5T_NATIVE_DOUBLE, count, 4);
  const auto scales = reader.values<double>(recording::kTakeUpScale, H5T_NATIVE_DOUBLE, count, 1);
  const auto devices = reader.values<double>(recording::kTakeUpDevice, H5T_NATIVE_DOUBLE, count, 3);
  const auto bones = reader.values<double>(recording::kTakeUpBone, H5T_NATIVE_DOUBLE, count, 3);
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
void read_pointer(Reader& reader, RecordedSession& session) {
  if (!reader.ok() || session.device != recording::kPointer) return;
  if (!reader.has_dataset(recording::kPointerSource)) {
    reader.wrong(ErrorCode::unsupported, reader.name() +
                                             " is of a pointer and does not say when its hand cut, because an older "
                                             "osteon-haptic wrote it; record it again");
    return;
  }
  const std::size_t rows = reader.rows();
  const auto ticks = reader.values<std::uint64_t>(recording::kTick, H5T_NATIVE_UINT64, rows, 1);
  if (!reader.ok()) return;
  if (rows != session.readings.size() || ticks.front() != 1) {
    reader.wrong(ErrorCode::unsupported, reader.name() +
                                             " is of a pointer and lacks some ticks, so its tool cannot be led as it "
                                             "was; record it again on a machine with less load");
    return;
  }
  const auto rpm = reader.values<double>(recording::kCommandedRpm, H5T_NATIVE_DOUBLE, rows, 1);
  const auto phase = reader.values<std::uint8_t>(recording::kPhase, H5T_NATIVE_UINT8, rows, 1);
  const auto source = reader.values<std::uint8_t>(recording::kPointerSource, H5T_NATIVE_UINT8, rows, 1);
  const auto law = reader.values<std::uint8_t>(recording::kLaw, H5T_NATIVE_UINT8, rows, 1);
  const auto wear = reader.values<double>(recording::kWear, H5T_NATIVE_DOUBLE, rows, 1);
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
  Reader reader(file);
  if (!reader.open()) return tl::unexpected(reader.error());
  if (!reader.has(recording::kFormatName) || reader.text(".", recording::kFormatName) != recording::kFormat)
    return failure(ErrorCode::invalid_input,
                   file.string() + " is HDF5, but no recording of Osteon; give one that --record wrote");
  const int version = static_cast<int>(reader.number(".", recording::kVersionName));
  if (reader.ok() && version != recording::kVersion)
    return failure(ErrorCode::unsupported, reader.name() + " is of version " + std::to_string(version) +
                                               " of the format; this program reads version " +
                                               std::to_string(recording::kVersion));
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
