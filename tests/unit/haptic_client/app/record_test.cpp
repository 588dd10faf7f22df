// Tests what a recording contains, that it survives killed writers and full disks, and that Python reads it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <csignal>
#include <fstream>
#include <thread>

#include "haptic_client/app/recorder.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/size_limit.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

using osteon::test::Random;
using osteon::test::TempDir;

RecordingInfo info_of_a_session() {
  RecordingInfo info;
  info.device = "simulated";
  info.device_info.model = "a hand of numbers";
  info.limits = {.peak_n = 8.5,
                 .continuous_n = 1.4,
                 .stiffness_n_per_mm = 0.8,
                 .workspace_radius_mm = 120.0,
                 .damping_n_s_per_mm = 0.002,
                 .workspace_middle_mm = {1, 2, 3}};
  info.loop.force_scale = 0.0466;
  info.case_hash = std::string(64, 'c');
  info.case_title = "block";
  info.plan_digest = std::string(64, 'p');
  info.pitch_mm = 0.5;
  info.author = 7;
  info.tools = {{"drill-3.2", "chi", 3.2}, {"burr-round-5", "milling", 5.0}};
  return info;
}

Vec3 vector(Random& random, double most) {
  return {random.between(-most, most), random.between(-most, most), random.between(-most, most)};
}

Pose pose(Random& random) {
  const Vec3 v = vector(random, 1.0);
  return {vector(random, 100.0), Eigen::Quaterniond(random.between(0.1, 1.0), v.x(), v.y(), v.z()).normalized()};
}

