#include "haptic_client/app/record_file.hpp"

#include <hdf5.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <functional>
#include <type_traits>
#include <utility>

#include "common/input/pointer_link.hpp"
#include "common/mechanics/force_law.hpp"
#include "common/recording/hdf5_handle.hpp"
#include "common/recording/hdf5_type.hpp"
#include "common/recording/recording_layout.hpp"

namespace osteon::haptic {
namespace {

static_assert(std::is_same_v<hid_t, std::int64_t>);

constexpr const char* kReadme =
    "One row for each millisecond, under `data` and in the groups of poses and wrenches. data/time has as many rows as "
    "are complete. Lengths are millimetres, forces newtons, torques newton-millimetres, times seconds since 1970 "
    "(UTC). "
    "Poses are [x, y, z, qx, qy, qz, qw] of the tool, its tip at the origin and +z along its axis out of the tip. "
    "Frame `bone` is the patient's (DICOM LPS: x to the left, y to the back, z to the head). Frame `device` has x to "
    "the right, y up, z to the user. drill_pose is the pose that the bone allows for the tool (the proxy), device_pose "
    "the pose that the hand asks for, handle_pose the device's handle. bone_pose is the bone on its mount, relative to "
    "its rest pose: frame `bone` moves with it, the frame of burr_change does not. Wrenches are [fx, fy, fz, tx, ty, "
    "tz] at the tip. `physical` is of the bone on the tool, not scaled. `wrench` in drill_force_feedback is what the "
    "device showed, s times as strong (data/force_scale), zero where it shows none. burr_change has a row for each "
    "time that a tool was taken up: the tool, its first row, and the pose of the device's frame in the bone's frame "
    "from then on. Enumerations carry their names. metadata/field_hash names the removed bone, which is stored in the "
    "room's journal.";

// The frames and units of columns.
constexpr const char* kBone = "bone";
constexpr const char* kDevice = "device";

// Switches off HDF5's own error output, because the callers report errors. The setting is per thread.
void be_quiet() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

Hdf5Handle text_type(std::size_t size) {
  Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(size, 1));
  if (size != H5T_VARIABLE) H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

// As a string of variable length, which Python's readers return as a str.
bool set_text(hid_t object, const char* name, const std::string& text) {
  const Hdf5Handle type = text_type(H5T_VARIABLE), space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Handle attribute(H5Acreate2(object, name, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* chars = text.c_str();
  return attribute.ok() && H5Awrite(attribute.id(), type.id(), &chars) >= 0;
}

bool set_number(hid_t object, const char* name, double value) {
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Handle attribute(H5Acreate2(object, name, H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.ok() && H5Awrite(attribute.id(), H5T_NATIVE_DOUBLE, &value) >= 0;
}

bool set_integer(hid_t object, const char* name, std::int64_t value) {
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Handle attribute(H5Acreate2(object, name, H5T_STD_I64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.ok() && H5Awrite(attribute.id(), H5T_NATIVE_INT64, &value) >= 0;
}

Hdf5Handle make_dataset(hid_t file, const std::string& path, hid_t type, hid_t space, hid_t creation) {
  const Hdf5Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links.id(), 1);
  return {H5Dcreate2(file, path.c_str(), type, space, links.id(), creation, H5P_DEFAULT), H5Dclose};
}

// A value that exists from the start and may be set at the end.
Hdf5Handle make_value(hid_t file, const char* path, hid_t type, const void* value) {
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  Hdf5Handle dataset = make_dataset(file, path, type, space.id(), H5P_DEFAULT);
  if (dataset.ok() && H5Dwrite(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) < 0) dataset.reset();
  return dataset;
}

bool make_texts(hid_t file, const char* path, const std::vector<std::string>& texts) {
  std::size_t longest = 1;
  for (const std::string& text : texts) longest = std::max(longest, text.size());
  std::vector<char> flat(longest * texts.size(), '\0');
  for (std::size_t i = 0; i < texts.size(); ++i)
    std::copy(texts[i].begin(), texts[i].end(), flat.begin() + static_cast<std::ptrdiff_t>(i * longest));
  const hsize_t count = texts.size();
  const Hdf5Handle type = text_type(longest), space(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Hdf5Handle dataset = make_dataset(file, path, type.id(), space.id(), H5P_DEFAULT);
  return dataset.ok() &&
         (texts.empty() || H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, flat.data()) >= 0);
}

struct Names {
  std::vector<std::pair<std::string, int>> values;
};

// An array that grows by rows, and its rows that are not written yet.
template <class Row>
struct Column {
  std::string path, units, frame, meaning;
  std::function<void(const Row&, std::vector<std::byte>&)> take;
  int width = 1;
  std::size_t value_bytes = 0;
  Hdf5Handle type;  // of a value; native integers and floats are not owned
  hid_t type_id = -1;
  Hdf5Handle dataset;
  std::vector<std::byte> waiting;
  hsize_t rows = 0;  // written
};

template <class T>
void put(std::vector<std::byte>& to, const T* values, std::size_t count) {
  const auto* bytes = reinterpret_cast<const std::byte*>(values);
  to.insert(to.end(), bytes, bytes + count * sizeof(T));
}

// A column of `width` values of type T. `get` takes the row and returns an array or one value.
template <class T, class Row, class Get>
Column<Row> column(const char* path, const char* units, const char* frame, const char* meaning, Get get) {
  Column<Row> made;
  made.path = path, made.units = units, made.frame = frame, made.meaning = meaning;
  made.value_bytes = sizeof(T);
  made.type_id = hdf5_type<T>();
  using Given = std::invoke_result_t<Get, const Row&>;
  if constexpr (std::is_arithmetic_v<Given>) {
    made.take = [get](const Row& row, std::vector<std::byte>& to) {
      const T value = static_cast<T>(get(row));
      put(to, &value, 1);
    };
  } else {
    made.width = static_cast<int>(std::tuple_size_v<Given>);
    made.take = [get](const Row& row, std::vector<std::byte>& to) {
      std::array<T, std::tuple_size_v<Given>> values;
      std::ranges::transform(get(row), values.begin(), [](double v) { return static_cast<T>(v); });
      put(to, values.data(), values.size());
    };
  }
  return made;
}

template <class Row, class Get>
Column<Row> enumeration(const char* path, const char* meaning, const Names& names, Get get) {
  Column<Row> made = column<std::uint8_t, Row>(path, "", "", meaning, get);
  made.type = Hdf5Handle(H5Tenum_create(H5T_STD_U8LE), H5Tclose);
  for (const auto& [name, value] : names.values) {
    const auto small = static_cast<std::uint8_t>(value);
    H5Tenum_insert(made.type.id(), name.c_str(), &small);
  }
  made.type_id = made.type.id();
  return made;
}

std::array<double, 7> numbers(const Pose& pose) {
  const Vec3& p = pose.position_mm;
  const Eigen::Quaterniond& q = pose.rotation;
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

std::array<double, 3> numbers(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

std::array<double, 6> wrench(const Vec3& force_n, const Vec3& torque_nmm) {
  return {force_n.x(), force_n.y(), force_n.z(), torque_nmm.x(), torque_nmm.y(), torque_nmm.z()};
}

template <class Row>
bool make_column(hid_t file, Column<Row>& made, hsize_t chunk_rows) {
  const int rank = made.width > 1 ? 2 : 1;
  const hsize_t width = static_cast<hsize_t>(made.width);
  const hsize_t now[] = {0, width}, most[] = {H5S_UNLIMITED, width}, chunk[] = {chunk_rows, width};
  const Hdf5Handle space(H5Screate_simple(rank, now, most), H5Sclose),
      creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  // Compressed, as in the recordings of similar programs; poses hardly change from one row to the next.
  if (H5Pset_chunk(creation.id(), rank, chunk) < 0 || H5Pset_shuffle(creation.id()) < 0 ||
      H5Pset_deflate(creation.id(), 1) < 0)
    return false;
  made.dataset = make_dataset(file, made.path, made.type_id, space.id(), creation.id());
  if (!made.dataset.ok()) return false;
  const hid_t id = made.dataset.id();
  return (made.units.empty() || set_text(id, "units", made.units)) &&
         (made.frame.empty() || set_text(id, "frame", made.frame)) && set_text(id, "meaning", made.meaning);
}

template <class Row>
bool write_column(Column<Row>& made) {
  const std::size_t row_bytes = made.value_bytes * static_cast<std::size_t>(made.width);
  const hsize_t rows = made.waiting.size() / row_bytes, width = static_cast<hsize_t>(made.width);
  if (rows == 0) return true;
  const int rank = made.width > 1 ? 2 : 1;
  const hsize_t size[] = {made.rows + rows, width}, from[] = {made.rows, 0}, count[] = {rows, width};
  if (H5Dset_extent(made.dataset.id(), size) < 0) return false;
  const Hdf5Handle space(H5Dget_space(made.dataset.id()), H5Sclose),
      memory(H5Screate_simple(rank, count, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, from, nullptr, count, nullptr) < 0) return false;
  if (H5Dwrite(made.dataset.id(), made.type_id, memory.id(), space.id(), H5P_DEFAULT, made.waiting.data()) < 0)
    return false;
  made.rows += rows;
  made.waiting.clear();
  return H5Dflush(made.dataset.id()) >= 0;
}

struct TakeUp {
  double time_s = 0;
  std::uint64_t row = 0;  // of the session, from 0
  TickRow tick;
  double diameter_mm = 0;
};

std::string utc(std::int64_t seconds) {
  const std::time_t time = static_cast<std::time_t>(seconds);
  std::tm parts{};
  gmtime_r(&time, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

}  // namespace

struct RecordFile::Impl {
  std::filesystem::path path;
  RecordingInfo info;
  Hdf5Handle file;
  Hdf5Handle start_hash, hash, room_seq, rows_dropped, finished;
  std::vector<Column<TickRow>> columns;  // the last is the time
  std::vector<Column<TakeUp>> take_ups;
  std::vector<std::string> laws;  // each once: those with which the tools began, then all others
  std::vector<std::uint8_t> law_of_tool;
  std::size_t waiting = 0;
  std::uint64_t rows = 0, seen = 0;
  double epoch_minus_mono_s = 0;
  std::uint64_t keep_free_bytes = 0;

  Result<void> create();
  [[nodiscard]] std::uint8_t law_of(const LoopReport& report) const;
  void make_columns();
  bool make_metadata();
  bool make_links();
  bool write_all();
  bool set_hash(const Hdf5Handle& dataset, std::string digits);
  tl::unexpected<Error> failed(const char* what);

  ~Impl() {
    // HDF5 cannot close what it could not write. The file is left as it is, as if the process had been killed.
    if (abandoned) abandon();
  }
  void abandon() {
    for (auto& c : columns) c.dataset.abandon();
    for (auto& c : take_ups) c.dataset.abandon();
    for (Hdf5Handle* h : {&start_hash, &hash, &room_seq, &rows_dropped, &finished, &file}) h->abandon();
  }
  bool abandoned = false;  // the disk has failed
};

tl::unexpected<Error> RecordFile::Impl::failed(const char* what) {
  const int why = errno;
  abandoned = true;
  const std::string reason = why == ENOSPC || why == EDQUOT || why == EFBIG
                                 ? "the disk is full (" + std::string(std::strerror(why)) + ")"
                             : why != 0 ? std::string(std::strerror(why))
                                        : "HDF5 gives no reason";
  return failure(ErrorCode::internal, "the recording " + path.string() + " cannot be " + what + ": " + reason);
}

std::uint8_t RecordFile::Impl::law_of(const LoopReport& report) const {
  if (report.cutting.law != nullptr) {
    const auto found = std::ranges::find(laws, report.cutting.law->name);
    if (found != laws.end()) return static_cast<std::uint8_t>(found - laws.begin());
  }
  const auto tool = static_cast<std::size_t>(report.tool);
  return tool < law_of_tool.size() ? law_of_tool[tool] : std::uint8_t{0};
}

void RecordFile::Impl::make_columns() {
  using R = TickRow;
  // On a device without motors the loop's force is not shown.
  const bool forces = info.device_info.force_axes > 0, torques = info.device_info.torque_axes > 0;
  const auto add = [this](auto&& made) { columns.push_back(std::forward<decltype(made)>(made)); };
  add(column<double, R>(recording::kHandlePose, "mm, mm, mm, 1, 1, 1, 1", kDevice, "the device's handle",
                        [](const R& r) { return numbers(r.reading.pose_device_tool); }));
  add(column<double, R>("high_frequency_poses/device_pose/pose", "mm, mm, mm, 1, 1, 1, 1", kBone,
                        "the tool's pose that the hand asks for",
                        [](const R& r) { return numbers(r.report.pose_bone_device); }));
  add(column<double, R>(recording::kToolPose, "mm, mm, mm, 1, 1, 1, 1", kBone,
                        "the tool's pose that the bone allows: the proxy",
                        [](const R& r) { return numbers(r.report.pose_bone_proxy); }));
  add(column<double, R>(recording::kBonePose, "mm, mm, mm, 1, 1, 1, 1", "rest",
                        "the bone on its mount, relative to its rest pose",
                        [](const R& r) { return numbers(r.report.pose_rest_bone); }));
  add(column<float, R>("drill_force_feedback/wrench", "N, N, N, N.mm, N.mm, N.mm", kDevice,
                       "force and torque that the device shows to the hand", [forces, torques](const R& r) {
                         return wrench(forces ? r.rendered.force_n : Vec3(Vec3::Zero()),
                                       torques ? r.rendered.torque_nmm : Vec3(Vec3::Zero()));
                       }));
  add(column<float, R>(
      "drill_force_feedback/motor_force", "N, N, N", kDevice, "the motor's part of the force: drag, kick, vibration",
      [forces](const R& r) { return numbers(forces ? r.report.motor.device_n : Vec3(Vec3::Zero())); }));
  add(column<float, R>(recording::kWrench, "N, N, N, N.mm, N.mm, N.mm", kBone, "of the bone on the tool, not scaled",
                       [](const R& r) { return wrench(r.report.coupling.force_n, r.report.coupling.torque_nmm); }));
  add(column<float, R>("drill_force_physical/cutting_force", "N, N, N", kBone,
                       "of the tool on the bone, by the law alone",
                       [](const R& r) { return numbers(r.report.cutting.force_n); }));
  add(column<std::int64_t, R>(recording::kMonoNs, "ns", "",
                              "the machine's monotonic clock, as in every log of the session",
                              [](const R& r) { return r.mono_ns; }));
  add(column<std::uint64_t, R>(recording::kTick, "1", "", "number of the tick and of its cutting state",
                               [](const R& r) { return r.report.state_seq; }));
  add(column<float, R>(recording::kSpindleRpm, "1/min", "", "speed of the spindle",
                       [](const R& r) { return r.report.spindle_rpm; }));
  add(column<double, R>(recording::kCommandedRpm, "1/min", "", "speed that the pedal commands",
                        [](const R& r) { return r.commanded_rpm; }));
  add(column<float, R>(recording::kFeed, "mm/s", "", "into bone, along the direction of cutting",
                       [](const R& r) { return r.report.cutting.feed_mm_per_s; }));
  add(column<float, R>(recording::kDensity, "g/cm3", "", "of the bone being cut, weighted by engaged area",
                       [](const R& r) { return r.report.cutting.density_g_cm3; }));
  add(column<float, R>(recording::kEngaged, "1", "", "share of the leading area that is in bone",
                       [](const R& r) { return r.report.cutting.engaged; }));
  add(column<float, R>(recording::kTorque, "N.mm", "", "torque of the bone on the spindle",
                       [](const R& r) { return r.report.cutting.torque_nmm; }));
  add(column<float, R>("data/cutting_work", "mJ", "", "work of the law's force over the path cut in the tick",
                       [](const R& r) { return r.report.cutting.work_mj; }));
  add(column<float, R>("data/coupling_energy", "mJ", "",
                       "energy that the coupling gave in this contact, minus what the hand put in",
                       [](const R& r) { return r.report.coupling.energy.episode_mj; }));
  add(column<float, R>("data/offset", "mm, mm, mm", kBone,
                       "of the hand's position: slack, and the extension that pushing the tool away would have caused",
                       [](const R& r) { return numbers(r.report.coupling.offset_mm); }));
  add(column<float, R>("data/depth", "mm", "", "of the tip below the entry of the current step",
                       [](const R& r) { return r.depth_mm; }));
  add(column<float, R>("data/device_depth", "mm", "", "the same of the hand",
                       [](const R& r) { return r.device_depth_mm; }));
  add(column<float, R>("data/force_scale", "1", "", "s: rendered over physical force",
                       [loop = info.loop](const R& r) { return loop.scale_of(r.report.coupling.force_n.norm()); }));
  add(column<float, R>("data/guide_play", "mm", "",
                       "while in a guide: permitted distance of the tip from the opening's middle",
                       [](const R& r) { return r.report.contact.guide_play_mm; }));
  add(column<float, R>("data/flutes_full", "1", "", "share of the tool's flutes that chips fill",
                       [](const R& r) { return r.report.cutting.flutes_full; }));
  add(column<float, R>(recording::kCortex, "mm", "", "thickness of the cortical layer that the tool cuts, 0 for none",
                       [](const R& r) { return r.cortex_mm; }));
  add(column<float, R>(recording::kSeated, "1", "", "of a broach: its resistance over that at which it is seated",
                       [](const R& r) { return r.report.cutting.seated; }));
  add(column<std::uint32_t, R>(recording::kBlows, "1", "", "blows on the tool so far",
                               [](const R& r) { return r.report.cutting.blows; }));
  add(column<float, R>(recording::kBlowImpulse, "N.s", "", "of the newest blow",
                       [](const R& r) { return r.report.cutting.blow_impulse_n_s; }));
  add(enumeration<R>(recording::kState, "what the tool does to the bone",
                     {{{"idle", 1}, {"free", 2}, {"cutting", 3}, {"rubbing", 4}}},
                     [](const R& r) { return static_cast<int>(r.report.cutting.phase); }));
  Names phases;
  for (int i = 0; i <= static_cast<int>(SurgeonPhase::free_hand); ++i)
    phases.values.emplace_back(name(static_cast<SurgeonPhase>(i)), i);
  add(enumeration<R>(recording::kPhase, "phase of the current step", phases,
                     [](const R& r) { return static_cast<int>(r.phase); }));
  add(column<std::uint32_t, R>("data/step", "1", "", "of the plan, from 0", [](const R& r) { return r.step; }));
  add(column<std::uint8_t, R>(recording::kTool, "1", "", "tool in hand: its index in metadata/tools",
                              [](const R& r) { return r.report.tool; }));
  add(column<std::uint8_t, R>(recording::kLaw, "1", "", "force law of the tool: its index in metadata/laws",
                              [this](const R& r) { return law_of(r.report); }));
  add(column<double, R>(recording::kWear, "1", "", "how blunt the tool was before the tick: 1 is sharp",
                        [](const R& r) { return r.report.cutting.wear; }));
  add(column<std::uint8_t, R>("data/law_out_of_range", "1", "",
                              "bits: exceeded limits of the law, named in metadata/range_bits",
                              [](const R& r) { return r.report.cutting.out_of_range; }));
  add(column<std::uint32_t, R>("data/events", "1", "",
                               "bits: events of the loop in the tick, named in metadata/event_bits",
                               [](const R& r) { return r.report.events; }));
  add(column<std::uint32_t, R>(recording::kButtons, "1", "",
                               "bits: 1 clutch, 2 spindle, 4 irrigation, 8 suction, 16 a pointer's hand cuts",
                               [](const R& r) { return r.reading.buttons; }));
  add(column<double, R>(recording::kPedal, "1", "", "of a proportional pedal, 0 to 1",
                        [](const R& r) { return r.reading.pedal; }));
  Names sources{{{"none", 0}}};
  for (const std::string_view source : kPointerSources)
    sources.values.emplace_back(std::string(source), static_cast<int>(sources.values.size()));
  add(enumeration<R>(recording::kPointerSource, "what leads the hand of the device pointer", sources,
                     [](const R& r) { return static_cast<int>(r.pointer_source); }));
  add(enumeration<R>(recording::kDeviceStatus, "whether the device works",
                     {{{"ok", 0}, {"warm", 1}, {"fault", 2}, {"absent", 3}}},
                     [](const R& r) { return static_cast<int>(r.reading.status); }));
  add(enumeration<R>(recording::kCalibration, "whether the device knows where its handle is",
                     {{{"done", 0}, {"pending", 1}}},
                     [](const R& r) { return static_cast<int>(r.reading.calibration); }));
  add(column<double, R>(recording::kTime, "s", "UTC, since 1970-01-01", "when the tick began",
                        [this](const R& r) { return epoch_minus_mono_s + 1e-9 * static_cast<double>(r.mono_ns); }));

  using T = TakeUp;
  const auto change = [this](auto&& made) { take_ups.push_back(std::forward<decltype(made)>(made)); };
  change(column<std::uint64_t, T>(recording::kTakeUpRow, "1", "", "first row of data with this tool in hand",
                                  [](const T& t) { return t.row; }));
  change(column<std::uint8_t, T>(recording::kTakeUpTool, "1", "", "its index in metadata/tools",
                                 [](const T& t) { return t.tick.report.tool; }));
  change(column<double, T>("burr_change/burr_size", "mm", "", "diameter of its cutting part",
                           [](const T& t) { return t.diameter_mm; }));
  change(column<double, T>(recording::kTakeUpPose, "mm, mm, mm, 1, 1, 1, 1", kBone, "where it was taken up",
                           [](const T& t) { return numbers(t.tick.taken_up_at); }));
  change(column<double, T>(recording::kTakeUpView, "1, 1, 1, 1", "bone from device",
                           "rotation of the workspace: qx, qy, qz, qw", [](const T& t) {
                             const Eigen::Quaterniond& q = t.tick.mapping.view();
                             return std::array{q.x(), q.y(), q.z(), q.w()};
                           }));
  change(column<double, T>(recording::kTakeUpScale, "1", "", "mm of the tool for each mm of the handle",
                           [](const T& t) { return t.tick.mapping.scale(); }));
  change(column<double, T>(recording::kTakeUpDevice, "mm, mm, mm", kDevice, "this position of the handle",
                           [](const T& t) { return numbers(t.tick.mapping.device_mm()); }));
  change(column<double, T>(recording::kTakeUpBone, "mm, mm, mm", kBone, "is that position of the tip",
                           [](const T& t) { return numbers(t.tick.mapping.bone_mm()); }));
  change(column<double, T>("burr_change/time_stamp", "s", "UTC, since 1970-01-01", "when",
                           [](const T& t) { return t.time_s; }));
}

bool RecordFile::Impl::make_metadata() {
  const Hdf5Handle group(H5Gcreate2(file.id(), recording::kMetadata, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  if (!group.ok()) return false;
  const hid_t g = group.id();
  const DeviceLimits& d = info.limits;
  const std::pair<const char*, double> numbers_of_device[] = {{recording::kPeak, d.peak_n},
                                                              {recording::kContinuous, d.continuous_n},
                                                              {recording::kStiffness, d.stiffness_n_per_mm},
                                                              {recording::kWorkspace, d.workspace_radius_mm},
                                                              {recording::kDamping, d.damping_n_s_per_mm},
                                                              {recording::kPeakTorque, d.peak_nmm},
                                                              {recording::kContinuousTorque, d.continuous_nmm},
                                                              {recording::kMiddleX, d.workspace_middle_mm.x()},
                                                              {recording::kMiddleY, d.workspace_middle_mm.y()},
                                                              {recording::kMiddleZ, d.workspace_middle_mm.z()},
                                                              {recording::kForceAxes, info.device_info.force_axes},
                                                              {recording::kTorqueAxes, info.device_info.torque_axes},
                                                              {recording::kForceScale, info.loop.force_scale},
                                                              {"tick_s", info.loop.dt_s},
                                                              {"pitch_mm", info.pitch_mm}};
  bool ok = set_text(g, recording::kDevice, info.device) && set_text(g, recording::kModel, info.device_info.model) &&
            set_text(g, recording::kCaseHash, info.case_hash) && set_text(g, recording::kCaseTitle, info.case_title) &&
            set_text(g, recording::kPlanDigest, info.plan_digest) &&
            set_text(g, recording::kForceChoice, std::string(name(info.loop.choice))) &&
            set_integer(g, recording::kAuthor, static_cast<std::int64_t>(info.author));
  for (const auto& [name, value] : numbers_of_device) ok = ok && set_number(g, name, value);
  std::vector<std::string> tools;
  for (const RecordingInfo::Item& tool : info.tools) {
    tools.push_back(tool.name);
    auto law = std::ranges::find(laws, tool.law);
    if (law == laws.end()) law = laws.insert(law, tool.law);
    law_of_tool.push_back(static_cast<std::uint8_t>(law - laws.begin()));
  }
  // A person may choose another law while the session runs, but no new text may appear while others read.
  for (const ForceLaw& law : force_laws())
    if (std::ranges::find(laws, law.name) == laws.end()) laws.emplace_back(law.name);
  const double voxel_mm3 = info.pitch_mm * info.pitch_mm * info.pitch_mm;
  const Hdf5Handle voxel = make_value(file.id(), "metadata/voxel_volume", H5T_NATIVE_DOUBLE, &voxel_mm3);
  const Hdf5Handle readme_type = text_type(std::strlen(kReadme));
  const Hdf5Handle readme = make_value(file.id(), "metadata/README", readme_type.id(), kReadme);
  ok = ok && voxel.ok() && readme.ok() && set_text(voxel.id(), "units", "mm3") &&
       make_texts(file.id(), recording::kTools, tools) && make_texts(file.id(), recording::kLaws, laws) &&
       make_texts(file.id(), "metadata/event_bits", event_names()) &&
       make_texts(file.id(), "metadata/range_bits", range_names());
  // Values known only later. They exist from the start, because no new objects may appear while others read.
  const std::string nothing(64, '\0');
  const std::uint64_t zero = 0;
  const Hdf5Handle hash_type = text_type(64);
  start_hash = make_value(file.id(), recording::kStartHash, hash_type.id(), nothing.data());
  hash = make_value(file.id(), recording::kFieldHash, hash_type.id(), nothing.data());
  room_seq = make_value(file.id(), "metadata/room_seq", H5T_NATIVE_UINT64, &zero);
  rows_dropped = make_value(file.id(), "metadata/rows_dropped", H5T_NATIVE_UINT64, &zero);
  finished = make_value(file.id(), "metadata/finished", H5T_NATIVE_UINT64, &zero);
  return ok && start_hash.ok() && hash.ok() && room_seq.ok() && rows_dropped.ok() && finished.ok() &&
         set_text(start_hash.id(), "meaning",
                  "hash of the whole bone when the room was joined, SHA-256 in hexadecimal digits") &&
         set_text(hash.id(), "meaning", "hash of the whole bone at room_seq, SHA-256 in hexadecimal digits") &&
         set_text(finished.id(), "meaning",
                  "1: the session ended normally; 0: it continues, its room was lost, or its writer was killed");
}

// Links the same array under the names of each group of the layout.
bool RecordFile::Impl::make_links() {
  for (const char* group :
       {"high_frequency_poses/handle_pose", "high_frequency_poses/device_pose", "high_frequency_poses/drill_pose",
        "high_frequency_poses/bone_pose", "drill_force_feedback", "drill_force_physical"})
    if (H5Lcreate_hard(file.id(), recording::kTime, file.id(), (std::string(group) + "/time_stamp").c_str(),
                       H5P_DEFAULT, H5P_DEFAULT) < 0)
      return false;
  return H5Lcreate_hard(file.id(), "high_frequency_poses/drill_pose/pose", file.id(), "data/pose_drill", H5P_DEFAULT,
                        H5P_DEFAULT) >= 0;
}

Result<void> RecordFile::Impl::create() {
  // At the end of the process HDF5 would try for ever to close what a full disk keeps open.
  H5dont_atexit();
  be_quiet();
  errno = 0;
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
  file = Hdf5Handle(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose);
  if (!file.ok()) return failed("made");
  const auto wall = std::chrono::system_clock::now().time_since_epoch();
  const auto mono = std::chrono::steady_clock::now().time_since_epoch();
  epoch_minus_mono_s =
      1e-9 * static_cast<double>(std::chrono::nanoseconds(wall).count() - std::chrono::nanoseconds(mono).count());
  if (!set_text(file.id(), recording::kFormatName, recording::kFormat) ||
      !set_integer(file.id(), recording::kVersionName, recording::kVersion) ||
      !set_text(file.id(), "began", utc(std::chrono::duration_cast<std::chrono::seconds>(wall).count())) ||
      !make_metadata())
    return failed("made");
  make_columns();
  for (Column<TickRow>& made : columns)
    if (!make_column(file.id(), made, kChunkRows)) return failed("made");
  for (Column<TakeUp>& made : take_ups)
    if (!make_column(file.id(), made, 16)) return failed("made");
  if (!make_links() || H5Fflush(file.id(), H5F_SCOPE_GLOBAL) < 0 || H5Fstart_swmr_write(file.id()) < 0)
    return failed("made");
  return {};
}

bool RecordFile::Impl::write_all() {
  be_quiet();
  errno = 0;
  for (Column<TakeUp>& made : take_ups)
    if (!write_column(made)) return false;
  for (Column<TickRow>& made : columns)
    if (!write_column(made)) return false;
  rows += waiting;
  waiting = 0;
  return true;
}

bool RecordFile::Impl::set_hash(const Hdf5Handle& dataset, std::string digits) {
  digits.resize(64, '\0');
  const Hdf5Handle type = text_type(64);
  return H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, digits.data()) >= 0;
}

RecordFile::RecordFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RecordFile::~RecordFile() = default;
RecordFile::RecordFile(RecordFile&&) noexcept = default;
RecordFile& RecordFile::operator=(RecordFile&&) noexcept = default;
std::uint64_t RecordFile::rows_written() const { return impl_->rows; }

Result<RecordFile> RecordFile::create(const std::filesystem::path& file, const RecordingInfo& info,
                                      std::uint64_t keep_free_bytes) {
  auto impl = std::make_unique<Impl>();
  impl->path = file;
  impl->info = info;
  impl->keep_free_bytes = keep_free_bytes;
  if (Result<void> made = impl->create(); !made) return tl::unexpected(made.error());
  return RecordFile(std::move(impl));
}

Result<void> RecordFile::begin_on(const std::string& field_hash) {
  be_quiet();
  errno = 0;
  if (!impl_->set_hash(impl_->start_hash, field_hash) || H5Dflush(impl_->start_hash.id()) < 0)
    return impl_->failed("begun");
  return {};
}

Result<void> RecordFile::append(std::span<const TickRow> rows) {
  Impl& impl = *impl_;
  for (const TickRow& row : rows) {
    if (row.take_up) {
      TakeUp taken{impl.epoch_minus_mono_s + 1e-9 * static_cast<double>(row.mono_ns), impl.seen, row, 0.0};
      const auto tool = static_cast<std::size_t>(row.report.tool);
      if (tool < impl.info.tools.size()) taken.diameter_mm = impl.info.tools[tool].diameter_mm;
      for (Column<TakeUp>& column : impl.take_ups) column.take(taken, column.waiting);
    }
    for (Column<TickRow>& column : impl.columns) column.take(row, column.waiting);
    ++impl.seen;
    if (++impl.waiting < kChunkRows) continue;
    // Stopped in time, the file can still be closed properly, and other programs have a little space left.
    struct statvfs disk {};
    if (statvfs(impl.path.c_str(), &disk) == 0 &&
        static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize < impl.keep_free_bytes)
      return failure(ErrorCode::internal,
                     "the recording " + impl.path.string() + " ends here: the disk is almost full");
    if (!impl.write_all()) return impl.failed("continued");
  }
  return {};
}

Result<void> RecordFile::finish(const RecordingEnd& end) {
  Impl& impl = *impl_;
  if (!impl.write_all()) return impl.failed("written whole");
  const std::uint64_t as_it_should = end.lost ? 0 : 1;
  const bool ok =
      impl.set_hash(impl.hash, end.field_hash) &&
      H5Dwrite(impl.room_seq.id(), H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &end.room_seq) >= 0 &&
      H5Dwrite(impl.rows_dropped.id(), H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &end.rows_dropped) >= 0 &&
      H5Dwrite(impl.finished.id(), H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &as_it_should) >= 0 &&
      H5Fflush(impl.file.id(), H5F_SCOPE_GLOBAL) >= 0;
  if (!ok) return impl.failed("written whole");
  impl.take_ups.clear();
  impl.columns.clear();
  for (Hdf5Handle* handle :
       {&impl.start_hash, &impl.hash, &impl.room_seq, &impl.rows_dropped, &impl.finished, &impl.file})
    if (!handle->reset()) return impl.failed("closed");
  return {};
}

}  // namespace osteon::haptic
