// What viewers and audio clients are shown beside the surface: the newest state of every tool, the scene, the bodies.
#pragma once
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/geometry/pose.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"
#include "server/net/outbox.hpp"
#include "server/net/stream_sink.hpp"

namespace osteon {

class CuttingSink : public StreamSink {
 public:
  virtual void offer(const Bytes& message) = 0;  // a whole WatchCuttingResponse; newest wins
};

// Any thread may call any function. Its lock is taken by itself or after the room's.
class StateBoard {
 public:
  // A tool whose session is over is shown idle for so many ticks, so that every reader sees it stop.
  static constexpr std::uint64_t kShowIdleTicks = 1200;

  // The sink is offered the newest message at once, and every later one until it leaves or all streams end.
  void watch(CuttingSink& sink);
  void leave(CuttingSink& sink);
  void end_streams(const std::string& why);  // those open now and those that come later
  [[nodiscard]] std::size_t streams() const;

  void offer(CuttingState state);    // newest of its author wins
  void session_over(AuthorId author);
  void show(const std::vector<SceneItem>& items, const std::vector<BodyId>& bodies);
  // [tick] What changed since the last call, to everyone.
  void publish(RoomSeq room_seq);
  [[nodiscard]] std::vector<Vec3> tool_tips_mm() const;  // of the tools in a hand

 private:
  struct Shown {
    CuttingState state;
    bool over = false;
    std::uint64_t ticks_over = 0;
  };
  mutable std::mutex mutex_;
  Audience<CuttingSink> streams_;
  std::map<AuthorId, Shown> states_;
  std::string scene_;                // a serialised WatchCuttingResponse of items and bodies alone
  bool changed_ = false;
  Bytes newest_;                     // for those who come later
  std::optional<std::string> ended_;
};

}  // namespace osteon
