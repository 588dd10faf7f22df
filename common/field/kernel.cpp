// The replicated arithmetic. Everything here must give the same bytes on every compiler and processor. It uses only +
// − × ÷ and square roots (correctly rounded by IEEE 754), comparisons, and conversions of in-range numbers to
// integers. The loops over samples are written once (kernel_rows.inl) for registers of 4, 8 and 16 floats. At run time
// the widest that the processor has is chosen. Each width gives the same bytes.
#include "common/field/kernel.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>

#include "common/core/check.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#define OSTEON_WIDE_ROWS 1
#endif

#define OSTEON_INLINE static inline __attribute__((always_inline))
#define OSTEON_INLINE_LAMBDA __attribute__((always_inline))

namespace osteon {
namespace {

constexpr std::size_t kMostOutlineEdges = kMostProfileCorners + 2;
constexpr std::size_t kMostSweptPlanes = kMostHullPlanes + (kMostHullPlanes / 2) * (kMostHullPlanes / 2);

namespace narrow {
constexpr int kLanes = 4;
#define OSTEON_LANES 4
#include "common/field/kernel_rows.inl"
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
#include "common/field/kernel_rows.inl"
#undef OSTEON_LANES
}  // namespace wide
#if defined(__clang__)
#pragma clang attribute pop
#pragma clang attribute push(__attribute__((target("avx2,avx512f"))), apply_to = function)
#else
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx2,avx512f")
#endif
namespace widest {
constexpr int kLanes = 16;
#define OSTEON_LANES 16
#include "common/field/kernel_rows.inl"
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
  decltype(&narrow::middles) middles;
  decltype(&narrow::point_distance) point_distance;
  decltype(&narrow::highest) highest;
  decltype(&narrow::evaluate) evaluate;
  decltype(&narrow::take_lower) take_lower;
};

#define OSTEON_ROWS(name) \
  { name::kLanes, name::middles, name::point_distance, name::highest, name::evaluate, name::take_lower }
constexpr Rows kNarrow = OSTEON_ROWS(narrow);
#ifdef OSTEON_WIDE_ROWS
constexpr Rows kWide = OSTEON_ROWS(wide);
constexpr Rows kWidest = OSTEON_ROWS(widest);
#endif

const Rows* widest_rows([[maybe_unused]] int lanes) {
#ifdef OSTEON_WIDE_ROWS
  if (lanes >= 16 && __builtin_cpu_supports("avx512f")) return &kWidest;
  if (lanes >= 8 && __builtin_cpu_supports("avx2")) return &kWide;
#endif
  return &kNarrow;
}

std::atomic<const Rows*>& chosen_rows() {
  static std::atomic<const Rows*> chosen{widest_rows(16)};
  return chosen;
}

const Rows& rows() { return *chosen_rows().load(std::memory_order_relaxed); }

double root(double x) { return std::sqrt(x); }

struct Rotation {
  double x, y, z, w;
};

Rotation normalised(double x, double y, double z, double w) {
  const double length = root(x * x + y * y + z * z + w * w);
  if (!(length > 0.0)) return {0.0, 0.0, 0.0, 1.0};
  return {x / length, y / length, z / length, w / length};
}

// Columns of the rotation matrix: the directions of the tool's x, y and z.
void columns(const Rotation& q, double turn[3][3]) {
  turn[0][0] = 1.0 - 2.0 * (q.y * q.y + q.z * q.z);
  turn[0][1] = 2.0 * (q.x * q.y + q.w * q.z);
  turn[0][2] = 2.0 * (q.x * q.z - q.w * q.y);
  turn[1][0] = 2.0 * (q.x * q.y - q.w * q.z);
  turn[1][1] = 1.0 - 2.0 * (q.x * q.x + q.z * q.z);
  turn[1][2] = 2.0 * (q.y * q.z + q.w * q.x);
  turn[2][0] = 2.0 * (q.x * q.z + q.w * q.y);
  turn[2][1] = 2.0 * (q.y * q.z - q.w * q.x);
  turn[2][2] = 1.0 - 2.0 * (q.x * q.x + q.y * q.y);
}

double length_of(const double v[3]) { return root(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }
double dot_of(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double mm(std::int32_t quanta) { return quanta * kQuantum_mm; }

// Largest distance of any point of the body from the tip.
double reach_of(const CutBody& body) {
  double farthest = 0.0;
  if (body.kind == CutKind::turned) {
    for (const ProfileCorner& c : body.profile)
      farthest = std::max(farthest, root(mm(c.r) * mm(c.r) + mm(c.z) * mm(c.z)));
    return farthest;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double side = std::max(std::abs(mm(body.lowest[k])), std::abs(mm(body.highest[k])));
    farthest += side * side;
  }
  return root(farthest);
}

// Whether the outline has an edge that faces the axis. Then the body is not convex when turned.
bool is_ring(const CutBody& body) {
  for (std::size_t i = 0; i < body.profile.size(); ++i) {
    const ProfileCorner& a = body.profile[i];
    const ProfileCorner& b = body.profile[(i + 1) % body.profile.size()];
    if (b.z < a.z && (a.r > 0 || b.r > 0)) return true;
  }
  return false;
}

void add_edge(std::vector<OutlineEdge>& edges, double r0, double s0, double r1, double s1) {
  const double dr = r1 - r0, ds = s1 - s0, length = root(dr * dr + ds * ds);
  if (!(length > 0.0) || (r0 == 0.0 && r1 == 0.0)) return;  // an edge on the axis bounds nothing
  const auto f = [](double x) { return static_cast<float>(x); };
  edges.push_back({f(r0), f(s0), f(dr / length), f(ds / length), f(length)});
}

// The outline when the body moves along its axis from `down` ≤ 0 to `up` ≥ 0. Edges that face forwards move up,
// edges that face backwards move down, and the part between them stretches.
void add_outline(std::vector<OutlineEdge>& edges, const std::vector<ProfileCorner>& profile, double down, double up) {
  std::array<std::array<double, 2>, 2 * kMostProfileCorners> corners;
  std::size_t count = 0;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const ProfileCorner& a = profile[i];
    const ProfileCorner& b = profile[(i + 1) % profile.size()];
    if (a.r == b.r) continue;
    const double shift = b.r < a.r ? up : down;
    corners[count++] = {mm(a.r), mm(a.z) + shift};
    corners[count++] = {mm(b.r), mm(b.z) + shift};
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto& a = corners[i];
    const auto& b = corners[(i + 1) % count];
    add_edge(edges, a[0], a[1], b[0], b[1]);
  }
}

// Range of leaves (in units of leaves) that a sweep with its band may touch.
struct LeafRange {
  std::int32_t lowest[3], highest[3];
  [[nodiscard]] bool has(const std::int32_t at[3]) const {
    for (int k = 0; k < 3; ++k)
      if (at[k] < lowest[k] || at[k] > highest[k]) return false;
    return true;
  }
};

LeafRange range_of(const ToolSweep& sweep, double pitch) {
  const double leaf_mm = kLeafSize * pitch, band = static_cast<double>(band_mm(pitch));
  LeafRange range;
  for (int k = 0; k < 3; ++k) {
    range.lowest[k] = static_cast<std::int32_t>(std::floor((sweep.min_mm[k] - band) / leaf_mm));
    range.highest[k] = static_cast<std::int32_t>(std::floor((sweep.max_mm[k] + band) / leaf_mm));
  }
  return range;
}

// A sweep and its distance from the middle of a leaf.
struct Candidate {
  std::uint32_t sweep;
  float middle_mm;
};

// A distance changes at most as fast as the position. So the distance at a leaf's middle bounds the distances at its
// samples. A sweep farther than the band changes no sample. A sweep that is everywhere farther than another changes
// nothing either.
void plan_leaf(CutPlan& plan, Coord origin, std::span<const Candidate> candidates, float radius, float band) {
  float farthest = band;
  for (const Candidate& c : candidates) farthest = std::min(farthest, c.middle_mm + radius);
  const auto first = static_cast<std::uint32_t>(plan.near.size());
  if (farthest <= -band) {
    plan.leaves.push_back({origin, first, 0, true});
    return;
  }
  for (const Candidate& c : candidates)
    if (c.middle_mm - radius < farthest) plan.near.push_back({c.sweep, c.middle_mm - radius});
  const auto count = static_cast<std::uint32_t>(plan.near.size()) - first;
  if (count > 0) plan.leaves.push_back({origin, first, count, false});
}

}  // namespace

int limit_kernel_lanes(int lanes) {
  chosen_rows() = widest_rows(lanes);
  return rows().lanes;
}

SweptTool::SweptTool(const Cut& cut, const CutBody& body, double pitch_mm)
    : level_pitch_mm_(osteon::level_pitch_mm(pitch_mm, cut.level)), sampled_(body.sampled) {
  OSTEON_CHECK(!cut.path.empty() && cut.level >= 0 && cut.level < kLevels && body.cuts());
  OSTEON_CHECK(body.profile.size() <= kMostProfileCorners && body.planes.size() <= kMostHullPlanes);
  const double quarter = 0.25 * level_pitch_mm_;
  const double reach = reach_of(body);
  // The middle of a leaf is 3.5 pitches from its outermost samples along each axis.
  double slack = 0.001;
  if (body.kind == CutKind::turned) slack += 0.06 * level_pitch_mm_;
  if (body.kind == CutKind::sampled) {
    OSTEON_CHECK(sampled_ != nullptr && sampled_->box.dims().x > 1 && sampled_->box.dims().y > 1 &&
                 sampled_->box.dims().z > 1);
    // Between samples the error of the distance is less than a cell's diagonal.
    slack += 1.75 * mm(sampled_->pitch);
    const Coord last = sampled_->box.dims() - Coord{1, 1, 1};
    std::int32_t least = INT16_MAX;
    std::size_t i = 0;
    for (std::int32_t x = 0; x <= last.x; ++x)
      for (std::int32_t y = 0; y <= last.y; ++y)
        for (std::int32_t z = 0; z <= last.z; ++z, ++i)
          if (x == 0 || y == 0 || z == 0 || x == last.x || y == last.y || z == last.z)
            least = std::min<std::int32_t>(least, sampled_->values[i]);
    sampled_outside_ = static_cast<float>(mm(least));
  }
  leaf_radius_mm_ = static_cast<float>(0.8660254037844387 * (kLeafSize - 1) * level_pitch_mm_ + slack);

  const auto position = [&](std::size_t i, double out[3]) {
    for (int k = 0; k < 3; ++k) out[k] = cut.path[i].position[static_cast<std::size_t>(k)] * kQuantum_mm;
  };
  const auto rotation = [&](std::size_t i) {
    const auto& q = cut.path[i].rotation;
    return normalised(q[0], q[1], q[2], q[3]);
  };
  const std::size_t segments = std::max<std::size_t>(1, cut.path.size() - 1);
  for (std::size_t i = 0; i < segments; ++i) {
    const std::size_t next = std::min(i + 1, cut.path.size() - 1);
    double from[3], to[3], way[3];
    position(i, from);
    position(next, to);
    for (int k = 0; k < 3; ++k) way[k] = to[k] - from[k];
    const Rotation a = rotation(i);
    Rotation b = rotation(next);
    if (a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0.0) b = {-b.x, -b.y, -b.z, -b.w};
    const double dx = b.x - a.x, dy = b.y - a.y, dz = b.z - a.z, dw = b.w - a.w;
    const auto turn_at = [&](double t, double turn[3][3]) {
      columns(normalised(a.x + t * dx, a.y + t * dy, a.z + t * dz, a.w + t * dw), turn);
    };
    double first_turn[3][3], last_turn[3][3], tilt[3];
    turn_at(0.0, first_turn);
    turn_at(1.0, last_turn);
    for (int k = 0; k < 3; ++k) tilt[k] = last_turn[2][k] - first_turn[2][k];

    // A rotation is cut at sub-poses between which no point of the cutting part moves by more than a quarter pitch.
    // Half the angle is the chord between the quaternions, to second order. Spin of a turned body about its axis moves
    // none of its points. A ball's centre moves on an arc, which chords replace with an error below 1/32 pitch.
    int parts = 1;
    if (body.kind == CutKind::ball) {
      parts += static_cast<int>(length_of(tilt) * root(4.0 * mm(body.radius) / level_pitch_mm_));
    } else if (body.kind == CutKind::turned) {
      parts += static_cast<int>(length_of(tilt) * reach / quarter);
    } else {
      parts += static_cast<int>(2.0 * root(dx * dx + dy * dy + dz * dz + dw * dw) * reach / quarter);
    }
    if (body.kind == CutKind::sampled) {
      // Translations are split into sub-poses too, including both ends.
      parts += static_cast<int>(length_of(way) / quarter);
      const bool still = from[0] == to[0] && from[1] == to[1] && from[2] == to[2] && parts == 1;
      for (int part = i > 0 ? 1 : 0; part <= (still ? 0 : parts); ++part) {
        const double t = static_cast<double>(part) / parts;
        double turn[3][3], at[3];
        turn_at(t, turn);
        for (int k = 0; k < 3; ++k) at[k] = from[k] + t * way[k];
        add_sampled(body, at, turn);
      }
      continue;
    }
    for (int part = 0; part < parts; ++part) {
      const double t0 = static_cast<double>(part) / parts, t1 = static_cast<double>(part + 1) / parts;
      double turn[3][3], start[3], end[3];
      for (int k = 0; k < 3; ++k) {
        start[k] = from[k] + t0 * way[k];
        end[k] = from[k] + t1 * way[k];
      }
      if (body.kind == CutKind::ball) {
        const double radius = mm(body.radius);
        double start_turn[3][3], end_turn[3][3];
        turn_at(t0, start_turn);
        turn_at(t1, end_turn);
        for (int k = 0; k < 3; ++k) {
          start[k] -= radius * start_turn[2][k];
          end[k] -= radius * end_turn[2][k];
        }
        sweeps_.push_back({});
        sweeps_.back().radius = static_cast<float>(radius);
        add_ball(start, end);
        continue;
      }
      turn_at(0.5 * (t0 + t1), turn);
      if (body.kind == CutKind::turned)
        add_turned(body, start, end, turn[2]);
      else
        add_hull(body, start, end, turn);
    }
  }
}

void SweptTool::add_ball(const double from[3], const double to[3]) {
  ToolSweep& sweep = sweeps_.back();
  sweep.kind = SweepKind::ball;
  double motion[3];
  for (int k = 0; k < 3; ++k) {
    motion[k] = to[k] - from[k];
    sweep.start_mm[k] = from[k];
    sweep.motion_mm[k] = static_cast<float>(motion[k]);
    sweep.min_mm[k] = std::min(from[k], to[k]) - static_cast<double>(sweep.radius);
    sweep.max_mm[k] = std::max(from[k], to[k]) + static_cast<double>(sweep.radius);
  }
  // Motion below half a quantum counts as none, because a division would lose its digits.
  const double square = dot_of(motion, motion);
  sweep.inverse_square = square > 0.25 * kQuantum_mm * kQuantum_mm ? static_cast<float>(1.0 / square) : 0.0f;
}

void SweptTool::add_turned(const CutBody& body, const double from[3], const double to[3], const double axis[3]) {
  double motion[3], across[3];
  for (int k = 0; k < 3; ++k) motion[k] = to[k] - from[k];
  const double along = dot_of(motion, axis);
  for (int k = 0; k < 3; ++k) across[k] = motion[k] - along * axis[k];
  const double sideways = length_of(across);
  // A tool that moves straight, along or across, leaves that line only by the rounding of its poses. Then half of that
  // rounding is added to the start.
  const bool is_axial = sideways <= 2.0 * kQuantum_mm;
  const bool is_across = !is_axial && std::abs(along) <= 2.0 * kQuantum_mm;
  if (!is_axial && is_ring(body)) {
    const int steps = 1 + static_cast<int>(sideways / (0.25 * level_pitch_mm_));
    for (int step = 0; step < steps; ++step) {
      // Each step moves along the axis, at the middle of its part of the motion across.
      const double t0 = static_cast<double>(step) / steps, t1 = static_cast<double>(step + 1) / steps,
                   middle = 0.5 * (t0 + t1);
      double start[3], end[3];
      for (int k = 0; k < 3; ++k) {
        start[k] = from[k] + middle * across[k] + t0 * along * axis[k];
        end[k] = from[k] + middle * across[k] + t1 * along * axis[k];
      }
      add_turned(body, start, end, axis);
    }
    return;
  }

  ToolSweep sweep{};
  sweep.kind = is_axial ? SweepKind::axial : is_across ? SweepKind::across : SweepKind::oblique;
  double u[3], v[3];
  if (is_axial) {
    // Any direction across the axis, derived from the coordinate axis that is most perpendicular to it.
    const double x = std::abs(axis[0]), y = std::abs(axis[1]), z = std::abs(axis[2]);
    const int most = x <= y && x <= z ? 0 : y <= z ? 1 : 2;
    for (int k = 0; k < 3; ++k) u[k] = (k == most ? 1.0 : 0.0) - axis[most] * axis[k];
  } else {
    for (int k = 0; k < 3; ++k) u[k] = across[k];
  }
  const double size = length_of(u);
  for (int k = 0; k < 3; ++k) u[k] = u[k] / size;
  for (int k = 0; k < 3; ++k) v[k] = axis[(k + 1) % 3] * u[(k + 2) % 3] - axis[(k + 2) % 3] * u[(k + 1) % 3];

  sweep.radius = static_cast<float>(mm(body.highest[0]));
  for (int k = 0; k < 3; ++k) {
    sweep.start_mm[k] = from[k] + (is_axial ? 0.5 * across[k] : is_across ? 0.5 * along * axis[k] : 0.0);
    sweep.axis[k] = static_cast<float>(axis[k]);
    sweep.u[k] = static_cast<float>(u[k]);
    sweep.v[k] = static_cast<float>(v[k]);
    const double top = mm(body.highest[2]) * axis[k], bottom = mm(body.lowest[2]) * axis[k];
    // A disc perpendicular to the axis extends this far in each direction.
    const double disc = mm(body.highest[0]) * root(std::max(0.0, 1.0 - axis[k] * axis[k])) + 2.0 * kQuantum_mm;
    sweep.min_mm[k] = std::min(from[k], to[k]) + std::min(top, bottom) - disc;
    sweep.max_mm[k] = std::max(from[k], to[k]) + std::max(top, bottom) + disc;
  }
  sweep.across_mm = is_axial ? 0.0f : static_cast<float>(sideways);
  sweep.along_mm = is_across ? 0.0f : static_cast<float>(along);
  sweep.length_mm = static_cast<float>(length_of(motion));
  sweep.dome = static_cast<float>(mm(body.dome));
  const double up = is_axial ? std::max(0.0, along) : 0.0, down = is_axial ? std::min(0.0, along) : 0.0;
  sweep.up_mm = static_cast<float>(up);
  sweep.down_mm = static_cast<float>(down);
  if (sweep.kind == SweepKind::oblique) {
    double interval = length_of(motion);
    while (interval > 0.05 * level_pitch_mm_) {
      interval *= 0.61803399;
      ++sweep.search_steps;
    }
  }
  // All sweeps that do not stretch share one outline.
  if (!is_axial && !sweeps_.empty() && sweeps_.back().kind != SweepKind::axial) {
    sweep.first = sweeps_.back().first;
    sweep.count = sweeps_.back().count;
  } else {
    sweep.first = static_cast<std::uint32_t>(edges_.size());
    add_outline(edges_, body.profile, down, up);
    sweep.count = static_cast<std::uint32_t>(edges_.size()) - sweep.first;
    OSTEON_CHECK(sweep.count > 0 && sweep.count <= kMostOutlineEdges);
  }
  sweeps_.push_back(sweep);
}

// p is in the swept hull if some t in [0, 1] has n_i · (p − t m) ≤ d_i for all i. Eliminating t (Fourier and
// Motzkin) gives three kinds of planes. Planes that face against the motion stay. Planes that face along it move with
// it. Each pair of the two kinds gives the plane through their common direction along m.
void SweptTool::add_hull(const CutBody& body, const double from[3], const double to[3], const double turn[3][3]) {
  ToolSweep sweep{};
  sweep.kind = SweepKind::hull;
  sweep.first = static_cast<std::uint32_t>(planes_.size());
  double motion[3];
  for (int k = 0; k < 3; ++k) motion[k] = to[k] - from[k];

  struct Plane {
    double normal[3], offset, advance;  // advance of the motion along the normal
  };
  std::array<Plane, kMostHullPlanes> planes;
  const std::size_t count = body.planes.size();
  const auto add = [&](const double normal[3], double offset) {
    const auto f = [](double x) { return static_cast<float>(x); };
    planes_.push_back({f(normal[0]), f(normal[1]), f(normal[2]), f(offset)});
  };
  for (std::size_t i = 0; i < count; ++i) {
    const HullPlane& plane = body.planes[i];
    const double n[3] = {plane.normal[0] * kDirectionStep, plane.normal[1] * kDirectionStep,
                         plane.normal[2] * kDirectionStep};
    const double length = length_of(n);
    OSTEON_CHECK(length > 0.0);
    Plane& p = planes[i];
    for (int k = 0; k < 3; ++k) p.normal[k] = (turn[0][k] * n[0] + turn[1][k] * n[1] + turn[2][k] * n[2]) / length;
    p.offset = mm(plane.offset);
    p.advance = dot_of(p.normal, motion);
    add(p.normal, p.offset + std::max(0.0, p.advance));
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      const Plane& ahead = planes[i];
      const Plane& behind = planes[j];
      if (!(ahead.advance > 0.0) || !(behind.advance < 0.0)) continue;
      double normal[3];
      for (int k = 0; k < 3; ++k) normal[k] = ahead.advance * behind.normal[k] - behind.advance * ahead.normal[k];
      const double length = length_of(normal);
      // Opposite planes, such as the two faces of a blade, give no condition together.
      if (length <= 0.001 * (ahead.advance - behind.advance)) continue;
      const double offset = (ahead.advance * behind.offset - behind.advance * ahead.offset) / length;
      for (int k = 0; k < 3; ++k) normal[k] = normal[k] / length;
      add(normal, offset);
    }
  }
  sweep.count = static_cast<std::uint32_t>(planes_.size()) - sweep.first;
  OSTEON_CHECK(sweep.count > 0 && sweep.count <= kMostSweptPlanes);
  for (int k = 0; k < 3; ++k) {
    sweep.start_mm[k] = from[k];
    double centre = 0.0, half = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
      centre += 0.5 * (mm(body.lowest[j]) + mm(body.highest[j])) * turn[j][k];
      half += 0.5 * (mm(body.highest[j]) - mm(body.lowest[j])) * std::abs(turn[j][k]);
    }
    sweep.min_mm[k] = std::min(from[k], to[k]) + centre - half;
    sweep.max_mm[k] = std::max(from[k], to[k]) + centre + half;
  }
  sweeps_.push_back(sweep);
}

