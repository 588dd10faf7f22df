// The virtual spring between handle and tool. It also contains what keeps the spring from giving the hand more energy
// than it got: its damping, its slack, the offset for bone that comes back, and the smoothing of the cutting force.
// Physical forces, bone frame.
//
// The spring's extension is e = handle + offset - proxy. The proxy moves only where that shortens e. Where bone that
// came back pushes the proxy out, the offset takes the difference. So the stored energy does not rise.
//
// A device of six axes has a second spring, for the rotation from the proxy to the handle. Both springs share one
// energy store. A proxy that leans away from a wall may lengthen e by the energy that the rotation releases. On a
// device of three axes, rotation costs the hand no energy. There the proxy may not lengthen e.
#pragma once
#include "common/mechanics/force_filter.hpp"
#include "haptic_client/contact/proxy.hpp"
#include "haptic_client/rendering/energy_ledger.hpp"
#include "haptic_client/rendering/force_scaling.hpp"

namespace osteon::haptic {

struct CouplingMoment {
  Vec3 handle_mm, proxy_before_mm, proxy_mm;  // bone frame; before: at the end of the last tick
  double stiffness_n_per_mm = 0;              // K_c, physical
  double limit_n = 0;                         // physical: the device's limit divided by s
  double energy_scale = 1;  // mJ at the handle for each physical mJ: s divided by the workspace's scale
  Compression compression;  // of the force; without a spring of the rotation
  bool touching = false;
  // In the last tick less force than the spring's was shown, and the slew limit was not the reason.
  bool fell_short = false;
  // Of a device that shows torque. Bone frame; axis times angle, from the proxy's orientation to the handle's.
  double stiffness_nmm_per_rad = 0;     // of the rotation, physical; 0: no torque is shown
  double limit_nmm = 0;                 // physical: the device's limit divided by energy_scale
  Vec3 turn_before_rad = Vec3::Zero();  // from the proxy's orientation at the end of the last tick
  Vec3 turn_rad = Vec3::Zero();
};

struct CouplingForce {
  Vec3 spring_n = Vec3::Zero();   // of the bone on the tool, within the limit: the physical force
  Vec3 damping_n = Vec3::Zero();  // k_c·T of the sampled spring, never more than the spring
  // The part of the cutting force that smoothing holds back, of the bone on the tool.
  Vec3 cutting_lag_n = Vec3::Zero();
  Vec3 turn_spring_nmm = Vec3::Zero();   // of the bone on the tool about its tip, within the limit, physical
  Vec3 turn_damping_nmm = Vec3::Zero();  // like damping_n, never more than the rotation's spring
  bool limited = false, breakthrough = false, returned = false;
};

class Coupling {
 public:
  // [haptic] The handle was put elsewhere, for example by the clutch. There is no extension and no offset.
  void reset(const Vec3& handle_mm, const Vec3& proxy_mm) noexcept;
  // [haptic] The handle was found elsewhere, for example after a device was reconnected. The tool stays; the difference
  // becomes slack.
  void release_all(const Vec3& handle_mm, const Vec3& proxy_mm) noexcept;
  // [haptic] The bone's frame turned. `now_before` maps its old axes to the new ones. The offset belongs to the hand
  // and does not turn with the bone.
  void turn(const Eigen::Quaterniond& now_before) noexcept;
  // [haptic] One tick, after the proxy's step towards handle + offset(). Reports the stored energy to the ledger.
  CouplingForce step(const CouplingMoment& moment, const ProxyStep& proxy, EnergyLedger& ledger, double dt_s,
                     double smooth_s) noexcept;
  [[nodiscard]] Vec3 offset_mm() const noexcept { return slack_mm_ + returned_mm_; }

 private:
  // Sets the extension. The excess becomes offset, which does not count as motion.
  void release(Vec3& offset_mm, Vec3& extension_mm, const Vec3& to_mm) noexcept;
  void bleed(const CouplingMoment& moment) noexcept;

  Vec3 slack_mm_ = Vec3::Zero(), returned_mm_ = Vec3::Zero();
  Vec3 extension_mm_ = Vec3::Zero();  // at the end of the last tick
  Vec3 turn_rad_ = Vec3::Zero();      // likewise
  Vec3 handle_mm_ = Vec3::Zero();
  ForceFilter<Vec3> smooth_{Vec3(Vec3::Zero())};  // smooths the cutting force
  bool cutting_ = false;                          // in the last tick
};

}  // namespace osteon::haptic
