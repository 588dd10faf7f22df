// osteon-record-scenarios FOLDER: runs the simulated surgeon on virtual time and saves its cuts.
#include <cstdio>

#include "tests/scenario/recording.hpp"
#include "tests/unit/haptic_client/bench.hpp"

namespace {

using namespace osteon;
using namespace osteon::haptic;

std::vector<PlanStep> plan() {
  PlanStep drill;
  drill.action = Action::drill;
  drill.tool = "drill-3.2";
  drill.spindle_rpm = 1000;
  drill.hand = HandKind::expert;
  drill.entry.point_mm = Vec3(-5.0, 0.3, 0.0);
  drill.entry.axis = Vec3(0.1, 0.0, -1.0);
  PlanStep burr;
  burr.action = Action::burr;
  burr.tool = "burr-round-5";
  burr.spindle_rpm = 20000;
  burr.hand = HandKind::expert;
  burr.window_u_mm = 5.0;
  burr.window_v_mm = 3.0;
  burr.depth_mm = 0.8;
  burr.entry.point_mm = Vec3(4.0, 0.0, 0.0);
  burr.entry.axis = Vec3(0.0, 0.0, -1.0);
  return {drill, burr};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: osteon-record-scenarios FOLDER\n");
    return 2;
  }
  haptic::test::Bench bench(osteon::test::recorded_bone(), plan());
  bench.run();
  const auto written = osteon::test::write_recording(std::filesystem::path(argv[1]) / "drill_and_burr",
                                                     {bench.cuts(), bench.replica().committed().hash()});
  if (!written) {
    std::fprintf(stderr, "osteon-record-scenarios: %s\n", written.error().message.c_str());
    return 1;
  }
  std::printf("%zu cuts, field %s\n", bench.cuts().size(), to_hex(bench.replica().committed().hash()).c_str());
  return 0;
}
