// The tool as the bone allows it: a god-object of six degrees of freedom. It follows the device but never enters bone
// except by cutting it. It never enters items on the bone.
//
// Each tick it takes the motion that every contact point allows and that is nearest to the device's. A motion is a move
// of the tip and a rotation about it. A rotation counts as much as a move that is kTurnArm_mm times as long. So a tool
// that is pressed on one side leans, and one in a hole follows the hole. What the device's orientation asks for beyond
// that is a torque.
//
// The motion is made in steps of at most half a patch pitch, or as far as nothing is near. So the tool never jumps over
// a wall that the patch shows. Points on the cutting part look for bone a little ahead of the face they stand for. So
// it does not matter that patches are some milliseconds old, nor that interpolation rounds edges by half a pitch. A
// ring of the proxy's own recent sweeps says what was cut since the patch was built.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/mechanics/cutting_effects.hpp"
#include "haptic_client/contact/guiding.hpp"
#include "haptic_client/contact/least_motion.hpp"
#include "haptic_client/contact/patch.hpp"
#include "haptic_client/contact/sweep.hpp"
#include "haptic_client/contact/tool_model.hpp"

namespace osteon::haptic {

struct ProxyStep {
  bool covered = true;     // the patch covers all relevant parts of the tool
  bool contact = false;    // something holds the tool back
  bool cutting = false;    // it advances into bone
  bool may_cut = false;    // it would cut if the force suffices: it turns, and nothing forbids it
  bool near_bone = false;  // the cutting part touches bone or may remove it
  bool heel_contact = false;
  bool on_metal = false;  // it turns, and metal is in its way: it goes no further there, and nothing is cut
  bool returned = false;  // bone came back where the tool is: it cuts nothing until it has left that bone
  // The returned bone is too deep to be felt: no force, the spindle must stand, until the tool is drawn out.
  bool locked = false;
  double feed_mm_per_s = 0;             // into bone, along the direction of cutting
  double density_g_cm3 = 0;             // engaged-area weighted
  double engaged = 0;                   // share of the leading projected area that is in bone
  double engaged_area_mm2 = 0;          // that area
  double torque_nmm = 0;                // of the bone on the spindle, about the tool's axis
  double across_n = 0;                  // of the bone on the tool across the feed, as ForceLaw::across_n says
  unsigned out_of_range = 0;            // bits: the limits of the law that were exceeded
  Vec3 cutting_force_n = Vec3::Zero();  // of the tool on the bone
  double cutting_work_mj =
      0;  // work of the law's force over the path cut in this tick, all parts added; never negative
  // Rotation cuts nothing. In some ticks rotation pushes the tool back by more than it then cut. The force of that cut
  // would have done this work on the tool. Such a tick counts as rubbing, without force, but its cut still took work,
  // torque and feed. Zero in every other tick.
  double pushed_back_mj = 0;
  // The bone that was cut ended in this tick or the one before. The tool has stopped there, and its coupling is still
  // extended. The loop decides where it continues.
  bool breakthrough = false;
  Vec3 moved_mm = Vec3::Zero();
  // Of bone and scene on the tool, about its tip, bone frame: what resists its rotation, and the moment of the cut. On
  // a device of three axes it is never shown as a force.
  Vec3 contact_torque_nmm = Vec3::Zero();
  Vec3 turn_rad = Vec3::Zero();  // from the proxy's orientation to the wanted one
};

// What surrounds the tool besides the bone.
struct Surroundings {
  std::span<const PlacedGuide> items;
  // The guide whose opening holds the tool, 0 for none: it is not touched, because the opening's play applies.
  std::uint32_t guide = 0;
  const CuttingEffects* effects = nullptr;  // of the tool in hand; null: it is clean and as sharp as its model says
};

class Proxy {
 public:
  // K of a rotation is the coupling's times this arm squared [A]: about a hand's width from where a pencil grip turns.
  static constexpr double kTurnArm_mm = 20.0;

  Proxy();
  // [haptic] Puts the tool at a pose in free air.
  void place(const Pose& pose_bone_tool) noexcept;
  // [haptic] One tick towards the device. `may_cut` false: every point only blocks.
  ProxyStep step(const ToolModel& model, const Patch& patch, const Pose& pose_bone_device, double spindle_rpm,
                 double stiffness_n_per_mm, bool may_cut, double dt_s, const Surroundings& around = {}) noexcept;
  // [haptic] From here on the sweep removes bone, until end_sweep(). Returns false while too many sweeps are in no
  // patch yet; then nothing may be cut.
  bool begin_sweep(const ToolModel& model) noexcept;
  // [haptic] The sweep so far was closed as own cut number `own_cut`; the sweep continues.
  void closed(const ToolModel& model, std::uint64_t own_cut) noexcept;
  void end_sweep() noexcept;
  [[nodiscard]] bool sweeps_full() const noexcept { return sweep_count_ >= kMostSweeps - 1; }
  [[nodiscard]] const Pose& pose() const noexcept { return pose_; }
  // [haptic] The pose from which the tool removes bone. A tool that goes along its axis has a play in its hole, the
  // inset of its points. The hole follows only beyond that play. Otherwise a drill that is pressed sideways would widen
  // it tick by tick.
  [[nodiscard]] const Pose& cut_pose() const noexcept { return cut_pose_; }

