#include "tests/support/scenes/random_cuts.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "common/core/check.hpp"

namespace osteon::test {
namespace {

constexpr double kRadius_mm = 10.0, kPitch_mm = 0.5;

struct Cutter {
  Tool tool;
  Digest hash;
  std::vector<SamplePoint> active;
};

std::vector<Cutter> all_cutters() {
  std::vector<Cutter> cutters;
  for (const Tool& tool : builtin_tools()) {
    if (!tool.cuts()) continue;
    Cutter cutter{tool, tool.hash(), {}};
    for (const SamplePoint& point : sample_points(tool, 60))
      if (point.active) cutter.active.push_back(point);
    OSTEON_CHECK(!cutter.active.empty());
    cutters.push_back(std::move(cutter));
  }
  return cutters;
}

}  // namespace

Case ball_of_bone() {
  const Vec3 corner = Vec3::Constant(kRadius_mm);
  return make_bone(
      {-corner, corner}, kPitch_mm, [](const Vec3& p) { return p.norm() - kRadius_mm; },
      [](const Vec3&) { return 1.9; });
}

std::vector<Cut> grazing_cuts(std::size_t count, Random& random) {
  const std::vector<Cutter> cutters = all_cutters();
  std::vector<Cut> cuts;
  for (std::size_t i = 0; i < count; ++i) {
    const Cutter& cutter = cutters[i % cutters.size()];
    const SamplePoint& point = cutter.active[random.index(cutter.active.size())];
    const Vec3 out = random.direction();
    const double depth = i % 200 == 7 ? random.between(1.0, 2.5) : random.between(-0.3, 0.35);
    // The tool's inward normal is along the bone's outward normal; any rotation about it.
    const Eigen::Quaterniond facing =
        Eigen::AngleAxisd(random.between(0.0, 6.283), out) * rotation_between(point.inward, out);
    const auto pose = [&](const Eigen::Quaterniond& rotation, const Vec3& contact) {
      return Pose{contact - rotation * point.position_mm, rotation};
    };
    const Vec3 contact = (kRadius_mm - depth) * out;
    // Along the surface and slightly about the contact point, as a hand moves within some milliseconds.
    const Vec3 way = random.in_cube(0.4);
    const Vec3 moved = contact + way - way.dot(out) * out;
    const Eigen::Quaterniond turned = Eigen::AngleAxisd(random.between(-0.01, 0.01), random.direction()) * facing;
    Cut cut{.author = {1 + i % 3},
            .author_seq = 1 + i / 3,
            .lease_epoch = 1,
            .body = {},
            .tool = cutter.hash,
            .level = cutter.tool.cut_level,
            .path = {quantise(pose(facing, contact))},
            .spindle_rpm = 1000};
    if (i % 8 != 0) cut.path.push_back(quantise(pose(i % 2 == 0 ? facing : turned, moved)));
    cuts.push_back(std::move(cut));
  }
  return cuts;
}

std::size_t cutting_tools() { return static_cast<std::size_t>(std::ranges::count_if(builtin_tools(), &Tool::cuts)); }

std::vector<std::size_t> order_with_repeats(std::size_t count, std::size_t repeats, Random& random) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random.index(i)]);
  for (std::size_t i = 0; i < repeats; ++i) {
    const std::size_t from = random.index(order.size()), to = from + random.index(order.size() - from) + 1;
    order.insert(order.begin() + static_cast<std::ptrdiff_t>(to), order[from]);
  }
  return order;
}

}  // namespace osteon::test
