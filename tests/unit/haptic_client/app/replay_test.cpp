// A recording repeats what a hand has done: the same bone to the last bit, whatever the tools and devices.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <random>

#include "common/mechanics/force_law.hpp"
#include "haptic_client/app/record_file.hpp"
#include "haptic_client/device/recorded_device.hpp"
#include "haptic_client/simulation/played_pointer.hpp"
#include "haptic_client/simulation/pointer_session.hpp"
#include "tests/support/changed_bytes.hpp"
#include "tests/support/content.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace osteon::haptic::test {
namespace {

// Through the bone, or to a depth.
PlanStep drill(HandKind hand, const Vec3& at, double to_mm = 0.0) {
  PlanStep step;
  step.action = Action::drill;
  step.tool = "drill-3.2";
  step.spindle_rpm = 1000;
  step.hand = hand;
  step.feed_mm_per_s = 3;
  step.to_mm = to_mm;
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

TickRow row_of(haptic::Session& session, const SessionTick& tick) {
  TickRow row;
  row.mono_ns = static_cast<std::int64_t>(1'000'000 * tick.report.state_seq);
  row.phase = tick.order.phase;
  row.pointer_source = tick.pointer_source;
  row.report = tick.report;
  row.reading = tick.reading;
  row.commanded_rpm = tick.commanded_rpm;
  row.rendered = {tick.report.device.force_n, tick.report.device.torque_nmm};
  row.take_up = tick.order.take_up;
  row.taken_up_at = {tick.order.hand.target_mm, tick.order.rotation};
  row.mapping = session.loop().mapping();
  return row;
}

RecordingInfo info_of(haptic::Session& session) {
  RecordingInfo info;
  info.device = session.device().name();
  info.limits = session.device().limits();
  info.loop = session.loop().params();
  for (const ToolModel& model : session.plan().tools) info.tools.push_back({model.tool.name, "", 0.0});
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
  Result<RecordFile> recording = RecordFile::create(file, info_of(bench.session()));
  EXPECT_TRUE(recording) << recording.error().message;
  Session session;
  if (mount) bench.session().loop().see_bone(mount(0));
  bench.run([&](const SessionTick& tick) {
    const TickRow row = row_of(bench.session(), tick);
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
                                   drill(HandKind::rig, {3.4, 4.2, 0}, 8.0)};
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

// The plan of a pointer's hand with two tools.
ReadyPlan pointed(const Case& bone) {
  const FreeHandOptions first{.tool = "drill-3.2", .toward = Vec3::UnitZ(), .at_mm = Vec3(0.1, -0.2, 0)};
  Result<ReadyPlan> plan = make_pointed_hand(first, bone, {*find_tool("drill-3.2"), *find_tool("burr-round-5")});
  EXPECT_TRUE(plan) << plan.error().message;
  return *plan;
}

// It rests, drills, makes the drill blunt and chooses another law for it, takes the bur, burrs while it moves, and
// leaves the bone. Without the rows of the first ticks, if some are `lost`.
Session record_pointer(const Case& bone, const std::filesystem::path& file, std::uint64_t lost = 0) {
  PointerExchange exchange;
  const SimulatedDeviceParams device{"pointer", SimulatedDeviceParams{}.limits};
  auto made = std::make_unique<PointerSession>(pointed(bone), exchange, device, 0.0);
  PointerSession& hand = *made;
  hand.loop().prepare(1);
  Bench bench(bone, std::move(made));
  Result<RecordFile> recording = RecordFile::create(file, info_of(hand));
  EXPECT_TRUE(recording) << recording.error().message;
  Session session;
  PointerCommand command{.target_mm = Vec3(0.1, -0.2, 0),
                         .rotation = pose_along(Vec3::Zero(), Vec3::UnitZ()).rotation,
                         .on_bone = true,
                         .push_n = 29.0,
                         .spindle = 1.0,
                         .empty_hand = false,
                         .source = PointerSource::pen};
  struct Act {
    int ticks, tool;
    bool push;
    Vec3 to_mm;
  };
  const Vec3 here(0.1, -0.2, 0), there(-3.2, 2.3, 0);
  for (const Act& act :
       {Act{1500, 0, false, here}, Act{2500, 0, true, here}, Act{1200, 0, false, here}, Act{1500, 1, false, there},
        Act{1500, 1, true, there + Vec3(0, 1.5, 0)}, Act{1000, 1, false, there}}) {
    for (int i = 0; i < act.ticks; ++i) {
      if (i % 50 == 0) {
        command.tool = act.tool;
        command.push = act.push;
        const bool changed = act.tool == 0 && act.push && i >= 1000;
        command.wear = changed ? 2.0 : 0.0;
        command.law = changed ? find_force_law("allotta") : nullptr;
        command.target_mm = act.push ? command.target_mm + 0.03 * (act.to_mm - command.target_mm) : act.to_mm;
        ++command.number;
        exchange.commands.store(command);
      }
      const SessionTick tick = bench.tick();
      const TickRow row = row_of(hand, tick);
      if (tick.report.state_seq > lost) {
        EXPECT_TRUE(recording->append({&row, 1}));
      }
      session.forces.push_back(tick.report.coupling.force_n);
      bench.follow();
    }
  }
  session.field_hash = to_hex(bench.replica().committed().hash());
  session.cuts = bench.cuts();
  EXPECT_TRUE(recording->finish({session.field_hash, session.cuts.size(), 0}));
  return session;
}

TEST(Replay, OfAPointerMakesTheSameCutsAndForces) {
  const osteon::test::TempDir temp;
  const Case bone = block_case();
  const Session made = record_pointer(bone, temp / "a.h5");
  EXPECT_GT(made.cuts.size(), 100u);
  EXPECT_NE(made.cuts.front().tool, made.cuts.back().tool);
  Result<std::unique_ptr<RecordedDevice>> device = make_recorded_device(temp / "a.h5");
  ASSERT_TRUE(device) << device.error().message;
  RecordedDevice& recorded = **device;
  EXPECT_TRUE(recorded.session().of_pointer());
  EXPECT_GE(recorded.session().take_ups.size(), 2u);
  for (const PointerTick& tick : recorded.session().pointer) ASSERT_EQ(tick.source, 2) << "a pen";
  Bench bench(bone, std::make_unique<PlayedPointerSession>(pointed(bone), recorded, recorded.session().force_scale));
  Session again;
  bench.run([&](const SessionTick& tick) { again.forces.push_back(tick.report.coupling.force_n); });
  EXPECT_TRUE(recorded.over());
  EXPECT_EQ(to_hex(bench.replica().committed().hash()), made.field_hash);
  EXPECT_EQ(bench.cuts(), made.cuts);
  EXPECT_EQ(again.forces, made.forces);
}

// The handle of a pointer says where it is only together with all that it did before.
TEST(Replay, OfAPointerNeedsTheFirstTickToo) {
  const osteon::test::TempDir temp;
  record_pointer(block_case(), temp / "a.h5", 1);
  const Result<RecordedSession> read = read_recording(temp / "a.h5");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::unsupported);
  EXPECT_NE(read.error().message.find("lacks some ticks"), std::string::npos) << read.error().message;
}

// HDF5 would read a damaged part again and again, without end.
TEST(Replay, OfADamagedFileIsReadOrRefused) {
  constexpr int kTrials = 60;
  const osteon::test::TempDir temp;
  record(block_case(), {drill(HandKind::rig, {0.1, -0.2, 0}, 3.0)}, {}, temp / "a.h5");
  const std::string whole = osteon::test::content(temp / "a.h5");
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < kTrials; ++i) {
    const auto file = temp / "damaged.h5";
    std::ofstream(file, std::ios::binary) << osteon::test::changed_bytes(whole, random, 30000);
    const Result<RecordedSession> read = read_recording(file);
    if (read) continue;
    ++refused;
    EXPECT_NE(read.error().message.find("damaged.h5"), std::string::npos) << read.error().message;
  }
  EXPECT_GT(refused, kTrials / 10);
  EXPECT_LT(refused, kTrials);
}

// A bone that moved on its mount moves again, even if the recording is played on a bone without a mount. Tools start,
// feel and cut relative to where the bone then was.
TEST(Replay, MovesTheBoneAsItMoved) {
  const osteon::test::TempDir temp;
  const Case bone = block_case(16.0);
  const std::vector<PlanStep> plan{drill(HandKind::expert, {3.1, -0.2, 0}, 4.0),
                                   drill(HandKind::rig, {-3.4, 2.2, 0}, 4.0)};
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
  const std::vector<PlanStep> plan{drill(HandKind::expert, {0.1, -0.2, 0}, 8.0),
                                   drill(HandKind::expert, {3.4, 1.2, 0}, 8.0)};
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
  const std::vector<PlanStep> deep{drill(HandKind::rig, {0.1, -0.2, 0}, 4.0)};
  std::vector<PlanStep> half = deep;
  half[0].to_mm = 2;
  const Session one = record(bone, deep, {}, temp / "a.h5"), other = record(bone, half, {}, temp / "b.h5");
  EXPECT_NE(one.field_hash, other.field_hash);
  EXPECT_EQ(replay(bone, half, temp / "b.h5").field_hash, other.field_hash);
}

}  // namespace
}  // namespace osteon::haptic::test
