// Tool against tool: what a partner's tool, known late and a few times a second, does to the tool in the hand where
// both touch. The own tool's surface points are asked for in the solid of the partner's, and pushed out of it by a
// spring:
//
//   F = k d + b v,  never pulling, at most most_n        d: deepest point; v: its own speed inwards
//
// Both users hold an end of this spring, each with the other's place as it was T ago. Two springs over a delay with a
// damper beside either make no energy as long as b >= k T (Nuño, Ortega, Barabanov and Basañez, 2008): so k is what b
// allows for the lag of the partner's pose, its low pass included. Poses are not extrapolated: that would take the
// damping back.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_client/control/obstacle.hpp"

namespace osteon::haptic {

// Points on the surface of the tool in the hand. Made off the haptic thread.
class TouchPoints {
 public:
  // About `most` points at most, nowhere nearer than they must be.
  explicit TouchPoints(const Tool& tool, int most = 400);
  [[nodiscard]] std::span<const Vec3> points_mm() const noexcept { return points_mm_; }  // tool frame
  // A ball round all of them.
  [[nodiscard]] const Vec3& centre_mm() const noexcept { return centre_mm_; }
  [[nodiscard]] double radius_mm() const noexcept { return radius_mm_; }

 private:
  std::vector<Vec3> points_mm_;
  Vec3 centre_mm_ = Vec3::Zero();
  double radius_mm_ = 0;
};

// The newest that is known of a partner's tool.
struct PartnerTool {
  std::uint64_t author = 0;  // not 0
  Pose pose_bone_tool;
  double lag_s = 0;                     // how old that pose is now
  const SolidLattice* solid = nullptr;  // outlives the step; null: not felt
};

struct PartnerParams {
  double most_n_per_mm = 2.0;        // k where the line is short
  double damping_n_s_per_mm = 0.04;  // b
  double low_pass_s = 0.02;          // of the partner's pose
  double most_n = 6.0;               // of all partners together, physical
  double most_n_per_s = 200.0;       // growth of that
  double stale_s = 0.5;              // a pose older than this is of nobody
};

struct PartnerForce {
  Vec3 force_n = Vec3::Zero();     // of the partners' tools on the own one, bone frame, physical
  Vec3 torque_nmm = Vec3::Zero();  // about the own tool's tip
  double depth_mm = 0;             // of the deepest point in any of them
  double n_per_mm = 0;             // k of the partner that is touched; 0: none is
  std::uint64_t author = 0;        // of the one that is touched deepest; 0: none
};

class PartnerContact {
 public:
  explicit PartnerContact(const PartnerParams& params = {}) : params_(params) {}

  // [haptic] Another tool is taken up, or the handle was put elsewhere: no force, no speed.
  void reset() noexcept;
  // [haptic] One tick. Partners beyond kMost are not felt.
  [[nodiscard]] PartnerForce step(const TouchPoints& own, const Pose& pose_bone_own,
                                  std::span<const PartnerTool> partners, double dt_s) noexcept;
  // [haptic] Where a partner's tool is felt to be; as told while it is not known.
  [[nodiscard]] Pose felt(const PartnerTool& partner) const noexcept;
  // [haptic] Work of the force on the own tool so far: what the hand put in, and what was released to it, mJ, physical.
  [[nodiscard]] double put_in_mj() const noexcept { return put_in_mj_; }
  [[nodiscard]] double released_mj() const noexcept { return released_mj_; }

  static constexpr std::size_t kMost = 16;

 private:
  struct Known {
    std::uint64_t author = 0;  // 0: free
    Pose pose_bone_tool;       // low-passed
    double n_per_mm = 0;
    bool seen = false;  // in this step
  };
  struct Touch {
    double depth_mm = 0;
    Vec3 at_mm = Vec3::Zero();    // own tool's frame
    Vec3 outward = Vec3::Zero();  // of the partner's tool, bone frame
  };
  Known* known(const PartnerTool& partner) noexcept;
  static Touch touch(const TouchPoints& own, const Pose& pose_bone_own, const SolidLattice& solid,
                     const Pose& pose_bone_partner) noexcept;

  PartnerParams params_;
  std::array<Known, kMost> known_;
  Pose pose_bone_own_;  // in the last step
  bool placed_ = false;
  Vec3 force_n_ = Vec3::Zero(), torque_nmm_ = Vec3::Zero();  // of the last step
  double put_in_mj_ = 0, released_mj_ = 0;
};

}  // namespace osteon::haptic
