// The spring between handle and tool, and what is done so that it never gives the hand more than it got: its damping,
// its slack, the offset for bone that comes back, the smoothing of the cutting force. Physical forces, bone frame.
//
// The spring's extension is e = handle + offset - proxy. The proxy moves only where that shortens e; where bone that
// came back pushes it out, the offset takes the difference, so that the stored energy does not rise.
//
// A device of six axes has a second spring, of the turn from the proxy to the handle. Both are one store: a proxy that
// leans away from a wall may lengthen e by what that relaxes in the turn. On a device of three axes turning costs the
// hand nothing, so there it may lengthen nothing.
#pragma once
#include "common/mechanics/force_filter.hpp"
#include "haptic_client/control/energy_ledger.hpp"
#include "haptic_client/control/proxy.hpp"

namespace osteon::haptic {

struct CouplingMoment {
  Vec3 handle_mm, proxy_before_mm, proxy_mm;  // bone frame; before: at the end of the last tick
  double stiffness_n_per_mm = 0;              // K_c, physical
  double limit_n = 0;                         // physical: the device's over s
  double energy_scale = 1;                    // mJ at the handle for each physical mJ: s over the workspace's scale
  bool touching = false;
  bool fell_short = false;  // less was shown in the last tick than the spring, and not for its growth
  // Of a device that shows torque; bone frame, axis times angle, from the proxy's orientation to the handle's.
  double stiffness_nmm_per_rad = 0;     // of the turn, physical; 0: no torque is shown
  double limit_nmm = 0;                 // physical: the device's over energy_scale
  Vec3 turn_before_rad = Vec3::Zero();  // from the proxy as it was at the end of the last tick
  Vec3 turn_rad = Vec3::Zero();
};

struct CouplingForce {
  Vec3 spring_n = Vec3::Zero();          // of the bone on the tool, within the limit: the physical force
  Vec3 damping_n = Vec3::Zero();         // the sampled spring's k_c·T, never more than the spring
  Vec3 cutting_lag_n = Vec3::Zero();     // what smoothing holds back of the cutting force, of the bone on the tool
  Vec3 turn_spring_nmm = Vec3::Zero();   // of the bone on the tool about its tip, within the limit, physical
  Vec3 turn_damping_nmm = Vec3::Zero();  // as the move's, never more than the turn's spring
  bool limited = false, breakthrough = false, returned = false;
};

class Coupling {
 public:
  // [haptic] The handle was put elsewhere, as by the clutch: no extension, no offset.
  void reset(const Vec3& handle_mm, const Vec3& proxy_mm) noexcept;
  // [haptic] The handle was found elsewhere, as after a device came back: the tool stays, what lies between is slack.
  void let_go_all(const Vec3& handle_mm, const Vec3& proxy_mm) noexcept;
  // [haptic] The bone's frame turned, by this into its new axes: the offset is the hand's and does not turn with the
  // bone.
  void turn(const Eigen::Quaterniond& now_before) noexcept;
  // [haptic] One tick, after the proxy's step towards handle + offset(). Keeps the ledger's stored energy.
  CouplingForce step(const CouplingMoment& moment, const ProxyStep& proxy, EnergyLedger& ledger, double dt_s,
                     double smooth_s) noexcept;
  [[nodiscard]] Vec3 offset_mm() const noexcept { return slack_mm_ + returned_mm_; }

 private:
  // Sets the extension; what was there more becomes offset, which does not count as motion.
  void let_go(Vec3& offset_mm, Vec3& extension_mm, const Vec3& to_mm) noexcept;
  void bleed(const CouplingMoment& moment) noexcept;

  Vec3 slack_mm_ = Vec3::Zero(), returned_mm_ = Vec3::Zero();
  Vec3 extension_mm_ = Vec3::Zero();  // at the end of the last tick
  Vec3 turn_rad_ = Vec3::Zero();      // likewise
  Vec3 handle_mm_ = Vec3::Zero();
  ForceFilter<Vec3> smooth_{Vec3(Vec3::Zero())};  // the cutting force
  bool cutting_ = false;                          // in the last tick
};

}  // namespace osteon::haptic
