// One pass over many points. The loops are written once (contact_rows.inl) for registers of 4, 8 and 16 floats. The
// program chooses the processor's widest when it runs.
#include "haptic_client/contact/contact.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "common/core/check.hpp"

#if defined(__x86_64__)
#define OSTEON_WIDE_ROWS 1
#endif

#define OSTEON_INLINE static inline __attribute__((always_inline))

namespace osteon::haptic {
namespace {

// Corners for lanes without a brick.
alignas(64) constexpr float kNothing[kBrickSamples * kBrickSamples + kBrickSamples + 2] = {};

// A grid relative to the origin of the evaluation.
struct GridPlace {
  const float* const* bricks = nullptr;
  std::int32_t dims[3] = {0, 0, 0};
  float inverse_pitch = 1;
  float shift[3] = {0, 0, 0};  // samples from the grid's first one to the origin, plus a brick
};

// Sums of ContactSums, in its order. A plain struct, because the loops for wide registers must not instantiate anything
// that others share.
constexpr int kTotals = 13;
struct Totals {
  double sum[kTotals] = {};
  float nearest = kLeftOut_mm;
};

struct Task {
  int first_group, last_group;
  float rotation[9], at[3];  // pose, relative to the origin of the evaluation
  float lift, margin;
  bool density, ahead;
  float direction[3], toward[3];  // bone frame, tool frame
  float ahead_mm, most_mm, least_facing;
  const float* strength;
  GridPlace fine, coarse, dense;
  const float* clearance;
  std::int32_t clear_dims[3];
  float clear_inverse, clear_shift[3];

