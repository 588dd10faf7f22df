// The tool that the bone sees: a god-object that follows the device but never enters bone except by cutting it.
//
// Translation is solved against contact points; the rotation is the device's wherever the tool fits. Points on the
// cutting part ask for bone a little ahead of the face they stand for: so it does not matter that patches are some
// milliseconds old, nor that interpolation rounds edges by half a pitch. What was cut since the patch was built is
// known from a ring of the proxy's own recent sweeps.
#pragma once
#include <array>
#include <cstdint>

#include "haptic_client/control/patch.hpp"
#include "haptic_client/control/tool_model.hpp"

namespace osteon::haptic {

struct ProxyStep {
  bool covered = true;         // the patch reaches all of the tool that matters
  bool contact = false;        // something holds the tool back
  bool cutting = false;        // it advances into bone
  bool near_bone = false;      // the cutting part touches or may remove bone
  bool heel_contact = false;
  double feed_mm_per_s = 0;    // into bone, along the direction of cutting
  double density_g_cm3 = 0;    // engaged-area weighted
  double engaged = 0;          // share of the leading projected area in bone
  double torque_nmm = 0;
  Vec3 cutting_force_n = Vec3::Zero();  // of the tool on the bone
  double cutting_work_mj = 0;  // of the law's force over the way cut in this tick, its parts added; never negative
  // What was being cut ended in this tick or with the one before: the tool has stopped there, its coupling still
  // stretched; where it goes on is the loop's to say.
  bool breakthrough = false;
  Vec3 moved_mm = Vec3::Zero();
};

class Proxy {
 public:
  // [haptic] Puts the tool down somewhere in free air.
  void place(const Pose& pose_bone_tool) noexcept;
  // [haptic] One tick towards the device. `may_cut` false: every point only blocks.
  ProxyStep step(const ToolModel& model, const Patch& patch, const Pose& pose_bone_device, double spindle_rpm,
                 double stiffness_n_per_mm, bool may_cut, double dt_s) noexcept;
  // [haptic] From here on the sweep takes bone away, until end_sweep(). False where too many sweeps still wait to be
  // seen in a patch; nothing may be cut then.
  bool begin_sweep(const ToolModel& model) noexcept;
  // [haptic] The sweep so far was closed as own cut number `own_cut`; it goes on.
  void closed(const ToolModel& model, std::uint64_t own_cut) noexcept;
  void end_sweep() noexcept;
  [[nodiscard]] bool sweeps_full() const noexcept { return sweep_count_ >= kMostSweeps - 1; }
  [[nodiscard]] const Pose& pose() const noexcept { return pose_; }

 private:
  // What the cutting part has taken away since a patch was built. A sphere: from one place to another. A drill or
  // reamer cuts along its axis, so its deepest place holds all others, and one sweep goes on for as long as it is not turned.
  struct Sweep {
    const SweptOutline* outline = nullptr;  // of the tool in hand; null for a sphere
    double radius_mm = 0;        // sphere
    Pose deepest;                // pose_bone_tool
    Pose pose_deepest_bone;      // its inverse
    Vec3 from_mm, to_mm;         // sphere: its centre
    std::uint64_t own_cut = 0;   // newest cut that holds it all; 0: none yet
    bool open = false;
  };
  [[nodiscard]] static double distance_mm(const Sweep& sweep, const Vec3& point_mm) noexcept;
  struct Engagement {
    double area_mm2 = 0, engaged_mm2 = 0, density = 0, milling = 0, nearest_mm = 0;
    bool covered = true;
  };

  [[nodiscard]] bool solid(const Patch& patch, const Vec3& point_mm, double& solid_mm) const noexcept;
  [[nodiscard]] Vec3 normal(const Patch& patch, const Vec3& point_mm) const noexcept;
  [[nodiscard]] Engagement engagement(const ToolModel& model, const Patch& patch, const Vec3& direction) const noexcept;
  // The part of `step_mm` that no given point forbids; `across`: it stays square to this direction.
  [[nodiscard]] Vec3 slide(const ToolModel& model, const Patch& patch, Vec3 step_mm, bool active_too,
                           const Vec3* across, bool& blocked, bool& covered) const noexcept;
  // Goes as far as nothing blocks, cutting nothing.
  void travel(const ToolModel& model, const Patch& patch, Vec3 left_mm, const Vec3* across, ProxyStep& report) noexcept;
  // Goes along a direction, cutting what is in the way as far as the force allows.
  void advance(const ToolModel& model, const Patch& patch, const Vec3& direction, double distance_mm, double spindle_rpm,
               double stiffness_n_per_mm, bool may_cut, double dt_s, ProxyStep& report) noexcept;
  void update_sweep() noexcept;
  void forget_contained(const Patch& patch) noexcept;

  static constexpr int kMostSweeps = 48;
  Pose pose_;
  std::array<Sweep, kMostSweeps> sweeps_;
  int sweep_count_ = 0;
  bool sweeping_ = false;
  bool cut_before_ = false;  // the last step ended cutting
};

}  // namespace osteon::haptic
