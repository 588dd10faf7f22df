// A simulated hand that burs in a real room, on a haptic client's own threads. Programs measure the room with it.
#pragma once
#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "haptic_client/app/client.hpp"

namespace osteon::test {

// A bur moves to and fro over the block's upper face, deeper with each pass, for about `seconds`. Then nothing moves.
[[nodiscard]] inline std::vector<haptic::PlanStep> burr_then_rest(double seconds, double tremor_mm, double rest_s) {
  haptic::PlanStep burr;
  burr.action = haptic::Action::burr;
  burr.tool = "burr-round-5";
  burr.tremor_mm = tremor_mm;
  burr.entry.point_mm = Vec3(0, 0, 0);
  burr.entry.axis = Vec3(0, 0, -1);
  burr.sweep_mm_per_s = 15;
  burr.window_u_mm = 20;
  burr.window_v_mm = 10;
  burr.depth_mm = std::max(0.5, seconds / 20.0);
  haptic::PlanStep rest;
  rest.action = haptic::Action::wait;
  rest.seconds = rest_s;
  return {burr, rest};
}

// Works from its construction until its plan is done. A room that cannot be joined ends the program.
class WorkingHand {
 public:
  WorkingHand(const RoomSessionOptions& options, const std::vector<haptic::PlanStep>& plan)
      : room_(joined(options)), session_(ready(plan, room_.bone()), {}, 0.0), thread_([this] {
          outcome_ = haptic::run_client(room_, session_, {}, stop_);
          over_ = true;
        }) {}
  ~WorkingHand() {
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] RoomSession& room() { return room_; }
  [[nodiscard]] bool over() const { return over_; }
  // Waits for the end.
  [[nodiscard]] const haptic::ClientOutcome& outcome() {
    thread_.join();
    OSTEON_CHECK(outcome_.has_value() && outcome_->has_value());
    return **outcome_;
  }

 private:
  static RoomSession joined(const RoomSessionOptions& options) {
    Result<RoomSession> room = RoomSession::join(options, {});
    OSTEON_CHECK(room.has_value());
    return std::move(*room);
  }
  static haptic::ReadyPlan ready(const std::vector<haptic::PlanStep>& plan, const Case& bone) {
    Result<haptic::ReadyPlan> made = haptic::make_ready(plan, bone);
    OSTEON_CHECK(made.has_value());
    return std::move(*made);
  }

  RoomSession room_;
  haptic::SimulatedSession session_;
  const StopSignal stop_;
  std::optional<Result<haptic::ClientOutcome>> outcome_;
  std::atomic<bool> over_{false};
  std::thread thread_;  // last: it uses the other members
};

}  // namespace osteon::test