// Every row has different numbers. Row i is tick i + 1.
TickRow row(std::uint64_t i) {
  Random random(i);
  TickRow row;
  row.mono_ns = static_cast<std::int64_t>(1'000'000'000 + 1'000'000 * i);
  row.phase = SurgeonPhase::push;
  row.step = static_cast<std::uint32_t>(i / 1000);
  row.depth_mm = random.between(-5, 30);
  row.report.state_seq = i + 1;
  row.report.pose_bone_proxy = pose(random);
  row.report.pose_bone_device = pose(random);
  row.report.coupling.force_n = vector(random, 30.0);
  row.report.cutting.torque_nmm = random.between(0, 40);
  row.report.coupling.torque_nmm = {1.0 + static_cast<double>(i), 2.0, 3.0};
  row.report.spindle_rpm = random.between(0, 1000);
  row.report.cutting.density_g_cm3 = random.between(0, 2);
  row.report.cutting.feed_mm_per_s = random.between(0, 20);
  row.report.cutting.phase = i % 2 ? CuttingPhase::cutting : CuttingPhase::free;
  row.report.cutting.out_of_range = static_cast<unsigned>(i % 64);
  row.report.tool = static_cast<int>(i / 700 % 2);
  row.report.cutting.blows = static_cast<std::uint32_t>(i / 100);
  row.report.cutting.seated = 0.25;
  row.cortex_mm = 4.5;
  row.report.cutting.wear = 1.0 + static_cast<double>(i) / 1024.0;
  if (i >= 900) row.report.cutting.law = find_force_law(i < 1000 ? "milling" : "multi-point");  // chosen meanwhile
  row.reading.pose_device_tool = pose(random);
  row.reading.buttons = static_cast<std::uint32_t>(i % 4);
  row.reading.pedal = random.between(0, 1);
  row.reading.status = i % 97 == 0 ? DeviceStatus::warm : DeviceStatus::ok;
  row.commanded_rpm = 1000;
  row.rendered = DeviceOutput(vector(random, 3.3));
  row.take_up = i % 700 == 0;
  row.taken_up_at = pose(random);
  row.mapping.align(pose(random).rotation, 1.5, vector(random, 10), vector(random, 10));
  row.report.pose_rest_bone = pose(random);
  return row;
}

void write_rows(const std::filesystem::path& file, std::uint64_t count) {
  Result<RecordFile> recording = RecordFile::create(file, info_of_a_session());
  ASSERT_TRUE(recording) << recording.error().message;
  for (std::uint64_t i = 0; i < count; ++i) {
    const TickRow one = row(i);
    ASSERT_TRUE(recording->append({&one, 1}));
  }
  ASSERT_TRUE(recording->finish({std::string(64, 'f'), 321, 0}));
  EXPECT_EQ(recording->rows_written(), count);
}

// Runs Debian's Python on a script. The script gets the file as sys.argv[1].
osteon::test::RunResult python(const std::string& script, const std::filesystem::path& file) {
  return osteon::test::run(OSTEON_PYTHON, {"-c", script, file});
}

void expect_same(const Pose* a, const Pose& b) {
  ASSERT_NE(a, nullptr);
  EXPECT_EQ(a->position_mm, b.position_mm);
  EXPECT_EQ(a->rotation.coeffs(), b.rotation.coeffs());
}

void expect_same(const DeviceReading& a, const DeviceReading& b) {
  EXPECT_EQ(a.pose_device_tool.position_mm, b.pose_device_tool.position_mm);
  EXPECT_EQ(a.pose_device_tool.rotation.coeffs(), b.pose_device_tool.rotation.coeffs());
  EXPECT_EQ(a.buttons, b.buttons);
  EXPECT_EQ(a.pedal, b.pedal);
  EXPECT_EQ(a.status, b.status);
}

TEST(Recording, GivesTheDeviceBackBitForBit) {
  const TempDir temp;
  write_rows(temp / "a.h5", 1234);
  const auto device = make_recorded_device(temp / "a.h5");
  ASSERT_TRUE(device) << device.error().message;
  RecordedDevice& recorded = **device;
  for (std::uint64_t i = 0; i < 1234; ++i) {
    ASSERT_FALSE(recorded.over());
    expect_same(recorded.read(), row(i).reading);
    expect_same(recorded.pose_rest_bone(), row(i).report.pose_rest_bone);
  }
  EXPECT_TRUE(recorded.over());
  EXPECT_EQ(recorded.read().status, DeviceStatus::absent);
  EXPECT_FALSE(recorded.read().usable());
  const RecordingInfo info = info_of_a_session();
  EXPECT_EQ(recorded.session().case_hash, info.case_hash);
  EXPECT_EQ(recorded.session().field_hash, std::string(64, 'f'));
  EXPECT_EQ(recorded.session().force_scale, info.loop.force_scale);
  EXPECT_EQ(recorded.limits().peak_n, info.limits.peak_n);
  EXPECT_EQ(recorded.limits().damping_n_s_per_mm, info.limits.damping_n_s_per_mm);
  EXPECT_EQ(recorded.limits().workspace_middle_mm, info.limits.workspace_middle_mm);
  EXPECT_EQ(recorded.name(), "recorded:" + (temp / "a.h5").string());
}

// A handle's motion makes sense only with the bone, the tools and the plan of the recording.
TEST(Recording, IsOfOneBoneToolAndPlan) {
  const TempDir temp;
  write_rows(temp / "a.h5", 3);
  auto session = read_recording(temp / "a.h5");
  ASSERT_TRUE(session) << session.error().message;
  const RecordingInfo info = info_of_a_session();
  const std::vector<std::string> tools{"drill-3.2", "burr-round-5"};
  EXPECT_EQ(session->tools, tools);
  EXPECT_EQ(session->plan_digest, info.plan_digest);
  EXPECT_TRUE(check_played(*session, "a.h5", info.case_hash, tools, info.plan_digest));
  const auto said = [&](const std::string& hash, const std::vector<std::string>& names, const std::string& plan) {
    const Result<void> played = check_played(*session, "a.h5", hash, names, plan);
    EXPECT_FALSE(played);
    return played ? std::string() : played.error().message;
  };
  using testing::HasSubstr;
  EXPECT_THAT(said(std::string(64, 'd'), tools, info.plan_digest), HasSubstr("a.h5 is of another bone, \"block\""));
  EXPECT_THAT(said(info.case_hash, {"drill-3.2"}, info.plan_digest),
              HasSubstr("drill-3.2, burr-round-5, not with drill-3.2"));
  EXPECT_THAT(said(info.case_hash, {"burr-round-5", "drill-3.2"}, info.plan_digest), HasSubstr("--plan or --tool"));
  EXPECT_THAT(said(info.case_hash, tools, std::string(64, 'q')), HasSubstr("another plan"));
  session->laws = {"chi", "law-of-a-later-release"};
  EXPECT_THAT(said(info.case_hash, tools, info.plan_digest),
              HasSubstr("\"law-of-a-later-release\", which this osteon-haptic does not know; play it with"));
}

// It also needs the bone in its state at the recording's start. A recording without that state plays on any bone.
TEST(Recording, BeganOnBoneInOneState) {
  const TempDir temp;
  const std::string uncut(64, 'a'), cut(64, 'b');
  {
    Recorder recorder;
    ASSERT_TRUE(recorder.open(temp / "a.h5", info_of_a_session()));
    recorder.begin_on(uncut);
    recorder.push(row(0));
    EXPECT_EQ(recorder.finish({cut, 5, 0}).trouble, "");
  }
  const auto recorded = make_recorded_device(temp / "a.h5");
  ASSERT_TRUE(recorded) << recorded.error().message;
  EXPECT_EQ((*recorded)->session().start_hash, uncut);
  EXPECT_EQ((*recorded)->session().field_hash, cut);
  EXPECT_TRUE(check_played_on(**recorded, uncut));
  const Result<void> refused = check_played_on(**recorded, cut);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message,
              testing::HasSubstr("a.h5 began on bone in another state (field aaaaaaaaaaaa) than the "
                                 "room's (field bbbbbbbbbbbb); restart osteon-server"));
  const auto done = python(
      "import sys, h5py\nf = h5py.File(sys.argv[1], 'r+')\n"
      "assert f['metadata/field_hash_at_start'].attrs['meaning']\n"
      "del f['metadata/field_hash_at_start']\nf.close()",
      temp / "a.h5");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const auto old = make_recorded_device(temp / "a.h5");
  ASSERT_TRUE(old) << old.error().message;
  EXPECT_EQ((*old)->session().start_hash, "");
  EXPECT_TRUE(check_played_on(**old, cut));
}

