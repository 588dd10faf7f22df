// What the benchmarks of cuts share: cuts of a haptic client (8 ms of tool path) at a pitch of 0.125 mm, and times.
#pragma once
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {

inline constexpr double kCutPitch_mm = 0.5;  // so a cut at level 2 has 0.125 mm
inline constexpr double kCutSeconds = 0.008;
using Clock = std::chrono::steady_clock;

inline double us_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

inline Tool tool_at_finest(const char* name) {
  auto tool = find_tool(name);
  OSTEON_CHECK(tool.has_value());
  OSTEON_CHECK(tool->cut_level == 2);
  return *tool;
}

// A burr half in bone that moves sideways, and a drill that goes in.
inline Cut burr_cut(const Vec3& at) {
  return straight_cut(tool_at_finest("burr-round-3.2"), at + Vec3(0, 0, -1.6), at + Vec3(15 * kCutSeconds, 0, -1.6),
                      {0, 0, -1});
}
inline Cut drill_cut(const Vec3& at) {
  return straight_cut(tool_at_finest("drill-3.5"), at + Vec3(0, 0, -6), at + Vec3(0, 0, -6 - 1 * kCutSeconds),
                      {0, 0, -1});
}

// A 3.5 mm drill with its band reaches 2.3 mm to each side and a leaf is 1 mm wide, so cuts 7 mm apart share no leaf.
// These are at least 7 mm apart, at any position relative to the leaves' faces.
inline std::vector<Cut> scattered_cuts(Cut (*cut_at)(const Vec3&), int places) {
  constexpr int kRow = 15;
  constexpr double kApart_mm = 8.0, kScatter_mm = 0.5;
  std::vector<Cut> cuts;
  Random random(5);
  for (int i = 0; i < places; ++i) {
    Vec3 scatter = random.in_cube(kScatter_mm);
    scatter.z() *= 0.25;
    cuts.push_back(cut_at(Vec3((i % kRow - 7) * kApart_mm, (i / kRow - 7) * kApart_mm, 0.0) + scatter));
  }
  return cuts;
}

// Wide enough for them.
inline const Case& wide_bone() {
  static const Case block = plain_block(120, 16, kCutPitch_mm);
  return block;
}

// Limits oneTBB's threads while it lives.
class Threads {
 public:
  explicit Threads(std::int64_t count)
      : limit_(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count)) {}

 private:
  tbb::global_control limit_;
};

struct Times {
  std::vector<double> us;
  void report(benchmark::State& state, const std::string& prefix = "") {
    std::ranges::sort(us);
    const auto at = [&](double part) {
      return us[std::min(us.size() - 1, static_cast<std::size_t>(part * static_cast<double>(us.size())))];
    };
    state.counters[prefix + "median_us"] = at(0.5);
    state.counters[prefix + "min_us"] = us.front();
    state.counters[prefix + "max_us"] = us.back();
    state.counters[prefix + "p99_us"] = at(0.99);
    state.counters[prefix + "cuts"] = static_cast<double>(us.size());
  }
};

}  // namespace osteon::test
