// osteon-mount TICKS: two users push a bone on its compliant mount against each other, for TICKS each. Their
// connections have 0, 50 and 150 ms, or 0 ms for one user and 150 ms for the other, with jitter and loss. Virtual time:
// the same numbers on every machine. Prints JSON.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "tests/support/mount/two_users.hpp"

namespace {

using osteon::test::push_each_other;
using osteon::test::TwoUsersResult;
using osteon::test::TwoUsersRun;

struct Line {
  const char* name;
  double delay_ms[2];
};
constexpr Line kLines[] = {{"0", {0, 0}}, {"50", {50, 50}}, {"150", {150, 150}}, {"0_and_150", {0, 150}}};

TwoUsersRun over(const Line& line, long ticks) {
  TwoUsersRun run;
  run.ticks = ticks;
  run.delay_ms[0] = line.delay_ms[0];
  run.delay_ms[1] = line.delay_ms[1];
  run.jitter_ms = line.delay_ms[1] > 0.0 ? 30.0 : 0.0;
  run.loss = line.delay_ms[1] > 0.0 ? 0.3 : 0.0;
  return run;
}

void print(const char* kind, const Line& line, const TwoUsersRun& run, bool first) {
  const TwoUsersResult r = push_each_other(run);
  std::fprintf(stderr, "# %s, %s ms: %d rests, worst %.2f %%, %.3f mJ made\n", kind, line.name, r.rests,
               100.0 * r.worst_error, r.most_created_mj);
  std::printf(
      "%s{\"kind\": \"%s\", \"line_ms\": \"%s\", \"ticks\": %ld, \"rests\": %d, \"worst_percent\": %.4f, "
      "\"mean_percent\": %.4f, "
      "\"least_other_n\": %.3f, \"made_mj\": %.6f, \"allowance_mj\": %.6g, \"force_n\": %.3f, \"growth\": %.4f, "
      "\"held_back\": %ld, \"put_in_mj\": %.3f, \"released_mj\": %.3f, \"account_mj\": %.9f, \"low_pass_s\": %.3f}",
      first ? "" : ", ", kind, line.name, run.ticks, r.rests, 100.0 * r.worst_error, 100.0 * r.mean_error,
      r.rests > 0 ? r.least_other_n : 0.0, r.most_created_mj, 2.0 * run.client.allowance_mj, r.most_force_n[1],
      r.most_force_n[1] / r.most_force_n[0], r.held_back, r.put_in_mj, r.released_mj, r.account_difference_mj,
      r.slowest_low_pass_s);
}

}  // namespace

int main(int argc, char** argv) {
  const long ticks = argc > 1 ? std::atol(argv[1]) : 0;
  if (ticks < 40'000 || ticks > 100'000'000) {
    std::fprintf(stderr, "osteon-mount: needs the number of ticks of each line, 40000 to 100000000\n");
    return 1;
  }
  std::printf("{\"runs\": [");
  for (const Line& line : kLines) {
    TwoUsersRun run = over(line, ticks);
    print("push", line, run, &line == kLines);
    // Hands that never rest and are three times as stiff.
    run.shaken = true;
    print("shake", line, run, false);
    run.hand_stiffness = 3.0;
    print("stiff", line, run, false);
    // The same without the controller: an account that is always full.
    run.ticks = std::min(run.ticks, 200'000L);
    run.client.allowance_mj = run.client.reserve_mj = 1e9;
    print("uncontrolled", line, run, false);
  }
  std::printf("]}\n");
  return 0;
}
