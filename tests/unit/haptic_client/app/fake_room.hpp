// A room for tests of the haptic client's workers. It notes what it receives, and answers at once.
#pragma once
#include <atomic>
#include <functional>
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "haptic_client/app/client_room.hpp"
#include "haptic_client/simulation/session.hpp"

namespace osteon::haptic::test {

class FakeRoom final : public RoomPort {
 public:
  [[nodiscard]] bool send(const Cut& cut) override {
    cuts.push_back(cut);
    if (on_cut) on_cut(cut);
    return true;
  }
  void send(const CuttingState& state) override { states.push_back(state); }
  void send(const MountLoad& push) override { loads.push_back(push); }
  [[nodiscard]] Result<std::uint32_t> set_item(const SceneItem& item) override {
    ++item_calls;
    if (deny_items > 0 && deny_items-- > 0) return failure(item_error, "not now");
    items.push_back(item);
    return static_cast<std::uint32_t>(items.size());
  }
  [[nodiscard]] FastPathHealth fast_path() const override { return {.round_trip_ms = 40.0}; }

  std::function<void(const Cut&)> on_cut;
  int deny_items = 0;  // the next so many are refused with item_error
  ErrorCode item_error = ErrorCode::denied;
  std::vector<Cut> cuts;
  std::vector<CuttingState> states;
  std::vector<MountLoad> loads;
  std::vector<SceneItem> items;
  std::atomic<int> item_calls{0};
};

inline ClientRoom client_room(RoomPort& port, const Case& bone) {
  return {port, bone, builtin_tool_box(), AuthorId{7}, 1};
}

inline SimulatedSession session_of(const std::vector<PlanStep>& plan, const Case& bone) {
  Result<ReadyPlan> ready = make_ready(plan, bone);
  OSTEON_CHECK(ready.has_value());
  return {std::move(*ready), SimulatedDeviceParams{}, 0.0};
}

inline PlanStep wait_for(double seconds) {
  PlanStep step;
  step.action = Action::wait;
  step.seconds = seconds;
  return step;
}

}  // namespace osteon::haptic::test
