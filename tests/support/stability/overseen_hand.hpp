// A simulated hand at the haptic loop while an instructor decides about it: stopped, taken over, led, limited, its cuts taken
// back, all as late as a line makes it; and what crosses its handle meanwhile.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "haptic_client/control/haptic_loop.hpp"
#include "haptic_client/control/patch_builder.hpp"
#include "haptic_client/device/simulated_device.hpp"
#include "tests/support/stability/delayed_room.hpp"

namespace osteon::test {

struct OverseenRun {
  const char* tool = "burr-round-5";
  int delay_ms = 0;           // of everything, each way
  bool weak = false;          // a device of 3.3 N with half of its stiffness, on a workspace of another size
  double slew_n_per_ms = 0.5; // of the loop
};

// Of what crossed the handle.
struct Crossed {
  double step_over_slew = 0;  // largest growth of coupling, pull and others' tools in a tick that the hand's motion does not explain
  double worst_mj = 0;        // most that one contact has given the hand and the cut beyond what it got
  double led_mj = 0;          // the same of the pull, beyond what its far end's motion has paid
  double fall_n = 0;          // largest fall of the whole force in a tick
  std::int64_t allocations = 0, cutting = 0, touching = 0;
};

class OverseenHand {
 public:
  explicit OverseenHand(const OverseenRun& run);

  // The room decides; the hand hears of it after the delay, and so late its cuts come to be refused.
  void decide(const Supervision& supervision);
  void undo(int count) { room_.undo(count); }

  // A millisecond. Command, place and force in the bone's frame, as everything here.
  haptic::LoopReport tick();
  // So many; the most and least force of the device meanwhile may be asked of `each`.
  void run(int ticks, const std::function<void(const haptic::LoopReport&)>& each = {});
  HandCommand command;
  bool pedal = false;
  haptic::GuideSeen guide;
  std::vector<haptic::PartnerTool> partners;

  [[nodiscard]] const Crossed& crossed() const { return crossed_; }
  [[nodiscard]] const std::vector<Cut>& cuts() const { return cuts_; }  // that the loop has closed
  [[nodiscard]] const haptic::Replica& replica() const { return replica_; }
  [[nodiscard]] haptic::HapticLoop& loop() { return *loop_; }
  [[nodiscard]] const haptic::LoopReport& last() const { return last_; }
  [[nodiscard]] Vec3 handle_mm() const { return last_.pose_bone_device.position_mm; }
  [[nodiscard]] double scale() const { return loop_->mapping().scale(); }

 private:
  void see(const haptic::LoopReport& report, const Vec3& handle_mm);
  void follow();

  OverseenRun run_;
  Case bone_;
  haptic::Replica replica_;
  DelayedRoom room_;
  std::unique_ptr<haptic::HapticLoop> loop_;
  std::unique_ptr<haptic::SimulatedDevice> device_;
  haptic::PatchBuilder builder_;
  haptic::Patch patch_;
  haptic::LoopReport last_;
  std::vector<Cut> cuts_;
  struct Decided {
    std::int64_t due;
    Supervision supervision;
    std::uint64_t epoch;
  };
  std::deque<Decided> decided_;
  Supervision now_;             // as the room has decided
  std::uint64_t decisions_ = 0, epoch_ = 0;
  std::int64_t ticks_ = 0;
  Eigen::Quaterniond rotation_;

  Crossed crossed_;
  Vec3 handle_mm_, coupling_n_ = Vec3::Zero(), guide_n_ = Vec3::Zero(), partner_n_ = Vec3::Zero(), force_n_ = Vec3::Zero();
  double moved_before_mm_ = 0, episode_mj_ = 0;
  bool seen_ = false;
};

}  // namespace osteon::test
