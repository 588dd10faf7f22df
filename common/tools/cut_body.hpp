// The cutting body: the convex or sampled solid that the cut kernel sweeps. It consists of whole numbers of
// kQuantum_mm. So every program evaluates the same bytes, and no trigonometry is computed in two places. Tool frame.
#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {

// Length step of everything that is replicated: 2^-10 mm.
inline constexpr double kQuantum_mm = 1.0 / 1024.0;
// Directions are in steps of 1/32767; the kernel renormalises them.
inline constexpr double kDirectionStep = 1.0 / 32767.0;

enum class CutKind : std::uint8_t {
  none = 0,     // does not cut
  ball = 1,     // a sphere of `radius` that ends at the tip: centre (0, 0, -radius)
  turned = 2,   // the convex `profile` turned about the axis, within the ball of `dome` if that is given
  hull = 3,     // the points behind all `planes`
  sampled = 4,  // any solid, as distances on a lattice
};

// A corner of a turned body: distance from the axis and position along it.
struct ProfileCorner {
  std::int32_t r = 0;
  std::int32_t z = 0;
  friend auto operator<=>(const ProfileCorner&, const ProfileCorner&) = default;
};

// A half-space normal · p ≤ offset.
struct HullPlane {
  std::array<std::int16_t, 3> normal{};  // kDirectionStep, out of the body
  std::int32_t offset = 0;               // kQuantum_mm
  friend auto operator<=>(const HullPlane&, const HullPlane&) = default;
};

// Signed distance of a solid on the samples of a lattice in the tool's frame. Negative inside, trilinear between
// samples.
struct SampledDistance {
  CoordBox box;                      // sample (i, j, k) lies at (i, j, k) · pitch
  std::int32_t pitch = 0;            // kQuantum_mm
  std::vector<std::int16_t> values;  // kQuantum_mm, clipped; z fastest, then y, then x
  friend bool operator==(const SampledDistance&, const SampledDistance&) = default;
};

inline constexpr std::size_t kMostProfileCorners = 12;
inline constexpr std::size_t kMostHullPlanes = 20;

struct CutBody {
  CutKind kind = CutKind::none;
  std::int32_t radius = 0;  // ball
  // turned: counter-clockwise in (r, z), with r to the right and z up; convex, r ≥ 0. A body that reaches the axis
  // has two corners on it (or one, a point). A body that does not is a ring, such as a hollow mill.
  std::vector<ProfileCorner> profile;
  std::int32_t dome = 0;          // turned: radius of the ball, 0 for none; like CutKind::ball, it ends at the tip
  std::vector<HullPlane> planes;  // hull
  // Shared by all copies of one tool's body, because it is immutable and up to megabytes.
  std::shared_ptr<const SampledDistance> sampled;

  // Box of the body in the tool's frame, kQuantum_mm, rounded outwards (Local Bounding Block, Niu 2008, §6.1).
  std::array<std::int32_t, 3> lowest{}, highest{};

  [[nodiscard]] bool cuts() const { return kind != CutKind::none; }
  // The largest distance of any of its points from the tip, mm.
  [[nodiscard]] double reach_mm() const;
  friend bool operator==(const CutBody& a, const CutBody& b);
};

}  // namespace osteon
