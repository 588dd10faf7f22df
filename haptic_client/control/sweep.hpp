// What the cutting part of the tool in hand has taken away since a patch was built: from one place to another. Of what
// goes along its axis the deepest place holds all others from where the sweep began on, and one sweep goes on for as
// long as it keeps to its axis.
#pragma once
#include <cstdint>

#include "common/geometry/pose.hpp"
#include "haptic_client/control/cut_shape.hpp"

namespace osteon::haptic {

struct Sweep {
  const CutShape* shape = nullptr;  // of the tool in hand
  Pose from, to;                    // pose_bone_tool; `to`: the deepest, where that holds all
  Pose middle;                      // between them
  std::uint64_t own_cut = 0;        // newest cut that holds it all; 0: none yet
  bool open = false;
  void reach(const Pose& pose) noexcept;
};

// Of each of a group's points: which part of a sweep.
using Parts = std::array<std::int32_t, kGroupPoints>;

// A sweep as the tool sees it from where it is: for many points of it at once. [haptic]
class SweepView {
 public:
  SweepView() = default;
  // Of a sweep that is shorter than `short_mm` only the end counts. `before`: the one seen before it, or null; where
  // that ends, this one need not begin.
  SweepView(const Sweep& sweep, const Sweep* before, const Pose& pose_bone_tool, double short_mm) noexcept;
  // f that the sweep leaves at a group of the tool's points, at least: tool frame, single precision, which tells
  // hundred-thousandths of a millimetre near the tip. `by`: what of the sweep it is that leaves it.
  void left_mm(const Lanes (&p)[3], Lanes& left, Parts& by) const noexcept;
  // The way out of bone at a point of which left_mm said by what it is left; tool frame, a unit vector.
  [[nodiscard]] Vec3 way_out(const Vec3& p, int by) const noexcept;
  static constexpr int kParts = 4;

 private:
  static constexpr int kBehind = 3;  // as a part: the hole's beginning; before it places, by number
  const CutShape* shape_ = nullptr;
  HullPlace places_[3];  // from the tool where it is to the tool where it was
  int count_ = 0;
  float began_mm_ = 0;        // along the axis, of a hole that goes on behind the tool
  Vec3 ball_from_, ball_to_;  // middles
};

}  // namespace osteon::haptic