// Only a session that ended normally says so. A session that lost its room still has its numbers.
TEST(Recording, SaysWhetherItsRoomWasLost) {
  const TempDir temp;
  for (const bool lost : {false, true}) {
    const auto file = temp / (lost ? "lost.h5" : "whole.h5");
    Result<RecordFile> recording = RecordFile::create(file, info_of_a_session());
    ASSERT_TRUE(recording);
    const TickRow one = row(0);
    ASSERT_TRUE(recording->append({&one, 1}));
    ASSERT_TRUE(recording->finish({std::string(64, 'f'), 321, 0, lost}));
    const auto read = python(
        "import sys, h5py; f = h5py.File(sys.argv[1], 'r'); "
        "print(f['metadata/finished'][()], f['metadata/room_seq'][()])",
        file);
    EXPECT_EQ(read.out, lost ? "0 321\n" : "1 321\n") << read.err;
  }
}

// A lost row is a tick with the same contents as the one before. Later rows keep their time.
TEST(Recording, LostRowsDoNotShiftTheRest) {
  const TempDir temp;
  {
    Result<RecordFile> recording = RecordFile::create(temp / "a.h5", info_of_a_session());
    ASSERT_TRUE(recording);
    for (const std::uint64_t i : {0, 1, 2, 6, 7}) {
      const TickRow one = row(i);
      ASSERT_TRUE(recording->append({&one, 1}));
    }
    ASSERT_TRUE(recording->finish({}));
  }
  const auto session = read_recording(temp / "a.h5");
  ASSERT_TRUE(session) << session.error().message;
  const int shown[] = {0, 1, 2, 2, 2, 2, 6, 7};
  ASSERT_EQ(session->readings.size(), std::size(shown));
  ASSERT_EQ(session->pose_rest_bone.size(), std::size(shown));
  for (std::size_t i = 0; i < std::size(shown); ++i) {
    const TickRow one = row(static_cast<std::uint64_t>(shown[i]));
    expect_same(session->readings[i], one.reading);
    expect_same(&session->pose_rest_bone[i], one.report.pose_rest_bone);
  }
}

// For a bone without a mount, and in recordings older than mounts, the recording has no pose of the bone.
TEST(Recording, OfABoneThatStoodMovesNone) {
  const TempDir temp;
  {
    Result<RecordFile> recording = RecordFile::create(temp / "stood.h5", info_of_a_session());
    ASSERT_TRUE(recording);
    TickRow one = row(0);
    one.report.pose_rest_bone = {};
    ASSERT_TRUE(recording->append({&one, 1}));
    ASSERT_TRUE(recording->finish({}));
  }
  write_rows(temp / "old.h5", 3);
  const auto done = python(
      "import sys, h5py\nf = h5py.File(sys.argv[1], 'r+')\n"
      "del f['high_frequency_poses/bone_pose']\nf.close()",
      temp / "old.h5");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  for (const char* name : {"stood.h5", "old.h5"}) {
    const auto device = make_recorded_device(temp / name);
    ASSERT_TRUE(device) << device.error().message;
    expect_same((*device)->read(), row(0).reading);
    EXPECT_EQ((*device)->pose_rest_bone(), nullptr) << name;
  }
}

// An invalid pose of the bone is damage, like an invalid pose of the handle.
TEST(Recording, RefusesAPlaceOfTheBoneThatIsNone) {
  const TempDir temp;
  write_rows(temp / "a.h5", 3);
  const auto done = python(
      "import sys, h5py\nf = h5py.File(sys.argv[1], 'r+')\nf['high_frequency_poses/bone_pose/pose'][1] = 0\n"
      "f.close()",
      temp / "a.h5");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const auto session = read_recording(temp / "a.h5");
  ASSERT_FALSE(session);
  EXPECT_THAT(session.error().message, testing::HasSubstr("row 1 is no reading of a device"));
}

// The lines of the README, word for word except for the file's name.
TEST(Recording, ThreeLinesOfPythonReadIt) {
  const TempDir temp;
  write_rows(temp / "session.h5", 600);
  const std::string lines = R"(
import h5py
session = h5py.File("session.h5", "r", swmr=True)
print(session["data/time"][:], session["drill_force_physical/wrench"][:, :3])
)";
  osteon::test::ProcessOptions options;
  options.folder = temp.path();
  const auto read = osteon::test::run(OSTEON_PYTHON, {"-c", lines}, std::chrono::seconds{60}, options);
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_THAT(read.out, ::testing::HasSubstr("[["));
}