void SweptTool::add_sampled(const CutBody& body, const double at[3], const double turn[3][3]) {
  ToolSweep sweep{};
  sweep.kind = SweepKind::sampled;
  for (int k = 0; k < 3; ++k) {
    sweep.start_mm[k] = at[k];
    sweep.u[k] = static_cast<float>(turn[0][k]);
    sweep.v[k] = static_cast<float>(turn[1][k]);
    sweep.axis[k] = static_cast<float>(turn[2][k]);
    double centre = 0.0, half = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
      centre += 0.5 * (mm(body.lowest[j]) + mm(body.highest[j])) * turn[j][k];
      half += 0.5 * (mm(body.highest[j]) - mm(body.lowest[j])) * std::abs(turn[j][k]);
    }
    sweep.min_mm[k] = at[k] + centre - half;
    sweep.max_mm[k] = at[k] + centre + half;
  }
  sweeps_.push_back(sweep);
}

SweptTool::Body SweptTool::shape() const { return {edges_, planes_, sampled_.get(), sampled_outside_}; }

CutPlan SweptTool::plan() const {
  CutPlan plan;
  const float band = band_mm(level_pitch_mm_);
  const Body body = shape();
  std::vector<LeafRange> ranges;
  ranges.reserve(sweeps_.size());
  for (const ToolSweep& sweep : sweeps_) ranges.push_back(range_of(sweep, level_pitch_mm_));
  LeafRange all = ranges.front();
  for (const LeafRange& range : ranges)
    for (int k = 0; k < 3; ++k) {
      all.lowest[k] = std::min(all.lowest[k], range.lowest[k]);
      all.highest[k] = std::max(all.highest[k], range.highest[k]);
    }
  const auto in_line = static_cast<std::size_t>(all.highest[2] - all.lowest[2] + 1);
  plan.visited = static_cast<std::int64_t>(all.highest[0] - all.lowest[0] + 1) * (all.highest[1] - all.lowest[1] + 1) *
                 static_cast<std::int64_t>(in_line);

  // Leaves are processed line by line along z, so that the middles of a line are evaluated together.
  std::vector<std::uint32_t> crossing;
  std::vector<float> middles;
  std::vector<Candidate> candidates;
  for (std::int32_t x = all.lowest[0]; x <= all.highest[0]; ++x)
    for (std::int32_t y = all.lowest[1]; y <= all.highest[1]; ++y) {
      crossing.clear();
      middles.clear();
      for (std::uint32_t i = 0; i < sweeps_.size(); ++i) {
        const LeafRange& range = ranges[i];
        if (x < range.lowest[0] || x > range.highest[0] || y < range.lowest[1] || y > range.highest[1]) continue;
        const int count = range.highest[2] - range.lowest[2] + 1;
        middles.resize(middles.size() + static_cast<std::size_t>(count));
        rows().middles(sweeps_[i], body, kLeafSize * Coord{x, y, range.lowest[2]}, count, level_pitch_mm_,
                       middles.data() + (middles.size() - static_cast<std::size_t>(count)));
        crossing.push_back(i);
      }
      if (crossing.empty()) continue;
      for (std::int32_t z = all.lowest[2]; z <= all.highest[2]; ++z) {
        candidates.clear();
        std::size_t at = 0;
        for (const std::uint32_t i : crossing) {
          const LeafRange& range = ranges[i];
          if (z >= range.lowest[2] && z <= range.highest[2])
            candidates.push_back({i, middles[at + static_cast<std::size_t>(z - range.lowest[2])]});
          at += static_cast<std::size_t>(range.highest[2] - range.lowest[2] + 1);
        }
        if (!candidates.empty()) plan_leaf(plan, kLeafSize * Coord{x, y, z}, candidates, leaf_radius_mm_, band);
      }
    }
  return plan;
}

