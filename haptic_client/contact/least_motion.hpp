// Finds the motion of a rigid tool that is nearest to a wanted one and meets all of some linear conditions: the motion
// that a contact allows.
#pragma once
#include <array>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

// A small motion of the tool's tip, and a rotation about the tip (axis times angle). Bone frame.
struct Motion {
  Vec3 move_mm = Vec3::Zero();
  Vec3 turn_rad = Vec3::Zero();
};
[[nodiscard]] inline Motion operator*(double k, const Motion& m) noexcept { return {k * m.move_mm, k * m.turn_rad}; }
[[nodiscard]] inline double norm_mm(const Motion& m, double arm_mm) noexcept {
  return std::sqrt(m.move_mm.squaredNorm() + arm_mm * arm_mm * m.turn_rad.squaredNorm());
}
// The pose after the motion.
[[nodiscard]] Pose moved(const Pose& pose, const Motion& motion) noexcept;
// The motion from one pose to another.
[[nodiscard]] Motion between(const Pose& from, const Pose& to) noexcept;

// n · move + m · turn ≥ least. For a point at r from the tip: n is the way out of bone, m = r × n.
struct Condition {
  Vec3 n = Vec3::Zero(), m = Vec3::Zero();
  double least_mm = 0;
};

// A list of conditions with room for a fixed number of them.
class Conditions {
 public:
  static constexpr int kMost = 256;
  void clear() noexcept { count_ = 0; }
  // Returns false when the list is full.
  bool add(const Condition& condition) noexcept {
    if (count_ == kMost) return false;
    all_[static_cast<std::size_t>(count_++)] = condition;
    return true;
  }
  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] const Condition& operator[](int i) const noexcept { return all_[static_cast<std::size_t>(i)]; }

 private:
  std::array<Condition, kMost> all_;
  int count_ = 0;
};

struct MotionLimits {
  double arm_mm = 20;  // a rotation counts as much as a move that is this arm times as long
  bool may_turn = true;
  const Vec3* across = nullptr;  // moves stay perpendicular to this unit vector
};

// Least squares of move and arm · turn against the wanted motion, over the conditions (the dual method of D. Goldfarb
// and A. Idnani, Mathematical Programming 27, 1983). `held`: some condition kept the motion from being the wanted one.
// Some conditions ask for more than to stand still. Where these contradict each other, or would push out farther than
// the wanted motion goes, they only forbid to go deeper. The work is bounded. A result that was not found in time may
// violate some conditions; the caller checks it. Pure, no allocation. [haptic]
// caller looks. Pure, no allocation. [haptic]
[[nodiscard]] Motion least_motion(const Motion& wanted, const Conditions& conditions, const MotionLimits& limits,
                                  bool& held) noexcept;

}  // namespace osteon::haptic