// Every array has its unit, its frame if it has one, and its meaning. All have a row for each time. The groups are
// those of the volumetric drilling simulator. Numbers come out as they went in.
TEST(Recording, IsLaidOutAsItSays) {
  const TempDir temp;
  write_rows(temp / "a.h5", 1300);
  const TickRow some = row(1234);
  char expected[256];
  std::snprintf(expected, sizeof expected, "%.6f,%.6f,%.6f,%.6f,%.6f", some.report.pose_bone_proxy.position_mm.x(),
                some.report.pose_bone_proxy.rotation.w(), some.report.coupling.force_n.z(), some.rendered.force_n.y(),
                some.report.cutting.density_g_cm3);
  const auto read = python(R"(
import sys, h5py, numpy as np
f = h5py.File(sys.argv[1], "r")
assert {"metadata", "data", "high_frequency_poses", "drill_force_feedback", "burr_change"} <= set(f), list(f)
poses = {"handle_pose": "device", "device_pose": "bone", "drill_pose": "bone", "bone_pose": "rest"}
for name, frame in poses.items():
    pose = f["high_frequency_poses"][name]["pose"]
    assert pose.shape == (1300, 7) and pose.attrs["frame"] == frame and pose.attrs["units"].startswith("mm"), name
    assert np.allclose(np.linalg.norm(pose[:, 3:], axis=1), 1)
    assert (f["high_frequency_poses"][name]["time_stamp"][:] == f["data/time"][:]).all()
for group, frame in {"drill_force_feedback": "device", "drill_force_physical": "bone"}.items():
    wrench = f[group]["wrench"]
    assert wrench.shape == (1300, 6) and wrench.attrs["frame"] == frame, group
    assert wrench.attrs["units"].startswith("N, N, N, N.mm"), group
    assert len(f[group]["time_stamp"]) == 1300
rows = []
def look(name, item):
    if isinstance(item, h5py.Dataset) and not name.startswith("metadata"):
        assert item.attrs["meaning"], name
        assert item.attrs.get("units") or h5py.check_enum_dtype(item.dtype), name
        rows.append(len(item))
f.visititems(look)
assert set(rows) == {1300, 2}, rows
for name in "spindle_rpm feed density law state tool force_scale torque".split():
    assert len(f["data"][name]) == 1300, name
assert h5py.check_enum_dtype(f["data/state"].dtype)["cutting"] == f["data/state"][1]
assert np.allclose(np.diff(f["data/time"][:]), 1e-3, atol=2e-6) and f["data/time"][0] > 1.7e9
assert [t.decode() for t in f["metadata/tools"][:]] == ["drill-3.2", "burr-round-5"]
laws = [t.decode() for t in f["metadata/laws"][:]]
assert laws[:2] == ["chi", "milling"] and len(laws) == len(set(laws)), laws
assert [laws[i] for i in f["data/law"][[699, 700, 999, 1000]]] == ["chi", "milling", "milling", "multi-point"]
assert (f["data/blows"][:] == np.arange(1300) // 100).all()
assert (f["data/seated"][:] == 0.25).all() and (f["data/cortex"][:] == 4.5).all()
assert (f["data/wear"][:] == 1 + np.arange(1300) / 1024).all()
assert f["burr_change/burr_size"][:].tolist() == [3.2, 5.0]
assert (f["data/law_out_of_range"][:] == np.arange(1300) % 64).all()
bits = [t.decode() for t in f["metadata/range_bits"][:]]
assert bits == ["speed", "feed", "density", "diameter", "depth of cut", "speed of the teeth"], bits
assert f["burr_change/row"][:].tolist() == [0, 700] and f["burr_change/scale"][0] == 1.5
assert f["metadata/voxel_volume"][()] == 0.125 and f["metadata"].attrs["force_scale"] == 0.0466
assert f["metadata"].attrs["pitch_mm"] == 0.5
assert b"bone" in f["metadata/README"][()]
assert f["metadata/field_hash"][()].decode() == 64 * "f"
assert f["metadata/room_seq"][()] == 321 and f["metadata/finished"][()] == 1
assert f["drill_force_physical/wrench"][5, 3:].tolist() == [6, 2, 3]
i = 1234
print("%.6f,%.6f,%.6f,%.6f,%.6f" % (f["high_frequency_poses/drill_pose/pose"][i, 0], f["data/pose_drill"][i, 6],
      f["drill_force_physical/wrench"][i, 2], f["drill_force_feedback/wrench"][i, 1], f["data/density"][i]))
)",
                           temp / "a.h5");
  ASSERT_EQ(read.exit_code, 0) << read.err;
  double got[5], want[5];
  ASSERT_EQ(std::sscanf(read.out.c_str(), "%lf,%lf,%lf,%lf,%lf", &got[0], &got[1], &got[2], &got[3], &got[4]), 5);
  ASSERT_EQ(std::sscanf(expected, "%lf,%lf,%lf,%lf,%lf", &want[0], &want[1], &want[2], &want[3], &want[4]), 5);
  for (int i = 0; i < 5; ++i)
    EXPECT_NEAR(got[i], want[i], i < 2 ? 1e-6 : 4e-6) << i;  // poses are doubles, forces floats
}

