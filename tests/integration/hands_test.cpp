// Two hands of one room as processes: where their tools touch both feel it. Judged by what each program recorded, on the
// clock of the machine that all of them share.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <vector>

#include "tests/integration/stage.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

Process start_hand(const Stage& stage, const std::string& name, const json& steps) {
  std::ofstream(stage / (name + "-plan.json")) << json{{"steps", steps}};
  return stage.start("osteon-haptic",
                     {"--server", stage.address(), "--name", name, "--plan", stage / (name + "-plan.json"), "--summary",
                      stage / (name + ".json"), "--record", stage / (name + ".h5"), "--cache", stage / "cache"});
}

// Every 10th millisecond of a recording.
struct Moment {
  double time_ms, x_mm, y_mm, z_mm;  // of the tool as the hand holds it, bone frame
  double force_x_n, force_y_n;       // shown, less the motor's, bone frame
  bool touched, led;
};
std::vector<Moment> recorded(const std::filesystem::path& file) {
  const RunResult answer =
      run(OSTEON_PYTHON,
          {"-c",
           "import sys, json, h5py, numpy as np\n"
           "f = h5py.File(sys.argv[1], 'r')\n"
           "n = len(f['data/time'])\n"
           "bits = [b.decode() if isinstance(b, bytes) else b for b in f['metadata/event_bits'][:]]\n"
           "events = f['data/events'][:n]\n"
           "bit = lambda name: (events >> bits.index(name)) & 1\n"
           "x, y, z, w = f['burr_change/view'][-1]\n"
           "turn = np.array([[1-2*(y*y+z*z), 2*(x*y-w*z), 2*(x*z+w*y)], [2*(x*y+w*z), 1-2*(x*x+z*z), 2*(y*z-w*x)],"
           " [2*(x*z-w*y), 2*(y*z+w*x), 1-2*(x*x+y*y)]])\n"
           "force = (f['drill_force_feedback/wrench'][:n, :3] - f['drill_force_feedback/motor_force'][:n]) @ turn.T\n"
           "rows = np.column_stack([f['data/mono_ns'][:n] / 1e6, f['high_frequency_poses/device_pose/pose'][:n, :3], "
           "force[:, :2],"
           " bit('partner touched'), bit('hand guided')])\n"
           "print(json.dumps(rows[::10].tolist()))\n",
           file},
          60s);
  EXPECT_EQ(answer.exit_code, 0) << answer.err;
  std::vector<Moment> moments;
  for (const json& row : json::parse(answer.out, nullptr, false))
    moments.push_back({row[0], row[1], row[2], row[3], row[4], row[5], row[6] != 0.0, row[7] != 0.0});
  return moments;
}

struct Touches {
  int count = 0;
  double force_x_n = 0;  // mean
};
Touches touches_of(const std::vector<Moment>& hand) {
  Touches touches;
  for (const Moment& moment : hand)
    if (moment.touched) ++touches.count, touches.force_x_n += moment.force_x_n;
  if (touches.count > 0) touches.force_x_n /= touches.count;
  return touches;
}

TEST(Hands, WhoseToolsTouchBothFeelIt) {
  Stage stage(40.0);
  // Drills of 3.2 mm, side by side into the same bone, 2.6 mm between their axes; and one that is far from both.
  constexpr double kDiameter_mm = 3.2;
  Process left = start_hand(stage, "left", json::array({drill_at(-1.3, 0, "rig")}));
  Process right = start_hand(stage, "right", json::array({drill_at(1.3, 0, "rig")}));
  Process far = start_hand(stage, "far", json::array({drill_at(0, 14, "rig")}));
  for (Process* hand : {&left, &right, &far}) {
    const auto code = hand->wait(150s);
    ASSERT_TRUE(code.has_value());
    EXPECT_LE(*code, 1) << hand->err();  // 1: a drill that is pushed aside may not come to its end
  }
  ASSERT_EQ(stage.server().terminate(), 0) << stage.server().err();

  const std::vector<Moment> of_left = recorded(stage / "left.h5"), of_right = recorded(stage / "right.h5");
  const Touches felt_left = touches_of(of_left), felt_right = touches_of(of_right);
  std::printf("left: %d moments, %.2f N; right: %d moments, %.2f N\n", felt_left.count, felt_left.force_x_n,
              felt_right.count, felt_right.force_x_n);
  EXPECT_GT(felt_left.count, 50) << "half a second";
  EXPECT_GT(felt_right.count, 50);
  EXPECT_EQ(touches_of(recorded(stage / "far.h5")).count, 0);
  // Wherever one felt it, the other's tool was there, by the other's own recording.
  std::map<long, const Moment*> others;
  for (const Moment& moment : of_right) others[std::lround(moment.time_ms / 10.0)] = &moment;
  int there = 0, compared = 0;
  for (const Moment& moment : of_left) {
    const auto other = others.find(std::lround(moment.time_ms / 10.0));
    if (!moment.touched || other == others.end()) continue;
    ++compared;
    there += std::hypot(moment.x_mm - other->second->x_mm, moment.y_mm - other->second->y_mm) < kDiameter_mm + 0.3;
  }
  EXPECT_GT(compared, 25);
  EXPECT_GE(there, compared * 9 / 10) << "of " << compared;
  // Each is pushed away from the other, though the walls of the holes take most of it.
  EXPECT_LT(felt_left.force_x_n, 0.0);
  EXPECT_GT(felt_right.force_x_n, 0.0);
}

}  // namespace
}  // namespace osteon::test
