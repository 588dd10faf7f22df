// The tool that the bone sees: a god-object of six degrees of freedom that follows the device but never enters bone
// except by cutting it, nor what stands on the bone.
//
// Each tick it takes the motion nearest to the device's that every contact point allows: a move of the tip and a turn
// about it, where a turn counts as much as a move that is kTurnArm_mm times as long. So a tool that is pressed on one
// side leans, one in a hole keeps to the hole, and what the device's orientation asks for beyond that is a torque. The
// motion goes in parts of at most half a patch pitch, or as far as nothing is near: no wall that the patch shows is
// ever jumped over. Points on the cutting part ask for bone a little ahead of the face they stand for: so it does not
// matter that patches are some milliseconds old, nor that interpolation rounds edges by half a pitch. What was cut
// since the patch was built is known from a ring of the proxy's own recent sweeps.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/mechanics/cutting_effects.hpp"
#include "haptic_client/control/guiding.hpp"
#include "haptic_client/control/least_motion.hpp"
#include "haptic_client/control/patch.hpp"
#include "haptic_client/control/sweep.hpp"
#include "haptic_client/control/tool_model.hpp"

namespace osteon::haptic {

struct ProxyStep {
  bool covered = true;     // the patch reaches all of the tool that matters
  bool contact = false;    // something holds the tool back
  bool cutting = false;    // it advances into bone
  bool may_cut = false;    // it would, where the force suffices: it turns, and nothing forbids it
  bool near_bone = false;  // the cutting part touches or may remove bone
  bool heel_contact = false;
  bool on_metal = false;     // it turns, and metal is in its way: there it goes no further, and nothing is cut
  bool returned = false;     // bone came back where the tool is: it cuts nothing until it has left that
  bool locked = false;       // and so deep that it cannot be felt: no force, the spindle is to stand, until drawn out
  double feed_mm_per_s = 0;  // into bone, along the direction of cutting
  double density_g_cm3 = 0;  // engaged-area weighted
  double engaged = 0;        // share of the leading projected area in bone
  double engaged_area_mm2 = 0;          // that area
  double torque_nmm = 0;                // of the bone on the spindle, about the tool's axis
  double across_n = 0;                  // of the bone on the tool across the feed, as ForceLaw::across_n says
  unsigned out_of_range = 0;            // bits: outside of which of its limits the law was used
  Vec3 cutting_force_n = Vec3::Zero();  // of the tool on the bone
  double cutting_work_mj = 0;  // of the law's force over the way cut in this tick, its parts added; never negative
  // Turning cuts nothing: what turned the tool pushed it back by more than it then cut, and the force of that cut would
  // have done this work on the tool. As a whole such a tick is rubbing, without force, though what was cut in it took
  // its work, torque and feed. Zero in every other.
  double pushed_back_mj = 0;
  // What was being cut ended in this tick or with the one before: the tool has stopped there, its coupling still
  // stretched; where it goes on is the loop's to say.
  bool breakthrough = false;
  Vec3 moved_mm = Vec3::Zero();
  // Of bone and scene on the tool, about its tip, bone frame: what holds its turn back, and the moment of the cut.
  // Never a force on a device of three axes.
  Vec3 contact_torque_nmm = Vec3::Zero();
  Vec3 turn_rad = Vec3::Zero();  // from the proxy's orientation to the wanted one
};

// What else is there beside the bone.
struct Surroundings {
  std::span<const PlacedGuide> items;
  std::uint32_t guide = 0;  // the one whose opening holds the tool, 0 for none: it is not touched, as its play rules
  const CuttingEffects* effects = nullptr;  // of the tool in hand; null: it is as sharp as its model says, and clean
};

class Proxy {
 public:
  // K of a turn is the coupling's times this arm squared [A]: about a hand's width from where a pencil grip turns.
  static constexpr double kTurnArm_mm = 20.0;

  Proxy();
  // [haptic] Puts the tool down somewhere in free air.
  void place(const Pose& pose_bone_tool) noexcept;
  // [haptic] One tick towards the device. `may_cut` false: every point only blocks.
  ProxyStep step(const ToolModel& model, const Patch& patch, const Pose& pose_bone_device, double spindle_rpm,
                 double stiffness_n_per_mm, bool may_cut, double dt_s, const Surroundings& around = {}) noexcept;
  // [haptic] From here on the sweep takes bone away, until end_sweep(). False where too many sweeps still wait to be
  // seen in a patch; nothing may be cut then.
  bool begin_sweep(const ToolModel& model) noexcept;
  // [haptic] The sweep so far was closed as own cut number `own_cut`; it goes on.
  void closed(const ToolModel& model, std::uint64_t own_cut) noexcept;
  void end_sweep() noexcept;
  [[nodiscard]] bool sweeps_full() const noexcept { return sweep_count_ >= kMostSweeps - 1; }
  [[nodiscard]] const Pose& pose() const noexcept { return pose_; }
  // [haptic] From where it takes bone away. A tool that goes along its axis plays in its hole by what its points are
  // inset, and the hole follows only beyond that play: else a drill that is pressed sideways would widen it tick by
  // tick.
  [[nodiscard]] const Pose& cut_pose() const noexcept { return cut_pose_; }