// A device without motors shows nothing of what the loop would have shown on a stronger device. Neither recording nor
// log says that it did.
TEST(Recording, ADeviceWithoutMotorsShowsNothing) {
  const TempDir temp;
  struct Device {
    const char* name;
    int force_axes, torque_axes;
  };
  for (const Device& device : {Device{"spacemouse", 0, 0}, {"falcon", 3, 0}, {"sigma", 3, 3}}) {
    RecordingInfo info = info_of_a_session();
    info.device_info.force_axes = device.force_axes;
    info.device_info.torque_axes = device.torque_axes;
    TickRow one = row(0);
    one.rendered = {Vec3(1, 2, 2), Vec3(4, 5, 6)};
    one.force_rendered_n = 3.0;
    one.report.motor.device_n = {0.5, 0, 0};
    const auto file = temp / (std::string(device.name) + ".h5"), log = temp / (std::string(device.name) + ".csv");
    Result<RecordFile> recording = RecordFile::create(file, info);
    ASSERT_TRUE(recording);
    ASSERT_TRUE(recording->append({&one, 1}));
    ASSERT_TRUE(recording->finish({}));
    SessionLog lines;
    ASSERT_TRUE(lines.open(log, info.device_info, AuthorId{7}));
    lines.write(one, "drill-3.2");
    ASSERT_TRUE(lines.finish());
    const auto read = python(
        "import sys, csv, h5py; f = h5py.File(sys.argv[1], 'r'); g = f['drill_force_feedback']\n"
        "log = next(csv.DictReader(open(sys.argv[1][:-2] + 'csv')))\n"
        "print(g['wrench'][0].tolist(), g['motor_force'][0, 0], float(log['force_rendered_n']))",
        file);
    EXPECT_EQ(read.out, device.torque_axes  ? "[1.0, 2.0, 2.0, 4.0, 5.0, 6.0] 0.5 3.0\n"
                        : device.force_axes ? "[1.0, 2.0, 2.0, 0.0, 0.0, 0.0] 0.5 3.0\n"
                                            : "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0] 0.0 0.0\n")
        << device.name << read.err;
  }
}

// The bits of a recording have the meaning with which the loop sets them.
TEST(Recording, NamesItsEvents) {
  const std::vector<std::string> names = event_names();
  const auto named = [&](unsigned bit) { return names.at(static_cast<std::size_t>(std::countr_zero(bit))); };
  EXPECT_EQ(named(kUncovered), "uncovered");
  EXPECT_EQ(named(kForceLimited), "force limited");
  EXPECT_EQ(named(kSlewLimited), "slew limited");
  EXPECT_EQ(named(kCutsWaiting), "cuts waiting");
  EXPECT_EQ(named(kMissedTicks), "missed ticks");
  EXPECT_EQ(named(kHeelContact), "heel contact");
  EXPECT_EQ(named(kGuided), "guided");
  EXPECT_EQ(named(kStalled), "stalled");
  EXPECT_EQ(named(kBreakthrough), "breakthrough");
  EXPECT_EQ(named(kPushedAway), "pushed away");
  EXPECT_EQ(named(kEnergyLimited), "energy limited");
  EXPECT_EQ(named(kRamping), "ramping");
  EXPECT_EQ(named(kRoomHeld), "room held");
  EXPECT_EQ(named(kForbidden), "forbidden");
  EXPECT_EQ(named(kHandGuided), "hand guided");
  EXPECT_EQ(named(kPartnerTouched), "partner touched");
  EXPECT_EQ(named(kOnMetal), "on metal");
  EXPECT_EQ(names.size(), kLoopEvents);
}

// A contact is reported once, however the hand trembles on it. The next contact is reported again.
TEST(MetalWatch, ReportsEachContactOnce) {
  const ToolModel model(*find_tool("drill-3.2"), 0.5);
  MetalWatch watch;
  int told = 0;
  const auto at = [&](std::uint64_t seq, std::uint32_t events) {
    LoopReport report;
    report.state_seq = seq;
    report.events = events;
    const std::string sentence = watch.note(model, report);
    told += !sentence.empty();
    EXPECT_TRUE(sentence.empty() || sentence.starts_with("drill-3.2 stands on metal")) << sentence;
  };
  for (std::uint64_t seq = 1; seq < 3000; ++seq) at(seq, seq > 1000 && seq % 300 < 200 ? kOnMetal : kGuided);
  EXPECT_EQ(told, 1);
  for (std::uint64_t seq = 3000; seq < 4000; ++seq) at(seq, 0);
  EXPECT_EQ(told, 1);
  for (std::uint64_t seq = 4000; seq < 4100; ++seq) at(seq, kOnMetal | kForceLimited);
  EXPECT_EQ(told, 2);
}

// Ticks of a session as the watch gets them: only those outside the range.
struct RangeTicks {
  std::string outside(const ToolModel& model, OutOfRange what, int ticks = 1) {
    std::string told;
    for (int i = 0; i < ticks; ++i) {
      LoopReport report;
      report.state_seq = ++seq;
      report.cutting.out_of_range = static_cast<unsigned>(what);
      told += watch.note(model, report);
    }
    return told;
  }
  void inside(int ticks) { seq += static_cast<std::uint64_t>(ticks); }
  RangeWatch watch;
  std::uint64_t seq = 5000;
};

