// Brings what the network threads received into the scene: surface, tools, items. It counts what was received, so that
// its owner can tell progress and log when an event was shown.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/core/id.hpp"
#include "common/runtime/tick_stats.hpp"
#include "viewer_client/render/bone_scene.hpp"
#include "viewer_client/scene/render_queue.hpp"

namespace osteon {

// [render]
class SceneUpdater {
 public:
  // Both must outlive it.
  SceneUpdater(RenderQueue& queue, BoneScene& scene) : queue_(&queue), scene_(&scene) {}

  // Takes what waits, and rebuilds the regions that changed. True if the picture changed. A change of tools counts only
  // if `tools_shown`.
  [[nodiscard]] bool update(bool tools_shown);

  // What is planned, and the structures at risk. Null: not yet received, or there is nothing.
  [[nodiscard]] const std::shared_ptr<const SurgicalPlan>& plan() const { return plan_; }
  // A sentence why there is no plan, once. Empty: none.
  [[nodiscard]] std::string take_plan_fault() { return std::exchange(plan_fault_, {}); }

  [[nodiscard]] std::span<const CuttingState> states() const { return states_; }
  [[nodiscard]] const std::vector<SceneItem>& items() const { return items_; }
  [[nodiscard]] const std::vector<BodyId>& bodies() const { return bodies_; }
  // Those that are not built in, as the room defines them.
  [[nodiscard]] const std::vector<Tool>& tools() const { return tools_; }
  [[nodiscard]] const SurfaceScene& surface() const { return surface_; }
  // The whole surface was received.
  [[nodiscard]] bool complete() const { return complete_; }
  // Percent of the surface that was received, 0 to 99. None: nothing yet, or all.
  [[nodiscard]] std::optional<std::size_t> percent_received() const;
  [[nodiscard]] RoomSeq received_seq() const { return received_seq_; }
  // Events received since the last call, oldest first.
  [[nodiscard]] std::vector<Arrival> take_arrivals() { return std::exchange(arrivals_, {}); }
  [[nodiscard]] bool any_arrivals() const { return !arrivals_.empty(); }

  [[nodiscard]] const DurationHistogram& update_times() const { return update_times_; }
  [[nodiscard]] std::uint64_t regions_rebuilt() const { return regions_rebuilt_; }

 private:
  bool rebuild();

  RenderQueue* queue_;
  BoneScene* scene_;
  SurfaceScene surface_;
  std::vector<CuttingState> states_;
  std::vector<CuttingState> drawn_;  // when the tools changed last; many small motions add up to one that is seen
  std::vector<SceneItem> items_;
  std::vector<Tool> tools_;
  std::vector<BodyId> bodies_;
  std::shared_ptr<const SurgicalPlan> plan_;  // shared with the scene and with distances
  std::string plan_fault_;
  bool complete_ = false;
  std::size_t snapshot_blocks_ = 0, snapshot_received_ = 0;
  RoomSeq received_seq_;
  std::vector<Arrival> arrivals_;
  DurationHistogram update_times_;
  std::uint64_t regions_rebuilt_ = 0;
};

}  // namespace osteon