 private:
  // The inputs of one tick.
  struct Tick {
    const ToolModel& model;
    const Patch& patch;
    const Surroundings& around;
    double stiffness_n_per_mm;
    double spindle_rpm;
    bool may_cut;
    double dt_s;
    bool scene = false;  // some item of the scene may be near
    double lift_mm = 0;  // cutting points are moved out of the tool by this much where they block
  };
  // Which points block, and against what.
  enum class Against : std::uint8_t {
    all,      // all points block
    cutting,  // cutting points are blocked by the scene only, the others by bone too
    scene,    // the scene blocks; bone gives way
  };
  // What the points find at a pose.
  static constexpr int kMostSweeps = 48;
  using SweepViews = std::array<SweepView, kMostSweeps>;
  struct Sight {
    ContactValues values;
    std::unique_ptr<std::uint8_t[]> hard;  // of each point: blocked by the scene, not by bone
    // Of each point: the part of the sweep that determines its distance, or kNoSweep. The way out is computed for few.
    std::unique_ptr<std::int32_t[]> by;
    std::unique_ptr<SweepViews> sweeps;
    float deepest_in_bone_mm = 0;  // least distance, over blocking points
  };
  struct Engagement {
    ContactSums sums;
    LawInputs inputs;
    bool covered = true;
    bool metal = false;  // some of the engaged bone is metal
  };

  void look(const Tick& tick, const Pose& pose, Against against, Sight& sight) noexcept;
  void see_scene(const Tick& tick, const Pose& pose, Against against, Sight& sight) const noexcept;
  void add_conditions(const Tick& tick, const Sight& sight, const Pose& pose, const Motion& at, double reach_mm,
                      bool broken_only) noexcept;
  // The part of a small motion that nothing forbids. Both sights are of the poses before and after it, if it is any.
  Motion allowed(const Tick& tick, const Motion& piece, Against against, const MotionLimits& limits,
                 ProxyStep& report) noexcept;
  // How much of a motion may be made at once.
  [[nodiscard]] double safe_part(const Tick& tick, const Motion& motion, Against against) const noexcept;
  // Goes towards a pose as far as nothing blocks, and cuts nothing.
  void travel(const Tick& tick, const Pose& wanted, const Vec3* across, bool move_too, ProxyStep& report) noexcept;
  [[nodiscard]] Engagement engagement(const Tick& tick, const Vec3& direction) noexcept;
  // After engagement(): whether any of the points that it found in bone is in metal.
  [[nodiscard]] bool meets_metal(const Tick& tick, const ContactQuery& query) const noexcept;
  void note_slope(const Tick& tick, const Vec3& direction, double thrust_n) noexcept;
  // Goes along a direction and cuts what is in the way, as far as the force permits. True: here_ is another sight now.
  bool advance(const Tick& tick, const Vec3& direction, double distance_mm, ProxyStep& report) noexcept;
  void cut_towards(Tick& tick, const Pose& wanted, ProxyStep& report) noexcept;
  // Handles bone that came back, by undo or rejection, where the tool is. True: the tick is over.
  [[nodiscard]] bool bone_returned(const Tick& tick, const Pose& wanted, ProxyStep& report) noexcept;
  void note_forces(const Tick& tick, const Engagement& now, const Vec3& direction, double thrust_n,
                   ProxyStep& report) noexcept;
  [[nodiscard]] bool near_bone(const Tick& tick) noexcept;
  void note_pushed_back(ProxyStep& report) noexcept;
  void update_sweep(const ToolModel& model) noexcept;
  // The sweeps as seen from a pose, what they leave at a group of the tool's points, and the way out there. Tool frame.
  void see_sweeps(const ToolModel& model, const Pose& pose, SweepViews& views) const noexcept;
  void swept(const SweepViews& views, const Lanes (&p)[3], Lanes& left, Parts& by) const noexcept;
  [[nodiscard]] static Vec3 way_out(const SweepViews& views, const Vec3& p, int by) noexcept;
  void forget_contained(const Patch& patch) noexcept;

  Pose pose_, cut_pose_;
  std::array<Sweep, kMostSweeps> sweeps_;
  int sweep_count_ = 0;
  bool sweeping_ = false;
  bool cut_before_ = false;  // the last step ended while cutting
  bool returned_ = false, locked_ = false;
  int tries_ = 0;                 // in this tick
  Vec3 skive_mm_ = Vec3::Zero();  // how far the slope under the point pushes it aside
  Vec3 skive_to_mm_ = Vec3::Zero();
  bool skates_ = false;  // the last tick met a slope
  bool bitten_ = false;  // all of the point has been in bone since it came near it
  Vec3 cut_moment_nmm_ = Vec3::Zero();
  Sight here_, there_, ahead_;
  std::unique_ptr<Conditions> conditions_;
};

}  // namespace osteon::haptic
