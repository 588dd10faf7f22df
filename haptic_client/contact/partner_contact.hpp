// Contact of tool with tool: the force of a partner's tool on the tool in hand where both touch. The partner's pose
// arrives late and a few times a second. Surface points of the own tool are tested against the solid of the partner's
// tool. A spring pushes them out of it:
//
//   F = k d + b v,  never pulling, at most most_n        d: deepest point; v: its own speed inwards
//
// Each user holds one end of this spring, and sees the other's position as it was T ago. Two springs over a delay with
// a damper beside either make no energy as long as b >= k T (Nuño, Ortega, Barabanov and Basañez, 2008). So k is
// what b permits for the lag of the partner's pose, its low pass included. Poses are not extrapolated: that would
// cancel the damping.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_client/contact/obstacle.hpp"

namespace osteon::haptic {

// Points on the surface of the tool in hand. Made off the haptic thread.
class TouchPoints {
 public:
  // At most about `most` points, spaced as widely as possible.
  explicit TouchPoints(const Tool& tool, int most = 400);
  [[nodiscard]] std::span<const Vec3> points_mm() const noexcept { return points_mm_; }  // tool frame
  // A ball around all of them.
  [[nodiscard]] const Vec3& centre_mm() const noexcept { return centre_mm_; }
  [[nodiscard]] double radius_mm() const noexcept { return radius_mm_; }

 private:
  std::vector<Vec3> points_mm_;
  Vec3 centre_mm_ = Vec3::Zero();
  double radius_mm_ = 0;
};

// The newest known pose of a partner's tool.
struct PartnerTool {
  std::uint64_t author = 0;  // not 0
  Pose pose_bone_tool;
  double lag_s = 0;                     // age of that pose now
  const SolidLattice* solid = nullptr;  // outlives the step; null: not felt
};

struct PartnerParams {
  double most_n_per_mm = 2.0;        // k where the delay is short
  double damping_n_s_per_mm = 0.04;  // b
  double low_pass_s = 0.02;          // of the partner's pose
  double most_n = 6.0;               // of all partners together, physical
  double most_n_per_s = 200.0;       // growth of that
  double stale_s = 0.5;              // an older pose is ignored
};

struct PartnerForce {
  Vec3 force_n = Vec3::Zero();     // of the partners' tools on the own one, bone frame, physical
  Vec3 torque_nmm = Vec3::Zero();  // about the own tool's tip
  double depth_mm = 0;             // of the deepest point in any partner's tool
  double n_per_mm = 0;             // k of the partner that is touched; 0: none is touched
  std::uint64_t author = 0;        // author of the tool that is touched deepest; 0: none
};

class PartnerContact {
 public:
  explicit PartnerContact(const PartnerParams& params = {}) : params_(params) {}

  // [haptic] Another tool is taken up, or the handle was put elsewhere: no force, no speed.
  void reset() noexcept;
  // [haptic] One tick. Partners beyond kMost are not felt.
  [[nodiscard]] PartnerForce step(const TouchPoints& own, const Pose& pose_bone_own,
                                  std::span<const PartnerTool> partners, double dt_s) noexcept;
  // [haptic] Pose at which a partner's tool is felt; as received while it is not known.
  [[nodiscard]] Pose felt(const PartnerTool& partner) const noexcept;
  // [haptic] Work of the force on the own tool so far, mJ, physical: put in by the hand, and released to it.
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
