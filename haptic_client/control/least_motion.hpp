// The motion of a rigid tool nearest to a wanted one that keeps to all of some linear conditions: what a contact
// allows.
#pragma once
#include <array>

#include "common/geometry/pose.hpp"

namespace osteon::haptic {

// A small motion: of the tool's tip, and a rotation about it (axis times angle). Bone frame.
struct Motion {
  Vec3 move_mm = Vec3::Zero();
  Vec3 turn_rad = Vec3::Zero();
};
[[nodiscard]] inline Motion operator*(double k, const Motion& m) noexcept { return {k * m.move_mm, k * m.turn_rad}; }
[[nodiscard]] inline double norm_mm(const Motion& m, double arm_mm) noexcept {
  return std::sqrt(m.move_mm.squaredNorm() + arm_mm * arm_mm * m.turn_rad.squaredNorm());
}
// The pose after it.
[[nodiscard]] Pose moved(const Pose& pose, const Motion& motion) noexcept;
// From one pose to another.
[[nodiscard]] Motion between(const Pose& from, const Pose& to) noexcept;

// n · move + m · turn ≥ least: of a point at r from the tip with the way out of bone n, m = r × n.
struct Condition {
  Vec3 n = Vec3::Zero(), m = Vec3::Zero();
  double least_mm = 0;
};

// A list of conditions with room for a fixed number of them.
class Conditions {
 public:
  static constexpr int kMost = 256;
  void clear() noexcept { count_ = 0; }
  // False: there is no room.
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
  double arm_mm = 20;  // a turn counts as much as a move that is this arm times as long
  bool may_turn = true;
  const Vec3* across = nullptr;  // moves stay square to this unit vector
};

// Least squares of move and arm · turn against the wanted motion, over the conditions (the dual method of D. Goldfarb
// and A. Idnani, Mathematical Programming 27, 1983). `held`: some condition kept the motion from being the wanted one.
// Where conditions that ask for more than to stand still contradict each other, or would push out farther than what is
// wanted goes, they only forbid to go deeper. Bounded work; a result that was not found in time may break some, the
// caller looks. Pure, no allocation. [haptic]
[[nodiscard]] Motion least_motion(const Motion& wanted, const Conditions& conditions, const MotionLimits& limits,
                                  bool& held) noexcept;

}  // namespace osteon::haptic
