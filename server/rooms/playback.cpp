#include "server/rooms/playback.hpp"

namespace osteon {

std::optional<LogEntry> Player::take(Time now) {
  // From the first call on, so that nothing happens before anyone can watch.
  if (!began_) began_ = now;
  if (playback_.speed <= 0) return {};
  if (!upcoming_ && playback_.next && !(upcoming_ = playback_.next())) stop();
  const std::chrono::duration<double, std::nano> passed = (now - *began_) * playback_.speed;
  if (!upcoming_ || upcoming_->at - from_ > passed) return {};
  return std::exchange(upcoming_, std::nullopt);
}

std::optional<CuttingState> Player::see(const Cut& cut, const ToolBox& tools, Time now) {
  const ToolBox::Entry* tool = tools.find(cut.tool);
  if (!tool) return {};
  CuttingState state;
  state.author = cut.author;
  state.state_seq = ++states_;
  state.tool_name = tool->tool.name;
  state.pose_bone_tool = state.pose_bone_device = dequantise(cut.path.back());
  state.spindle_rpm = cut.spindle_rpm;
  state.phase = CuttingPhase::cutting;
  seen_[cut.author] = {state, now};
  return state;
}

std::vector<CuttingState> Player::at_rest(Time now) {
  std::vector<CuttingState> rested;
  for (auto& [author, seen] : seen_) {
    if (now - seen.last_cut < kSeenAfterCut) continue;
    seen.state.state_seq = ++states_;
    seen.state.phase = CuttingPhase::idle;
    seen.state.spindle_rpm = 0;
    rested.push_back(seen.state);
  }
  std::erase_if(seen_, [](const auto& one) { return one.second.state.phase == CuttingPhase::idle; });
  return rested;
}

}  // namespace osteon
