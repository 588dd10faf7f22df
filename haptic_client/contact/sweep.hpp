// What the cutting part of the tool in hand has removed since a patch was built, from one position to another. For a
// tool that goes along its axis, the deepest position includes all others since the sweep began. One sweep continues as
// long as the tool keeps to its axis.
#pragma once
#include <cstdint>

#include "common/geometry/pose.hpp"
#include "haptic_client/contact/cut_shape.hpp"

namespace osteon::haptic {

struct Sweep {
  const CutShape* shape = nullptr;  // of the tool in hand
  Pose from, to;                    // pose_bone_tool; `to`: the deepest, if that includes all
  Pose middle;                      // between them
  std::uint64_t own_cut = 0;        // newest cut that includes it all; 0: none yet
  bool open = false;
  void reach(const Pose& pose) noexcept;
};

// For each point of a group: the part of a sweep.
using Parts = std::array<std::int32_t, kGroupPoints>;

// A sweep as seen from the tool's present pose, evaluated for many of its points at once. [haptic]
class SweepView {  // NOLINT(bugprone-reserved-identifier): clang's own name in the copy of an array
 public:
  SweepView() = default;
  // Of a sweep that is shorter than `short_mm` only the end counts. `before`: the preceding sweep, or null. Where that
  // one ends, this one need not begin.
  SweepView(const Sweep& sweep, const Sweep* before, const Pose& pose_bone_tool, double short_mm) noexcept;
  // Lower bound of f that the sweep leaves at a group of the tool's points. Tool frame, single precision, which
  // resolves hundred-thousandths of a millimetre near the tip. `by`: the part of the sweep that determines it.
  void left_mm(const Lanes (&p)[3], Lanes& left, Parts& by) const noexcept;
  // The way out of bone at a point for which left_mm gave the part `by`. Tool frame, a unit vector.
  [[nodiscard]] Vec3 way_out(const Vec3& p, int by) const noexcept;
  static constexpr int kParts = 4;

 private:
  static constexpr int kBehind = 3;  // the part number of the hole's beginning; lower numbers are positions
  const CutShape* shape_ = nullptr;
  HullPlace places_[3];  // from the tool's present pose to an earlier one
  int count_ = 0;
  float began_mm_ = 0;        // along the axis, of a hole that continues behind the tool
  Vec3 ball_from_, ball_to_;  // centres
};

}  // namespace osteon::haptic
