// Evaluates many points of a tool against the bone around it in one pass. It gives each point's distance from the
// surface, the surface's direction and the density of the bone. It also gives sums over the points in bone. It computes
// 4, 8 or 16 points at a time, depending on the processor, with the same numbers. It skips groups of neighbours that
// are far from bone by the case's clearance, a lower bound of the distance to bone.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_client/contact/patch.hpp"

namespace osteon::haptic {

struct ContactPoint {
  Vec3 surface_mm;  // on the tool, tool frame
  Vec3 inset_mm;    // moved inwards by half a Patch pitch and the rounding of poses; else a tool jams in its own hole
  Vec3 outward;     // unit normal out of the tool
  double area_mm2;
  double axis_distance_mm;
  double edge = 0;  // length of cutting edge that the point represents, mm; for a saw, number of teeth
};

inline constexpr int kGroupPoints = 16;
// Distance of a point that was left out: it neither touches nor counts.
inline constexpr float kLeftOut_mm = 1e6f;
// Values of a function of density, linear between steps. Computing powers is too slow for thousands of points.
inline constexpr int kDensitySteps = 256;
inline constexpr double kMostDensity_g_cm3 = 4.0;
using DensityTable = std::array<float, kDensitySteps + 2>;

// The points of a tool as the evaluation reads them, in groups of neighbours. Cutting (active) points come first, then
// points that only block (passive). The last group of each kind is filled up with copies of its last point that have no
// area.
struct ContactSet {
  struct Ball {
    float x = 0, y = 0, z = 0, radius_mm = 0;  // round a group, tool frame
  };
  std::vector<float> x, y, z;           // inset positions, tool frame
  std::vector<float> nx, ny, nz;        // outward
  std::vector<float> area_mm2, arm_mm;  // arm: from the tool's axis, at least the caller's minimum
  std::vector<float> edge;
  std::vector<Ball> balls;
  int active = 0, passive = 0;  // points; passive ones begin with their group
  int active_groups = 0;
  double reach_mm = 0;  // upper bound of the distance of the farthest point from the tip
  [[nodiscard]] int groups() const noexcept { return static_cast<int>(balls.size()); }
  [[nodiscard]] int first_passive() const noexcept { return active_groups * kGroupPoints; }
};
// Sorts both lists into the order of the set: point i is active[i], point first_passive() + i is passive[i].
[[nodiscard]] ContactSet contact_set(std::vector<ContactPoint>& active, std::vector<ContactPoint>& passive,
                                     double least_arm_mm);

// What to evaluate. Frames as named; lengths in mm.
struct ContactQuery {
  Pose pose_bone_tool;
  int first_group = 0, groups = 0;
  double lift_mm = 0;      // points are moved out of the tool along their normals by this much
  double margin_mm = 0.5;  // groups farther than this from bone may be skipped: distance is then a lower bound
  bool density = false;    // compute the density at points in bone
  // Evaluates the bone ahead of the faces that point along a direction. Each point is moved along the direction until
  // it is `ahead_mm` in front of the face that it lies on, but at most by `most_mm`. Faces whose normal has less than
  // `least_facing` along the direction are left out.
  bool ahead = false;
  Vec3 direction_bone = Vec3::UnitZ();
  double ahead_mm = 0, most_mm = 0, least_facing = 0;
  const DensityTable* strength = nullptr;  // for ContactSums::milling
};

// Values of every evaluated point, in the set's order. The memory for all points is allocated once, off the haptic
// thread.
struct ContactValues {
  std::vector<float> distance_mm;    // f: negative in bone
  std::vector<float> gx, gy, gz;     // its gradient in the cell that the point is in, bone frame; zero where unknown
  std::vector<float> density_g_cm3;  // where the query asks for it
  std::vector<float> nearest_mm;     // of each group
  bool covered = true;               // at every point, the bone or a clearance was known
  void make_room(int points);
};

// Sums over the evaluated points, each weighted by its area projected on the direction. They hold the force laws'
// inputs, and force and torque of Niu 2008, (7.12), (7.14), for K_1 · speed = 1. Tool frame; torque about the tip.
struct ContactSums {
  double area_mm2 = 0;     // of all faces that point along the direction
  double engaged_mm2 = 0;  // those with bone ahead of them
  double density_mm2 = 0;  // engaged area times density
  double milling = 0;      // engaged area / arm times strength(density)
  double arm_mm3 = 0;      // engaged area times arm
  double nearest_mm = kLeftOut_mm;
  double turned_area_mm2 = 0;  // engaged area, not projected
  double edge = 0;             // of the engaged points
  Vec3 force = Vec3::Zero();   // sum of -n · area · facing · density
  Vec3 torque = Vec3::Zero();
};

// [haptic] Computes distance, gradient and, if the query asks for it, density of the points. It also computes the sums
// where `query.ahead` is set.
ContactSums evaluate_contact(const Patch& patch, const ContactSet& set, const ContactQuery& query,
                             ContactValues& values) noexcept;

// One number for each point of a group.
using Lanes = std::array<float, kGroupPoints>;
// The pose of a convex body as seen from the points. The point p has the coordinates rotation · p + at in the body's
// frame. HullFace: normal and offset of a plane, mm.
struct HullPlace {
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
  Eigen::Vector3f at = Eigen::Vector3f::Zero();
};
using HullFace = std::array<float, 4>;
// [haptic] Distance of a group's points to the farthest of the body's planes, mm. `p`: x, y, z. Exact inside and in
// front of faces. In front of edges the result is too small, but only its sign is used there.
[[nodiscard]] Lanes hull_distance_mm(const HullPlace& place, std::span<const HullFace> faces,
                                     const Lanes (&p)[3]) noexcept;

// For tests and benchmarks: limits the number of points that are computed at a time. Returns the number used from now
// on.
int limit_contact_lanes(int lanes);

}  // namespace osteon::haptic
