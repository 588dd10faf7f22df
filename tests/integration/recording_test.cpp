// Tests recordings of the real haptic client: a complete one, one of a killed process, one on a full disk, and one
// played again in another room.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <thread>

#include "tests/integration/stage.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

class RecordedRoom : public testing::Test {
 protected:
  // Arguments for a haptic client that drills quickly through the block at a position.
  std::vector<std::string> arguments(const Stage& stage, const std::string& name, double x_mm) {
    json step = drill_at(x_mm, 0.0, "rig");
    step["feed_mm_per_s"] = 4.0;
    const auto plan = stage / (name + "-plan.json");
    std::ofstream(plan) << json{{"steps", json::array({step})}};
    return {"--server",
            stage.address(),
            "--plain",
            "--plan",
            plan,
            "--summary",
            stage / (name + ".json"),
            "--cache",
            stage / "cache",
            "--record",
            stage / (name + ".h5")};
  }
  // Result of a Python expression on a recording `f`, as JSON.
  static json ask(const std::filesystem::path& file, const std::string& expression) {
    const RunResult answer =
        run(OSTEON_PYTHON, {"-c",
                            "import sys, json, h5py, numpy as np\nf = h5py.File(sys.argv[1], 'r', swmr=True)\n"
                            "n = len(f['data/time'])\nprint(json.dumps(" +
                                expression + "))",
                            file});
    EXPECT_EQ(answer.exit_code, 0) << answer.err;
    const json result = json::parse(answer.out, nullptr, false);
    EXPECT_FALSE(result.is_discarded()) << expression << " is " << answer.out;
    return result;
  }
};

TEST_F(RecordedRoom, HoldsEveryTickAndIsPlayedAgainInAnotherRoom) {
  Stage stage(24.0);
  Process haptic = stage.start("osteon-haptic", arguments(stage, "made", 0.0));
  ASSERT_EQ(haptic.wait(120s), 0) << haptic.err();
  const json summary = read_json(stage / "made.json");
  const auto file = stage / "made.h5";
  EXPECT_EQ(ask(file, "n"), summary["loop"]["ticks"]);
  EXPECT_EQ(summary["recording"]["rows"], summary["loop"]["ticks"]);
  EXPECT_EQ(summary["recording"]["trouble"], "");
  EXPECT_EQ(ask(file, "f['metadata/field_hash'][()].decode()"), summary["field_hash"]);
  EXPECT_EQ(ask(file, "int(f['metadata/finished'][()])"), 1);
  EXPECT_EQ(ask(file, "f['metadata'].attrs['device']"), "simulated");
  EXPECT_EQ(ask(file, "f['metadata/tools'][0].decode()"), "drill-3.2");
  // The ticks' own clock shows 1 kHz, even if the machine was delayed.
  EXPECT_NEAR(ask(file, "float(np.median(np.diff(f['data/time'][:])))").get<double>(), 1e-3, 5e-5);
  // Chi (7.3) at 1000 rpm in the far cortex, along the tool's axis. On a busy machine a patch may be late, and the tool
  // then rebounds and has another feed. So each tick is compared at its own feed.
  const double thrust_n_at_1 = 134.6 * std::pow(1000.0, -0.3327) * std::pow(1.9, 1.1841);
  const std::string far = "[(f['data/depth'][:] > 26.5) & (f['data/depth'][:] < 29.5) & (f['data/feed'][:] > 2.0)]";
  EXPECT_NEAR(ask(file, "float(np.median(np.linalg.norm(f['drill_force_physical/wrench'][:, :3], axis=1)" + far +
                            " / f['data/feed'][:]" + far + "**0.5189))")
                  .get<double>(),
              thrust_n_at_1, 0.06 * thrust_n_at_1);
  EXPECT_EQ(stage.server().terminate(), 0);

  stage.start_server({"--plain"});
  std::vector<std::string> again = arguments(stage, "again", 0.0);
  again.insert(again.end(), {"--device", "recorded:" + file.string()});
  Process replay = stage.start("osteon-haptic", again);
  ASSERT_EQ(replay.wait(120s), 0) << replay.err();
  const json replayed = read_json(stage / "again.json");
  // The handle is the same tick by tick. Real threads deliver the patches, so cuts agree in size but not bit by bit.
  EXPECT_EQ(ask(stage / "again.h5", "int((f['high_frequency_poses/handle_pose/pose'][:n] == h5py.File('" +
                                        file.string() + "', 'r')['high_frequency_poses/handle_pose/pose'][:n]).all())"),
            1);
  EXPECT_NEAR(replayed["removed_mm3"].get<double>(), summary["removed_mm3"].get<double>(),
              0.01 * summary["removed_mm3"].get<double>());
  EXPECT_GT(summary["removed_mm3"].get<double>(), 200.0);

  // That room's bone is already cut, so the handle would go through the existing hole.
  EXPECT_EQ(ask(stage / "again.h5", "f['metadata/field_hash_at_start'][()].decode()"),
            ask(file, "f['metadata/field_hash_at_start'][()].decode()"));
  std::vector<std::string> third = arguments(stage, "third", 0.0);
  third.insert(third.end(), {"--device", "recorded:" + file.string()});
  Process refused = stage.start("osteon-haptic", third);
  ASSERT_EQ(refused.wait(60s), 1) << refused.out();
  EXPECT_THAT(refused.err(), testing::HasSubstr("made.h5 began on bone in another state"));
  EXPECT_EQ(read_json(stage / "third.json")["cuts"], 0);
}