// Each law is reported once in a session, if it stays outside. Everything after that is counted.
TEST(RangeWatch, ReportsEachLawOnce) {
  const ToolModel drill(*find_tool("drill-3.2"), 0.5), other(*find_tool("drill-3.5"), 0.5);
  const ToolModel saw(*find_tool("saw-oscillating-1"), 0.5);
  RangeTicks ticks;
  EXPECT_EQ(ticks.watch.note(drill, LoopReport{}), "");
  EXPECT_TRUE(ticks.watch.uses().empty());
  const std::string first = ticks.outside(drill, OutOfRange::feed, 500);
  EXPECT_NE(first.find("\"chi\""), std::string::npos) << first;
  EXPECT_NE(first.find("feed"), std::string::npos) << first;
  EXPECT_EQ(first.find("\"chi\"", first.find("\"chi\"") + 1), std::string::npos) << first;
  EXPECT_EQ(ticks.outside(drill, OutOfRange::density, 500), "");
  EXPECT_EQ(ticks.outside(other, OutOfRange::feed, 500), "");  // another tool, the same law
  EXPECT_NE(ticks.outside(saw, OutOfRange::depth_of_cut, 300).find("\"saw\""), std::string::npos);
  const std::vector<RangeWatch::Use>& uses = ticks.watch.uses();
  ASSERT_EQ(uses.size(), 2u);
  EXPECT_EQ(uses[0].law->name, "chi");
  EXPECT_EQ(uses[0].ticks, 1500u);
  EXPECT_EQ(out_of_range_words(uses[0].bits), "feed, density");
  EXPECT_EQ(uses[1].ticks, 300u);
  // A law that was chosen while the session runs counts by itself.
  LoopReport chosen;
  chosen.cutting.law = find_force_law("allotta");
  chosen.cutting.out_of_range = static_cast<unsigned>(OutOfRange::density);
  EXPECT_EQ(ticks.watch.note(drill, chosen), "");
  ASSERT_EQ(ticks.watch.uses().size(), 3u);
  EXPECT_EQ(ticks.watch.uses()[2].law->name, "allotta");
}

// A cone that enters is outside for less than 0.2 s. Nothing is reported, however many holes follow, but each tick is
// counted. A law that is outside in two ticks of three is still reported: it gains one tick in three.
TEST(RangeWatch, ReportsOnlyWhatLasts) {
  const ToolModel drill(*find_tool("drill-3.2"), 0.5);
  RangeTicks holes;
  for (int hole = 0; hole < 30; ++hole) {
    EXPECT_EQ(holes.outside(drill, OutOfRange::feed, 150), "") << hole;
    holes.inside(3000);
  }
  EXPECT_EQ(holes.watch.uses()[0].ticks, 30u * 150u);

  RangeTicks now_and_then;
  int told_after = 0;
  for (int i = 0; i < 1000 && told_after == 0; ++i) {
    if (!now_and_then.outside(drill, OutOfRange::feed, 2).empty()) told_after = 3 * i;
    now_and_then.inside(1);
  }
  EXPECT_NEAR(told_after, 600, 6);
}

// A surgeon's drill that enters cortical bone causes no message. A rig that feeds the drill more slowly than the law's
// range does.
TEST(RangeWatch, SaysNothingOfAnEnteringDrill) {
  PlanStep hole = straight_down("drill-3.2");
  hole.to_mm = 4.0;
  PlanStep slow = hole;
  slow.hand = HandKind::rig;
  slow.feed_mm_per_s = 0.3;
  for (const PlanStep& step : {hole, slow}) {
    Bench bench(test::block_case(), {step});
    RangeWatch watch;
    std::string told;
    bench.run([&](const SessionTick& tick) { told += watch.note(bench.session().plan().tools[0], tick.report); });
    ASSERT_TRUE(bench.session().results()[0].completed);
    ASSERT_FALSE(watch.uses().empty());
    std::printf("  %s hand: %llu ticks outside\n", step.hand == HandKind::rig ? "a slow rig's" : "an expert's",
                static_cast<unsigned long long>(watch.uses()[0].ticks));
    EXPECT_EQ(told.empty(), step.hand == HandKind::expert) << told;
  }
}

// A child process that records as fast as it can. After each chunk it prints how many rows it has written.
class Writer {
 public:
  explicit Writer(const std::filesystem::path& file) {
    int ends[2];
    if (pipe(ends) != 0) return;
    pid_ = fork();
    if (pid_ == 0) {
      Result<RecordFile> recording = RecordFile::create(file, info_of_a_session());
      for (std::uint64_t i = 0; recording; ++i) {
        const TickRow one = row(i);
        if (!recording->append({&one, 1})) break;
        const std::uint64_t rows = recording->rows_written();
        if (rows == i + 1 && write(ends[1], &rows, sizeof rows) < 0) break;
      }
      _exit(1);
    }
    close(ends[1]);
    from_ = ends[0];
  }
  ~Writer() {
    kill();
    close(from_);
  }
  // The next number of rows that are certainly written.
  std::uint64_t rows() {
    std::uint64_t rows = 0;
    if (read(from_, &rows, sizeof rows) != sizeof rows) return 0;
    written_ = rows;
    return rows;
  }
  void kill() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
    while (rows() != 0) continue;
  }
  [[nodiscard]] std::uint64_t written() const { return written_; }

 private:
  pid_t pid_ = -1;
  int from_ = -1;
  std::uint64_t written_ = 0;
};

