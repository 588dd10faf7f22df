// Passes data from the network threads to the render thread. The surface bounds its size: only the newest version of
// each block waits.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/surface/density_grid.hpp"
#include "common/surface/surgical_plan.hpp"
#include "common/tools/scene_item.hpp"
#include "viewer_client/scene/surface_scene.hpp"

namespace osteon {

// When the picture data of a committed event was received; CLOCK_MONOTONIC.
struct Arrival {
  RoomSeq room_seq;
  std::int64_t received_mono_ns = 0;
};

// All data received since the last take().
struct Delivery {
  bool snapshot_begun = false;     // a new stream: these blocks belong to its snapshot or come after it
  bool snapshot_complete = false;  // the whole surface was received
  std::uint32_t snapshot_blocks = 0;
  std::map<BlockKey, ReceivedBlock> blocks;
  std::vector<Arrival> arrivals;  // oldest first
  RoomSeq room_seq;               // null: no mesh message came
  bool any_mesh = false;
  bool any_states = false;
  std::vector<CuttingState> states;
  std::vector<SceneItem> items;  // with any_states
  std::vector<BodyId> bodies;    // with any_states
  std::vector<Tool> tools;       // that this program did not have
  // What is planned, and the structures at risk. They come once. Null: they did not come since the last take(). Shared:
  // the picture and whoever measures distances read it.
  std::shared_ptr<const SurgicalPlan> plan;
  std::shared_ptr<const DensityGrid> density;  // of the imported bone; it comes once too
  std::string plan_fault;                      // a sentence: why there is no plan
};

// Any thread may call any function. One mutex, held only for a few moves.
class RenderQueue {
 public:
  // A stream begins. Waiting data of the stream before it is dropped.
  void begin_stream();
  void put_mesh(RoomSeq room_seq, std::vector<ReceivedBlock> blocks, bool snapshot_complete,
                std::uint32_t snapshot_blocks, std::int64_t received_mono_ns);
  void put_states(std::vector<CuttingState> states, std::vector<SceneItem> items = {}, std::vector<BodyId> bodies = {});
  void put_tool(Tool tool);
  void put_plan(SurgicalPlan plan);
  void put_density(DensityGrid density);
  void put_plan_fault(std::string sentence);

  // Called by the thread that put data, once until the next take(). It must return at once. Call this before data
  // comes.
  void set_wake(std::function<void()> wake) { wake_ = std::move(wake); }

  [[nodiscard]] Delivery take();
  // Returns early if data is waiting.
  void wait_for(std::chrono::milliseconds time);

 private:
  void announce(bool first);

  Mutex mutex_{LockRank::leaf};
  CondVar arrived_;
  std::function<void()> wake_;  // set before the network threads start
  bool waiting_ OSTEON_GUARDED_BY(mutex_) = false;
  Delivery next_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon
