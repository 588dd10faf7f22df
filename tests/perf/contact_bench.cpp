// One collision and force evaluation of a tool of 4096 points with density, compared with the dense baseline
// (tests/perf/baselines) and with OpenVDB's sampler and central differences. A bur is half immersed in bone that it has
// cut. Points, poses and sums are the same, and all take turns, with warm and with cold caches. The ratio is that of
// the fastest of the others over ours. Prints JSON.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "common/field/kernel.hpp"
#include "haptic_client/contact/contact.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "tests/perf/baselines/contact_input.hpp"
#include "tests/perf/cold_caches.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::haptic::test {
namespace {

constexpr double kPitch_mm = 0.5;
constexpr int kPoints = 4096, kPoses = 16, kRounds = 60;
using Clock = std::chrono::steady_clock;

struct Sums {
  double engaged = 0, density = 0, milling = 0;
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
};

// The same evaluation with any kind of sampler.
template <class Solid, class Density>
Sums by_samplers(const std::vector<ContactPoint>& points, const ContactQuery& query, double step_mm,
                 const DensityTable& strength, double least_arm_mm, const Solid& solid, const Density& density,
                 std::vector<double>& distances) {
  Sums sums;
  const Vec3 toward = query.pose_bone_tool.rotation.conjugate() * query.direction_bone;
  const Eigen::Matrix3d turn = query.pose_bone_tool.rotation.toRotationMatrix();
  Vec3 gradients = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ContactPoint& point = points[i];
    const double facing = point.outward.dot(toward);
    distances[i] = static_cast<double>(kLeftOut_mm);
    if (facing < query.least_facing) continue;
    const Vec3 tool_mm = point.inset_mm + query.lift_mm * point.outward;
    const Vec3 p = turn * tool_mm + query.pose_bone_tool.position_mm +
                   std::min(query.ahead_mm / facing, query.most_mm) * query.direction_bone;
    const auto at = [&](double x, double y, double z) {
      return static_cast<double>(solid.wsSample(openvdb::Vec3d(x, y, z)));
    };
    const double distance = at(p.x(), p.y(), p.z());
    gradients += Vec3(at(p.x() + step_mm, p.y(), p.z()) - at(p.x() - step_mm, p.y(), p.z()),
                      at(p.x(), p.y() + step_mm, p.z()) - at(p.x(), p.y() - step_mm, p.z()),
                      at(p.x(), p.y(), p.z() + step_mm) - at(p.x(), p.y(), p.z() - step_mm));
    distances[i] = distance;
    if (distance >= 0.0) continue;
    const auto rho = static_cast<double>(density.wsSample(openvdb::Vec3d(p.x(), p.y(), p.z())));
    const double area = point.area_mm2 * facing, arm = std::max(point.axis_distance_mm, least_arm_mm);
    const double s = std::min(rho, kMostDensity_g_cm3) * (kDensitySteps / kMostDensity_g_cm3);
    const auto below = static_cast<std::size_t>(s);
    sums.engaged += area;
    sums.density += area * rho;
    sums.milling += area / arm *
                    (static_cast<double>(strength[below]) +
                     (s - static_cast<double>(below)) * static_cast<double>(strength[below + 1] - strength[below]));
    const Vec3 push = -area * rho * point.outward;
    sums.force += push;
    sums.torque += tool_mm.cross(push);
  }
  if (!(gradients.norm() >= 0.0)) std::abort();  // prevents that they are optimised away
  return sums;
}

template <class Call>
double us_of(Call call) {
  const auto began = Clock::now();
  call();
  return 1e6 * std::chrono::duration<double>(Clock::now() - began).count();
}

// Calls once to warm the caches, then five times. Returns the third time.
template <class Call>
double hot(std::vector<double>& times, Call call) {
  call();
  for (int i = 0; i < 5; ++i) times.push_back(us_of(call));
  return times[times.size() - 3];
}

double apart(const Vec3& theirs, const Vec3& ours) { return (theirs - ours).norm() / theirs.norm(); }

