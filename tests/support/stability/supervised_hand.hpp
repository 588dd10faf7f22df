// A simulated hand at the haptic loop under an instructor's decisions: stopped, taken over, guided, limited, its cuts
// undone, all with the delay of a line. It measures what crosses its handle. The bone stands still, or is on a mount
// that this hand and another user push.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "common/mechanics/compliant_mount.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/device/simulated_device.hpp"
#include "haptic_client/rendering/felt_mount.hpp"
#include "haptic_client/rendering/haptic_loop.hpp"
#include "tests/support/stability/delayed_room.hpp"

namespace osteon::test {

struct OverseenRun {
  const char* tool = "burr-round-5";
  int delay_ms = 0;            // of all messages, each way
  bool weak = false;           // a device of 3.3 N with half of its stiffness, on a workspace of another size
  double slew_n_per_ms = 0.5;  // of the loop
  bool mount = false;          // the bone yields
  haptic::ForceChoice choice = haptic::ForceChoice::proportional;
};

// Number of interventions while the tool touched bone.
struct InContact {
  int stopped = 0, taken = 0, given_back = 0, led = 0, released = 0, limited = 0, undone = 0;
};

// Measured at the handle.
struct Crossed {
  // Largest growth of the coupling in a tick, or of the coupling with guidance and others' tools, without the hand's
  // own motion.
  double step_over_slew = 0;
  double worst_mj = 0;    // most that one contact has given the hand, the cut and a yielding bone beyond its input
  double led_mj = 0;      // the same of the guidance, beyond what its far end's motion has paid
  double fall_n = 0;      // largest fall of the whole force in a tick
  double made_mj = 0;     // most that a bone on its mount ever gave the hand and the other user beyond their input
  double carried_mm = 0;  // motion of such a bone under the tool while they were in contact
  InContact in_contact;
  std::int64_t allocations = 0, cutting = 0, touching = 0;
};

class OverseenHand {
 public:
  explicit OverseenHand(const OverseenRun& run);

  // The room decides. The hand receives the decision after the delay, and its cuts are refused as late.
  void decide(const Restrictions& supervision);
  void undo(int count);

  // One millisecond. Command, position and force are in the bone's frame, as everywhere here.
  haptic::LoopReport tick();
  // Runs this number of ticks. `each` is called after each of them.
  void run(int ticks, const std::function<void(const haptic::LoopReport&)>& each = {});
  HandCommand command;
  bool pedal = false;
  Load other;  // of the other user on a yielding bone; held until it is set again
  haptic::GuideSeen guide;
  std::vector<haptic::PartnerTool> partners;

  [[nodiscard]] const Crossed& crossed() const { return crossed_; }
  [[nodiscard]] const std::vector<Cut>& cuts() const { return cuts_; }  // closed by the loop
  [[nodiscard]] const Replica& replica() const { return replica_; }
  [[nodiscard]] haptic::HapticLoop& loop() { return *loop_; }
  [[nodiscard]] const haptic::LoopReport& last() const { return last_; }
  [[nodiscard]] Vec3 handle_mm() const { return last_.pose_bone_device.position_mm; }
  [[nodiscard]] double scale() const { return loop_->mapping().scale(); }

 private:
  void see(const haptic::LoopReport& report, const Vec3& handle_mm);
  void follow();
  void hear();
  void move_bone();

  // A yielding bone: the server's, as shown to this hand and to the other user, and the lines between.
  struct Yielding {
    explicit Yielding(const MountParams& params) : mine(params), other({.mount = params}), server({.mount = params}) {}
    haptic::FeltMount mine;
    MountFollower other;
    MountServer server;
    struct Push {
      std::int64_t due;
      std::uint64_t author;
      MountLoad push;
    };
    struct Seen {
      std::int64_t due;
      MountPose to[2];
    };
    std::deque<Push> up;
    std::deque<Seen> down;
    double put_in_mj = 0;   // by both, computed here
    double by_hand_mj = 0;  // the hand's part in this tick
  };

  OverseenRun run_;
  Case bone_;
  Replica replica_;
  DelayedRoom room_;
  std::unique_ptr<haptic::HapticLoop> loop_;
  std::unique_ptr<haptic::SimulatedDevice> device_;
  haptic::PatchBuilder builder_;
  haptic::Patch patch_;
  haptic::LoopReport last_;
  std::vector<Cut> cuts_;
  struct Decided {
    std::int64_t due;
    Restrictions supervision;
    std::uint64_t epoch;
  };
  std::deque<Decided> decided_;
  std::deque<std::int64_t> undone_due_;
  std::unique_ptr<Yielding> yielding_;  // null: the bone stands still
  Restrictions now_, heard_;            // as the room has decided, and as the hand has received
  std::uint64_t decisions_ = 0, epoch_ = 0;
  std::int64_t ticks_ = 0;
  Eigen::Quaterniond rotation_;

  Crossed crossed_;
  Vec3 handle_mm_, coupling_n_ = Vec3::Zero(), together_n_ = Vec3::Zero(), force_n_ = Vec3::Zero();
  double moved_before_mm_ = 0, episode_mj_ = 0;
  bool seen_ = false;
};

}  // namespace osteon::test