CutPlan SweptTool::plan(std::span<const Coord> leaves) const {
  CutPlan plan;
  const float band = band_mm(level_pitch_mm_);
  const Body body = shape();
  plan.visited = static_cast<std::int64_t>(leaves.size());
  std::vector<LeafRange> ranges;
  ranges.reserve(sweeps_.size());
  for (const ToolSweep& sweep : sweeps_) ranges.push_back(range_of(sweep, level_pitch_mm_));
  std::vector<Candidate> candidates;
  for (const Coord origin : leaves) {
    candidates.clear();
    const std::int32_t at[3] = {origin.x >> 3, origin.y >> 3, origin.z >> 3};
    for (std::uint32_t i = 0; i < sweeps_.size(); ++i) {
      if (!ranges[i].has(at)) continue;
      float middle = 0.0f;
      rows().middles(sweeps_[i], body, origin, 1, level_pitch_mm_, &middle);
      candidates.push_back({i, middle});
    }
    if (!candidates.empty()) plan_leaf(plan, origin, candidates, leaf_radius_mm_, band);
  }
  return plan;
}

std::vector<Coord> SweptTool::leaves() const {
  const CutPlan all = plan();
  std::vector<Coord> origins;
  origins.reserve(all.leaves.size());
  for (const CutPlan::Leaf& leaf : all.leaves) origins.push_back(leaf.origin);
  return origins;
}