TEST_F(RecordedRoom, OfAKilledClientCanBeReadAndPlayedToWhereItEnds) {
  Stage stage(24.0);
  Process haptic = stage.start("osteon-haptic", arguments(stage, "killed", 0.0));
  ASSERT_TRUE(wait_for_file(stage / "killed.h5", 60s));
  std::this_thread::sleep_for(5s);
  ASSERT_TRUE(haptic.running());
  haptic.signal(SIGKILL);
  ASSERT_EQ(haptic.wait(10s), 128 + SIGKILL);
  const auto file = stage / "killed.h5";
  EXPECT_GE(ask(file, "n").get<int>(), 3000);
  EXPECT_EQ(ask(file, "n % 500"), 0);
  EXPECT_EQ(ask(file, "int(f['metadata/finished'][()])"), 0);
  EXPECT_EQ(ask(file, "int((f['data/state_seq'][:n] == np.arange(1, n + 1)).all())"), 1);
  EXPECT_EQ(ask(file, "int((f['data/state'][:n] == h5py.check_enum_dtype(f['data/state'].dtype)['cutting']).any())"),
            1);
  EXPECT_EQ(stage.server().terminate(), 0);

  stage.start_server({"--plain"});
  std::vector<std::string> again = arguments(stage, "again", 0.0);
  again.insert(again.end(), {"--device", "recorded:" + file.string()});
  Process replay = stage.start("osteon-haptic", again);
  ASSERT_EQ(replay.wait(60s), 1) << replay.out();
  EXPECT_THAT(replay.err(), testing::HasSubstr("step 1 (drill) did not finish: the recording ends here"));
  const json summary = read_json(stage / "again.json");
  EXPECT_EQ(summary["steps"][0]["completed"], false);
  EXPECT_GT(summary["cuts"].get<int>(), 0);
  EXPECT_EQ(summary["loop"]["ticks"], ask(file, "n"));
}

// Whoever plays or plots it later can see that it did not end normally.
TEST_F(RecordedRoom, OfALostRoomSaysThatItDidNotEndAsItShould) {
  Stage stage(24.0);
  Process haptic = stage.start("osteon-haptic", arguments(stage, "lost", 0.0));
  ASSERT_TRUE(wait_for_file(stage / "lost.h5", 60s));
  std::this_thread::sleep_for(4s);
  ASSERT_TRUE(haptic.running());
  stage.server().signal(SIGKILL);
  ASSERT_EQ(haptic.wait(30s), 1);
  EXPECT_THAT(haptic.err(), testing::HasSubstr("see whether osteon-server still runs"));
  const auto file = stage / "lost.h5";
  EXPECT_EQ(ask(file, "int(f['metadata/finished'][()])"), 0);
  const json summary = read_json(stage / "lost.json");
  ASSERT_TRUE(summary.is_object());
  EXPECT_THAT(haptic.err(), testing::HasSubstr(summary["lost"].get<std::string>()));
  EXPECT_EQ(ask(file, "n"), summary["recording"]["rows"]);
  EXPECT_GT(summary["cuts"].get<int>(), 0);
}

TEST_F(RecordedRoom, OnAFullDiskTheSessionGoesOn) {
  const Stage stage(24.0);
  // The case is fetched first, while files may still be large.
  std::ofstream(stage / "wait.json") << json{{"steps", json::array({{{"action", "wait"}, {"seconds", 0.1}}})}};
  Process first = stage.start("osteon-haptic", {"--server", stage.address(), "--plain", "--plan", stage / "wait.json",
                                                "--cache", stage / "cache"});
  ASSERT_EQ(first.wait(60s), 0) << first.err();
  // Files may not grow beyond 400 kB. The signal of this limit is ignored, so writing fails as on a full disk.
  const std::string command = "trap '' XFSZ; ulimit -f 800; exec \"$@\"";
  std::vector<std::string> all{"-c", command, "sh", program("osteon-haptic"), "--plain"};
  const std::vector<std::string> given = arguments(stage, "full", 0.0);
  all.insert(all.end(), given.begin(), given.end());
  Process haptic("/bin/sh", all);
  ASSERT_EQ(haptic.wait(120s), 0) << haptic.err();
  const json summary = read_json(stage / "full.json");
  EXPECT_THAT(summary["recording"]["trouble"].get<std::string>(), testing::HasSubstr("the disk is full"));
  EXPECT_THAT(haptic.err(), testing::HasSubstr("the session continues"));
  EXPECT_EQ(summary["steps"][0]["completed"], true);
  EXPECT_EQ(ask(stage / "full.h5", "n"), summary["recording"]["rows"]);
  EXPECT_GE(summary["recording"]["rows"].get<int>(), 500);
  EXPECT_LT(summary["recording"]["rows"].get<int>(), summary["loop"]["ticks"].get<int>());
}

TEST_F(RecordedRoom, APlaceThatCannotBeWrittenOrReadIsSaidAtOnce) {
  const TempDir temp;
  std::ofstream(temp / "plan.json") << json{{"steps", json::array({{{"action", "wait"}, {"seconds", 0.1}}})}};
  const auto said = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all{"--server", "127.0.0.1:1", "--plain", "--plan", temp / "plan.json"};
    all.insert(all.end(), more.begin(), more.end());
    const RunResult result = run(program("osteon-haptic"), all, 20s);
    EXPECT_EQ(result.exit_code, 1);
    return result.err;
  };
  EXPECT_THAT(said({"--record", "/nowhere/at/all.h5"}), testing::HasSubstr("--record"));
  EXPECT_THAT(said({"--device", "recorded:" + (temp / "none.h5").string()}), testing::HasSubstr("there is no file"));
}

}  // namespace
}  // namespace osteon::test