// A writer killed at any moment leaves every whole chunk. The next reader needs only the file.
TEST(Recording, AKilledWriterLeavesWhatItWrote) {
  const TempDir temp;
  Random random(7);
  std::uint64_t most = 0;
  for (int trial = 0; trial < 25; ++trial) {
    const auto file = temp / ("killed-" + std::to_string(trial) + ".h5");
    Writer writer(file);
    ASSERT_GT(writer.rows(), 0u);
    std::this_thread::sleep_for(std::chrono::microseconds(static_cast<int>(random.between(0, 60'000))));
    writer.kill();
    const auto session = read_recording(file);
    ASSERT_TRUE(session) << session.error().message;
    const std::size_t rows = session->readings.size();
    EXPECT_GE(rows, writer.written());
    EXPECT_LE(rows, writer.written() + RecordFile::kChunkRows);  // one more may be written than reported
    EXPECT_EQ(rows % RecordFile::kChunkRows, 0u);
    for (std::size_t i = 0; i < rows; i += 97) expect_same(session->readings[i], row(i).reading);
    EXPECT_EQ(session->field_hash, "");
    most = std::max(most, static_cast<std::uint64_t>(rows));
    if (trial != 0) continue;
    const auto read = python(
        "import sys, h5py\nf = h5py.File(sys.argv[1], 'r', swmr=True)\n"
        "n = len(f['data/time'])\nassert n >= 500\n"
        "assert (f['data/state_seq'][:n] == range(1, n + 1)).all() and f['metadata/finished'][()] == 0\n",
        file);
    EXPECT_EQ(read.exit_code, 0) << read.err;
  }
  EXPECT_GT(most, 500u);
}

TEST(Recording, CanBeReadWhileItGrows) {
  const TempDir temp;
  Writer writer(temp / "a.h5");
  ASSERT_GT(writer.rows(), 0u);
  const auto read = python(
      "import sys, time, h5py\nf = h5py.File(sys.argv[1], 'r', swmr=True)\nt = f['data/time']\n"
      "first, until = len(t), time.time() + 20\n"
      "while len(t) <= first and time.time() < until:\n  time.sleep(0.01)\n  t.refresh()\n"
      "print(first, len(t))\nassert len(t) > first\n",
      temp / "a.h5");
  EXPECT_EQ(read.exit_code, 0) << read.err;
}

TEST(Recording, AFullDiskIsSaidInASentenceAndLeavesWhatWasWritten) {
  for (const rlim_t bytes : {400'000u, 555'555u, 700'001u}) {
    const TempDir temp;
    std::uint64_t fitted = 0;
    {
      const osteon::test::SizeLimit full(bytes);
      Result<RecordFile> recording = RecordFile::create(temp / "a.h5", info_of_a_session());
      ASSERT_TRUE(recording) << recording.error().message;
      Result<void> appended;
      for (std::uint64_t i = 0; appended && i < 20'000; ++i) {
        const TickRow one = row(i);
        appended = recording->append({&one, 1});
      }
      ASSERT_FALSE(appended);
      EXPECT_EQ(appended.error().message, "the recording " + (temp / "a.h5").string() +
                                              " cannot be continued: the disk is full (File too large)");
      fitted = recording->rows_written();
    }
    const auto session = read_recording(temp / "a.h5");
    ASSERT_TRUE(session) << session.error().message;
    EXPECT_EQ(session->readings.size(), fitted);
    EXPECT_GE(fitted, RecordFile::kChunkRows);
    for (std::size_t i = 0; i < fitted; i += 97) expect_same(session->readings[i], row(i).reading);
  }
}

// Recording stops before the disk is full and closes the file properly, so that any reader opens it.
TEST(Recording, LeavesALittleOfTheDisk) {
  const TempDir temp;
  {
    Result<RecordFile> recording = RecordFile::create(temp / "a.h5", info_of_a_session(), std::uint64_t{1} << 60);
    ASSERT_TRUE(recording) << recording.error().message;
    Result<void> appended;
    std::uint64_t i = 0;
    for (; appended && i < 2000; ++i) {
      const TickRow one = row(i);
      appended = recording->append({&one, 1});
    }
    ASSERT_FALSE(appended);
    EXPECT_EQ(i, RecordFile::kChunkRows);
    EXPECT_EQ(appended.error().message,
              "the recording " + (temp / "a.h5").string() + " ends here: the disk is almost full");
  }
  const auto read = python(
      "import sys, h5py\nf = h5py.File(sys.argv[1], 'r')\nassert len(f['data/time']) == 0 and "
      "f['metadata/finished'][()] == 0",
      temp / "a.h5");
  EXPECT_EQ(read.exit_code, 0) << read.err;
}

// The recorder's thread meets the full disk. The thread that pushes rows gets no error.
TEST(Recorder, EndsTheRecordingAndNothingElse) {
  const TempDir temp;
  Recorder recorder;
  const osteon::test::SizeLimit full(500'000);
  ASSERT_TRUE(recorder.open(temp / "a.h5", info_of_a_session()));
  for (std::uint64_t i = 0; i < 10'000; ++i) recorder.push(row(i));
  const Recorder::Outcome outcome = recorder.finish({});
  EXPECT_THAT(outcome.trouble, ::testing::HasSubstr("the disk is full"));
  EXPECT_GE(outcome.rows, RecordFile::kChunkRows);
  EXPECT_LT(outcome.rows, 10'000u);
  EXPECT_EQ(outcome.dropped, 0u);
  const auto session = read_recording(temp / "a.h5");
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->readings.size(), outcome.rows);
}

TEST(Recorder, WritesAllThatWasPushed) {
  const TempDir temp;
  Recorder recorder;
  EXPECT_FALSE(recorder.recording());
  ASSERT_TRUE(recorder.open({}, info_of_a_session()));  // nothing to record
  EXPECT_FALSE(recorder.recording());
  ASSERT_TRUE(recorder.open(temp / "a.h5", info_of_a_session()));
  for (std::uint64_t i = 0; i < 3333; ++i) recorder.push(row(i));
  const Recorder::Outcome outcome = recorder.finish({std::string(64, 'e'), 5, 0});
  EXPECT_EQ(outcome.trouble, "");
  EXPECT_EQ(outcome.rows, 3333u);
  const auto session = read_recording(temp / "a.h5");
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->readings.size(), 3333u);
  EXPECT_EQ(session->field_hash, std::string(64, 'e'));
}

TEST(Recording, APlaceThatCannotBeWrittenIsAnError) {
  const auto made = RecordFile::create("/nowhere/at/all.h5", info_of_a_session());
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message, "the recording /nowhere/at/all.h5 cannot be made: No such file or directory");
}

// Each wrong file causes one sentence with the file's name and the fault.
class WrongFile : public ::testing::Test {
 protected:
  void expect(ErrorCode code, const std::string& part, std::string name = "a.h5") {
    const auto device = make_recorded_device(temp_ / name);
    ASSERT_FALSE(device) << part;
    const std::string& message = device.error().message;
    EXPECT_EQ(device.error().code, code) << message;
    EXPECT_THAT(message, ::testing::HasSubstr(part));
    EXPECT_THAT(message, ::testing::HasSubstr((temp_ / name).string()));
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    std::printf("  %s\n", message.c_str());
  }
  // A good recording after a Python statement has changed it as `f`.
  void spoil(const std::string& how) {
    write_rows(temp_ / "a.h5", 600);
    const auto done =
        python("import sys, h5py\nf = h5py.File(sys.argv[1], 'r+')\n" + how + "\nf.close()", temp_ / "a.h5");
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }
  TempDir temp_;
};

TEST_F(WrongFile, IsNotThere) { expect(ErrorCode::not_found, "there is no file", "none.h5"); }
TEST_F(WrongFile, IsAFolder) {
  std::filesystem::create_directory(temp_ / "folder");
  expect(ErrorCode::not_found, "there is no file", "folder");
}
TEST_F(WrongFile, IsNoHdf5) {
  std::ofstream(temp_ / "a.h5") << "time_s,mono_ns\n1,2\n";
  expect(ErrorCode::invalid_input, "is not an HDF5 file");
}
TEST_F(WrongFile, IsOfAnotherProgram) {
  const auto made =
      python("import sys, h5py\nf = h5py.File(sys.argv[1], 'w')\nf['drill_force_feedback/wrench'] = [[0.0] * 6]",
             temp_ / "a.h5");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  expect(ErrorCode::invalid_input, "no recording of Osteon");
}
TEST_F(WrongFile, IsCutOff) {
  write_rows(temp_ / "a.h5", 600);
  std::filesystem::resize_file(temp_ / "a.h5", 5000);
  expect(ErrorCode::invalid_input, "");
}
TEST_F(WrongFile, IsOfAnotherVersion) {
  spoil("f.attrs['version'] = 2");
  expect(ErrorCode::unsupported, "is of version 2 of the format; this program reads version 1");
}
TEST_F(WrongFile, LacksADataset) {
  spoil("del f['high_frequency_poses/handle_pose/pose']");
  expect(ErrorCode::invalid_input, "has no dataset \"high_frequency_poses/handle_pose/pose\"");
}
TEST_F(WrongFile, LacksAnAttribute) {
  spoil("del f['metadata'].attrs['device_peak_n']");
  expect(ErrorCode::invalid_input, "has no attribute \"device_peak_n\"");
}
TEST_F(WrongFile, HasADatasetOfAnotherShape) {
  spoil("del f['data/pedal']\nf['data/pedal'] = [[0.0, 0.0]] * 600");
  expect(ErrorCode::invalid_input, "\"data/pedal\" has not 1 values in a row");
}
TEST_F(WrongFile, HasADatasetThatIsTooShort) {
  spoil("f['data/buttons'].resize((599,))");
  expect(ErrorCode::invalid_input, "\"data/buttons\" has fewer rows");
}
TEST_F(WrongFile, HasANumberThatIsNone) {
  spoil("f['high_frequency_poses/handle_pose/pose'][17, 1] = float('nan')");
  expect(ErrorCode::invalid_input, "row 17 is no reading");
}
TEST_F(WrongFile, HasARotationThatIsNone) {
  spoil("f['high_frequency_poses/handle_pose/pose'][18, 6] = 3.0");
  expect(ErrorCode::invalid_input, "row 18 is no reading");
}
TEST_F(WrongFile, HoldsNoRow) {
  write_rows(temp_ / "a.h5", 0);
  expect(ErrorCode::invalid_input, "holds no complete row");
}

}  // namespace
}  // namespace osteon::haptic::test