LeafChange SweptTool::cut_leaf(const CutPlan& plan, const CutPlan::Leaf& leaf,
                               std::span<float, kLeafVoxels> values) const {
  const float band = band_mm(level_pitch_mm_);
  if (leaf.removed) {
    LeafChange change{0, false, true};
    for (float& value : values) {
      if (value == -band) continue;
      value = -band;
      ++change.modified;
    }
    return change;
  }
  // A sweep that is nowhere below the leaf's highest value cannot change the leaf.
  const float enough = rows().highest(values.data());
  alignas(64) float distances[kLeafVoxels];
  const Body body = shape();
  bool first = true;
  for (std::uint32_t i = 0; i < leaf.count; ++i) {
    const CutPlan::Near& near = plan.near[leaf.first + i];
    if (near.nearest_mm >= enough) continue;
    rows().evaluate(sweeps_[near.sweep], body, leaf.origin, level_pitch_mm_, leaf_radius_mm_, first, enough, band,
                    distances);
    first = false;
  }
  if (first) return {};
  return rows().take_lower(distances, band, values.data());
}

int SweptTool::cut_leaf(Coord origin, std::span<float, kLeafVoxels> values) const {
  const CutPlan only = plan(std::span(&origin, 1));
  return only.leaves.empty() ? 0 : cut_leaf(only, only.leaves.front(), values).modified;
}

float SweptTool::distance_mm(const Vec3& point) const {
  const double at[3] = {point.x(), point.y(), point.z()};
  const Body body = shape();
  float nearest = 1e9f;
  for (const ToolSweep& sweep : sweeps_) nearest = std::min(nearest, rows().point_distance(sweep, body, at));
  return nearest;
}

}  // namespace osteon
