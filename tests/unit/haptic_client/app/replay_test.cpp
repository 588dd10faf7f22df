// A recording repeats what a hand has done: the same bone to the last bit, whatever the tools and devices.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "haptic_client/app/record_file.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

PlanStep drill(HandKind hand, const Vec3& at) {
  PlanStep step;
  step.action = Action::drill;
  step.tool = "drill-3.2";
  step.spindle_rpm = 1000;
  step.hand = hand;
  step.feed_mm_per_s = 3;
  step.entry.point_mm = at;
  step.entry.axis = Vec3(0, 0, 1);
  return step;
}

PlanStep burr() {
  PlanStep step;
  step.action = Action::burr;
  step.tool = "burr-round-5";
  step.window_u_mm = 4;
  step.window_v_mm = 3;
  step.depth_mm = 1;
  step.tremor_mm = 0.3;
  step.entry.point_mm = Vec3(-3, 2, 0);
  step.entry.axis = Vec3(0, 0, 1);
  return step;
}

TickRow row_of(Bench& bench, const SessionTick& tick) {
  TickRow row;
  row.mono_ns = static_cast<std::int64_t>(1'000'000 * tick.report.state_seq);
  row.report = tick.report;
  row.reading = tick.reading;
  row.commanded_rpm = tick.commanded_rpm;
  row.rendered = {tick.report.device.force_n, tick.report.device.torque_nmm};
  row.take_up = tick.order.take_up;
  row.taken_up_at = {tick.order.hand.target_mm, tick.order.rotation};
  row.mapping = bench.session().loop().mapping();
  return row;
}

RecordingInfo info_of(Bench& bench) {
  RecordingInfo info;
  info.device = bench.session().device().name();
  info.limits = bench.session().device().limits();
  info.loop = bench.session().loop().params();
  return info;
}

struct Session {
  std::string field_hash;
  std::vector<Cut> cuts;
  std::vector<Vec3> forces;  // physical, of every tick
};

// A session with the simulated hand, recorded.
// `mount`: pose of the bone on a compliant mount, by the number of the tick.
Session record(const Case& bone, const std::vector<PlanStep>& plan, const SimulatedDeviceParams& device,
               const std::filesystem::path& file, const std::function<Pose(std::uint64_t)>& mount = {}) {
  Bench bench(bone, plan, device);
  Result<RecordFile> recording = RecordFile::create(file, info_of(bench));
  EXPECT_TRUE(recording) << recording.error().message;
  Session session;
  if (mount) bench.session().loop().see_bone(mount(0));
  bench.run([&](const SessionTick& tick) {
    const TickRow row = row_of(bench, tick);
    EXPECT_TRUE(recording->append({&row, 1}));
    session.forces.push_back(tick.report.coupling.force_n);
    if (mount) bench.session().loop().see_bone(mount(tick.report.state_seq));
  });
  EXPECT_TRUE(bench.session().done());
  session.field_hash = to_hex(bench.replica().committed().hash());
  session.cuts = bench.cuts();
  EXPECT_TRUE(recording->finish({session.field_hash, session.cuts.size(), 0}));
  return session;
}

// The same plan on the same bone, moved by the recording alone.
Session replay(const Case& bone, const std::vector<PlanStep>& plan, const std::filesystem::path& file) {
  Result<std::unique_ptr<RecordedDevice>> device = make_recorded_device(file);
  EXPECT_TRUE(device) << device.error().message;
  RecordedDevice& recorded = **device;
  Bench bench(bone, plan, {std::string(recorded.name()), recorded.limits()}, recorded.session().force_scale);
  bench.session().play(recorded);
  Session session;
  bench.run([&](const SessionTick& tick) { session.forces.push_back(tick.report.coupling.force_n); });
  EXPECT_TRUE(recorded.over());
  session.field_hash = to_hex(bench.replica().committed().hash());
  session.cuts = bench.cuts();
  EXPECT_EQ(session.field_hash, recorded.session().field_hash);
  return session;
}

