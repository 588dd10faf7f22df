// Many points of a tool against the bone round it in one pass: how far each is from the surface, where the surface
// looks and how dense the bone is, and what the points in bone say together. Computed 4, 8 or 16 points at a time,
// whatever the processor has, with the same numbers; groups of neighbours that the case's clearance keeps away are
// passed over.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_client/control/patch.hpp"

namespace osteon::haptic {

struct ContactPoint {
  Vec3 surface_mm;  // on the tool, tool frame
  Vec3 inset_mm;    // moved inwards by half a patch pitch and the pose quantum, else a tool jams in its own hole
  Vec3 outward;     // unit normal out of the tool
  double area_mm2;
  double axis_distance_mm;
  double edge = 0;  // cutting edge that it stands for, mm; of a saw, how many teeth
};

inline constexpr int kGroupPoints = 16;
// So far a point is that was left out: it neither touches nor counts.
inline constexpr float kLeftOut_mm = 1e6f;
// Values of a function of density, linear between steps: powers are too slow for thousands of points.
inline constexpr int kDensitySteps = 256;
inline constexpr double kMostDensity_g_cm3 = 4.0;
using DensityTable = std::array<float, kDensitySteps + 2>;

// The points of a tool as the evaluation reads them: in groups of neighbours, first those that cut, then those that
// only block. The last group of either is filled up with copies of its last point that have no area.
struct ContactSet {
  struct Ball {
    float x = 0, y = 0, z = 0, radius_mm = 0;  // round a group, tool frame
  };
  std::vector<float> x, y, z;           // inset places, tool frame
  std::vector<float> nx, ny, nz;        // outward
  std::vector<float> area_mm2, arm_mm;  // arm: from the tool's axis, not below the caller's least
  std::vector<float> edge;
  std::vector<Ball> balls;
  int active = 0, passive = 0;  // points; passive ones begin with their group
  int active_groups = 0;
  double reach_mm = 0;  // of the farthest of all from the tip, at most
  [[nodiscard]] int groups() const noexcept { return static_cast<int>(balls.size()); }
  [[nodiscard]] int first_passive() const noexcept { return active_groups * kGroupPoints; }
};
// Brings both lists into the order of the set: point i is active[i], point first_passive() + i is passive[i].
[[nodiscard]] ContactSet contact_set(std::vector<ContactPoint>& active, std::vector<ContactPoint>& passive,
                                     double least_arm_mm);

// What is asked of the points. Frames as named; lengths in mm.
struct ContactQuery {
  Pose pose_bone_tool;
  int first_group = 0, groups = 0;
  double lift_mm = 0;      // points are moved out of the tool along their normals by so much
  double margin_mm = 0.5;  // groups farther than this from bone may be passed over: their points read a lower bound
  bool density = false;    // of points in bone
  // Ahead of the faces that look along a direction: each point is moved along it until it is `ahead_mm` before its own
  // face, `most_mm` at most. Those that look less than `least_facing` along it are left out.
  bool ahead = false;
  Vec3 direction_bone = Vec3::UnitZ();
  double ahead_mm = 0, most_mm = 0, least_facing = 0;
  const DensityTable* strength = nullptr;  // for ContactSums::milling
};

// Values of every point asked, in the set's order. Room for all points is made once, off the haptic thread.
struct ContactValues {
  std::vector<float> distance_mm;    // f: negative in bone
  std::vector<float> gx, gy, gz;     // its gradient in the cell that the point is in, bone frame; zero where not known
  std::vector<float> density_g_cm3;  // where it was asked for
  std::vector<float> nearest_mm;     // of each group
  bool covered = true;               // no point was where neither bone nor clearance is known
  void make_room(int points);
};

// Sums over the asked points, each by its area projected on the direction: what laws want to know, and force and torque
// of (7.12) and (7.14) for K_1 · speed = 1. Tool frame; torque about the tip.
struct ContactSums {
  double area_mm2 = 0;     // of all faces that look along the direction
  double engaged_mm2 = 0;  // those ahead of which there is bone
  double density_mm2 = 0;  // engaged area times density
  double milling = 0;      // engaged area / arm times strength(density)
  double arm_mm3 = 0;      // engaged area times arm
  double nearest_mm = kLeftOut_mm;
  double turned_area_mm2 = 0;  // engaged area, not projected
  double edge = 0;             // of the engaged points
  Vec3 force = Vec3::Zero();   // sum of -n · area · facing · density
  Vec3 torque = Vec3::Zero();
};

// [haptic] Distance, gradient and, if asked for, density of the points; the sums too where `query.ahead` is set.
ContactSums evaluate_contact(const Patch& patch, const ContactSet& set, const ContactQuery& query,
                             ContactValues& values) noexcept;

// Numbers of a group's points.
using Lanes = std::array<float, kGroupPoints>;
// A convex body as the points see it: to each of its own places, rotation · p + at; of each plane, normal and offset,
// mm.
struct HullPlace {
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
  Eigen::Vector3f at = Eigen::Vector3f::Zero();
};
using HullFace = std::array<float, 4>;
// [haptic] Distance of a group's points to the farthest of its planes, mm; `p`: x, y, z. Exact inside and before faces,
// too small before edges, where only the sign counts.
[[nodiscard]] Lanes hull_distance_mm(const HullPlace& place, std::span<const HullFace> faces,
                                     const Lanes (&p)[3]) noexcept;

// For tests and benchmarks: at most so many points at a time from now on. Returns how many.
int limit_contact_lanes(int lanes);

}  // namespace osteon::haptic
