#include "viewer_client/render/scene_updater.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "viewer_client/scene/looks_same.hpp"

namespace osteon {

bool SceneUpdater::update(bool tools_shown) {
  Delivery delivery = queue_->take();
  bool changed = false;
  for (const Tool& tool : delivery.tools) {
    scene_->learn_tool(tool);
    tools_.push_back(tool);
  }
  if (delivery.any_states) {
    states_ = std::move(delivery.states);
    changed = tools_shown && !std::ranges::equal(drawn_, states_, [](const CuttingState& a, const CuttingState& b) {
                return looks_same(a, b);
              });
    if (changed) drawn_ = states_;
    bodies_ = std::move(delivery.bodies);
    if (items_ != delivery.items || !delivery.tools.empty()) {
      items_ = std::move(delivery.items);
      scene_->show_items(items_);
      changed = true;
    }
  }
  if (!delivery.plan_fault.empty()) plan_fault_ = std::move(delivery.plan_fault);
  if (delivery.plan) {
    plan_ = std::move(delivery.plan);
    scene_->show_plan(*plan_);
    changed = true;
  }
  if (delivery.density) {
    scene_->set_density(std::move(delivery.density));
    surface_.repaint_cuts();
    changed = (complete_ && rebuild()) || changed;
  }
  if (delivery.snapshot_begun) {
    surface_.begin_snapshot();
    complete_ = false;
    snapshot_received_ = 0;
    arrivals_.clear();
  }
  if (!delivery.any_mesh) return changed;

  if (delivery.snapshot_blocks != 0) snapshot_blocks_ = delivery.snapshot_blocks;
  snapshot_received_ += delivery.blocks.size();
  for (auto& [key, block] : delivery.blocks) surface_.replace(std::move(block));
  received_seq_ = delivery.room_seq;
  arrivals_.insert(arrivals_.end(), delivery.arrivals.begin(), delivery.arrivals.end());
  if (delivery.snapshot_complete && !complete_) {
    surface_.end_snapshot();
    complete_ = true;
    changed = true;
  }
  // Until the whole surface was received, the picture shows the surface before it, or the progress of the first one.
  if (!complete_) return true;
  return rebuild() || changed;
}

bool SceneUpdater::rebuild() {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<RegionKey> regions = surface_.take_dirty();
  if (regions.empty()) return false;
  for (const RegionKey& region : regions) scene_->show_region(region, surface_.region_mesh(region));
  regions_rebuilt_ += regions.size();
  update_times_.record(std::chrono::steady_clock::now() - begin);
  return true;
}

std::optional<std::size_t> SceneUpdater::percent_received() const {
  if (complete_ || snapshot_blocks_ == 0) return std::nullopt;
  return std::min<std::size_t>(99, 100 * snapshot_received_ / snapshot_blocks_);
}

}  // namespace osteon
