// Cost of undoing one cut by rebuilding the leaves that it reached, compared with applying all the others again. Takes
// the numbers of cuts and of trials, and prints JSON.
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "common/volume/cut_field.hpp"
#include "common/volume/cut_history.hpp"
#include "tests/support/scenes/known_cuts.hpp"

namespace osteon::test {
namespace {

double us_since(std::chrono::steady_clock::time_point start) {
  return 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double quantile(std::vector<double> values, double part) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

void print(const char* name, const std::vector<double>& values) {
  std::printf("\"%s_p50\": %.4f, \"%s_min\": %.4f, \"%s_max\": %.4f, ", name, quantile(values, 0.5), name,
              quantile(values, 0), name, quantile(values, 1));
}

// A bur that mills a field of 30 by 30 mm in overlapping strokes of 8 ms each, as a hand does.
std::vector<Cut> milling(const Tool& burr, std::size_t count) {
  std::vector<Cut> cuts;
  Vec3 at{-15.0, -15.0, -1.0};
  double way = 0.4;
  for (std::size_t i = 0; i < count; ++i) {
    Vec3 next = at + Vec3{way, 0.0, 0.0};
    if (std::abs(next.x()) > 15.0) {
      way = -way;
      next = at + Vec3{0.0, 1.5, 0.0};
    }
    cuts.push_back(straight_cut(burr, at, next, {0, 0, -1}, i + 1));
    at = next;
  }
  return cuts;
}

int run(std::size_t count, int trials) {
  const auto burr = nearest_tool(ToolKind::round_burr, 3.2);
  if (!burr) return 1;
  const Case bone = plain_block(40.0, 6.0, 0.5);
  const std::vector<Cut> cuts = milling(*burr, count);
  CutField field(bone, BodyId{});
  CutHistory history;
  for (std::size_t i = 0; i < count; ++i) history.add(RoomSeq{i + 1}, cuts[i], field.apply(cuts[i]).reached_leaves);
  const Digest whole = field.hash();

  Random random(9);
  std::vector<double> leaves, undo_us, again_us, ratios;
  int differing = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const std::size_t victim = random.index(count);
    const RoomSeq place{victim + 1};
    auto start = std::chrono::steady_clock::now();
    history.undo(field, std::span(&place, 1));
    undo_us.push_back(us_since(start));
    leaves.push_back(static_cast<double>(history.last_cost().leaves));

    CutField again(bone, BodyId{});
    start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < count; ++i)
      if (i != victim) again.apply(cuts[i]);
    again_us.push_back(us_since(start));
    ratios.push_back(undo_us.back() / again_us.back());
    differing += field.hash() == again.hash() ? 0 : 1;
    history.redo(field, std::span(&place, 1));
    differing += field.hash() == whole ? 0 : 1;
  }
  std::printf("{\"cuts\": %zu, \"trials\": %d, ", count, trials);
  print("leaves", leaves);
  print("undo_us", undo_us);
  print("again_us", again_us);
  print("ratio", ratios);
  std::printf("\"differing\": %d}\n", differing);
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const int cuts = argc > 1 ? std::atoi(argv[1]) : 0, trials = argc > 2 ? std::atoi(argv[2]) : 0;
  if (cuts < 1 || trials < 1) {
    std::fprintf(stderr, "osteon-undo: needs the numbers of cuts and of trials\n");
    return 1;
  }
  return osteon::test::run(static_cast<std::size_t>(cuts), trials);
}