void print(const char* name, std::vector<double> values) {
  std::ranges::sort(values);
  std::printf("\"%s_p50\": %.4f, \"%s_min\": %.4f, \"%s_max\": %.4f, ", name, values[values.size() / 2], name,
              values.front(), name, values.back());
}

int run() {
  openvdb::initialize();
  const Tool tool = *find_tool("burr-round");
  const CutField start(osteon::test::plain_block(40.0, 12.0, kPitch_mm), {});
  CutField field(start.bone(), {});
  // A groove that the bur has made, half as deep as it is wide. The bur is at its end.
  field.apply(osteon::test::straight_cut(tool, {-12, 0, -3}, {0, 0, -3}, -Vec3::UnitZ()));

  ToolModel model(tool, kPitch_mm, 1.0, kPoints);
  std::vector<ContactPoint> points, none;
  for (std::size_t i = 0; i < kPoints; ++i) points.push_back(model.active[i * model.active.size() / kPoints]);
  const double least_arm_mm = 0.15 * 0.5 * tool.diameter_mm;
  const ContactSet set = contact_set(points, none, least_arm_mm);

  std::vector<ContactQuery> queries;
  for (int i = 0; i < kPoses; ++i) {
    ContactQuery query;
    const double turn = 0.05 * i;
    query.pose_bone_tool = {
        {0.02 * i, 0.01 * std::sin(turn), -3.0 + 0.005 * i},
        Eigen::Quaterniond(Eigen::AngleAxisd(turn, Vec3::UnitZ())) * pose_along(Vec3::Zero(), -Vec3::UnitZ()).rotation};
    query.groups = set.groups();
    query.density = query.ahead = true;
    query.direction_bone = Vec3(1, 0, -0.3).normalized();
    query.ahead_mm = model.inset + 0.25 * model.fine_pitch_mm;
    query.most_mm = 2.0 * model.fine_pitch_mm;
    query.least_facing = -1.0;  // every point is evaluated
    query.strength = &model.strength;
    // Each point looks a quarter pitch ahead of its own face, where the groove's walls are. Points that face backwards
    // must not be moved along the direction.
    query.lift_mm = query.ahead_mm;
    query.ahead_mm = 0.0;
    queries.push_back(query);
  }
  Patch patch;
  PatchBuilder().build(field, model, queries[kPoses / 2].pose_bone_tool, patch);
  ContactValues values;
  values.make_room(kPoints);

  // The same field for OpenVDB: f at the tool's pitch round the tool, and density at h.
  openvdb::FloatGrid::Ptr solid = openvdb::FloatGrid::create(static_cast<float>(kBandVoxels * kPitch_mm)),
                          density = openvdb::FloatGrid::create(0.0f);
  solid->setTransform(openvdb::math::Transform::createLinearTransform(model.fine_pitch_mm));
  density->setTransform(openvdb::math::Transform::createLinearTransform(kPitch_mm));
  const auto fill = [](openvdb::FloatGrid& grid, const CoordBox& box, const std::vector<float>& samples) {
    auto accessor = grid.getAccessor();
    std::size_t i = 0;
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) accessor.setValue(openvdb::Coord(x, y, z), samples[i++]);
  };
  const auto samples_of = [](const CoordBox& box) {
    const Coord d = box.dims();
    return std::vector<float>(static_cast<std::size_t>(d.x) * static_cast<std::size_t>(d.y) *
                              static_cast<std::size_t>(d.z));
  };
  const CoordBox fine{{-40, -40, -48}, {44, 40, 48}}, coarse{{-12, -12, -14}, {13, 12, 14}};
  std::vector<float> samples = samples_of(fine);
  field.gather_solid(model.cut_level, fine, samples);
  fill(*solid, fine, samples);
  samples = samples_of(coarse);
  field.bone().gather_density(coarse, samples);
  fill(*density, coarse, samples);
  using Accessor = openvdb::FloatGrid::ConstAccessor;
  const Accessor solid_accessor = solid->getConstAccessor(), density_accessor = density->getConstAccessor();
  const openvdb::tools::GridSampler<Accessor, openvdb::tools::BoxSampler> fast(solid_accessor, solid->transform()),
      fast_density(density_accessor, density->transform());
  const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> plain(*solid),
      plain_density(*density);

  const baselines::PointArrays arrays = baselines::point_arrays(set);
  const baselines::DenseGrid dense_solid = baselines::dense_solid(field, model.cut_level, fine),
                             dense_density = baselines::dense_density(field.bone(), coarse);
  baselines::PointValues dense_values = baselines::room_for(arrays);

  std::vector<double> ours, dense, accessor, tree, cold_ours, cold_dense, cold_accessor, ratios, cold_ratios,
      distances(kPoints);
  double worst_mm = 0.0, worst_sum = 0.0;
  int touching = 0, compared = 0;
  for (int round = 0; round < kRounds; ++round) {
    const ContactQuery& query = queries[static_cast<std::size_t>(round % kPoses)];
    ContactSums sums;
    Sums theirs;
    baselines::ContactTotals totals;
    const auto by_ours = [&] { sums = evaluate_contact(patch, set, query, values); };
    const auto by_dense = [&] {
      totals =
          baselines::dense_contact(dense_solid, dense_density, arrays, baselines::contact_task(query), dense_values);
    };
    const auto by_accessor = [&] {
      theirs =
          by_samplers(points, query, model.fine_pitch_mm, model.strength, least_arm_mm, fast, fast_density, distances);
    };
    const auto cold = [](std::vector<double>& times, auto call) {
      osteon::test::flush_caches();
      times.push_back(us_of(call));
    };
    // Hot: the caches hold the bone, as in a loop that does almost nothing else every millisecond.
    const double mine = hot(ours, by_ours), by_array = hot(dense, by_dense);
    accessor.push_back(us_of(by_accessor));
    ratios.push_back(std::min(by_array, accessor.back()) / mine);
    cold(cold_ours, by_ours);
    cold(cold_dense, by_dense);
    cold(cold_accessor, by_accessor);
    cold_ratios.push_back(std::min(cold_dense.back(), cold_accessor.back()) / cold_ours.back());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (std::abs(distances[i]) > 0.4) continue;  // beyond this, samples are clipped differently
      const auto value = static_cast<double>(values.distance_mm[i]);
      worst_mm = std::max({worst_mm, std::abs(distances[i] - value),
                           std::abs(static_cast<double>(dense_values.distance_mm[i]) - value)});
      ++compared;
    }
    touching += static_cast<int>(std::ranges::count_if(distances, [](double d) { return d < 0.0; }));
    const auto vector = [](const std::array<float, 3>& v) { return Vec3(v[0], v[1], v[2]); };
    worst_sum = std::max({worst_sum, apart(theirs.force, sums.force), apart(theirs.torque, sums.torque),
                          apart(vector(totals.force), sums.force), apart(vector(totals.torque), sums.torque)});
    tree.push_back(us_of([&] {
      by_samplers(points, query, model.fine_pitch_mm, model.strength, least_arm_mm, plain, plain_density, distances);
    }));
  }
  const int lanes = limit_contact_lanes(16);
  std::printf("{\"points\": %d, \"lanes\": %d, \"in_bone\": %.4f, ", kPoints, lanes,
              static_cast<double>(touching) / (kRounds * kPoints));
  print("contact_us", ours);
  print("dense_us", dense);
  print("accessor_us", accessor);
  print("tree_us", tree);
  print("speedup", ratios);
  print("cold_contact_us", cold_ours);
  print("cold_dense_us", cold_dense);
  print("cold_accessor_us", cold_accessor);
  print("cold_speedup", cold_ratios);
  std::printf("\"compared\": %d, \"largest_difference_mm\": %.3g, \"largest_force_difference\": %.3g}\n", compared,
              worst_mm, worst_sum);
  return 0;
}

}  // namespace
}  // namespace osteon::haptic::test

int main() { return osteon::haptic::test::run(); }