 private:
  // All that a tick works on.
  struct Tick {
    const ToolModel& model;
    const Patch& patch;
    const Surroundings& around;
    double stiffness_n_per_mm;
    double spindle_rpm;
    bool may_cut;
    double dt_s;
    bool scene = false;  // something of it may be near
    double lift_mm = 0;  // by which points that cut are taken out of the tool again where they block
  };
  // Which points block, and against what.
  enum class Against : std::uint8_t {
    all,      // everything does
    cutting,  // points that cut meet the scene only, the others bone too
    scene,    // bone gives way
  };
  // What the points find at a pose.
  static constexpr int kMostSweeps = 48;
  using SweepViews = std::array<SweepView, kMostSweeps>;
  struct Sight {
    ContactValues values;
    std::unique_ptr<std::uint8_t[]> hard;  // of each point: the scene, not bone
    // Of each point: by which part of which sweep its distance is what it is, or kNoSweep. The way out is asked of few.
    std::unique_ptr<std::int32_t[]> by;
    std::unique_ptr<SweepViews> sweeps;
    float deepest_in_bone_mm = 0;  // least distance, over blocking points
  };
  struct Engagement {
    ContactSums sums;
    LawInputs inputs;
    bool covered = true;
    bool metal = false;  // some of what is engaged is
  };

  void look(const Tick& tick, const Pose& pose, Against against, Sight& sight) noexcept;
  void see_scene(const Tick& tick, const Pose& pose, Against against, Sight& sight) const noexcept;
  void add_conditions(const Tick& tick, const Sight& sight, const Pose& pose, const Motion& at, double reach_mm,
                      bool broken_only) noexcept;
  // The part of a small motion that nothing forbids; both sights are of the poses before and after it, if it is any.
  Motion allowed(const Tick& tick, const Motion& piece, Against against, const MotionLimits& limits,
                 ProxyStep& report) noexcept;
  // How much of a motion may be made at once.
  [[nodiscard]] double safe_part(const Tick& tick, const Motion& motion, Against against) const noexcept;
  // Goes as far towards a pose as nothing blocks, cutting nothing.
  void travel(const Tick& tick, const Pose& wanted, const Vec3* across, bool move_too, ProxyStep& report) noexcept;
  [[nodiscard]] Engagement engagement(const Tick& tick, const Vec3& direction) noexcept;
  // After engagement(): whether any of the points that it found in bone is in metal.
  [[nodiscard]] bool meets_metal(const Tick& tick, const ContactQuery& query) const noexcept;
  void note_slope(const Tick& tick, const Vec3& direction, double thrust_n) noexcept;
  // Goes along a direction, cutting what is in the way as far as the force allows. True: here_ is another sight now.
  bool advance(const Tick& tick, const Vec3& direction, double distance_mm, ProxyStep& report) noexcept;
  void cut_towards(Tick& tick, const Pose& wanted, ProxyStep& report) noexcept;
  // Bone that came back, by undo or rejection, where the tool is. True: the tick is over.
  [[nodiscard]] bool bone_returned(const Tick& tick, const Pose& wanted, ProxyStep& report) noexcept;
  void note_forces(const Tick& tick, const Engagement& now, const Vec3& direction, double thrust_n,
                   ProxyStep& report) noexcept;
  [[nodiscard]] bool near_bone(const Tick& tick) noexcept;
  void note_pushed_back(ProxyStep& report) noexcept;
  void update_sweep(const ToolModel& model) noexcept;
  // The sweeps as they are seen from a pose, what they leave at a group of the tool's points, and the way out there:
  // tool frame.
  void see_sweeps(const ToolModel& model, const Pose& pose, SweepViews& views) const noexcept;
  void swept(const SweepViews& views, const Lanes (&p)[3], Lanes& left, Parts& by) const noexcept;
  [[nodiscard]] static Vec3 way_out(const SweepViews& views, const Vec3& p, int by) noexcept;
  void forget_contained(const Patch& patch) noexcept;

  Pose pose_, cut_pose_;
  std::array<Sweep, kMostSweeps> sweeps_;
  int sweep_count_ = 0;
  bool sweeping_ = false;
  bool cut_before_ = false;  // the last step ended cutting
  bool returned_ = false, locked_ = false;
  int tries_ = 0;                 // in this tick
  Vec3 skive_mm_ = Vec3::Zero();  // how far the point is pushed aside by the slope that it stands on
  Vec3 skive_to_mm_ = Vec3::Zero();
  bool skates_ = false;  // the last tick met a slope
  bool bitten_ = false;  // all of the point has been in bone since it came near it
  Vec3 cut_moment_nmm_ = Vec3::Zero();
  Sight here_, there_, ahead_;
  std::unique_ptr<Conditions> conditions_;
};

}  // namespace osteon::haptic
