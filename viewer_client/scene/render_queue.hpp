// What the network threads hand to the render thread. Bounded by the surface: of each block only the newest waits.
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "common/core/id.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"
#include "viewer_client/scene/surface_scene.hpp"

namespace osteon {

// When a committed event's picture data came in; CLOCK_MONOTONIC.
struct Arrival {
  RoomSeq room_seq;
  std::int64_t received_mono_ns = 0;
};

// Everything that came since the last take().
struct Delivery {
  bool snapshot_begun = false;     // a new stream: the blocks here belong to its snapshot or come after it
  bool snapshot_complete = false;  // the whole surface has come
  std::uint32_t snapshot_blocks = 0;
  std::map<BlockKey, ReceivedBlock> blocks;
  std::vector<Arrival> arrivals;  // oldest first
  RoomSeq room_seq;               // null: no mesh message came
  bool any_mesh = false;
  bool any_states = false;
  std::vector<CuttingState> states;
  std::vector<SceneItem> items;  // with any_states
  std::vector<BodyId> bodies;    // with any_states
  std::vector<Tool> tools;       // that this program did not know
};

// Any thread may call any function; one mutex, held for a few moves at a time.
class RenderQueue {
 public:
  // A stream begins: what waits of the stream before it is void.
  void begin_stream();
  void put_mesh(RoomSeq room_seq, std::vector<ReceivedBlock> blocks, bool snapshot_complete,
                std::uint32_t snapshot_blocks, std::int64_t received_mono_ns);
  void put_states(std::vector<CuttingState> states, std::vector<SceneItem> items = {}, std::vector<BodyId> bodies = {});
  void put_tool(Tool tool);

  [[nodiscard]] Delivery take();
  // Returns early when something waits.
  void wait_for(std::chrono::milliseconds time);

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  bool waiting_ = false;
  Delivery next_;
};

}  // namespace osteon