TEST(Replay, MakesTheSameCutsAndForces) {
  const osteon::test::TempDir temp;
  const Case bone = block_case(16.0);
  const std::vector<PlanStep> plan{drill(HandKind::expert, {3.1, -0.2, 0}), burr(),
                                   drill(HandKind::rig, {3.4, 4.2, 0})};
  for (const char* name : {"simulated", "simulated-3.3N"}) {
    const Session made = record(bone, plan, *find_simulated_device(name), temp / "a.h5");
    const Session again = replay(bone, plan, temp / "a.h5");
    EXPECT_EQ(again.field_hash, made.field_hash) << name;
    EXPECT_EQ(again.cuts, made.cuts) << name;
    EXPECT_EQ(again.forces, made.forces) << name;
    EXPECT_GT(made.cuts.size(), 500u);
    std::printf("  %s: %zu ticks, %zu cuts, field %.12s\n", name, made.forces.size(), made.cuts.size(),
                made.field_hash.c_str());
  }
}

// A bone that moved on its mount moves again, even if the recording is played on a bone without a mount. Tools start,
// feel and cut relative to where the bone then was.
TEST(Replay, MovesTheBoneAsItMoved) {
  const osteon::test::TempDir temp;
  const Case bone = block_case(16.0);
  const std::vector<PlanStep> plan{drill(HandKind::expert, {3.1, -0.2, 0}), drill(HandKind::rig, {-3.4, 2.2, 0})};
  const auto sways = [](std::uint64_t tick) {
    const double t = 1e-3 * static_cast<double>(tick);
    return Pose{Vec3(0.2 * std::sin(1.3 * t), 0.1, 0.6 * std::sin(0.7 * t + 0.3)),
                Eigen::Quaterniond(Eigen::AngleAxisd(0.01 * std::sin(0.9 * t), Vec3::UnitX()))};
  };
  const Session stood = record(bone, plan, {}, temp / "stood.h5");
  const Session made = record(bone, plan, {}, temp / "a.h5", sways);
  EXPECT_NE(made.field_hash, stood.field_hash);
  const Session again = replay(bone, plan, temp / "a.h5");
  EXPECT_EQ(again.field_hash, made.field_hash);
  EXPECT_EQ(again.cuts, made.cuts);
  EXPECT_EQ(again.forces, made.forces);
  EXPECT_GT(made.cuts.size(), 300u);
}

// An interrupted recording ends the session that plays it, and no hash of the bone is reported.
TEST(Replay, EndsWithARecordingThatWasBrokenOff) {
  const osteon::test::TempDir temp;
  const Case bone = block_case();
  const std::vector<PlanStep> plan{drill(HandKind::expert, {0.1, -0.2, 0}), drill(HandKind::expert, {3.4, 1.2, 0})};
  record(bone, plan, {}, temp / "a.h5");
  for (const double share : {0.02, 0.25, 0.6}) {
    Result<RecordedSession> session = read_recording(temp / "a.h5");
    ASSERT_TRUE(session) << session.error().message;
    const auto rows = static_cast<std::size_t>(share * static_cast<double>(session->readings.size()));
    session->readings.resize(rows);
    RecordedDevice recorded("broken off", std::move(*session));
    Bench bench(bone, plan, {std::string(recorded.name()), recorded.limits()}, recorded.session().force_scale);
    bench.session().play(recorded);
    SurgeonPhase phase{};
    for (std::size_t i = 0; i < rows; ++i) {
      ASSERT_FALSE(bench.session().done()) << share;
      phase = bench.tick().order.phase;
      bench.follow();
    }
    ASSERT_NE(phase, SurgeonPhase::retract);  // the phase passed without a hand
    EXPECT_TRUE(bench.session().done()) << share << ' ' << name(phase);
    const std::vector<StepResult>& results = bench.session().results();
    EXPECT_EQ(results[0].completed, share > 0.5);
    EXPECT_FALSE(results[1].completed);
    for (const StepResult& result : results) EXPECT_FALSE(result.gave_up) << share;
  }
}

// The hash depends on what the hand did: another hand leaves another bone.
TEST(Replay, AnotherRecordingMakesAnotherBone) {
  const osteon::test::TempDir temp;
  const Case bone = block_case();
  const std::vector<PlanStep> through{drill(HandKind::rig, {0.1, -0.2, 0})};
  std::vector<PlanStep> half = through;
  half[0].to_mm = 7;
  const Session one = record(bone, through, {}, temp / "a.h5"), other = record(bone, half, {}, temp / "b.h5");
  EXPECT_NE(one.field_hash, other.field_hash);
  EXPECT_EQ(replay(bone, half, temp / "b.h5").field_hash, other.field_hash);
}

}  // namespace
}  // namespace osteon::haptic::test