  [[nodiscard]] float clearance_at(float x, float y, float z) const noexcept {
    if (!clearance) return 0.0f;
    const std::int32_t i = static_cast<std::int32_t>(std::floor(x * clear_inverse + clear_shift[0]));
    const std::int32_t j = static_cast<std::int32_t>(std::floor(y * clear_inverse + clear_shift[1]));
    const std::int32_t k = static_cast<std::int32_t>(std::floor(z * clear_inverse + clear_shift[2]));
    if (i < 0 || j < 0 || k < 0 || i >= clear_dims[0] || j >= clear_dims[1] || k >= clear_dims[2]) return 0.0f;
    return clearance[(i * clear_dims[1] + j) * clear_dims[2] + k];
  }
  // Lower bound for every point of a group; zero where it is unknown.
  [[nodiscard]] float bound(const ContactSet::Ball& ball) const noexcept {
    if (!clearance) return 0.0f;
    const float(&r)[9] = rotation;
    const float x = ((ball.x * r[0] + ball.y * r[1]) + ball.z * r[2]) + at[0];
    const float y = ((ball.x * r[3] + ball.y * r[4]) + ball.z * r[5]) + at[1];
    const float z = ((ball.x * r[6] + ball.y * r[7]) + ball.z * r[8]) + at[2];
    return clearance_at(x, y, z) - ball.radius_mm - lift - (ahead ? most_mm : 0.0f);
  }
};

namespace narrow {
constexpr int kLanes = 4;
#define OSTEON_LANES 4
#include "haptic_client/contact/contact_rows.inl"
#undef OSTEON_LANES
}  // namespace narrow

#ifdef OSTEON_WIDE_ROWS
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif
namespace wide {
constexpr int kLanes = 8;
#define OSTEON_LANES 8
#include "haptic_client/contact/contact_rows.inl"
#undef OSTEON_LANES
}  // namespace wide
#if defined(__clang__)
#pragma clang attribute pop
#pragma clang attribute push(__attribute__((target("avx2,avx512f,avx512dq"))), apply_to = function)
#else
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx2,avx512f,avx512dq")
#endif
namespace widest {
constexpr int kLanes = 16;
#define OSTEON_LANES 16
#include "haptic_client/contact/contact_rows.inl"
#undef OSTEON_LANES
}  // namespace widest
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif

struct Rows {
  int lanes;
  void (*evaluate)(const ContactSet&, const Task&, ContactValues&, Totals&);
  void (*hull_distance)(const float*, const float*, const float*, int, const float* const*, float*);
};
constexpr Rows kNarrow{narrow::kLanes, narrow::evaluate, narrow::hull_distance};
#ifdef OSTEON_WIDE_ROWS
constexpr Rows kWide{wide::kLanes, wide::evaluate, wide::hull_distance};
constexpr Rows kWidest{widest::kLanes, widest::evaluate, widest::hull_distance};
#endif

const Rows* widest_rows([[maybe_unused]] int lanes) {
#ifdef OSTEON_WIDE_ROWS
  if (lanes >= 16 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return &kWidest;
  if (lanes >= 8 && __builtin_cpu_supports("avx2")) return &kWide;
#endif
  return &kNarrow;
}

std::atomic<const Rows*> chosen_rows{widest_rows(16)};

GridPlace placed(const BrickGrid& grid, const Vec3& origin_mm) noexcept {
  GridPlace place;
  const Coord dims = grid.dims(), first = grid.first();
  place.bricks = grid.tables();
  place.dims[0] = dims.x;
  place.dims[1] = dims.y;
  place.dims[2] = dims.z;
  if (!(grid.pitch_mm() > 0.0)) return place;
  place.inverse_pitch = static_cast<float>(1.0 / grid.pitch_mm());
  const std::int32_t corner[3] = {first.x, first.y, first.z};
  for (int k = 0; k < 3; ++k)
    place.shift[k] = static_cast<float>(origin_mm[k] / grid.pitch_mm() - kBrickCells * (corner[k] - 1.0));
  return place;
}

// Halves the list repeatedly across its longest side, at a multiple of a group's size. So neighbours in the list are
// near each other in space.
void order(std::span<ContactPoint> points) {
  if (points.size() <= static_cast<std::size_t>(kGroupPoints)) return;
  Box box;
  for (const ContactPoint& point : points) box.include(point.inset_mm);
  int axis = 0;
  box.size_mm().maxCoeff(&axis);
  const std::size_t groups = (points.size() + kGroupPoints - 1) / kGroupPoints,
                    middle = (groups + 1) / 2 * kGroupPoints;
  std::ranges::stable_sort(points, {}, [axis](const ContactPoint& point) { return point.inset_mm[axis]; });
  order(points.first(std::min(middle, points.size())));
  if (middle < points.size()) order(points.subspan(middle));
}

void append(ContactSet& set, const std::vector<ContactPoint>& points, double least_arm_mm) {
  for (std::size_t from = 0; from < points.size(); from += kGroupPoints) {
    Box box;
    for (std::size_t i = from; i < std::min(from + kGroupPoints, points.size()); ++i) box.include(points[i].inset_mm);
    const Vec3 centre = box.centre_mm();
    double radius = 0.0;
    for (std::size_t i = from; i < from + kGroupPoints; ++i) {
      const bool real = i < points.size();
      const ContactPoint& point = points[std::min(i, points.size() - 1)];
      set.x.push_back(static_cast<float>(point.inset_mm.x()));
      set.y.push_back(static_cast<float>(point.inset_mm.y()));
      set.z.push_back(static_cast<float>(point.inset_mm.z()));
      set.nx.push_back(static_cast<float>(point.outward.x()));
      set.ny.push_back(static_cast<float>(point.outward.y()));
      set.nz.push_back(static_cast<float>(point.outward.z()));
      set.area_mm2.push_back(real ? static_cast<float>(point.area_mm2) : 0.0f);
      set.edge.push_back(real ? static_cast<float>(point.edge) : 0.0f);
      set.arm_mm.push_back(static_cast<float>(std::max({point.axis_distance_mm, least_arm_mm, 1e-3})));
      radius = std::max(radius, (point.inset_mm - centre).norm());
    }
    set.reach_mm = std::max(set.reach_mm, centre.norm() + radius + 1e-4);
    set.balls.push_back({static_cast<float>(centre.x()), static_cast<float>(centre.y()), static_cast<float>(centre.z()),
                         static_cast<float>(radius + 1e-4)});
  }
}

}  // namespace

ContactSet contact_set(std::vector<ContactPoint>& active, std::vector<ContactPoint>& passive, double least_arm_mm) {
  order(active);
  order(passive);
  ContactSet set;
  append(set, active, least_arm_mm);
  set.active = static_cast<int>(active.size());
  set.active_groups = set.groups();
  append(set, passive, least_arm_mm);
  set.passive = static_cast<int>(passive.size());
  return set;
}

void ContactValues::make_room(int points) {
  const auto padded = static_cast<std::size_t>((points + kGroupPoints - 1) / kGroupPoints * kGroupPoints);
  for (std::vector<float>* values : {&distance_mm, &gx, &gy, &gz, &density_g_cm3})
    values->resize(std::max(values->size(), padded));
  nearest_mm.resize(std::max(nearest_mm.size(), padded / kGroupPoints));
}

ContactSums evaluate_contact(const Patch& patch, const ContactSet& set, const ContactQuery& query,
                             ContactValues& values) noexcept {
  Totals totals;
  Task task{};
  task.first_group = query.first_group;
  task.last_group = query.first_group + query.groups;
  OSTEON_CHECK(task.first_group >= 0 && task.last_group <= set.groups() &&
               values.nearest_mm.size() >= set.balls.size());
  values.covered = true;
  // Floats count from a corner near the tool, so that they are exact to a hundred-thousandth of a millimetre.
  const Vec3 origin_mm = patch.fine.pitch_mm() > 0.0
                             ? position_mm(kBrickCells * patch.fine.first(), patch.fine.pitch_mm())
                             : query.pose_bone_tool.position_mm;
  const Eigen::Matrix3d rotation = query.pose_bone_tool.rotation.toRotationMatrix();
  const Vec3 at = query.pose_bone_tool.position_mm - origin_mm, toward = rotation.transpose() * query.direction_bone;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) task.rotation[3 * i + j] = static_cast<float>(rotation(i, j));
    task.at[i] = static_cast<float>(at[i]);
    task.direction[i] = static_cast<float>(query.direction_bone[i]);
    task.toward[i] = static_cast<float>(toward[i]);
  }
  task.lift = static_cast<float>(query.lift_mm);
  task.margin = static_cast<float>(query.margin_mm);
  task.density = query.density;
  task.ahead = query.ahead;
  task.ahead_mm = static_cast<float>(query.ahead_mm);
  task.most_mm = static_cast<float>(query.most_mm);
  task.least_facing = static_cast<float>(query.least_facing);
  task.strength = query.strength ? query.strength->data() : nullptr;
  task.fine = placed(patch.fine, origin_mm);
  task.coarse = placed(patch.coarse, origin_mm);
  task.dense = placed(patch.density, origin_mm);
  const Clearance& clear = patch.clearance;
  if (!clear.mm.empty()) {
    const Coord dims = clear.cells.dims();
    task.clearance = clear.mm.data();
    task.clear_inverse = static_cast<float>(1.0 / clear.cell_mm);
    const std::int32_t first[3] = {clear.cells.min.x, clear.cells.min.y, clear.cells.min.z},
                       size[3] = {dims.x, dims.y, dims.z};
    for (int k = 0; k < 3; ++k) {
      task.clear_dims[k] = size[k];
      task.clear_shift[k] = static_cast<float>(origin_mm[k] / clear.cell_mm - first[k]);
    }
  }
  chosen_rows.load(std::memory_order_relaxed)->evaluate(set, task, values, totals);
  const double(&sum)[kTotals] = totals.sum;
  return {sum[0],
          sum[1],
          sum[2],
          sum[3],
          sum[4],
          static_cast<double>(totals.nearest),
          sum[5],
          sum[6],
          {sum[7], sum[8], sum[9]},
          {sum[10], sum[11], sum[12]}};
}

Lanes hull_distance_mm(const HullPlace& place, std::span<const HullFace> faces, const Lanes (&p)[3]) noexcept {
  Lanes distance;
  const Eigen::Matrix3f by_rows = place.rotation.transpose();  // stored by columns
  const float* const at[3] = {p[0].data(), p[1].data(), p[2].data()};
  chosen_rows.load(std::memory_order_relaxed)
      ->hull_distance(by_rows.data(), place.at.data(), faces.empty() ? nullptr : faces[0].data(),
                      static_cast<int>(faces.size()), at, distance.data());
  return distance;
}

int limit_contact_lanes(int lanes) {
  const Rows* rows = widest_rows(lanes);
  chosen_rows = rows;
  return rows->lanes;
}

}  // namespace osteon::haptic
